//! Unusual and faulty URDFs from public reports: each is read correctly, or refused by the name of the link or joint.

mod small_urdf;

use std::process::Command;

use aforce::{JointVector, Pose, Vector3};
use nalgebra::UnitQuaternion;
use physics::model::Model;
use physics::robots::urdf::{self, Choices, Document, UrdfError};
use physics::robots::{Robot, RobotName};
use physics::scene::Scene;
use small_urdf::arm;

fn read(text: &str, choices: &Choices) -> Result<Robot, UrdfError> {
    urdf::robot(&Document::parse(text)?, choices, &RobotName::Fr3.robot())
}

fn error(text: &str) -> String {
    read(text, &Choices::default()).unwrap_err().to_string()
}

/// The arm of seven joints with `old` replaced wherever it stands.
fn with(old: &str, new: &str) -> String {
    let text = arm(7);
    assert!(text.contains(old), "{old}");
    text.replace(old, new)
}

/// The arm of seven joints with another element.
fn and(more: &str) -> String {
    with("</robot>", &format!("{more}</robot>"))
}

#[test]
fn what_no_arm_has_is_refused_by_its_link() {
    for (text, words) in [
        (with("<link name=\"l3\"><inertial", "<link name=\"l3\"><nothing"), "no URDF: "),
        (with(small_urdf::INERTIAL, ""), "link \"l1\", which joint \"j1\" moves, has no mass"),
        (small_urdf::inertial_of_l5("-1", "0.02", "0.03"), "link \"l5\": a mass of -1 kg; it must be at least 0"),
        (small_urdf::inertial_of_l5("0", "0.02", "0.03"), "link \"l5\": it has an inertia and a mass of 0 kg"),
        (small_urdf::inertial_of_l5("0", "0", "0"), "link \"l5\", which joint \"j5\" moves, has no mass"),
        (small_urdf::inertial_of_l5("nan", "0.02", "0.03"), "link \"l5\": <mass value=\"nan\">; wanted: one number"),
        (small_urdf::inertial_of_l5("2", "-0.02", "0.03"), "link \"l5\": principal moments of inertia of -2.000e-2"),
        (
            small_urdf::inertial_of_l5("2", "0.2", "0.03"),
            "no body has them: none may be below 0, none above the sum of the others",
        ),
        (and("<link name=\"l3\"/>"), "two links are called \"l3\""),
        (and("<link name=\"elsewhere\"/>"), "links \"base\" and \"elsewhere\" both have no parent"),
        (
            with("<parent link=\"l4\"/>", "<parent link=\"l44\"/>"),
            "joint \"j5\": its parent \"l44\" is no link of the file",
        ),
        (
            and("<joint name=\"more\" type=\"fixed\"><parent link=\"base\"/><child link=\"l5\"/></joint>"),
            "link \"l5\" is the child of two joints",
        ),
        (
            and("<joint name=\"more\" type=\"fixed\"><parent link=\"tool\"/><child link=\"base\"/></joint>"),
            "no link is without a parent",
        ),
        (
            and(
                "<link name=\"a\"/><link name=\"b\"/><joint name=\"ab\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></joint>\
                 <joint name=\"ba\" type=\"fixed\"><parent link=\"b\"/><child link=\"a\"/></joint>",
            ),
            "link \"a\" is below itself",
        ),
        (
            and("<xacro:include filename=\"x\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\"/>"),
            "<xacro:include> is left in it",
        ),
        (with("<robot", "<sdf").replace("</robot", "</sdf"), "no URDF: its element is <sdf>"),
    ] {
        let error = error(&text);
        assert!(error.contains(words), "{error}, not {words}");
    }
}

#[test]
fn what_no_joint_has_is_refused_by_its_name() {
    let axis = "<axis xyz=\"0 0 1\"/>";
    let limit = |joint: &str, limit: &str| small_urdf::limit_of(joint, limit);
    for (text, words) in [
        (with("name=\"j5\"", "name=\"j4\""), "two joints are called \"j4\""),
        (
            with("xyz=\"0 0 0.3\"", "xyz=\"0,5 0 0 0.3\""),
            "joint \"j1\": <origin xyz=\"0,5 0 0 0.3\">; wanted: 3 numbers",
        ),
        (with("xyz=\"0 0 0.3\"", "xyz=\"0 0 0.3 m\""), "joint \"j1\": <origin xyz=\"0 0 0.3 m\">"),
        (with(axis, "<axis xyz=\"0 0 nan\"/>"), "joint \"j1\": <axis xyz=\"0 0 nan\">"),
        (with(axis, "<axis xyz=\"0 0 0\"/>"), "joint \"j1\": the axis 0 0 0 has no direction"),
        (limit("j4", ""), "joint \"j4\": it is revolute and has no <limit lower=... upper=...>"),
        (limit("j4", "lower=\"2\" upper=\"-2\" effort=\"80\" velocity=\"2\""), "joint \"j4\": a range of 2 to -2 rad"),
        (limit("j4", "lower=\"-165\" upper=\"165\" effort=\"80\" velocity=\"2\""), "are these degrees?"),
        (limit("j4", "lower=\"nan\" upper=\"2\" effort=\"80\" velocity=\"2\""), "joint \"j4\": <limit lower=\"nan\">"),
        (limit("j4", "lower=\"-2\" upper=\"2\" effort=\"0\" velocity=\"2\""), "a largest torque (effort) of 0 Nm"),
        (limit("j4", "lower=\"-2\" upper=\"2\" effort=\"80\""), "the key `speed_max` of a robot file"),
        (
            with("<parent link=\"l4\"/>", "<mimic joint=\"j1\"/><parent link=\"l4\"/>"),
            "joint \"j5\" follows \"j1\" (<mimic>)",
        ),
        (
            with("<parent link=\"l4\"/>", "<dynamics friction=\"-0.1\"/><parent link=\"l4\"/>"),
            "joint \"j5\": a friction of -0.1; it must be at least 0",
        ),
        (with("name=\"j4\" type=\"revolute\"", "name=\"j4\" type=\"prismatic\""), "j4 (prismatic)"),
        (
            arm(5),
            "the way to \"tool\" has j1 (revolute), j2 (revolute), j3 (revolute), j4 (revolute), j5 (revolute); six or",
        ),
    ] {
        let error = error(&text);
        assert!(error.contains(words), "{error}, not {words}");
    }
}

#[test]
fn links_that_are_asked_for_are_there() {
    let wrong = |choices: Choices| read(&arm(7), &choices).unwrap_err().to_string();
    let name = |name: &str| Some(name.to_string());
    assert_eq!(
        wrong(Choices { tool: name("tol"), ..Choices::default() }),
        "tool: no link \"tol\"; did you mean \"tool\"?"
    );
    assert!(wrong(Choices { base: name("bath"), ..Choices::default() }).starts_with("base: no link \"bath\""));
    let aside = wrong(Choices { base: name("tool"), tool: name("l7"), ..Choices::default() });
    assert_eq!(aside, "base: link \"tool\" is not on the way to \"l7\"");
    let pairs = vec![["l1".to_string(), "l9".to_string()]];
    assert!(wrong(Choices { never_touch: pairs, ..Choices::default() }).starts_with("never_touch: no link \"l9\""));
    // Two end links, neither of them called `tool0`.
    let two = and(
        "<link name=\"camera\"/><joint name=\"c\" type=\"fixed\"><parent link=\"l7\"/><child link=\"camera\"/></joint>",
    );
    assert_eq!(
        error(&two),
        "which link is the flange? The key `tool` of a robot file says it; the arm ends in tool, camera"
    );
    let sliding = read(&arm(7).replace("revolute", "prismatic"), &Choices::default()).unwrap_err().to_string();
    assert_eq!(sliding, "no joint is revolute or continuous; an arm has six or seven that are");
    assert!(read(&two.replace("\"tool\"", "\"tool0\""), &Choices::default()).is_ok());
    // An arm on a moving base: the joints above the link `base` do not count.
    let on_a_lift = with(
        "</robot>",
        "<link name=\"cart\"/><joint name=\"up\" type=\"prismatic\"><parent link=\"cart\"/><child link=\"base\"/></joint></robot>",
    );
    assert!(error(&on_a_lift).contains("up (prismatic), j1 (revolute)"));
    let robot = read(&on_a_lift, &Choices { base: name("base"), ..Choices::default() }).unwrap();
    assert_eq!(robot, Robot { name: robot.name.clone(), ..read(&arm(7), &Choices::default()).unwrap() });
}

fn tool_at(robot: &Robot, q: &JointVector) -> Pose {
    let mut scene = Scene::default();
    let flange = robot.add_to(&mut scene, Pose::identity());
    Model::new(&scene, flange, [0.0; 3]).kinematics(q).tool
}

/// The frame of the flange is the link's own, whatever the axis of the joint that moves it.
#[test]
fn a_flange_keeps_the_frame_of_its_link() {
    let text = small_urdf::with_last_axis("0 1 0");
    let robot = read(&text, &Choices { tool: Some("l7".into()), ..Choices::default() }).unwrap();
    let upright = tool_at(&robot, &JointVector::zeros());
    assert!(upright.rotation.angle() < 1e-12, "{upright}");
    let mut q = JointVector::zeros();
    q[6] = 0.3;
    let expected = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.3);
    assert!(tool_at(&robot, &q).rotation.angle_to(&expected) < 1e-12);
}

#[test]
fn what_is_unusual_and_right_is_read() {
    let plain = read(&arm(7), &Choices::default()).unwrap();
    // A joint without end has a stated effort and speed.
    let endless = small_urdf::limit_of("j3", "effort=\"80\" velocity=\"2\"")
        .replace("name=\"j3\" type=\"revolute\"", "name=\"j3\" type=\"continuous\"");
    assert_eq!(read(&endless, &Choices::default()).unwrap().arm.range[2], [-100.0, 100.0]);
    // Without effort and speed in the file, the choices may give them.
    let silent = endless.replace("<limit effort=\"80\" velocity=\"2\"/>", "");
    let said = Choices { speed_max: Some(vec![2.0; 7]), torque_max: Some(vec![80.0; 7]), ..Choices::default() };
    assert_eq!(read(&silent, &said).unwrap().arm, read(&endless, &Choices::default()).unwrap().arm);
    // A point mass, which is welded to a link and named as one of this project's links.
    let inertia = "<inertia ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"0\"/>";
    let welded = and(&format!(
        "<link name=\"link3\"><inertial><mass value=\"0.5\"/>{inertia}</inertial></link>\
         <joint name=\"w\" type=\"fixed\"><parent link=\"l7\"/><child link=\"link3\"/></joint>"
    ));
    let choices = Choices { tool: Some("tool".into()), ..Choices::default() };
    let heavier = read(&welded, &choices).unwrap();
    assert!((heavier.links[6].inertial.mass - plain.links[6].inertial.mass - 0.5).abs() < 1e-12);
    // A frame with the small numbers that makers write in place of zeros.
    let all = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"].map(|part| format!("{part}=\"1e-8\"")).join(" ");
    let tiny = format!("<inertial><mass value=\"1e-8\"/><inertia {all}/></inertial>");
    assert!(read(&with("<link name=\"tool\"/>", &format!("<link name=\"tool\">{tiny}</link>")), &choices).is_ok());
    // Byte order mark, entities, a root that is called `world`, as MuJoCo's own.
    let marked = format!(
        "\u{feff}<?xml version=\"1.0\"?><!DOCTYPE robot [<!ENTITY m \"2\">]>{}",
        with("value=\"2\"", "value=\"&m;\"")
    );
    assert_eq!(read(&marked, &Choices::default()).unwrap(), plain);
    assert_eq!(read(&with("\"base\"", "\"world\""), &Choices::default()).unwrap(), plain);
}

/// A link that the arm does not carry may have an impossible inertia, and a shape that is left out may have no size.
#[test]
fn what_is_not_of_the_arm_refuses_nothing() {
    let flat = "<inertial><mass value=\"1\"/><inertia ixx=\"0.001\" ixy=\"0\" ixz=\"0\" iyy=\"0.001\" iyz=\"0\" izz=\"0.01\"/></inertial>";
    let sensor = |parent: &str| {
        and(&format!(
            "<link name=\"sensor\">{flat}</link>\
             <joint name=\"s\" type=\"fixed\"><parent link=\"{parent}\"/><child link=\"sensor\"/></joint>"
        ))
    };
    let choices = Choices { tool: Some("tool".into()), without_shapes: true, ..Choices::default() };
    let plain = read(&arm(7), &choices).unwrap();
    assert_eq!(read(&sensor("base"), &choices).unwrap(), plain);
    // The same on a link that the arm moves.
    let error = read(&sensor("l4"), &choices).unwrap_err().to_string();
    assert!(error.starts_with("link \"sensor\": principal moments of inertia of 1.000e-3"), "{error}");
    // Where the arm begins at l1, the link `base` and the sensor on it are no part of the arm.
    let choices = Choices { base: Some("l1".into()), ..choices };
    let six = read(&arm(7), &choices).unwrap();
    assert_eq!((six.joints, &read(&sensor("base"), &choices).unwrap()), (6, &six));

    let point = "<collision><geometry><sphere radius=\"0\"/></geometry></collision></link>";
    let frame = with("<link name=\"tool\"/>", &format!("<link name=\"tool\">{point}"));
    let wanted = Choices { without_shapes: false, ..choices.clone() };
    assert_eq!(read(&frame, &choices).unwrap(), six);
    let error = read(&frame, &wanted).unwrap_err().to_string();
    assert_eq!(error, "link \"tool\": <sphere radius=\"0\">; it must be above 0");
}

/// Shapes are read where links have them; a mesh that is not found is refused with what to do.
#[test]
fn shapes_are_those_of_the_file() {
    use physics::scene::{Role, Shape};
    let shape = |shape: &str| {
        let link =
            format!("<link name=\"l4\"><collision><origin xyz=\"0 0 0.1\"/><geometry>{shape}</geometry></collision>");
        with("<link name=\"l4\">", &link)
    };
    for (text, expected) in [
        ("<box size=\"0.2 0.4 0.6\"/>", Shape::Box(Vector3::new(0.1, 0.2, 0.3))),
        ("<cylinder radius=\"0.1\" length=\"0.4\"/>", Shape::Cylinder { half_length: 0.2, radius: 0.1 }),
        ("<capsule radius=\"0.1\" length=\"0.4\"/>", Shape::Capsule { half_length: 0.2, radius: 0.1 }),
        ("<sphere radius=\"0.1\"/>", Shape::Sphere { radius: 0.1 }),
    ] {
        let robot = read(&shape(text), &Choices::default()).unwrap();
        let [geom] = &robot.links[3].geoms[..] else { panic!("{text}: {:?}", robot.links[3].geoms) };
        assert_eq!((geom.name.as_str(), geom.shape.clone(), geom.role), ("l4_0", expected, Role::Link(4)));
    }
    for (text, words) in [
        (
            "<mesh filename=\"package://a/b.stl\"/>",
            "link \"l4\": package://a/b.stl: no folder \"a\" at the URDF or above it; the key `packages` of a robot file says",
        ),
        ("<mesh filename=\"nowhere.stl\"/>", "link \"l4\": nowhere.stl: No such file"),
        ("<mesh/>", "link \"l4\": <mesh> has no filename"),
        ("<mesh filename=\"a.dae\"/>", "link \"l4\": a.dae: a mesh ends in .obj or .stl"),
        ("<cylinder radius=\"0.1\"/>", "link \"l4\": <cylinder> has no length"),
        ("<sphere radius=\"-1\"/>", "link \"l4\": <sphere radius=\"-1\">; it must be above 0"),
        ("<box size=\"1 1\"/>", "link \"l4\": <box size=\"1 1\">; wanted: 3 numbers"),
        (
            "<cone radius=\"1\"/>",
            "link \"l4\": a collision shape <cone>; known are box, cylinder, sphere, capsule and mesh",
        ),
    ] {
        let error = error(&shape(text));
        assert!(error.starts_with(words), "{error}");
    }
    let choices = Choices { without_shapes: true, ..Choices::default() };
    assert!(read(&shape("<mesh filename=\"b.stl\"/>"), &choices).unwrap().links[3].geoms.is_empty());
}

/// The program that prints an arm says what is wrong in a sentence.
#[test]
fn the_program_says_it_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("arm.urdf");
    std::fs::write(&file, with(small_urdf::INERTIAL, "")).unwrap();
    let profile = std::env::current_exe().unwrap().ancestors().nth(2).unwrap().to_path_buf();
    let program = profile.join("examples/urdf_to_mjcf");
    assert!(program.is_file(), "{}: made by `cargo test -p physics` or `cargo build --example`", program.display());
    let ended = Command::new(program).arg(&file).arg("l7").output().unwrap();
    let told = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(1), "{told}");
    let sentence = "link \"l1\", which joint \"j1\" moves, has no mass";
    assert!(told.starts_with(&format!("{}: {sentence}", file.display())) && told.lines().count() == 1, "{told}");
}
