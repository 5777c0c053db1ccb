//! Robots' models are those of the same arms in MuJoCo: kinematics, mass matrix and bias torques, in 70 random states each.

mod mujoco_reference;

use aforce::{JointMatrix, JointVector, Pose};
use mujoco_reference::reference;
use physics::gripper::add_gripper;
use physics::model::Model;
use physics::robots::RobotName;
use physics::scene::{Scene, pose};
use physics::scenes::wipe;

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

/// Of every robot by name, as it is exported: `scripts/arms_reference.py` made the reference.
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

/// The seventh joint of an arm of six moves nothing, and nothing moves it.
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
