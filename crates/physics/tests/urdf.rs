//! The FR3 written as a URDF, with joints about any axis, reads back as the FR3. `scripts/urdf_compared.py` holds what is read
//! against Pinocchio and MuJoCo, which read the same file.

use std::fmt::Write;

use aforce::{JointVector, Pose, Vector3};
use approx::assert_relative_eq;
use nalgebra::{Rotation3, Translation3, UnitQuaternion};
use physics::model::Model;
use physics::robots::panda::HOME;
use physics::robots::urdf::{self, Choices, Document};
use physics::robots::{Robot, RobotName};
use physics::scene::{Inertial, Joint, Scene};

fn fr3() -> Robot {
    RobotName::Fr3.robot()
}

/// The arm without a tool, and its flange.
fn scene(robot: &Robot) -> (Scene, usize) {
    let mut scene = Scene::default();
    let flange = robot.add_to(&mut scene, Pose::identity());
    (scene, flange)
}

fn xyz_rpy(pose: &Pose) -> String {
    let (roll, pitch, yaw) = Rotation3::from(pose.rotation).euler_angles();
    let p = pose.translation.vector;
    format!("xyz=\"{} {} {}\" rpy=\"{roll} {pitch} {yaw}\"", p.x, p.y, p.z)
}

/// A scene's arm as a URDF. Frame i of the file is the body's, turned by `turns[i]`: the joint's axis is then not z.
fn as_urdf(scene: &Scene, turns: &[UnitQuaternion<f64>]) -> String {
    let mut text = String::from("<robot name=\"arm\">\n");
    let turned = |index: usize| Pose::from_parts(Translation3::identity(), turns[index]);
    for (index, body) in scene.bodies.iter().enumerate() {
        let Inertial { mass, com, inertia: i } = body.inertial.transformed(&turned(index).inverse());
        writeln!(
            text,
            "<link name=\"{}\"><inertial><origin xyz=\"{} {} {}\"/><mass value=\"{mass}\"/><inertia ixx=\"{}\" ixy=\"{}\" \
             ixz=\"{}\" iyy=\"{}\" iyz=\"{}\" izz=\"{}\"/></inertial></link>",
            body.name, com.x, com.y, com.z, i.m11, i.m12, i.m13, i.m22, i.m23, i.m33
        )
        .unwrap();
        let Some(parent) = body.parent else { continue };
        let origin = xyz_rpy(&(turned(parent).inverse() * body.pose * turned(index)));
        let ends = format!(
            "<parent link=\"{}\"/><child link=\"{}\"/><origin {origin}/>",
            scene.bodies[parent].name, body.name
        );
        match &body.joint {
            Joint::Hinge(axis) => {
                let z = turns[index].inverse() * Vector3::z();
                writeln!(
                    text,
                    "<joint name=\"{}\" type=\"revolute\">{ends}<axis xyz=\"{} {} {}\"/><limit lower=\"{}\" upper=\"{}\" \
                     effort=\"87\" velocity=\"2\"/><dynamics damping=\"{}\" friction=\"{}\"/></joint>",
                    axis.name, z.x, z.y, z.z, axis.range[0], axis.range[1], axis.damping, axis.friction
                )
                .unwrap();
            }
            _ => writeln!(text, "<joint name=\"to_{}\" type=\"fixed\">{ends}</joint>", body.name).unwrap(),
        }
    }
    text + "</robot>\n"
}

fn turns(scene: &Scene, size: f64) -> Vec<UnitQuaternion<f64>> {
    let turn = |i: usize| Vector3::new(1.3 * i as f64, 0.7 - i as f64, 2.0 + i as f64).map(|a| size * a.sin());
    let mut turns: Vec<_> = (0..scene.bodies.len()).map(|i| UnitQuaternion::from_scaled_axis(turn(i))).collect();
    (turns[0], turns[8]) = (UnitQuaternion::identity(), UnitQuaternion::identity()); // The base and the hand.
    turns
}

#[test]
fn an_arm_reads_back_whatever_the_axes_of_its_joints() {
    let (arm, hand) = scene(&fr3());
    let expected = Model::new(&arm, hand, [0.0; 3]);
    for size in [0.0, 0.4, 3.0] {
        let document = Document::parse(&as_urdf(&arm, &turns(&arm, size))).unwrap();
        let robot = urdf::robot(&document, &Choices::default(), &fr3()).unwrap();
        let (read, flange) = scene(&robot);
        let model = Model::new(&read, flange, [0.0; 3]);
        for k in 0..10 {
            let q = JointVector::from_fn(|i, _| HOME[i] + 0.8 * (0.7 * (k as f64 + 1.0) * (i as f64 + 1.0)).sin());
            let qd = JointVector::from_fn(|i, _| (1.1 * (k as f64 + 2.0) * (i as f64 + 1.0)).sin());
            let (a, b) = (expected.kinematics(&q), model.kinematics(&q));
            assert_relative_eq!(aforce::pose_error(&b.tool, &a.tool).norm(), 0.0, epsilon = 1e-9);
            assert_relative_eq!(expected.jacobian(&a), model.jacobian(&b), epsilon = 1e-9);
            assert_relative_eq!(expected.mass(&a), model.mass(&b), epsilon = 1e-9);
            assert_relative_eq!(expected.bias(&a, &qd), model.bias(&b, &qd), epsilon = 1e-9);
        }
        let joint = |scene: &Scene, name: &str| match &scene.bodies[scene.body(name)].joint {
            Joint::Hinge(axis) => axis.clone(),
            other => panic!("{other:?}"),
        };
        assert_eq!(joint(&read, "link4"), joint(&arm, "link4"));
        assert_eq!((robot.arm.torque_max, robot.arm.speed_max), ([87.0; 7], [2.0; 7]));
    }
}
