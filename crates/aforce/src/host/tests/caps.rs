//! Bounds on errors, wrench, workspace and joints, and anti-windup against them.

use super::*;

#[test]
fn errors_are_clipped_and_the_wrench_keeps_its_bound_and_its_rate() {
    let limits =
        HostLimits { error_max: [0.02, 0.1], wrench_max: [12.0, 2.0], wrench_rate_max: [200.0, 50.0], ..endless() };
    let mut plant = Plant::new(&HostSetup { limits, ..setup("high") });
    let mut last = Wrench::zeros();
    // The tool is held aside: without the bounds 10 cm of error at 1500 N/m would make 150 N.
    plant.y.pose.translation.vector.x += 0.1;
    let mut strongest = 0.0f64;
    for _ in 0..100 {
        let status = plant.host.update(&state(&plant.y, &plant.tau), DT).status;
        assert!(matches!(status, Status::Limited(limited) if limited.contains(Limited::ERROR)), "{status:?}");
        let wrench = *plant.host.controller().wrench();
        assert!(linear(&(wrench - last)).norm() <= 0.2 + 1e-9, "200 N/s");
        strongest = strongest.max(linear(&wrench).norm());
        last = wrench;
    }
    assert!(strongest <= 12.0 + 1e-9 && strongest > 9.0, "{strongest}");
}

#[test]
fn goals_stay_in_the_workspace_and_a_tool_outside_of_it_is_a_fault() {
    let limits = HostLimits { workspace: [[0.4, -0.1, 0.2], [0.6, 0.1, 0.4]], ..setup("aforce").limits };
    let mut plant = Plant::new(&HostSetup { limits, ..setup("aforce") });
    let status = plant.act(&[1.0, 0.0, 0.0, 0.0, 0.0, 0.0], 3000);
    let Status::Limited(limited) = status else { panic!("{status:?}") };
    assert!(limited.contains(Limited::GOAL));
    assert!((plant.position().x - 0.6).abs() < 5e-3, "{}", plant.position());
    plant.y.pose.translation.vector.x = 0.66;
    assert!(matches!(plant.step(&Wrench::zeros()), Status::Fault(Fault::Workspace { axis: 'x', .. })));
}

#[test]
fn a_joint_near_its_end_is_pushed_back_and_beyond_it_is_a_fault() {
    let mut arm = setup("low").arm;
    arm.range[6] = [-0.5, 0.5]; // The idle joint: nothing else moves it.
    let mut plant = Plant::new(&HostSetup { arm, ..setup("low") });
    plant.y.q[6] = 0.45;
    plant.host.start(&state(&plant.y, &plant.tau), &plant.y.pose).unwrap();
    let Status::Limited(limited) = plant.step(&Wrench::zeros()) else { panic!() };
    assert!(limited.contains(Limited::JOINT_RANGE));
    assert_relative_eq!(plant.tau[6], -0.05 * 50.0, epsilon = 1e-9);
    plant.y.q[6] = 0.55;
    assert!(matches!(plant.step(&Wrench::zeros()), Status::Fault(Fault::JointRange { joint: 7, .. })));
}

#[test]
fn stiffness_does_not_wind_up_against_a_cap() {
    let grown = |wrench_max: f64| {
        let limits = HostLimits { wrench_max: [wrench_max, f64::INFINITY], ..endless() };
        let mut plant = Plant::new(&HostSetup { limits, ..setup("aforce") });
        for _ in 0..500 {
            // A hand holds the tool 6 cm aside.
            plant.y.pose.translation.vector = Vector3::from(HOME) + Vector3::x() * 0.06;
            plant.host.update(&state(&plant.y, &plant.tau), DT);
        }
        plant.host.acting_stiffness()[0]
    };
    let k_0 = space("aforce").psi().unwrap().k_0[0];
    assert!(grown(f64::INFINITY) > 2.0 * k_0);
    let capped = grown(5.0);
    assert!(capped < k_0 + 5.0, "{capped}");
}

/// A rigid table pushes back with the force that acts, and the cap holds this force below the request. When the request falls below the
/// cap, the force falls with the ramp of the request and not after an integral has run down.
#[test]
fn a_force_that_is_capped_does_not_wind_up() {
    let limits = HostLimits { wrench_max: [8.0, 50.0], ..endless() };
    let mut plant = Plant::new(&HostSetup { limits, ..setup("aforce-force") });
    let mut press = |force: f64, cycles: usize| {
        for cycle in 0..cycles {
            if cycle % 50 == 0 {
                let action =
                    encode(plant.host.controller().space(), &ControllerConfig::default(), &Vector6::zeros(), force);
                plant.host.set_goal(&action).unwrap();
            }
            let table = f64::max(-plant.tau[2], 2.0);
            plant.step(&Wrench::new(0.0, 0.0, if cycle < 20 { table.max(5.0) } else { table }, 0.0, 0.0, 0.0));
        }
        (-plant.tau[2], plant.host.controller().force_command())
    };
    let (pressed, told) = press(10.0, 5000);
    assert!(pressed > 7.9 && told < 8.1, "{pressed} N of {told} N");
    let (pressed, _) = press(5.0, 400);
    assert!(pressed < 6.0, "{pressed} N");
}
