//! The simulated FR3 is its maker's: kinematics, mass matrix and bias torques are those that MuJoCo computes for an arm made of
//! franka_description's own files. `scripts/fr3_reference.py` made the reference.

mod mujoco_reference;

use aforce::{JointMatrix, JointVector, Pose};
use mujoco_reference::reference;
use physics::gripper::add_gripper;
use physics::model::Model;
use physics::robots::RobotName;
use physics::scene::{Scene, pose};

/// The references carry 12 digits. Differences are relative to the largest entry.
#[test]
fn dynamics_are_those_of_the_makers_files_in_mujoco() {
    let robot = RobotName::Fr3.robot();
    let mut scene = Scene::default();
    let right_hand = robot.add_to(&mut scene, Pose::identity());
    add_gripper(&mut scene, &robot, right_hand);
    let model = Model::new(&scene, right_hand, [0.0; 3]);
    let rotors = JointMatrix::from_diagonal(&robot.arm.rotor_inertia.into());
    let rows = reference("states_fr3.csv", 0);
    assert_eq!(rows.len(), 70);
    let mut worst = [0.0f64; 3];
    for (_, numbers) in rows {
        let part = |from: usize| &numbers[from..];
        let (q, qd) = (JointVector::from_column_slice(&numbers[..7]), JointVector::from_column_slice(&numbers[7..14]));
        let lower = part(14);
        let mass = JointMatrix::from_fn(|i, j| lower[i.max(j) * (i.max(j) + 1) / 2 + i.min(j)]);
        let bias = JointVector::from_column_slice(&numbers[42..49]);
        let &[x, y, z, qw, qx, qy, qz] = part(49) else { panic!("56 numbers in a row") };
        let k = model.kinematics(&q);
        let differences = [
            (model.mass(&k) - rotors - mass).amax() / mass.amax(),
            (model.bias(&k, &qd) - bias).amax() / bias.amax(),
            aforce::pose_error(&k.tool, &pose([x, y, z], [qw, qx, qy, qz])).amax(),
        ];
        worst = std::array::from_fn(|i| worst[i].max(differences[i]));
    }
    println!("mass, bias, pose within {worst:?}");
    assert!(worst.into_iter().all(|difference| difference < 1e-9), "mass, bias, pose differ by {worst:?}");
}
