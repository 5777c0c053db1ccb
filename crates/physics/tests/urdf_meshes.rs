//! Collision meshes of an arm: the hull of each file, found as ROS finds it, or one line that names link and file.

mod small_urdf;

use std::fs;
use std::path::{Path, PathBuf};

use physics::robots::{Robot, RobotChoice, read};
use physics::scene::{Role, Shape};
use small_urdf::arm;

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

/// By a path that counts from the URDF, in full, and by the package's name.
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
