//! The simulated plant: forces, gripper, arm.

use aforce::{JointVector, Vector3};
use approx::assert_relative_eq;
use nalgebra::{Translation3, UnitQuaternion};
use physics::robots::RobotName;
use physics::robots::panda::HOME;
use physics::scenes::lift::{Lift, TABLE_HEIGHT};
use physics::scenes::wipe::Wipe;
use physics::{Deviation, Plant, Simulation, SimulationConfig};

fn lift(set: RobotName) -> (Simulation, Lift) {
    let plant =
        Plant { robot: set.robot(), dt: 0.002, config: SimulationConfig::default(), deviation: Deviation::default() };
    let (mut simulation, lift) = Lift::simulate(&plant, Vector3::repeat(0.021));
    simulation.reset(&HOME.into());
    (simulation, lift)
}

fn hold(simulation: &mut Simulation, steps: usize, grip: f64) {
    (0..steps).for_each(|_| pull(simulation, &HOME.into(), grip));
}

/// One step in which springs and dampers pull the arm towards `q`.
fn pull(simulation: &mut Simulation, q: &JointVector, grip: f64) {
    let y = simulation.measure();
    let tau = y.bias + y.mass * ((q - y.q) * 400.0 - y.qd * 40.0);
    simulation.step(&tau, grip).unwrap();
}

/// Closes the fingers on the cube, which is kept between them until they hold it.
fn grasp(simulation: &mut Simulation, lift: &Lift) {
    hold(simulation, 250, -1.0);
    for _ in 0..300 {
        let grip = simulation.measure().pose;
        lift.place_cube(simulation, &grip);
        hold(simulation, 1, 1.0);
    }
    hold(simulation, 500, 1.0);
    assert!(lift.is_grasped(simulation));
}

/// The engine accelerates as the independent model says: qdd = M^-1 (tau - bias - friction).
#[test]
fn engine_agrees_with_the_model() {
    for set in RobotName::ALL {
        let robot = set.robot().with_damping(0.0).with_friction(0.0);
        let (home, joints) = (robot.home, robot.joints);
        let plant = Plant { robot, dt: 1e-6, config: SimulationConfig::default(), deviation: Deviation::default() };
        let (mut simulation, _) = Lift::simulate(&plant, Vector3::repeat(0.021));
        simulation.reset(&home);
        let tau = JointVector::from([5.0, -20.0, 3.0, 15.0, -2.0, 4.0, 1.0]);
        let before = simulation.measure();
        simulation.step(&tau, 0.0).unwrap();
        let qdd = (simulation.joints().1 - before.qd) * 1e6;
        let expected = before.mass.cholesky().unwrap().solve(&(tau - before.bias));
        // The fingers slide freely in the engine and are welded in the model.
        // A light arm accelerates more, and the error of that grows with the acceleration.
        let epsilon = f64::max(2e-3, 1.2e-4 * expected.norm());
        let real = |qdd: &JointVector| qdd.rows(0, joints).into_owned();
        assert_relative_eq!(real(&qdd), real(&expected), max_relative = 2e-3, epsilon = epsilon);
    }
}

/// What is drawn is what is simulated: each shape's middle lies inside a shape of the engine.
#[test]
fn solids_stand_where_the_engine_has_them() {
    let (mut simulation, _) = lift(RobotName::Robosuite);
    for _ in 0..100 {
        simulation.step(&JointVector::from([20.0, -10.0, 15.0, -20.0, 5.0, 5.0, 5.0]), 1.0).unwrap();
    }
    assert!((simulation.joints().0 - JointVector::from(HOME)).norm() > 0.2, "the arm has moved");
    draws_what_it_simulates(&simulation);

    let deviation = Deviation { table_height: 0.06, payload: 1.0, ..Deviation::default() };
    let (robot, config) = (RobotName::Robosuite.robot(), SimulationConfig::default());
    let (mut raised, _) = Wipe::simulate(&Plant { robot, dt: 0.002, config, deviation }, 0.8, 0.03);
    raised.reset(&HOME.into());
    hold(&mut raised, 1, 0.0);
    draws_what_it_simulates(&raised);
}

fn draws_what_it_simulates(simulation: &Simulation) {
    for solid in simulation.solids() {
        let pose = solid.body.map_or(solid.pose, |body| simulation.body_pose(body) * solid.pose);
        let (distance, ..) = simulation.surfaces().cast(&pose.translation.vector, &Vector3::z()).unwrap();
        assert_eq!(distance, 0.0, "{solid:?}");
    }
}

/// A long control step has many engine steps. An impact that is over at its end is still in the readings of these steps.
#[test]
fn a_blow_within_a_long_step_is_told() {
    let deviation = Deviation::default();
    let (robot, config) = (RobotName::Robosuite.robot(), SimulationConfig::default());
    let (mut simulation, lift) = Lift::simulate(&Plant { robot, dt: 0.05, config, deviation }, Vector3::repeat(0.021));
    simulation.reset(&HOME.into());
    drop_on_forearm(&mut simulation, &lift);
    let felt = (0..10).any(|_| {
        let tau = simulation.measure().bias;
        simulation.step(&tau, 0.0).unwrap();
        let largest = simulation.contacts().iter().map(|contact| contact.arm_force()).fold(0.0, f64::max);
        largest > 2.0 * simulation.contact().arm_force() + 1.0
    });
    assert!(felt && simulation.contacts().len() == 25);
}

/// The cube begins to fall from 20 cm above the forearm.
fn drop_on_forearm(simulation: &mut Simulation, lift: &Lift) {
    let robot = RobotName::Robosuite.robot();
    let forearm = physics::scenes::lift::scene(&robot, Vector3::repeat(0.021)).0.body("link5");
    let top = simulation.body_pose(forearm) * nalgebra::Point3::new(0.0, 0.0, -0.2);
    lift.place_cube(simulation, &nalgebra::Isometry3::translation(top.x, top.y, top.z + 0.2));
}

#[test]
fn cube_rests_on_the_table() {
    let (mut simulation, lift) = lift(RobotName::Robosuite);
    hold(&mut simulation, 500, 0.0);
    let z = lift.cube_pose(&simulation).translation.z;
    assert!((z - TABLE_HEIGHT - 0.021).abs() < 5e-4, "cube centre at {z}");
    assert!(simulation.deepest_penetration() < 5e-4);
    assert!(!simulation.contact().touching);
}

/// A cube that falls on the forearm presses on a link and on nothing beyond the wrist. A cube on the table
/// presses on neither, a cube in the gripper on the fingers alone.
#[test]
fn what_touches_the_arm_is_told_from_what_touches_the_hand() {
    let (mut simulation, cube) = lift(RobotName::Robosuite);
    hold(&mut simulation, 500, 0.0);
    assert_eq!(touches(&simulation), [false; 4], "on the table");

    drop_on_forearm(&mut simulation, &cube);
    let mut steps = 0;
    while !simulation.contact().arm_touches() && steps < 250 {
        assert!(!simulation.contact().touching);
        hold(&mut simulation, 1, 0.0);
        steps += 1;
    }
    assert!(steps > 10, "it falls first: {steps}");
    assert_eq!(touches(&simulation), ON_A_LINK, "on the forearm");

    grasp(&mut simulation, &cube);
    assert_eq!(touches(&simulation), ON_THE_HAND, "in the gripper");
}

/// Whether anything presses on a link, whether the scene does, whether anything presses on the hand, and whether the arm touches itself.
fn touches(simulation: &Simulation) -> [bool; 4] {
    let contact = simulation.contact();
    [contact.arm_touches(), contact.links.touching, contact.touching, contact.touching_itself]
}

const ON_A_LINK: [bool; 4] = [true, true, false, false];
const ON_THE_HAND: [bool; 4] = [false, false, true, false];

/// Pulls the arm to `q` in two seconds, until something touches it.
fn pull_until_it_touches(simulation: &mut Simulation, q: &JointVector) {
    let start = simulation.joints().0;
    for step in 0..1500 {
        let share = (f64::from(step) / 1000.0).min(1.0);
        pull(simulation, &(start + (q - start) * share), 0.0);
        if touches(simulation) != [false; 4] {
            return;
        }
    }
    panic!("it touches nothing on its way to {q}");
}

/// The readings tell which part of the arm touches the table first: the fingers of an arm that bends down, the forearm of one that
/// stretches over the table with its hand up.
#[test]
fn an_arm_on_the_table_is_told_by_what_of_it_lies_there() {
    let (mut simulation, _) = lift(RobotName::Robosuite);
    let mut lower = JointVector::from(HOME);
    // The fingers would be a centimetre deep in the table, every link 7 cm above it.
    lower[1] += 0.6;
    pull_until_it_touches(&mut simulation, &lower);
    assert_eq!(touches(&simulation), ON_THE_HAND);

    let (robot, deviation) = (RobotName::Robosuite.robot(), Deviation::default());
    let plant = Plant { robot, dt: 0.002, config: SimulationConfig::default(), deviation };
    let (mut simulation, _) = Wipe::simulate(&plant, 0.9, 0.03);
    // 7 cm above the table, and 6 cm deep in it, where the tool's lowest corner would be 2 cm deep.
    let [above, below] = [1.5, 1.7].map(|shoulder| JointVector::from([0.0, shoulder, 0.0, -0.7, 0.0, 3.5, 0.8]));
    simulation.reset(&above);
    pull_until_it_touches(&mut simulation, &below);
    assert_eq!(touches(&simulation), ON_A_LINK);
}

/// A cube held in the air pulls the hand down by its weight; the two grip forces cancel.
#[test]
fn contact_wrench_has_the_right_sign_and_size() {
    let (mut simulation, cube) = lift(RobotName::Robosuite);
    let weight = 8.0 * 0.021f64.powi(3) * 1000.0 * 9.81;
    grasp(&mut simulation, &cube);
    let wrench = simulation.contact().filtered;
    assert_relative_eq!(wrench[2], -weight, max_relative = 0.02);
    assert!(wrench.fixed_rows::<2>(0).norm() < 0.05 * weight, "{wrench}");
}

/// Opening of the left finger after 1 to 12 closing actions from open, as measured in
/// robosuite (m).
#[test]
fn gripper_closes_as_measured() {
    const MEASURED: [f64; 12] =
        [0.0392, 0.0371, 0.0337, 0.0297, 0.0252, 0.0205, 0.0156, 0.0107, 0.0066, 0.0041, 0.0028, 0.0020];
    let (mut simulation, _) = lift(RobotName::Robosuite);
    hold(&mut simulation, 1000, -1.0);
    for (action, expected) in MEASURED.into_iter().enumerate() {
        hold(&mut simulation, 25, 1.0);
        let opening = simulation.joint(7).0;
        assert!((opening - expected).abs() < 5e-4, "after {} actions: {opening}, measured {expected}", action + 1);
    }
}

/// A grasped cube does not creep.
#[test]
fn grasp_holds_for_ten_seconds() {
    let (mut simulation, cube) = lift(RobotName::Robosuite);
    grasp(&mut simulation, &cube);
    let in_hand = |s: &Simulation| s.measure().pose.inverse() * cube.cube_pose(s);
    let start = in_hand(&simulation);
    hold(&mut simulation, 5000, 1.0);
    let slip = (in_hand(&simulation).translation.vector - start.translation.vector).norm();
    assert!(slip < 2e-4, "slipped by {slip} m");
}

#[test]
fn non_finite_torque_is_a_divergence() {
    let (mut simulation, _) = lift(RobotName::Robosuite);
    assert!(simulation.step(&JointVector::repeat(f64::NAN), 0.0).is_err());
    simulation.reset(&HOME.into());
    simulation.step(&JointVector::zeros(), 0.0).unwrap();
}

#[test]
fn cube_falls_onto_the_floor_and_stays() {
    let (mut simulation, cube) = lift(RobotName::Robosuite);
    let beside = nalgebra::Isometry3::from_parts(Translation3::new(0.6, 0.0, 0.5), UnitQuaternion::identity());
    cube.place_cube(&mut simulation, &beside);
    hold(&mut simulation, 1000, 0.0);
    let z = cube.cube_pose(&simulation).translation.z;
    assert!((z - 0.021).abs() < 1e-3, "cube centre at {z}");
}
