//! The rigid-body model agrees with published numbers of the same arm and with itself (finite
//! differences, energy), and every robot's model with the same arm in MuJoCo. `plant.rs` compares the model with the engine, `mujoco.rs`
//! motions with MuJoCo's.

mod mujoco_reference;

use aforce::{JointMatrix, JointVector, Pose, Vector3};
use approx::assert_relative_eq;
use mujoco_reference::reference;
use nalgebra::SVector;
use physics::gripper::add_gripper;
use physics::model::Model;
use physics::robots::panda::HOME;
use physics::robots::{Robot, RobotName};
use physics::scene::{Inertial, Scene, pose};
use physics::scenes::{lift, wipe};

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

/// C. Gaz, M. Cognetti, A. Oliva, P. Robuffo Giordano, A. De Luca, "Dynamic Identification of the Franka Emika Panda Robot With
/// Retrieval of Feasible Parameters Using Penalty-Based Optimization", IEEE RA-L 4(4), 2019.
///
/// Moments (kg m, along x and y of the link frame) that the links 2 to 7 carry about their joint,
/// each with everything distal of it that does not turn with the joints between. The coefficients
/// of the gravity vector in the authors' own code (github.com/marcocognetti/FrankaEmikaPandaDynModel,
/// get_GravityVector.m): least-squares estimates from motions of a real arm without a hand.
const PUBLISHED: [[f64; 2]; 6] = [
    [0.005_368_784_261_474_552, -3.102_575_671_767_16],
    [0.687_353_310_277_526_2, 0.023_376_494_573_717_96],
    [-0.488_836_024_633_242_9, 1.718_488_169_611_198],
    [-0.010_003_952_253_559_1, 0.077_053_241_958_930_29],
    [0.165_680_968_759_300_8, -0.067_711_741_442_479_46],
    [0.006_230_758_965_393_622, -0.000_488_352_108_512_765_7],
];

/// The link masses and centres of mass come from a second step, a search for physically possible
/// values that fit those estimates. What remains is at most 9 g at a distance of 1 m.
#[test]
fn gravity_moments_of_the_identified_set_are_the_published_ones() {
    let robot = Robot { flange_inertial: Inertial::NONE, ..RobotName::Identified.robot() };
    let mut scene = Scene::default();
    robot.add_to(&mut scene, Pose::identity());
    // What a link's child hands on to it: mass at the child's origin, and the child's moment along
    // its own joint axis, which does not change as the joint turns.
    let (mut mass, mut handed) = (0.0, Vector3::zeros());
    for i in (2..=7).rev() {
        let link = &scene.bodies[scene.body(&format!("link{i}"))];
        let moment = link.inertial.mass * link.inertial.com + handed;
        let [x, y] = PUBLISHED[i - 2];
        assert!((moment.x - x).abs() < 0.01 && (moment.y - y).abs() < 0.01, "link {i}: {moment} against {x}, {y}");
        mass += link.inertial.mass;
        handed = link.pose.rotation * Vector3::new(0.0, 0.0, moment.z) + mass * link.pose.translation.vector;
    }
}

/// The largest differences of mass matrix, bias torques and pose over the states of a reference file; the first two relative to the largest entry.
/// `rotors` are inertias of the model's mass matrix that the file's lacks.
fn worst<'a>(model: &Model, rotors: JointMatrix, states: impl Iterator<Item = &'a [f64]>) -> [f64; 3] {
    let mut worst = [0.0f64; 3];
    let mut count = 0;
    for numbers in states {
        let column = |from: usize| JointVector::from_column_slice(&numbers[from..from + 7]);
        let (q, qd, bias) = (column(0), column(7), column(42));
        let mass = JointMatrix::from_fn(|i, j| numbers[14 + i.max(j) * (i.max(j) + 1) / 2 + i.min(j)]);
        let &[x, y, z, qw, qx, qy, qz] = &numbers[49..] else { panic!("56 numbers in a row") };
        let k = model.kinematics(&q);
        let differences = [
            (model.mass(&k) - rotors - mass).amax() / mass.amax(),
            (model.bias(&k, &qd) - bias).amax() / bias.amax(),
            aforce::pose_error(&k.tool, &pose([x, y, z], [qw, qx, qy, qz])).amax(),
        ];
        worst = std::array::from_fn(|i| worst[i].max(differences[i]));
        count += 1;
    }
    assert_eq!(count, 70);
    worst
}

/// The references carry 12 digits.
fn is_mujocos(name: &str, worst: [f64; 3]) {
    println!("{name}: mass, bias, pose within {worst:?}");
    assert!(worst.into_iter().all(|difference| difference < 1e-9), "{name}: mass, bias, pose differ by {worst:?}");
}

/// Every built-in robot is compared with its MJCF export in MuJoCo: `scripts/arms_reference.py` made the reference.
#[test]
fn dynamics_are_those_of_the_exported_arm_in_mujoco() {
    let rows = reference("states_arms.csv", 1);
    for name in RobotName::ALL {
        let (scene, tool) = wipe::scene(&name.robot(), wipe::TABLE_HEIGHT, wipe::TABLE_FRICTION);
        let model = Model::new(&scene, tool, [0.0; 3]);
        assert_eq!(model.joints(), if name == RobotName::Ur5e { 6 } else { 7 });
        let states = rows.iter().filter(|(names, _)| names[0] == name.as_str()).map(|(_, numbers)| &numbers[..]);
        is_mujocos(name.as_str(), worst(&model, JointMatrix::zeros(), states));
    }
}

/// The simulated FR3 is its maker's: MuJoCo's arm is made of franka_description's own files. `scripts/fr3_reference.py` made the reference.
#[test]
fn dynamics_of_the_fr3_are_those_of_its_makers_files_in_mujoco() {
    let robot = RobotName::Fr3.robot();
    let mut scene = Scene::default();
    let right_hand = robot.add_to(&mut scene, Pose::identity());
    add_gripper(&mut scene, &robot, right_hand);
    let model = Model::new(&scene, right_hand, [0.0; 3]);
    let rotors = JointMatrix::from_diagonal(&robot.arm.rotor_inertia.into());
    let rows = reference("states_fr3.csv", 0);
    is_mujocos("fr3", worst(&model, rotors, rows.iter().map(|(_, numbers)| &numbers[..])));
}

/// The seventh joint, which an arm of six does not have, moves nothing, and nothing moves it.
#[test]
fn a_joint_that_there_is_not_is_empty() {
    let robot = RobotName::Ur5e.robot();
    let (scene, tool) = wipe::scene(&robot, wipe::TABLE_HEIGHT, wipe::TABLE_FRICTION);
    let model = Model::new(&scene, tool, [0.0; 3]);
    let y = model.measure(robot.home, JointVector::repeat(0.3), Default::default());
    assert_eq!(y.jacobian.column(6).amax(), 0.0);
    assert_eq!((y.mass.column(6).fixed_rows::<6>(0).amax(), y.mass[(6, 6)], y.bias[6]), (0.0, 1.0, 0.0));
    assert!(y.jacobian.fixed_columns::<6>(0).determinant().abs() > 1e-3);
}
