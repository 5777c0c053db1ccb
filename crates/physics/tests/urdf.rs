//! The Panda written as a URDF, with joints about any axis, reads back as the Panda. `scripts/urdf_mujoco.py` holds the same way
//! against MuJoCo: it loads the URDF itself and the MJCF that is exported of what was read.

use std::fmt::Write;

use aforce::{JointVector, Pose, Vector3};
use approx::assert_relative_eq;
use nalgebra::{Rotation3, Translation3, UnitQuaternion};
use physics::model::Model;
use physics::robots::panda::HOME;
use physics::robots::urdf;
use physics::robots::{Robot, RobotName};
use physics::scene::{Inertial, Joint, Scene};

fn panda() -> Robot {
    RobotName::Identified.robot()
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
fn the_panda_reads_back_whatever_the_axes_of_its_joints() {
    let (arm, hand) = scene(&panda());
    let expected = Model::new(&arm, hand, [0.0; 3]);
    for size in [0.0, 0.4, 3.0] {
        let robot = urdf::robot(&as_urdf(&arm, &turns(&arm, size)), "right_hand", &panda()).unwrap();
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

#[test]
fn what_is_no_arm_of_seven_joints_is_refused_by_name() {
    let (arm, _) = scene(&panda());
    let text = as_urdf(&arm, &turns(&arm, 0.0));
    let error = |text: &str, tool: &str| urdf::robot(text, tool, &panda()).unwrap_err().to_string();
    assert!(error("<robot", "right_hand").starts_with("no URDF: "));
    assert!(error(&text, "hand").starts_with("no link \"hand\"; there are link0, link1"), "{}", error(&text, "hand"));
    let short = error(&text, "link6");
    assert!(short.contains("joint6 (revolute); allowed are seven revolute joints"), "{short}");
    let sliding = text.replacen("type=\"revolute\"", "type=\"prismatic\"", 1);
    assert!(error(&sliding, "right_hand").contains("joint1 (prismatic)"));
    let z = "<axis xyz=\"0 0 1\"/>";
    assert!(text.contains(z));
    let flat = text.replacen(z, "<axis xyz=\"0 0 0\"/>", 1);
    assert_eq!(error(&flat, "right_hand"), "joint \"joint1\" has the axis [0.0, 0.0, 0.0]");
    let driving = text.replacen("friction=\"0\"", "friction=\"-0.1\"", 1);
    assert_eq!(
        error(&driving, "right_hand"),
        "joint \"joint1\" has a dry friction of -0.1; it must be finite and at least 0"
    );
    // A loop, of the arm or beside it, and a link with two parents.
    let joint = |parent, child| {
        let ends = format!("<parent link=\"{parent}\"/><child link=\"{child}\"/>");
        text.replace("</robot>", &format!("<joint name=\"more\" type=\"fixed\">{ends}</joint></robot>"))
    };
    assert!(error(&joint("right_hand", "link0"), "right_hand").contains("is below itself"));
    assert!(error(&joint("link0", "link5"), "right_hand").starts_with("link \"link5\" is moved by two joints"));
    // Links of any name.
    let named = text.replace("\"link", "\"part").replace("\"part0\"", "\"link1\"");
    assert!(urdf::robot(&named, "right_hand", &panda()).is_ok());
}
