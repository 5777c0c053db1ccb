//! A joint that full torque pushes into its stop overshoots as in robosuite, recorded by `scripts/robosuite_motion.py`.

mod mujoco_reference;

use aforce::{Arm, JointVector, Vector3};
use mujoco_reference::reference;
use physics::gripper::GRIP_SITE;
use physics::robots::RobotName;
use physics::robots::panda::HOME;
use physics::scene::Role;
use physics::scenes::lift;
use physics::{Deviation, Plant, Simulation, SimulationConfig};

/// Overshoot (rad) of a joint that full torque pushes into the lower (0) or upper (1) end of its range from 0.2 rad
/// before it: the largest, and the last of 2 s. The other joints are held; nothing is touched.
fn push(set: RobotName, joint: usize, end: usize, dt: f64) -> [f64; 2] {
    let robot = set.robot();
    let (mut scene, gripper) = lift::scene(&robot, Vector3::repeat(0.021));
    // The table loses its geoms below, and a cube without ground is refused.
    scene.bodies.retain(|body| body.name != "cube");
    for body in &mut scene.bodies {
        body.geoms.retain(|geom| geom.role == Role::Object);
    }
    let torque = robot.arm.torque_max[joint];
    let plant = Plant { robot, dt, config: SimulationConfig::default(), deviation: Deviation::default() };
    let mut simulation = Simulation::new(&scene, gripper, GRIP_SITE, &plant);
    let sign = [-1.0, 1.0][end];
    let mut q0 = JointVector::from(HOME);
    q0[joint] = Arm::PANDA.range[joint][end] - 0.2 * sign;
    simulation.reset(&q0);
    let (mut largest, mut last) = (0.0f64, 0.0);
    for _ in 0..(2.0 / dt).round() as usize {
        let y = simulation.measure();
        let mut held = y.mass * ((q0 - y.q) * 400.0 - y.qd * 40.0);
        held[joint] = sign * torque;
        simulation.step(&(y.bias + held), 0.0).unwrap();
        last = sign * (simulation.joints().0[joint] - Arm::PANDA.range[joint][end]);
        largest = largest.max(last);
    }
    [largest, last]
}

/// Joint and end of its range, with what robosuite says.
fn references() -> Vec<(usize, usize, [f64; 2])> {
    let rows = reference("robosuite_stops.csv", 2);
    assert_eq!(rows.len(), 14);
    let joint = |name: &str| name.parse::<usize>().unwrap() - 1;
    let row = |(names, n): (Vec<String>, Vec<f64>)| (joint(&names[0]), usize::from(names[1] == "upper"), [n[0], n[1]]);
    rows.into_iter().map(row).collect()
}

#[test]
fn joints_stop_as_robosuites() {
    for (joint, end, [largest, rest]) in references() {
        let ours = push(RobotName::Robosuite, joint, end, 0.002);
        println!("joint {}, end {end}: {ours:.6?} rad, robosuite {largest} and {rest}", joint + 1);
        assert!((ours[0] - largest).abs() < 1e-4 && (ours[1] - rest).abs() < 5e-5, "joint {}: {ours:?}", joint + 1);
    }
}

/// Full torque from a fifth of a radian away is the worst that a controller does to a stop.
#[test]
fn no_joint_goes_far_beyond_its_range() {
    for (set, most, at_rest) in [(RobotName::Robosuite, 0.032, 0.0013), (RobotName::Identified, 0.052, 0.0035)] {
        for dt in [0.001, 0.002, 0.01] {
            for (joint, end, _) in references() {
                let [largest, rest] = push(set, joint, end, dt);
                let what = format!("{set:?}, joint {}, end {end}, {dt} s: {largest} and {rest} rad", joint + 1);
                assert!(0.0 < rest && rest < at_rest && largest < most, "{what}");
            }
        }
    }
}
