//! The estimated wrench against the simulated contact.

use aforce::{JointVector, MomentumObserver, Pose, Vector6, Wrench};
use approx::assert_relative_eq;
use nalgebra::Translation3;
use physics::robots::RobotName;
use physics::robots::panda::HOME;
use physics::scenes::wipe::{TABLE_HEIGHT, Wipe};
use physics::{Deviation, Plant, SimulationConfig};

/// In the air the estimate stays near zero in spite of fast motion; on the table it is the contact force, friction
/// included, once it had time to follow.
#[test]
fn free_motion_reads_zero_and_contact_its_force() {
    const DT: f64 = 0.001;
    let robot = RobotName::Identified.robot();
    let damping = robot.damping();
    let plant = Plant { robot, dt: DT, config: SimulationConfig::default(), deviation: Deviation::default() };
    let (mut simulation, _) = Wipe::simulate(&plant, TABLE_HEIGHT, 0.3);
    simulation.reset(&HOME.into());
    let mut y = simulation.measure();
    let level = y.pose.rotation;
    let mut observer = MomentumObserver::new(25.0, damping, &y);
    let (mut in_the_air, mut speed) = (0.0f64, 0.0f64);
    let (mut estimated, mut exact) = (Wrench::zeros(), Wrench::zeros());
    // The table pushes up all the time: this sum has a sign.
    let mut upwards = [0.0, 0.0];
    for step in 0..6000 {
        let time = f64::from(step) * DT;
        // A swing through the air, then down onto the table and along it.
        let swing = 0.1 * (4.0 * time).sin();
        let height = if time < 2.0 { TABLE_HEIGHT + 0.15 } else { TABLE_HEIGHT - 0.02 };
        let target = Pose::from_parts(Translation3::new(0.1, swing, height), level);
        let error = aforce::pose_error(&y.pose, &target);
        let stiffness = Vector6::new(600.0, 600.0, 600.0, 60.0, 60.0, 60.0);
        let wrench = -stiffness.component_mul(&error) - 0.15 * stiffness.component_mul(&y.twist);
        let tau: JointVector = y.bias + y.jacobian.tr_mul(&wrench);
        simulation.step(&tau, 0.0).unwrap();
        y = simulation.measure();
        observer.update(&tau, &y, DT);
        if (0.2..2.0).contains(&time) {
            in_the_air = in_the_air.max(observer.wrench().fixed_rows::<3>(0).norm());
            speed = speed.max(y.twist.fixed_rows::<3>(0).norm());
        }
        if time >= 4.0 {
            // Over whole swings, so that the delay of the estimate averages out.
            estimated += observer.wrench().map(f64::abs);
            exact += simulation.contact().raw.map(f64::abs);
            upwards[0] += observer.wrench()[2];
            upwards[1] += simulation.contact().raw[2];
        }
    }
    println!("in the air {in_the_air:.3} N at up to {speed:.2} m/s; {:.3?}, {:.3?}", estimated, exact);
    assert!(in_the_air < 0.1 && speed > 0.2);
    for axis in 0..3 {
        assert_relative_eq!(estimated[axis], exact[axis], max_relative = 0.05);
    }
    assert!(upwards[1] > 0.0);
    assert_relative_eq!(upwards[0], upwards[1], max_relative = 0.05);
}

/// A resting arm that a force and a moment push at, and that is held all the same: the estimate is what pushes.
#[test]
fn forces_and_moments_are_told_apart() {
    let plant = Plant {
        robot: RobotName::Identified.robot(),
        dt: 0.001,
        config: SimulationConfig::default(),
        deviation: Deviation::default(),
    };
    let (mut simulation, _) = Wipe::simulate(&plant, TABLE_HEIGHT, 0.3);
    simulation.reset(&HOME.into());
    let y = simulation.measure();
    // The highest cut-off and the longest period that a host allows, too.
    for (axis, (cutoff, dt)) in (0..6).flat_map(|axis| [(25.0, 0.001), (100.0, 0.1)].map(|rate| (axis, rate))) {
        let mut push = Wrench::zeros();
        push[axis] = if axis < 3 { 7.0 } else { -0.8 };
        let mut observer = MomentumObserver::new(cutoff, JointVector::zeros(), &y);
        for _ in 0..500 {
            observer.update(&(y.bias - y.jacobian.tr_mul(&push)), &y, dt);
        }
        assert_relative_eq!(observer.wrench(), push, epsilon = 1e-6);
    }
}
