//! The rigid-body model agrees with published numbers of the same arm and with itself (finite
//! differences, energy). `plant.rs` compares it with the engine, `mujoco.rs` with MuJoCo.

use aforce::{JointVector, Vector3};
use approx::assert_relative_eq;
use nalgebra::SVector;
use physics::model::Model;
use physics::robots::RobotName;
use physics::robots::panda::HOME;
use physics::scenes::lift;

fn model(set: RobotName) -> Model {
    let (scene, gripper) = lift::scene(&set.robot(), Vector3::repeat(0.021));
    Model::new(&scene, gripper, physics::gripper::GRIP_SITE)
}

/// Deterministic, well spread joint states.
fn states() -> impl Iterator<Item = (JointVector, JointVector)> {
    (0..20).map(|k| {
        let wave = |i: usize, a: f64| (a * (k as f64 + 1.0) * (i as f64 + 1.0)).sin();
        let q = JointVector::from_fn(|i, _| HOME[i] + 0.8 * wave(i, 0.7));
        (q, JointVector::from_fn(|i, _| 1.5 * wave(i, 1.3)))
    })
}

#[test]
fn home_pose_is_robosuites() {
    let tool = model(RobotName::Robosuite).kinematics(&HOME.into()).tool;
    let p = tool.translation.vector;
    assert_relative_eq!(p, Vector3::new(-0.10277, 0.0, 1.01104), epsilon = 1e-5);
    let axes = tool.rotation.to_rotation_matrix();
    let expected = [(0.0, 1.0, 0.0), (0.9919, 0.0, 0.1269), (0.1269, 0.0, -0.9919)];
    for (i, (x, y, z)) in expected.into_iter().enumerate() {
        assert_relative_eq!(axes.matrix().column(i).into_owned(), Vector3::new(x, y, z), epsilon = 1e-3);
    }
}

/// Measured in robosuite 1.4.1 at the nominal pose, with rotor inertia.
#[test]
fn mass_and_gravity_are_robosuites() {
    let model = model(RobotName::Robosuite);
    let k = model.kinematics(&HOME.into());
    let diagonal = model.mass(&k).diagonal();
    let expected: JointVector = SVector::from([7.322, 4.922, 3.345, 2.866, 1.510, 1.222, 0.914]);
    assert_relative_eq!(diagonal, expected, epsilon = 2e-3);
    let gravity: JointVector = SVector::from([0.0, -24.67, 0.0, 12.49, 0.0, 2.454, 0.0]);
    assert_relative_eq!(model.bias(&k, &JointVector::zeros()), gravity, epsilon = 5e-3);
}

#[test]
fn jacobian_is_the_derivative_of_the_pose() {
    let model = model(RobotName::Identified);
    let h = 1e-6;
    for (q, qd) in states() {
        let twist = model.jacobian(&model.kinematics(&q)) * qd;
        let (a, b) = (model.kinematics(&(q - qd * h)).tool, model.kinematics(&(q + qd * h)).tool);
        let difference = aforce::pose_error(&b, &a) / (2.0 * h);
        assert_relative_eq!(twist, difference, epsilon = 1e-7);
    }
}

/// Lagrange: d/dt (M qd) - dT/dq + dV/dq = bias when qdd = 0, by finite differences of the
/// energy alone.
#[test]
fn bias_follows_from_the_energy() {
    for set in [RobotName::Robosuite, RobotName::Identified] {
        let model = model(set);
        let h = 1e-5;
        for (q, qd) in states() {
            let momentum = |s: f64| model.mass(&model.kinematics(&(q + qd * s))) * qd;
            let momentum_rate = (momentum(h) - momentum(-h)) / (2.0 * h);
            let lagrangian = |q: &JointVector| {
                let at_rest = model.energy(q, &JointVector::zeros());
                model.energy(q, &qd) - 2.0 * at_rest
            };
            let gradient = JointVector::from_fn(|i, _| {
                let mut step = JointVector::zeros();
                step[i] = h;
                (lagrangian(&(q + step)) - lagrangian(&(q - step))) / (2.0 * h)
            });
            let bias = model.bias(&model.kinematics(&q), &qd);
            assert_relative_eq!(bias, momentum_rate - gradient, epsilon = 1e-5);
        }
    }
}

#[test]
fn mass_matrix_is_symmetric_and_positive() {
    let model = model(RobotName::Identified);
    for (q, _) in states() {
        let mass = model.mass(&model.kinematics(&q));
        assert_relative_eq!(mass, mass.transpose(), epsilon = 1e-14);
        assert!(mass.cholesky().is_some());
    }
}
