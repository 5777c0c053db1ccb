//! The FR3 written as a URDF, with joints about any axis, reads back as the FR3. `scripts/urdf_compared.py` holds what is read
//! against Pinocchio and MuJoCo, which read the same file. Collision meshes of an arm: the hull of each file, found as ROS finds it,
//! or one line that names link and file.
//! A robot file adds to a URDF what the URDF does not say.

mod small_urdf;

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use aforce::{JointVector, Pose, Vector3};
use approx::assert_relative_eq;
use nalgebra::{Rotation3, Translation3, UnitQuaternion};
use physics::model::Model;
use physics::robots::panda::HOME;
use physics::robots::urdf::{self, Choices, Document};
use physics::robots::{Robot, RobotChoice, RobotName, read};
use physics::scene::{Inertial, Joint, Role, Scene, Shape};
use small_urdf::arm;

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

/// A roof, in millimetres: 60 x 40 x 25.
const ROOF: &str = include_str!("../reference/roof.obj");

/// A folder of the test's own, as of a ROS package: `urdf/arm.urdf`, whose fourth link has these shapes, and `meshes/roof.obj`.
fn package(test: &str, shapes: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test).join("roof_description");
    for part in ["urdf", "meshes"] {
        fs::create_dir_all(folder.join(part)).unwrap();
    }
    let link = "<link name=\"l4\">";
    fs::write(folder.join("urdf/arm.urdf"), arm(7).replace(link, &format!("{link}{shapes}"))).unwrap();
    fs::write(folder.join("meshes/roof.obj"), ROOF).unwrap();
    folder
}

fn collision(shape: &str) -> String {
    format!("<collision><origin xyz=\"0 0 0.1\" rpy=\"0.1 0.2 0.3\"/><geometry><{shape}/></geometry></collision>")
}

/// The arm of such a package, or why there is none.
fn robot(test: &str, mesh: &str) -> Result<Robot, String> {
    read(&package(test, &collision(&format!("mesh {mesh}"))).join("urdf/arm.urdf")).map_err(|error| error.to_string())
}

const MILLIMETRES: &str = "scale=\"0.001 0.001 0.001\"";

/// The mesh is named by a path relative to the URDF, by an absolute path, and by the package's name.
#[test]
fn a_mesh_is_its_hull_wherever_the_file_says_it_is() {
    let folder = package("found", &collision("box size=\"1 1 1\""));
    let boxed = read(&folder.join("urdf/arm.urdf")).unwrap();
    let full = fs::canonicalize(folder.join("meshes/roof.obj")).unwrap();
    for file in [
        "../meshes/roof.obj".into(),
        format!("file://{}", full.display()),
        "package://roof_description/meshes/roof.obj".into(),
    ] {
        let robot = robot("found", &format!("filename=\"{file}\" {MILLIMETRES}")).unwrap();
        let [geom] = &robot.links[3].geoms[..] else { panic!("{file}: {:?}", robot.links[3].geoms) };
        let Shape::Convex(hull) = &geom.shape else { panic!("{file}: {:?}", geom.shape) };
        let size = |i: usize| {
            let of = hull.corners().iter().map(|corner| corner[i]);
            of.clone().fold(f64::MIN, f64::max) - of.fold(f64::MAX, f64::min)
        };
        assert_eq!(geom.pose, boxed.links[3].geoms[0].pose);
        assert_eq!((geom.name.as_str(), geom.role, hull.corners().len()), ("l4_0", Role::Link(4), 6));
        assert!([0.06, 0.04, 0.025].iter().enumerate().all(|(i, &wanted)| (size(i) - wanted).abs() < 1e-12), "{file}");
    }
}

/// A package that lies elsewhere is named by the robot file.
#[test]
fn a_robot_file_says_where_a_package_is() {
    let folder = package("elsewhere", &collision(&format!("mesh filename=\"package://other/roof.obj\" {MILLIMETRES}")));
    let file = folder.join("arm.toml");
    fs::write(&file, "urdf = 'urdf/arm.urdf'\npackages = { other = 'meshes' }\n").unwrap();
    assert_eq!(read(&file).unwrap().links[3].geoms.len(), 1);
    fs::write(&file, "urdf = 'urdf/arm.urdf'\npackages = { another = 'meshes' }\n").unwrap();
    let error = read(&file).unwrap_err().to_string();
    assert!(
        error.contains("link \"l4\": package://other/roof.obj: no folder \"other\" at the URDF or above it"),
        "{error}"
    );
}

/// Link and file are named, on one line.
#[test]
fn what_is_no_body_is_refused_by_link_and_file() {
    let folder = package("faults", "");
    fs::write(folder.join("meshes/open.obj"), ROOF.replace("f 4 1 5\n", "")).unwrap();
    for (mesh, words) in [
        ("filename=\"../meshes/missing.stl\"", "meshes/missing.stl: No such file"),
        ("filename=\"../meshes/open.obj\"", "meshes/open.obj: the mesh is not closed: 3 edges belong to one face only"),
        ("filename=\"../meshes/roof.dae\"", "meshes/roof.dae: a mesh ends in .obj or .stl"),
        ("filename=\"package://roof_description/roof.obj\"", "roof_description/roof.obj: No such file"),
        (
            "filename=\"package://nowhere_description/roof.obj\"",
            "no folder \"nowhere_description\" at the URDF or above it",
        ),
        (
            "filename=\"../meshes/roof.obj\" scale=\"1 1 0\"",
            "meshes/roof.obj, scaled by [1.0, 1.0, 0.0]: its points lie in one plane",
        ),
        ("filename=\"../meshes/roof.obj\" scale=\"1 1\"", "<mesh scale=\"1 1\">; wanted: 3 numbers"),
    ] {
        let error = robot("faults", mesh).unwrap_err();
        assert!(
            error.contains("link \"l4\": ") && error.contains(words) && !error.contains('\n'),
            "{error}, not {words}"
        );
    }
    robot("faults", "filename=\"../meshes/missing.stl\"").unwrap_err();
    let file = folder.join("arm.toml");
    fs::write(&file, "urdf = 'urdf/arm.urdf'\nshapes = 'none'\n").unwrap();
    assert!(read(&file).unwrap().links[3].geoms.is_empty());
}

/// A configuration keeps the corners, and the robot that is read from it is the same.
#[test]
fn a_configuration_keeps_the_hull() {
    let robot = robot("kept", &format!("filename=\"../meshes/roof.obj\" {MILLIMETRES}")).unwrap();
    let choice = RobotChoice::Own(Box::new(robot));
    let text = toml::to_string(&choice).unwrap();
    assert_eq!(toml::from_str::<RobotChoice>(&text).unwrap(), choice);
}

/// A folder of the test's own with a URDF of so many joints.
fn folder(test: &str, joints: usize) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("small.urdf"), arm(joints)).unwrap();
    folder
}

fn robot_of(folder: &Path, text: &str) -> Result<Robot, String> {
    let path = folder.join("mine.toml");
    fs::write(&path, text).unwrap();
    read(&path).map_err(|error| error.to_string())
}

#[test]
fn a_urdf_alone_is_a_robot_that_starts_like_the_panda() {
    for joints in [6, 7] {
        let alone = read(&folder(&format!("alone{joints}"), joints).join("small.urdf")).unwrap();
        assert_eq!((alone.name.as_str(), alone.joints), ("small", joints));
        assert_eq!(alone.arm.rotor_inertia[0], RobotName::Fr3.robot().arm.rotor_inertia[0]);
        alone.validate().unwrap();
    }
}

#[test]
fn what_no_scene_could_hold_is_refused_with_the_robot() {
    let told = |change: fn(&mut Robot)| {
        let mut robot = RobotName::Fr3.robot();
        change(&mut robot);
        robot.validate().unwrap_err().to_string()
    };
    let twice = told(|robot| {
        let geom = robot.links[0].geoms[0].clone();
        robot.links[1].geoms.push(geom);
    });
    assert!(
        twice.starts_with("bodies: body \"link2\": the name ") && twice.ends_with("is that of two geoms"),
        "{twice}"
    );
    let hollow = told(|robot| robot.gripper.palm.mass = -1.0);
    assert!(hollow.starts_with("bodies: body \"gripper"), "{hollow}");
    let slippery = told(|robot| robot.links[3].geoms[0].friction = -1.0);
    assert!(slippery.starts_with("bodies: body \"link4\": geom "), "{slippery}");
}

#[test]
fn a_robot_file_says_what_the_urdf_does_not() {
    let folder = folder("says", 6);
    let text = "urdf = 'small.urdf'\nbase = 'base'\ntool = 'l6'\nflange = { xyz = [0.0, 0.0, 0.2], rpy = [0.0, 0.0, 0.5] }\n\
                home = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]\nmount = { height = 0.5, behind_table = 0.1 }\n\
                rotors = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]\ndamping = [1, 2, 3, 4, 5, 6]\nfriction = [0, 0, 0, 0, 0, 0.5]\n\
                drives = [1, 1, 1, 1, 1, 2]\nspeed_max = [3, 3, 3, 3, 3, 4]\ntorque_max = [9, 9, 9, 9, 9, 8]\n\
                torque_rate_max = [500, 500, 500, 500, 500, 400]\n\
                range = [[-1, 1], [-1, 1], [-1, 1], [-1, 1], [-1, 1], [-1, 2]]\n\
                never_touch = [['l1', 'l4']]\n\
                [[capsules]]\nlink = 'l2'\nfrom = [0.0, 0.0, 0.0]\nto = [0.0, 0.0, 0.3]\nradius = 0.05\n";
    let robot = robot_of(&folder, text).unwrap();
    assert_eq!((robot.name.as_str(), robot.joints), ("mine", 6));
    assert_eq!(robot.home.as_slice(), [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.0]);
    assert_eq!((robot.mount.height, robot.mount.behind_table), (0.5, 0.1));
    assert_eq!((robot.links[5].damping, robot.links[5].friction, robot.drives[5]), (6.0, 0.5, 2.0));
    let arm = robot.arm;
    assert_eq!((arm.rotor_inertia[5], arm.speed_max[5], arm.torque_max[5]), (0.6, 4.0, 8.0));
    assert_eq!((arm.torque_rate_max[5], arm.range[5]), (400.0, [-1.0, 2.0]));
    assert!((robot.flange.translation.vector.norm() - 0.2).abs() < 1e-12);
    assert!(robot.never_touch.contains(&[1, 4]) && robot.never_touch.contains(&[4, 5]));
    let [capsule] = &robot.links[1].geoms[..] else { panic!("{:?}", robot.links[1].geoms) };
    assert_eq!(
        (capsule.shape.clone(), capsule.role),
        (Shape::Capsule { half_length: 0.15, radius: 0.05 }, Role::Link(2))
    );
}

#[test]
fn what_is_wrong_is_told_with_file_and_key() {
    let folder = folder("wrong", 7);
    let seven = "urdf = 'small.urdf'\n";
    for (text, words) in [
        ("", "mine.toml: line 1, column 1: missing field `urdf`"),
        ("urdf = 'none.urdf'", "none.urdf: "),
        (&format!("{seven}hme = [0.0]"), "mine.toml: line 2, column 1: unknown key \"hme\"; did you mean \"home\"?"),
        (&format!("{seven}home = [0.0]"), "mine.toml: home has 1 values; the arm has 7 joints"),
        (&format!("{seven}tool = 'tol'"), "small.urdf: tool: no link \"tol\"; did you mean \"tool\"?"),
        (
            &format!("{seven}home = [0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0]"),
            "mine.toml: home[1] = 3 is not allowed; allowed: -2.8 to 2.8",
        ),
        (
            &format!("{seven}rotors = [-1, 1, 1, 1, 1, 1, 1]"),
            "mine.toml: arm.rotor_inertia (joint 1) = -1 is not allowed",
        ),
        (
            &format!("{seven}mount = {{ height = 0.9, behind_table = 3.0 }}"),
            "the arm does not reach to where the Panda's flange is at the start of an episode, its z facing down",
        ),
        (
            &format!("{seven}[[capsules]]\nlink = 'l2'\nfrom = [0.0, 0.0, 0.0]\nto = [0.0, 0.0, 0.0]\nradius = 0.1"),
            "capsules: the one on \"l2\" has a radius of 0.1 m and a length of 0 m; both must be above 0",
        ),
        (
            &format!("{seven}[[capsules]]\nlink = 'l9'\nfrom = [0.0, 0.0, 0.0]\nto = [0.0, 0.0, 1.0]\nradius = 0.1"),
            "capsules: no link \"l9\"",
        ),
    ] {
        let error = robot_of(&folder, text).unwrap_err();
        assert!(error.contains(words), "{error}, not {words}");
    }
}
