//! The limits of an arm's postures: end stops, and contact of the arm with itself. A joint that full torque pushes into its stop
//! overshoots as in robosuite, recorded by `scripts/robosuite_motion.py`.

mod mujoco_reference;

use aforce::{Arm, JointVector, Vector3};
use mujoco_reference::reference;
use physics::gripper::GRIP_SITE;
use physics::robots::RobotName;
use physics::robots::panda::HOME;
use physics::scene::Role;
use physics::scenes::lift::{self, Lift};
use physics::scenes::wipe::{TABLE_FRICTION, TABLE_HEIGHT, Wipe};
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

/// Joint, end of its range (0 lower, 1 upper), and robosuite's largest and last overshoot (rad).
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

fn plant() -> Plant {
    Plant {
        robot: RobotName::Robosuite.robot(),
        dt: 0.002,
        config: SimulationConfig::default(),
        deviation: Deviation::default(),
    }
}

fn simulation() -> Simulation {
    Lift::simulate(&plant(), Vector3::repeat(0.021)).0
}

/// A spring and damper on every joint, within the torque limits, pull the arm towards `target`.
fn drive(simulation: &mut Simulation, target: &JointVector) {
    let limit = JointVector::from(RobotName::Robosuite.robot().arm.torque_max);
    let y = simulation.measure();
    let tau = y.bias + (target - y.q) * 200.0 - y.qd * 40.0;
    simulation.step(&tau.zip_map(&limit, |tau, limit| tau.clamp(-limit, limit)), 0.0).unwrap();
}

/// Postures in which hand and forearm, or hand and shoulder, would overlap by centimetres (rad).
const OVERLAPPING: [[f64; 7]; 4] = [
    [-2.83, -0.97, 2.64, -2.38, 0.71, 0.45, 2.15],
    [-1.49, 0.76, 1.29, -1.88, 1.55, 0.45, 2.30],
    [2.61, 0.65, 2.01, -1.98, 1.78, 0.17, -0.35],
    [2.03, -0.10, 2.10, -1.89, 2.34, 0.07, 1.51],
];

/// Driven into postures in which it would overlap, the arm stops at its own surface: less than 1 mm deep in the impact,
/// pressed on with more than 100 N in the end, and well short of where it was driven.
#[test]
fn the_arm_does_not_pass_through_itself() {
    for target in OVERLAPPING.map(JointVector::from) {
        let mut simulation = simulation();
        simulation.reset(&HOME.into());
        let mut deepest = 0.0f64;
        for _ in 0..2000 {
            drive(&mut simulation, &target);
            deepest = deepest.max(simulation.deepest_penetration());
        }
        let contact = simulation.contact();
        let short = (simulation.joints().0 - target).amax();
        println!("{:.2} mm deep, {:.0} N, {short:.2} rad short", deepest * 1e3, contact.arm_force());
        assert!(contact.touching_itself && contact.arm_touches() && contact.arm_force() > 100.0);
        assert!(deepest < 1e-3 && short > 0.1, "{deepest} m deep, {short} rad short");
    }
}

/// A last link without a shape of its own, with a tool without joints on it, does not make the links pass through each other.
#[test]
fn an_arm_whose_last_link_has_no_shape_meets_itself_too() {
    let mut robot = RobotName::Robosuite.robot();
    robot.links[6].geoms.clear();
    let plant = Plant { robot, dt: 0.002, config: SimulationConfig::default(), deviation: Deviation::default() };
    let (mut simulation, _) = Wipe::simulate(&plant, TABLE_HEIGHT, TABLE_FRICTION);
    simulation.reset(&HOME.into());
    let touches = (0..2000).any(|_| {
        drive(&mut simulation, &OVERLAPPING[2].into());
        simulation.contact().touching_itself
    });
    assert!(touches);
}

/// Contact between two links is not reported as contact with the scene or of the hand.
#[test]
fn links_that_meet_each_other_are_not_touched_by_the_scene() {
    let plant = plant();
    let (mut scene, gripper) = lift::scene(&plant.robot, Vector3::repeat(0.021));
    // Only links are left: the hand would meet the arm before them. A cube without ground is refused.
    scene.bodies.retain(|body| body.name != "cube");
    for body in &mut scene.bodies {
        body.geoms.retain(|geom| matches!(geom.role, Role::Link(_)));
    }
    let mut simulation = Simulation::new(&scene, gripper, GRIP_SITE, &plant);
    simulation.reset(&HOME.into());
    // The forearm would lie 7 cm deep in the first link.
    let folded = JointVector::from([0.0, 1.06, -0.17, -2.94, -1.51, 0.78, 1.15]);
    let mut met = 0;
    for _ in 0..2000 {
        drive(&mut simulation, &folded);
        let contact = simulation.contact();
        assert!(!contact.links.touching && !contact.touching);
        assert_eq!(contact.touching_itself, contact.links.raw > 0.0);
        met += usize::from(contact.touching_itself);
    }
    assert!(met > 0);
}

/// An arm on a free path does not touch itself.
#[test]
fn a_free_arm_does_not_touch_itself() {
    let mut simulation = simulation();
    simulation.reset(&HOME.into());
    let target = JointVector::from(HOME) + JointVector::from([0.5, 0.2, -0.5, 0.6, 0.5, -0.6, 0.5]);
    for _ in 0..1000 {
        drive(&mut simulation, &target);
        assert!(!simulation.contact().touching_itself);
    }
    assert!((simulation.joints().0 - target).amax() < 0.01);
}
