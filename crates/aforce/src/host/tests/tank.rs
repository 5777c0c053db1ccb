//! The energy tank pays for what stiffness gains.

use super::*;

/// A hand holds the tool aside. K grows against it, and the tank pays for the growth until it is empty.
#[test]
fn the_tank_bounds_what_growing_stiffness_pays() {
    let paid = |initial: f64| {
        let tank = TankConfig { initial, capacity: initial.max(1e-9), low: 0.1 };
        let limits = HostLimits { tank, ..endless() };
        let mut plant = Plant::new(&HostSetup { limits, ..setup("aforce") });
        let mut growth = 0.0;
        let mut level = initial;
        for _ in 0..4000 {
            // A hand holds the tool 4 cm aside of where the law wants it. The damper rests: nothing fills the tank.
            plant.y.pose.translation.vector = Vector3::from(HOME) + Vector3::x() * 0.04;
            let before = plant.host.acting_stiffness()[0];
            let e = plant.host.controller().error()[0];
            plant.host.update(&state(&plant.y, &plant.tau), DT);
            growth += 0.5 * e * e * (plant.host.acting_stiffness()[0] - before);
            assert!(plant.host.tank() >= 0.0 && plant.host.tank() <= level + 1e-9);
            level = plant.host.tank();
        }
        growth
    };
    let (rich, poor) = (paid(f64::INFINITY), paid(0.3));
    assert!(rich > 0.5, "{rich}");
    assert!(poor <= 0.3 && poor > 0.2, "{poor}");
}

/// A moving set-point that leaves a held tool behind fills no tank, however hard the damper pulls: the tool does not
/// move.
#[test]
fn a_held_tool_fills_no_tank() {
    let mut setup = setup("high");
    setup.space.rate = RateRule::SetPoint;
    setup.space.goal = GoalRule::Continued { leash_position: 0.1, leash_rotation: 0.5 };
    setup.limits = HostLimits { tank: TankConfig { initial: 1.0, capacity: 5.0, low: 0.5 }, ..endless() };
    let mut plant = Plant::new(&setup);
    let mut strongest = 0.0f64;
    for cycle in 0..500 {
        if cycle % 50 == 0 {
            plant.host.set_goal(&[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
        }
        plant.host.update(&state(&plant.y, &plant.tau), DT);
        strongest = strongest.max(plant.host.controller().wrench()[0]);
        assert_eq!(plant.host.tank(), 1.0);
    }
    assert!(strongest > 20.0, "it pulls: {strongest} N");
}

/// A hand drags the tool by 10 cm against a cap of 5 N: at most half a joule goes into the tank, whatever the damper
/// wants.
#[test]
fn a_damper_that_is_cut_fills_the_tank_with_what_is_left_of_it() {
    let tank = TankConfig { initial: 0.0, capacity: 100.0, low: 0.0 };
    let limits = HostLimits { wrench_max: [5.0, f64::INFINITY], tank, ..endless() };
    let mut plant = Plant::new(&HostSetup { limits, ..setup("high") });
    plant.y.qd[0] = 0.2;
    plant.y.twist[0] = 0.2;
    for _ in 0..500 {
        plant.y.pose.translation.vector.x += 0.2 * DT;
        plant.host.update(&state(&plant.y, &plant.tau), DT);
    }
    let filled = plant.host.tank();
    assert!(filled > 0.1 && filled <= 0.5, "{filled} J");
}

/// A hand holds the tool while K grows without an error, the set-point leaves, and K falls again: nobody has put energy into the arm.
#[test]
fn softening_gives_back_no_more_than_growing_took() {
    let mut setup = setup("variable");
    setup.limits = HostLimits { tank: TankConfig { initial: 1.0, capacity: 5.0, low: 0.5 }, ..endless() };
    let mut plant = Plant::new(&setup);
    let (hard, soft) = ([1.0; 6], [-1.0; 6]);
    for (stiffness, along_x) in [(hard, 0.0), (hard, 1.0), (soft, 1.0)] {
        let action = [stiffness.as_slice(), &[along_x, 0.0, 0.0, 0.0, 0.0, 0.0]].concat();
        plant.host.set_goal(&action).unwrap();
        for _ in 0..200 {
            plant.host.update(&state(&plant.y, &plant.tau), DT);
            assert!(plant.host.tank() <= 1.0, "{} J", plant.host.tank());
        }
    }
    assert!(
        plant.host.controller().error()[0] < -0.02,
        "the set-point has left: {}",
        plant.host.controller().error()[0]
    );
}

/// A hand drags the tool by 10 cm against F_ff under a cap of 5 N: at most half a joule comes back, whatever F_ff would
/// be.
#[test]
fn a_feedforward_that_is_cut_gives_back_what_acted() {
    let tank = TankConfig { initial: 100.0, capacity: 1000.0, low: 0.0 };
    let limits = HostLimits { wrench_max: [5.0, f64::INFINITY], tank, ..endless() };
    let mut plant = Plant::new(&HostSetup { limits, ..setup("aforce") });
    plant.y.pose.translation.vector.x += 0.1;
    for _ in 0..2000 {
        plant.host.update(&state(&plant.y, &plant.tau), DT);
    }
    assert!(plant.host.controller().feedforward()[0] > 8.0, "{}", plant.host.controller().feedforward());
    let before = plant.host.tank();
    plant.y.qd[0] = 0.2;
    plant.y.twist[0] = 0.2;
    for _ in 0..500 {
        plant.y.pose.translation.vector.x += 0.2 * DT;
        plant.host.update(&state(&plant.y, &plant.tau), DT);
    }
    let gained = plant.host.tank() - before;
    assert!(gained <= 0.5 + 1e-9, "{gained} J");
}
