//! A fault stops the arm until a new start.

use super::*;

#[test]
fn a_fault_latches_holds_and_relaxes_until_a_new_start() {
    let mut plant = Plant::new(&setup("aforce"));
    plant.act(&[0.5, 0.0, 0.0, 0.0, 0.0, 0.0], 100);
    let moving = plant.y.twist.norm();
    assert!(moving > 0.01, "{moving}");
    let mut broken = state(&plant.y, &plant.tau);
    broken.mass[(2, 2)] = f64::NAN;
    let command = plant.host.update(&broken, DT);
    let fault = Fault::Unreadable { field: "mass" };
    assert_eq!(command.status, Status::Fault(fault));
    let held_at = plant.position();
    for _ in 0..3000 {
        assert_eq!(plant.step(&Wrench::zeros()), Status::Fault(fault), "a good measurement does not end it");
        assert_eq!(plant.host.set_goal(&[0.0; 6]), Err(NotTaken::NotRunning));
    }
    assert!(plant.host.is_relaxed());
    assert!(plant.y.twist.norm() < 1e-3 && (plant.position() - held_at).norm() < 0.05);
    // Relaxed: 20 Nm/rad, which the gantry's first axis has as 20 N/m. 1 N moves it by 5 cm.
    let before = plant.position().x;
    for _ in 0..5000 {
        plant.step(&Wrench::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.0));
    }
    assert_relative_eq!(plant.position().x - before, 0.05, epsilon = 2e-3);
    plant.host.stop();
    assert_eq!(plant.step(&Wrench::zeros()), Status::Fault(fault), "to stop is not to forget");
    plant.y.pose.translation.vector = HOME.into();
    plant.host.start(&state(&plant.y, &plant.tau), &plant.y.pose).unwrap();
    assert!(matches!(plant.act(&[0.0; 6], 50), Status::Running | Status::Limited(_)));
}

/// A host that was never started begins with the torque that the arm reports, and stays within the arm's torque rate.
#[test]
fn before_the_first_start_rates_count_from_the_torque_that_the_arm_has() {
    let setup = setup("aforce");
    let mut host = Host::new(&setup).unwrap();
    let plant = Plant::new(&setup);
    let tau = JointVector::from_fn(|joint, _| 0.5 * setup.arm.torque_max[joint]);
    let command = host.update(&state(&plant.y, &tau), DT);
    assert_eq!(command.status, Status::Stopped);
    for joint in 0..7 {
        let (change, most) = ((command.tau[joint] - tau[joint]).abs(), setup.arm.torque_rate_max[joint] * DT);
        assert!(change <= most * (1.0 + 1e-9), "joint {joint}: {change} Nm in a cycle, not {most}");
    }
}

/// A gantry that has just begun to move, and where it is.
fn moving() -> (Plant, Vector3<f64>) {
    let mut plant = Plant::new(&setup("aforce"));
    plant.act(&[0.5, 0.0, 0.0, 0.0, 0.0, 0.0], 100);
    assert!(plant.y.twist.norm() > 0.01);
    let position = plant.position();
    (plant, position)
}

/// Three seconds after a fault at `position`.
fn assert_held(plant: &Plant, position: &Vector3<f64>) {
    assert!(plant.host.is_relaxed());
    let (speed, distance) = (plant.y.twist.norm(), (plant.position() - position).norm());
    assert!(speed < 1e-3 && distance < 0.05, "{speed} m/s, {distance} m");
}

#[test]
fn a_hold_stops_the_tool_whatever_else_stays_unreadable() {
    type Spoil = fn(&mut ArmState);
    let spoils: [(&str, Spoil); 4] = [
        ("wrench", |state| state.wrench[2] = f64::NAN),
        ("mass", |state| state.mass[(0, 0)] = f64::NAN),
        ("jacobian", |state| state.jacobian[(1, 1)] = f64::INFINITY),
        ("tau", |state| state.tau[6] = f64::NAN),
    ];
    for (field, spoil) in spoils {
        let (mut plant, position) = moving();
        // A weight is added to the tool; only the bias of the present state contains it.
        plant.y.bias[2] = 30.0;
        for _ in 0..3000 {
            let status = plant.spoilt_step(&Wrench::zeros(), DT, spoil);
            assert_eq!(status, Status::Fault(Fault::Unreadable { field }));
        }
        assert_held(&plant, &position);
    }
}

#[test]
fn a_hold_goes_on_when_the_clock_does_not() {
    for period in [f64::NAN, -0.001, 0.0, 5e-324, 1e-6, 1.0] {
        let (mut plant, position) = moving();
        // The first five cycles with a `dt` of 0 in a row are no fault.
        let believed = if (0.0..1e-5).contains(&period) { 5 } else { 0 };
        for cycle in 0..3000 {
            let status = plant.spoilt_step(&Wrench::zeros(), period, |_| ());
            let is_fault = matches!(status, Status::Fault(Fault::Period { .. }));
            assert_eq!(is_fault, cycle >= believed, "{status:?} in cycle {cycle} of {period} s");
        }
        assert_held(&plant, &position);
    }
}

/// A policy that has diverged sends NaN. Its actions move no goal and do not keep the watchdog quiet.
#[test]
fn an_action_with_a_nan_is_silence() {
    let mut plant = Plant::new(&setup("low"));
    plant.act(&[0.3; 6], 50);
    let goal = *plant.host.controller().goal();
    let mut action = [0.3; 6];
    action[2] = f64::NAN;
    let mut status = Status::Stopped;
    for cycle in 50..260 {
        if cycle % 50 == 0 {
            let refused = plant.host.set_goal(&action).unwrap_err();
            assert_eq!(refused.to_string(), "an action of 5 numbers, NaN not counted; the space has 6");
        }
        assert_eq!(*plant.host.controller().goal(), goal);
        status = plant.step(&Wrench::zeros());
    }
    assert!(matches!(status, Status::Fault(Fault::Silence { .. })), "{status:?}");
    let longer = [f64::NAN, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(plant.host.set_goal(&longer), Err(NotTaken::Length { found: 7, expected: 6 }), "one NaN too many");
}

#[test]
fn a_silent_policy_and_a_stalled_loop_are_faults() {
    let mut plant = Plant::new(&setup("low"));
    plant.act(&[0.3; 6], 50);
    let mut cycles = 50; // Since the latest action, at cycle 0.
    let fault = loop {
        cycles += 1;
        if let Status::Fault(fault) = plant.step(&Wrench::zeros()) {
            break fault;
        }
    };
    assert!(matches!(fault, Fault::Silence { max: 0.25, .. }), "{fault}");
    assert!((250..=252).contains(&cycles), "{cycles}");
    for period in [-0.001, f64::NAN, 0.021] {
        let mut plant = Plant::new(&setup("low"));
        let command = plant.host.update(&state(&plant.y, &plant.tau), period);
        assert!(matches!(command.status, Status::Fault(Fault::Period { .. })), "{period}");
    }
}
