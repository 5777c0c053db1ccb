//! Objects from files: objects that are read move as in MuJoCo, and errors in a file are refused by name. MuJoCo's answers come
//! from `scripts/objects_reference.py`.

mod mujoco_reference;

use std::path::{Path, PathBuf};

use aforce::{JointVector, Pose, Twist, Vector3};
use mujoco_reference::reference;
use nalgebra::UnitQuaternion;
use physics::gripper::{GRIP_SITE, add_gripper};
use physics::model::GRAVITY;
use physics::objects::{ReadError, Root, read_mjcf, read_urdf};
use physics::robots::RobotName;
use physics::robots::panda::HOME;
use physics::scene::{Axis, Body, Geom, Hull, Inertial, Joint, Role, Scene, Shape, Stop, at, pose};
use physics::{Deviation, Plant, Push, Simulation, SimulationConfig};

const DT: f64 = 0.002;

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("reference").join(name)
}

/// An arm, out of the way, and its gripper's body.
fn arm() -> (Scene, usize, Plant) {
    let robot = RobotName::Robosuite.robot();
    let mut scene = Scene::default();
    let wrist = robot.add_to(&mut scene, at([0.0, -2.0, 0.0]));
    let gripper = add_gripper(&mut scene, &robot, wrist);
    // The file has no air.
    scene.air = None;
    let plant = Plant { robot, dt: DT, config: SimulationConfig::default(), deviation: Deviation::default() };
    (scene, gripper, plant)
}

/// A step with the arm held at home.
fn hold(simulation: &mut Simulation) {
    let y = simulation.measure();
    simulation.step(&(y.bias + y.mass * ((JointVector::from(HOME) - y.q) * 400.0 - y.qd * 40.0)), 0.0).unwrap();
}

/// Largest differences of the objects' poses from MuJoCo's, in steps of `dt` (s): ball (m), roof (m and rad), flap (rad), drawer (m).
fn apart_from_mujoco(dt: f64) -> [f64; 5] {
    let (mut scene, gripper, plant) = arm();
    scene.add_part(read_mjcf(&file("objects.xml")).unwrap(), &Pose::identity());
    let mut simulation = Simulation::new(&scene, gripper, GRIP_SITE, &Plant { dt, ..plant });
    let [ball, roof] = ["ball", "roof"].map(|name| scene.body(name));
    let [flap, drawer] = ["flap", "drawer"].map(|name| scene.joint(name));
    simulation.reset(&HOME.into());
    let rows = reference("objects.csv", 0);
    assert_eq!(rows.len(), 21);
    let last = &rows[20].1;
    assert!(last[1] > 0.1 && last[6] < 0.001 && last[11] > 0.3 && last[12] > 0.1, "they move: {last:?}");
    let mut worst = [0.0f64; 5];
    for (index, (_, row)) in rows.iter().enumerate() {
        let roof_pose = simulation.body_pose(roof);
        let expected = pose([row[4], row[5], row[6]], [row[7], row[8], row[9], row[10]]);
        let ball = simulation.body_pose(ball).translation.vector;
        let mut apart = [
            (ball - Vector3::new(row[1], row[2], row[3])).norm(),
            (roof_pose.translation.vector - expected.translation.vector).norm(),
            roof_pose.rotation.angle_to(&expected.rotation),
            (simulation.joint(flap).0 - row[11]).abs(),
            (simulation.joint(drawer).0 - row[12]).abs(),
        ];
        // The softness of the floor decides how the roof tumbles as it lands, so only its start and its rest are
        // compared.
        if (2..rows.len() - 1).contains(&index) {
            (apart[1], apart[2]) = (0.0, 0.0);
        }
        worst = std::array::from_fn(|i| worst[i].max(apart[i]));
        let steps = if index + 1 < rows.len() { (0.05 / dt).round() as usize } else { 0 };
        (0..steps).for_each(|_| hold(&mut simulation));
    }
    // A rolling ball accelerates with 5/7 of what one that slides without friction does. A first-order scheme is half a
    // step ahead.
    let rolled = (simulation.body_pose(ball).translation.vector - Vector3::new(-0.4837215, 1.0, 0.4360645)).norm();
    let acceleration = 5.0 / 7.0 * 9.81 * 10f64.to_radians().sin();
    assert!((rolled - acceleration * (0.5 + 0.5 * dt)).abs() < 2e-4, "{rolled} m in a second");
    worst
}

/// A ball that rolls, a hull that falls on the floor and comes to rest, a hinge and a slide with springs at rest aside of
/// zero, dry friction and damping. With steps an eighth as long the differences are smaller.
#[test]
fn objects_move_as_mujocos() {
    for (dt, allowed) in [(DT, [1.5e-3, 1e-3, 1.5e-2, 4e-3, 4e-4]), (DT / 8.0, [2e-4, 1e-3, 5e-3, 4e-4, 5e-5])] {
        let apart = apart_from_mujoco(dt);
        println!("{dt} s: {apart:?}");
        for ((what, apart), allowed) in ["ball", "roof", "roof's turn", "flap", "drawer"].iter().zip(apart).zip(allowed)
        {
            assert!(apart < allowed, "{what}, in steps of {dt} s: {apart}, {allowed} allowed");
        }
    }
}

/// Mass, centre and inertia of ball, capsule and hulls as MuJoCo computes them from the same file.
#[test]
fn mass_is_mujocos() {
    let part = read_mjcf(&file("objects.xml")).unwrap();
    let rows = reference("objects_inertia.csv", 1);
    assert_eq!(rows.len(), 4);
    let mut worst = 0.0f64;
    for (name, row) in rows {
        let Inertial { mass, com, inertia: i } = part.bodies.iter().find(|body| body.name == name[0]).unwrap().inertial;
        let ours = [mass, com.x, com.y, com.z, i.m11, i.m22, i.m33, i.m12, i.m13, i.m23];
        for (range, size) in [(0..1, mass), (1..4, 0.1), (4..10, i.trace())] {
            let apart = range.map(|k| (ours[k] - row[k]).abs() / size).fold(0.0, f64::max);
            assert!(apart < 1e-9, "{name:?}: {ours:?}, in MuJoCo {row:?}");
            worst = worst.max(apart);
        }
    }
    println!("within {worst:.1e}");
}

/// The error of `read` for a text, without the path of the file.
fn answer<T: std::fmt::Debug>(name: &str, text: &str, read: impl Fn(&Path) -> Result<T, ReadError>) -> String {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("roof.obj"), std::fs::read(file("roof.obj")).unwrap()).unwrap();
    std::fs::write(folder.path().join("open.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n").unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    let error = read(&path).unwrap_err().to_string();
    error.replace(&format!("{}/", folder.path().display()), "")
}

#[test]
fn what_is_not_read_of_mjcf_is_refused_by_name() {
    let whole = std::fs::read_to_string(file("objects.xml")).unwrap();
    for (before, after, line, wanted) in [
        ("<default>\n", "<compiler/>\n<default>\n", 4, "a second <compiler>"),
        ("<asset>", "<option timestep=\"0.001\"/>\n<asset>", 11, "<option>: not read in <mujoco>"),
        ("<freejoint/>", "<freejoint/><site name=\"top\"/>", 19, "<site>: not read in <body>"),
        ("size=\"0.03\"", "size=\"0.03\" solref=\"0.01 1\"", 20, "attribute \"solref\" of <geom> is not read"),
        ("size=\"0.03\"", "size=\"0.03 0.02\"", 20, "the size of a sphere is a radius"),
        ("type=\"sphere\" size=\"0.03\"", "type=\"plane\" size=\"1 1 1\"", 20, "type=\"plane\"; read are box,"),
        ("mesh=\"gem\"", "mesh=\"jewel\"", 29, "there is no mesh \"jewel\""),
        ("roof.obj", "open.obj", 12, "open.obj: the mesh is not closed"),
        ("roof.obj", "away.obj", 12, "away.obj: "),
        ("damping=\"2\"", "damping=\"-2\"", 35, "damping=\"-2\": at least 0 is wanted"),
        ("damping=\"2\"", "damping=\"inf\"", 35, "damping=\"inf\": finite numbers are wanted"),
        ("type=\"slide\"", "type=\"ball\"", 35, "type=\"ball\"; read are hinge, slide and free"),
        ("<freejoint/>", "<freejoint/><joint name=\"b\"/>", 19, "body \"ball\" has one already"),
        ("class=\"stage\" size=\"2", "class=\"show\" size=\"2", 16, "there is no default class \"show\""),
        ("euler=\"0 0 30\"", "euler=\"0 0 30\" quat=\"1 0 0 0\"", 26, "more than one of quat, euler"),
        ("<body name=\"drawer\">", "<body>", 33, "the attribute \"name\" is missing"),
        ("<freejoint name=\"roof\"/>", "<joint type=\"free\"/>", 23, "a free joint with damping is not read"),
        ("</mujoco>", "", 1, "never closed"),
    ] {
        assert_eq!(whole.matches(before).count().min(1), 1, "{before}");
        let text = whole.replacen(before, after, 1);
        let error = answer("objects.xml", &text, read_mjcf);
        assert!(error.contains(wanted) && !error.contains('\n'), "{error}\nwanted: {wanted}");
        assert!(
            error.starts_with("objects.xml:") && error.starts_with(&format!("objects.xml:{line}:")),
            "{line}: {error}"
        );
    }
}

const URDF: &str = r#"<robot name="box">
  <material name="red"><color rgba="1 0 0 1"/></material>
  <link name="base">
    <collision><origin xyz="0 0 0.1"/><geometry><box size="0.2 0.4 0.2"/></geometry></collision>
  </link>
  <joint name="lid" type="revolute">
    <origin xyz="0.1 0 0.2" rpy="0 0 1.5707963267948966"/>
    <parent link="base"/><child link="lid"/>
    <axis xyz="0 1 0"/>
    <limit lower="-1" upper="0.5" effort="1" velocity="1"/>
    <dynamics damping="0.2" friction="0.3"/>
  </joint>
  <link name="lid">
    <inertial><origin xyz="0 0 0.05"/><mass value="0.5"/>
      <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.002" iyz="0" izz="0.003"/></inertial>
    <visual><geometry><sphere radius="1"/></geometry><material name="red"/></visual>
    <collision name="plate"><geometry><cylinder radius="0.05" length="0.02"/></geometry></collision>
    <collision><geometry><mesh filename="roof.obj" scale="0.001 0.001 0.001"/></geometry></collision>
  </link>
</robot>"#;

#[test]
fn a_urdf_becomes_a_part_of_a_scene() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(file("roof.obj"), folder.path().join("roof.obj")).unwrap();
    let path = folder.path().join("box.urdf");
    std::fs::write(&path, URDF).unwrap();
    let mut scene = Scene::default();
    let first = scene.add_part(read_urdf(&path, Root::Fixed, 0.7).unwrap(), &at([1.0, 0.0, 0.0]));
    scene.check().unwrap();
    let [base, lid] = [&scene.bodies[first], &scene.bodies[scene.body("lid")]];
    assert_eq!((base.pose, base.geoms[0].role), (at([1.0, 0.0, 0.0]), Role::Fixture));
    assert_eq!(base.geoms[0].shape, Shape::Box(Vector3::new(0.1, 0.2, 0.1)));
    let Joint::Hinge(axis) = &lid.joint else { panic!("{:?}", lid.joint) };
    assert_eq!((axis.name.as_str(), axis.range, axis.damping, axis.friction), ("lid", [-1.0, 0.5], 0.2, 0.3));
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
    assert!(lid.parent == Some(first) && lid.pose.rotation.angle_to(&turn) < 1e-9);
    let names: Vec<&str> = lid.geoms.iter().map(|geom| geom.name.as_str()).collect();
    assert_eq!(names, ["plate", "lid_1"]);
    assert!(lid.geoms.iter().all(|geom| (geom.color, geom.friction, geom.role) == ([255, 0, 0], 0.7, Role::Object)));
    assert!(matches!(&lid.geoms[1].shape, Shape::Convex(hull) if hull.corners().len() == 6));
}

#[test]
fn what_is_not_read_of_a_urdf_is_refused_by_name() {
    for (before, after, wanted) in [
        ("<axis xyz=\"0 1 0\"/>", "<mimic joint=\"other\"/>", "box.urdf:9: <mimic>: not read in <joint>"),
        (
            "<dynamics damping=\"0.2\"",
            "<dynamics stiffness=\"0.2\"",
            "attribute \"stiffness\" of <dynamics> is not read",
        ),
        ("type=\"revolute\"", "type=\"planar\"", "box.urdf:6: <joint>: type=\"planar\""),
        ("<child link=\"lid\"/>", "<child link=\"cover\"/>", "there is no link \"cover\""),
        ("filename=\"", "filename=\"package://box/", "a path from the URDF's folder is wanted"),
        ("<mass value=\"0.5\"/>", "", "<inertial>: no <mass>"),
        ("<material name=\"red\"/>", "<material name=\"blue\"/>", "no colour is called \"blue\""),
        ("friction=\"0.3\"", "friction=\"-0.3\"", "friction=\"-0.3\": at least 0 is wanted"),
        (
            "</robot>",
            "<link name=\"a\"/><link name=\"b\"/>\
             <joint name=\"to_b\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></joint>\
             <joint name=\"to_a\" type=\"fixed\"><parent link=\"b\"/><child link=\"a\"/></joint></robot>",
            "joints go round in a circle",
        ),
    ] {
        assert!(URDF.contains(before), "{before}");
        let error = answer("box.urdf", &URDF.replacen(before, after, 1), |file| read_urdf(file, Root::Fixed, 1.0));
        assert!(error.contains(wanted) && !error.contains('\n'), "{error}\nwanted: {wanted}");
    }
}

/// A cube on a table.
fn scene() -> Scene {
    let geom = |name: &str, z: f64, role| Geom {
        name: name.into(),
        shape: Shape::Box(Vector3::new(0.1, 0.1, 0.05)),
        pose: at([0.0, 0.0, z]),
        friction: 1.0,
        role,
        color: [0; 3],
    };
    let mut scene = Scene::default();
    scene.add_static("table", vec![geom("top", -0.05, Role::Fixture)]);
    scene.add(Body {
        name: "cube".into(),
        parent: None,
        pose: at([0.0, 0.0, 0.05]),
        joint: Joint::Free,
        inertial: Inertial::of_mass(&Shape::Box(Vector3::repeat(0.05)), 0.3),
        geoms: vec![geom("cube", 0.0, Role::Object)],
    });
    scene
}

#[test]
fn a_wrong_scene_is_refused_with_the_name_of_its_body() {
    scene().check().unwrap();
    type Change = fn(&mut Scene);
    let cases: [(Change, &str); 13] = [
        (|s| s.bodies[1].inertial = Inertial::NONE, "body \"cube\": it is free and has a mass of 0 kg"),
        (|s| s.bodies[1].name = "table".into(), "body \"table\": the name \"table\" is that of two bodies"),
        (|s| s.bodies[1].geoms[0].name = "top".into(), "body \"cube\": the name \"top\" is that of two geoms"),
        (|s| s.bodies[1].name.clear(), "body \"\": a body has no name"),
        (
            |s| s.bodies[1].pose = at([1.0, 0.0, 0.05]),
            "body \"cube\": it is free and nothing that stands still is below it",
        ),
        (|s| s.bodies[1].pose.translation.x = f64::NAN, "body \"cube\": its pose is not finite"),
        (|s| s.bodies[1].geoms[0].friction = -1.0, "body \"cube\": geom \"cube\": friction is -1"),
        (|s| s.bodies[0].geoms[0].shape = Shape::Sphere { radius: 0.0 }, "body \"table\": geom \"top\": a size of 0 m"),
        (|s| s.bodies[1].inertial.inertia.m11 *= 3.0, "body \"cube\": principal moments of inertia of"),
        (|s| s.bodies[1].inertial.mass = -1.0, "body \"cube\": its mass is -1"),
        (|s| s.bodies[1].parent = Some(1), "body \"cube\": its parent has to stand before it"),
        (|s| s.bodies[1].parent = Some(0), "body \"cube\": a free body is a child of the world"),
        (|s| s.prediction = Some(0.0), "scene: a prediction distance of 0 m"),
    ];
    for (change, wanted) in cases {
        let mut scene = scene();
        change(&mut scene);
        let error = scene.check().unwrap_err().to_string();
        assert!(error.starts_with(wanted) && !error.contains('\n'), "{error}\nwanted: {wanted}");
    }
}

#[test]
fn a_wrong_joint_is_refused_with_the_name_of_its_body() {
    type Change = fn(&mut Axis);
    let cases: [(Change, &str); 6] = [
        (|a| a.damping = -1.0, "body \"flap\": joint \"flap\": damping is -1; it must be finite and at least 0"),
        (|a| a.friction = f64::NAN, "body \"flap\": joint \"flap\": dry friction is NaN"),
        (|a| a.rest = f64::INFINITY, "body \"flap\": joint \"flap\": its direction or the rest of its spring"),
        (|a| a.range = [1.0, 0.0], "body \"flap\": joint \"flap\": the range [1, 0]"),
        (|a| a.range = [0.0, f64::INFINITY], "body \"flap\": joint \"flap\": the range [0, inf]"),
        (|a| a.name = "drawer".into(), "body \"drawer\": the name \"drawer\" is that of two joints"),
    ];
    for (change, wanted) in cases {
        let mut scene = Scene::default();
        scene.add_part(read_mjcf(&file("objects.xml")).unwrap(), &Pose::identity());
        let flap = scene.body("flap");
        let Joint::Hinge(axis) = &mut scene.bodies[flap].joint else { panic!("a hinge") };
        change(axis);
        let error = scene.check().unwrap_err().to_string();
        assert!(error.starts_with(wanted) && !error.contains('\n'), "{error}\nwanted: {wanted}");
    }
}

/// A cube that starts 3 mm deep in a table, and one that stands on it.
#[test]
fn a_start_that_overlaps_is_told() {
    for (height, expected) in [(0.05, vec![]), (0.047, vec!["geoms \"top\" and \"cube\" overlap by 3.000 mm"])] {
        let (mut whole, gripper, plant) = arm();
        whole.bodies.extend(scene().bodies);
        let cube = whole.body("cube");
        whole.bodies[cube].pose = at([0.0, 0.0, height]);
        let mut simulation = Simulation::new(&whole, gripper, GRIP_SITE, &plant);
        simulation.reset(&HOME.into());
        let told: Vec<String> = simulation.overlaps(1e-3).iter().map(ToString::to_string).collect();
        assert_eq!(told, expected);
    }
}

/// A box that falls from a metre above the table, its centre of mass aside of its origin, with a lid on a hinge: the
/// simulation, and the bodies of box and lid.
fn falling_box() -> (Simulation, [usize; 2]) {
    let (mut whole, gripper, plant) = arm();
    whole.bodies.extend(scene().bodies);
    let cube = whole.body("cube");
    whole.bodies[cube].pose = at([0.0, 0.0, 1.0]);
    whole.bodies[cube].inertial.com = Vector3::new(0.02, 0.01, 0.0);
    let hinge = Axis {
        name: "lid".into(),
        direction: Vector3::y_axis(),
        range: [f64::NEG_INFINITY, f64::INFINITY],
        damping: 0.0,
        friction: 0.0,
        armature: 0.0,
        spring: 0.0,
        rest: 0.0,
        stop: Stop::Spring { stiffness: 0.0, damping: 0.0 },
    };
    let lid = whole.add(Body {
        name: "lid".into(),
        parent: Some(cube),
        pose: at([-0.1, 0.0, 0.05]),
        joint: Joint::Hinge(hinge),
        inertial: Inertial::diagonal(0.05, [0.1, 0.0, 0.0], [1e-4; 3]),
        geoms: vec![],
    });
    let mut simulation = Simulation::new(&whole, gripper, GRIP_SITE, &plant);
    simulation.reset(&HOME.into());
    (simulation, [cube, lid])
}

/// A free body that carries a joint tells its velocity of now, as one that carries none does.
#[test]
fn a_box_with_a_lid_falls_from_the_first_step_on() {
    let (mut simulation, bodies) = falling_box();
    hold(&mut simulation);
    for body in bodies {
        let velocity = simulation.body_velocity(body);
        let fall = Twist::new(0.0, 0.0, -GRAVITY * DT, 0.0, 0.0, 0.0);
        assert!((velocity - fall).norm() < 1e-9, "{velocity}");
    }
}

/// In every step a box that is turned by a push moves with the velocity that is told after the step.
#[test]
fn a_box_with_a_lid_moves_as_its_velocity_says() {
    let (mut simulation, [cube, _]) = falling_box();
    let (point, force) = (Vector3::new(0.1, -0.1, 0.05), Vector3::new(1.0, 2.0, 3.0));
    simulation.set_hand(Some(Push { body: cube, point, force }));
    let mut fastest = 0.0f64;
    for _ in 0..20 {
        let before = simulation.body_pose(cube);
        hold(&mut simulation);
        let now = simulation.body_pose(cube);
        let velocity = simulation.body_velocity_at(cube, &now.translation.vector);
        let [v, omega] = [0, 3].map(|row| velocity.fixed_rows::<3>(row).into_owned());
        let moved = (now.translation.vector - before.translation.vector) / DT;
        let turned = (now.rotation * before.rotation.inverse()).scaled_axis() / DT;
        assert!((v - moved).norm() < 1e-6, "{v} m/s, it moved at {moved} m/s");
        assert!((omega - turned).norm() < 1e-6, "{omega} rad/s, it turned at {turned} rad/s");
        fastest = fastest.max(omega.norm());
    }
    assert!(fastest > 1.0, "{fastest} rad/s");
}

/// Rays meet balls and hulls where they are.
#[test]
fn rays_meet_the_new_shapes() {
    let octahedron = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Vector3::from);
    let corners: Vec<Vector3> = octahedron.into_iter().flat_map(|corner| [0.1 * corner, -0.1 * corner]).collect();
    let (mut whole, gripper, plant) = arm();
    let geom = |name: &str, shape, x: f64| Geom {
        name: name.into(),
        shape,
        pose: at([x, 3.0, 0.0]),
        friction: 1.0,
        role: Role::Fixture,
        color: [9; 3],
    };
    let hull = Shape::Convex(Hull::new(&corners).unwrap());
    whole.add_static("shapes", vec![geom("ball", Shape::Sphere { radius: 0.1 }, 0.0), geom("hull", hull, 1.0)]);
    let simulation = Simulation::new(&whole, gripper, GRIP_SITE, &plant);
    let surfaces = simulation.surfaces();
    let down = -Vector3::z();
    for (x, height, upwards) in [(0.0, 0.1, Vector3::z()), (1.02, 0.05, Vector3::new(1.0, 1.0, 1.0).normalize())] {
        let y = if x == 0.0 { 3.0 } else { 3.03 };
        let (distance, normal, _) = surfaces.cast(&Vector3::new(x, y, 1.0), &down).unwrap();
        assert!((distance - (1.0 - height)).abs() < 1e-6, "at {x}: {distance} m");
        assert!((normal - upwards).norm() < 1e-3, "at {x}: {normal}");
    }
    assert!(surfaces.cast(&Vector3::new(1.06, 3.06, 1.0), &down).is_none(), "beside the hull");
}
