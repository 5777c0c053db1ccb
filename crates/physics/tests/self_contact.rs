//! The arm meets itself.

use aforce::{JointVector, Vector3};
use physics::robots::RobotName;
use physics::robots::panda::HOME;
use physics::scenes::lift::Lift;
use physics::scenes::wipe::{TABLE_FRICTION, TABLE_HEIGHT, Wipe};
use physics::{Deviation, Plant, Simulation, SimulationConfig};

fn simulation() -> Simulation {
    let plant = Plant {
        robot: RobotName::Robosuite.robot(),
        dt: 0.002,
        config: SimulationConfig::default(),
        deviation: Deviation::default(),
    };
    Lift::simulate(&plant, Vector3::repeat(0.021)).0
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

/// On its way to where nothing is in the way it does not meet itself.
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
