//! The energy tank pays for the growth of stiffness and for the work of F_ff and F_cmd.

use super::*;
use crate::law::action_space::ActionSpace;
use crate::law::gains::Gains;
use crate::law::psi::Psi;
use crate::testing::{adaptive, psi};

/// A tank that never runs dry.
const LARGE: TankConfig = TankConfig { initial: 100.0, capacity: 1000.0, low: 0.0 };

/// A plant whose tool a hand has held 10 cm aside for two seconds: F_ff = alpha/mu e (1 - exp(-mu t)) = 8.65 N pushes it
/// back, along -x.
fn leaning(setup: &HostSetup) -> Plant {
    let mut plant = Plant::new(setup);
    plant.y.pose.translation.vector.x += 0.1;
    for _ in 0..2000 {
        plant.host.update(&state(&plant.y, &plant.tau), DT);
    }
    plant
}

/// A hand moves the tool along an axis at `speed` (m/s) for half a second. `each` is called after every cycle.
fn drag(plant: &mut Plant, axis: usize, speed: f64, mut each: impl FnMut(&Host)) {
    (plant.y.qd[axis], plant.y.twist[axis]) = (speed, speed);
    for _ in 0..500 {
        plant.y.pose.translation.vector[axis] += speed * DT;
        plant.host.update(&state(&plant.y, &plant.tau), DT);
        each(&plant.host);
    }
}

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
            // A hand holds the tool 4 cm from its set-point. The damper does no work, so nothing fills the tank.
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
    drag(&mut plant, 0, 0.2, |_| ());
    let filled = plant.host.tank();
    assert!(filled > 0.1 && filled <= 0.5, "{filled} J");
}

/// A hand holds the tool while K grows without an error, the set-point moves away, and K falls again. No energy was put into the arm, so
/// the tank gains none.
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
    let limits = HostLimits { wrench_max: [5.0, f64::INFINITY], tank: LARGE, ..endless() };
    let mut plant = leaning(&HostSetup { limits, ..setup("aforce") });
    assert!(plant.host.controller().feedforward()[0] > 8.0, "{}", plant.host.controller().feedforward());
    let before = plant.host.tank();
    drag(&mut plant, 0, 0.2, |_| ());
    let gained = plant.host.tank() - before;
    assert!(gained <= 0.5 + 1e-9, "{gained} J");
}

/// A hand drags the tool against the push of F_ff, and then with it. A second plant without F_ff has the same K and the same damper, so the
/// two tanks differ by the work of F_ff alone.
#[test]
fn motion_against_feedforward_fills_the_tank_and_motion_with_it_drains_it() {
    let limits = HostLimits { tank: LARGE, ..endless() };
    let gained = |alpha: f64, speed: f64| {
        let space = adaptive(Psi { alpha: Gains::pair(alpha, 0.0), ..psi() });
        let mut plant = leaning(&HostSetup { limits, space, ..setup("aforce") });
        let before = plant.host.tank();
        drag(&mut plant, 0, speed, |_| ());
        plant.host.tank() - before
    };
    // F_ff' = 100 (0.1 + (t + 0.05) v) - F_ff (eqs. 5 and 6) from 8.65 N on, times v, over half a second.
    for (speed, work) in [(0.1, 0.471), (-0.1, -0.423)] {
        assert_relative_eq!(gained(100.0, speed) - gained(0.0, speed), work, max_relative = 0.01);
    }
}

/// The same for F_cmd: 10 N along the contact axis, compared with a plant that is asked for no force.
#[test]
fn motion_against_the_force_command_fills_the_tank_and_motion_with_it_drains_it() {
    let mut setup = HostSetup { limits: HostLimits { tank: LARGE, ..endless() }, ..setup("aforce-force") };
    // Without gains F_cmd is F_d, whatever is measured.
    (setup.controller.force.kp, setup.controller.force.ki) = (0.0, 0.0);
    let gained = |force: f64, speed: f64| {
        let mut plant = Plant::new(&setup);
        let action = encode(plant.host.controller().space(), &setup.controller, &Vector6::zeros(), force);
        plant.host.set_goal(&action).unwrap();
        plant.y.wrench[2] = 10.0;
        for _ in 0..200 {
            plant.host.update(&state(&plant.y, &plant.tau), DT);
        }
        assert_eq!(plant.host.controller().engagement(), 1.0);
        let before = plant.host.tank();
        drag(&mut plant, 2, speed, |_| ());
        plant.host.tank() - before
    };
    // 10 N over 5 cm.
    for (speed, work) in [(0.1, 0.5), (-0.1, -0.5)] {
        assert_relative_eq!(gained(10.0, speed) - gained(0.0, speed), work, max_relative = 0.01);
    }
}

/// A hand drags the tool with the push of F_ff, which would do 0.8 J of work. F_ff does the work that the tank can pay for, and fades.
#[test]
fn a_feedforward_that_the_tank_cannot_pay_for_fades() {
    let tank = TankConfig { initial: 0.3, capacity: 0.3, low: 0.1 };
    // K neither costs nor gives back energy, and no damper fills the tank. The law is unstable, which does not show because the hand moves
    // the tool.
    let frozen = Psi { beta: Gains::all(0.0), gamma: Gains::all(0.0), allow_unstable: true, ..psi() };
    let space = ActionSpace { damping_ratio: Gains::all(0.0), ..adaptive(frozen) };
    let mut plant = leaning(&HostSetup { limits: HostLimits { tank, ..endless() }, space, ..setup("aforce") });
    assert!(plant.host.controller().feedforward()[0] > 8.0, "{}", plant.host.controller().feedforward());
    let mut given = 0.0;
    drag(&mut plant, 0, -0.2, |host| {
        given += host.controller().feedforward()[0] * 0.2 * DT;
        assert!(host.tank() >= 0.0);
    });
    assert!(given > 0.25 && given <= 0.3 + 1e-9, "{given} J");
    let left = plant.host.controller().feedforward()[0];
    assert!(left < 0.1, "{left} N");
}
