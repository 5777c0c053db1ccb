//! A robot file: a URDF and what that does not say.

mod small_urdf;

use std::fs;
use std::path::{Path, PathBuf};

use physics::robots::{Robot, RobotName, read};
use physics::scene::{Role, Shape};
use small_urdf::arm;

/// A folder of the test's own with a URDF of so many joints.
fn folder(test: &str, joints: usize) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("small.urdf"), arm(joints)).unwrap();
    folder
}

fn robot(folder: &Path, text: &str) -> Result<Robot, String> {
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
    assert!(hollow.contains("palm") || hollow.contains("mass"), "{hollow}");
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
    let robot = robot(&folder, text).unwrap();
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
        let error = robot(&folder, text).unwrap_err();
        assert!(error.contains(words), "{error}, not {words}");
    }
}
