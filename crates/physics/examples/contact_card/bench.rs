//! A scene with the arm held away from it.

use aforce::{JointVector, Vector3};
use physics::gripper::GRIP_SITE;
use physics::robots::RobotName;
use physics::robots::panda::HOME;
use physics::scene::{Axis, Body, Geom, Inertial, Joint, Role, Scene, Shape, Stop, at};
use physics::{Deviation, Plant, Simulation, SimulationConfig};

/// Step of the simulation (s).
pub const DT: f64 = 0.002;

pub fn plant() -> Plant {
    Plant {
        robot: RobotName::Robosuite.robot(),
        dt: DT,
        config: SimulationConfig::default(),
        deviation: Deviation::default(),
    }
}

/// Simulates a scene whose controlled point is that of the gripper.
pub fn simulate(scene: &Scene) -> Simulation {
    let mut simulation = Simulation::new(scene, scene.body("gripper"), GRIP_SITE, &plant());
    simulation.reset(&HOME.into());
    simulation
}

/// A step in which springs on all joints, within the torque limits, pull the arm towards `target`.
pub fn drive(simulation: &mut Simulation, target: &JointVector) {
    let limit = JointVector::from(RobotName::Robosuite.robot().arm.torque_max);
    let y = simulation.measure();
    let tau = y.bias + (target - y.q) * 200.0 - y.qd * 40.0;
    simulation.step(&tau.zip_map(&limit, |tau, limit| tau.clamp(-limit, limit)), 0.0).expect("it stays finite");
}

/// A step in which the arm is held at home.
pub fn hold(simulation: &mut Simulation) {
    drive(simulation, &HOME.into());
}

/// A body on a slide without friction or stops.
pub fn slide(
    name: &str,
    parent: Option<usize>,
    position: [f64; 3],
    direction: Vector3,
    mass: f64,
    geoms: Vec<Geom>,
) -> Body {
    Body {
        name: name.into(),
        parent,
        pose: at(position),
        joint: Joint::Slide(Axis {
            name: name.into(),
            direction: nalgebra::Unit::new_normalize(direction),
            range: [-1.0, 1.0],
            damping: 0.0,
            friction: 0.0,
            armature: 0.0,
            spring: 0.0,
            rest: 0.0,
            stop: Stop::Spring { stiffness: 1000.0, damping: 10.0 },
        }),
        inertial: Inertial::diagonal(mass, [0.0; 3], [1e-3; 3]),
        geoms,
    }
}

pub fn block(name: &str, half: [f64; 3], centre: [f64; 3], friction: f64, role: Role) -> Geom {
    Geom { name: name.into(), shape: Shape::Box(half.into()), pose: at(centre), friction, role, color: [120; 3] }
}
