//! The door: latch, handle, hinge, and the readings of their state.

use aforce::{JointVector, Vector3};
use approx::assert_relative_eq;
use nalgebra::UnitQuaternion;
use physics::robots::panda::HOME;
use physics::robots::{Robot, RobotName};
use physics::scenes::door::{self, Door, MIDDLE};
use physics::{Deviation, Plant, Simulation, SimulationConfig};

const DT: f64 = 0.002;
/// Turns the handle until the latch is clear (Nm).
const TURN: f64 = 1.45;

/// A shut door, the arm turned away from it.
fn door() -> (Simulation, Door) {
    simulate(RobotName::Robosuite.robot())
}

fn simulate(robot: Robot) -> (Simulation, Door) {
    let plant = Plant { robot, dt: DT, config: SimulationConfig::default(), deviation: Deviation::default() };
    let (mut simulation, door) = Door::simulate(&plant, &door::root(MIDDLE));
    simulation.reset(&aside());
    (simulation, door)
}

fn aside() -> JointVector {
    let mut q = JointVector::from(HOME);
    q[0] = 1.5;
    q
}

/// Runs for `seconds` with these loads (Nm) on hinge and handle, the arm held where it is.
fn load(simulation: &mut Simulation, door: &Door, hinge: f64, handle: f64, seconds: f64) {
    simulation.set_load(door.hinge, hinge);
    simulation.set_load(door.shaft, handle);
    for _ in 0..(seconds / DT).round() as usize {
        let y = simulation.measure();
        let tau = y.bias + y.mass * ((aside() - y.q) * 400.0 - y.qd * 40.0);
        simulation.step(&tau, 0.0).unwrap();
    }
}

/// A joint of the arm that is put somewhere is measured there, tool and all.
#[test]
fn a_joint_that_was_put_somewhere_is_measured_there() {
    let (mut simulation, door) = door();
    let before = simulation.measure().pose;
    simulation.set_joint(0, 1.0);
    assert_eq!((simulation.joints().0[0], simulation.joint(0).0), (1.0, 1.0));
    assert!((simulation.measure().pose.translation.vector - before.translation.vector).norm() > 0.1);
    simulation.set_joint(door.hinge, 0.2);
    assert_eq!((simulation.joint(door.hinge).0, simulation.joints().0[0]), (0.2, 1.0));
}

/// robosuite's free play is 0.0149 rad. With the handle half turned the latch still holds.
#[test]
fn latch_holds_until_the_handle_is_turned() {
    let (mut simulation, door) = door();
    load(&mut simulation, &door, 20.0, 0.0, 1.0);
    assert!((door.opening(&simulation) - 0.0149).abs() < 5e-4, "free play {}", door.opening(&simulation));
    load(&mut simulation, &door, 0.0, 0.8, 2.0);
    load(&mut simulation, &door, 20.0, 0.8, 1.0);
    assert!(door.opening(&simulation) < 0.03, "half turned {}", door.opening(&simulation));
    assert!(simulation.deepest_penetration() < 5e-4);
}

#[test]
fn door_opens_once_the_handle_is_turned_either_way() {
    for turn in [TURN, -TURN] {
        let (mut simulation, door) = door();
        load(&mut simulation, &door, 0.0, turn, 2.0);
        load(&mut simulation, &door, 3.0, turn, 1.0);
        assert!(door.opening(&simulation) > 0.39, "handle {turn} Nm: {}", door.opening(&simulation));
    }
}

/// Without damping the handle swings until dry friction holds it: 0.1 Nm over 1 Nm/rad.
#[test]
fn handle_springs_back_to_where_friction_holds_it() {
    let (mut simulation, door) = door();
    load(&mut simulation, &door, 0.0, TURN, 2.0);
    assert!(door.handle_angle(&simulation) > 1.23);
    load(&mut simulation, &door, 0.0, 0.0, 4.0);
    assert!(door.handle_angle(&simulation).abs() < 0.1 + 1e-6, "{}", door.handle_angle(&simulation));
    assert!(simulation.joint(door.shaft).1.abs() < 1e-6);
}

/// Moment of inertia (kg m2) about the hinge with the handle turned by `angle`.
fn inertia_about_hinge(angle: f64) -> f64 {
    let (scene, _) = door::scene(&RobotName::Robosuite.robot(), &door::root(MIDDLE));
    let (door, handle) = (&scene.bodies[scene.body("door")], &scene.bodies[scene.body("handle")]);
    let turned = handle.pose * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
    let all = door.inertial.merged(&handle.inertial.transformed(&turned));
    all.inertia.m33 + all.mass * (all.com.x.powi(2) + all.com.y.powi(2))
}

/// I v' = -c v - f without air: the door coasts by I/c (v0 - f/c ln(1 + c v0/f)), to 6 % because the
/// handle, loose on its spring, moves along.
#[test]
fn open_door_coasts_as_damping_and_friction_say() {
    assert_relative_eq!(inertia_about_hinge(0.0), 0.236, epsilon = 5e-4);
    let (mut simulation, door) = simulate(Robot { air: None, ..RobotName::Robosuite.robot() });
    load(&mut simulation, &door, 0.0, TURN, 2.0);
    load(&mut simulation, &door, 5.0, TURN, 0.1);
    let (q, v) = simulation.joint(door.hinge);
    let inertia = inertia_about_hinge(door.handle_angle(&simulation));
    assert!(v > 1.0);
    load(&mut simulation, &door, 0.0, TURN, 1.0);
    let coasted = door.opening(&simulation) - q;
    assert_relative_eq!(coasted, inertia * (v - v.ln_1p()), max_relative = 0.06);
    assert!(simulation.joint(door.hinge).1.abs() < 1e-6);
}

/// The shut door's handle is where robosuite's is, and moves as hinge and shaft turn.
#[test]
fn handle_moves_on_the_arcs_of_hinge_and_shaft() {
    let (mut simulation, door) = door();
    let shut = door.handle_pose(&simulation);
    assert_relative_eq!(shut.translation.z, 1.075, epsilon = 1e-9);
    assert_relative_eq!(door.centre(&simulation), Vector3::new(-0.2, -0.34, 1.1), epsilon = 5e-3);
    load(&mut simulation, &door, 0.0, TURN, 2.0);
    load(&mut simulation, &door, 3.0, TURN, 0.3);
    let (opening, angle) = (door.opening(&simulation), door.handle_angle(&simulation));
    let open = door.handle_pose(&simulation);
    assert!(opening > 0.2);
    assert_relative_eq!(open.translation.z, 1.075 - 0.125 * angle.sin(), epsilon = 1e-6);
    assert!(open.translation.y > shut.translation.y + 0.05);
    assert_relative_eq!(door.moved_handle(&simulation, -opening, -angle), shut, epsilon = 1e-6);
}
