//! Writes a scene for MuJoCo: `export_mjcf lift|door|wipe|insert ROBOT FOLDER` makes
//! FOLDER/<scene>_<robot>.xml and FOLDER/<scene>_<robot>.csv, the table of what the file must
//! contain.

use std::fmt::Write;
use std::path::Path;
use std::{env, fs, process};

use aforce::Vector3;
use physics::mjcf;
use physics::robots::RobotName;
use physics::scene::{Joint, Scene};
use physics::scenes::{door, insert, lift, wipe};

fn main() {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [place, robot, folder] = arguments.as_slice() else { usage() };
    let Ok(robot) = robot.parse::<RobotName>().map(RobotName::robot) else { usage() };
    let scene = match place.as_str() {
        "lift" => lift::scene(&robot, Vector3::repeat(0.021)).0,
        "door" => door::scene(&robot, &door::root(door::MIDDLE)).0,
        "wipe" => wipe::scene(&robot, wipe::TABLE_HEIGHT, wipe::TABLE_FRICTION).0,
        "insert" => insert::scene(&robot, &insert::FORGE, [0.0; 2]).0,
        _ => usage(),
    };
    let (folder, name) = (Path::new(folder), format!("{place}_{}", robot.name));
    fs::create_dir_all(folder).expect("the folder can be made");
    fs::write(folder.join(format!("{name}.xml")), mjcf::export(&scene, 0.002)).expect("the folder is writable");
    fs::write(folder.join(format!("{name}.csv")), table(&scene)).expect("the folder is writable");
}

/// One line per joint, and one with the mass of the whole scene.
fn table(scene: &Scene) -> String {
    let mut out = String::from("name,lower,upper,damping,friction,armature,spring,max_effort,mass\n");
    for body in &scene.bodies {
        if let Joint::Hinge(axis) | Joint::Slide(axis) = &body.joint {
            let max_effort = scene.actuators.iter().find(|a| a.joint == axis.name).map_or(0.0, |a| a.max_effort);
            let [lower, upper] = axis.range;
            let (damping, friction, armature, spring) = (axis.damping, axis.friction, axis.armature, axis.spring);
            writeln!(out, "{},{lower},{upper},{damping},{friction},{armature},{spring},{max_effort},", axis.name)
                .unwrap();
        }
    }
    let mass: f64 = scene.bodies.iter().map(|b| b.inertial.mass).sum();
    writeln!(out, "total,,,,,,,,{mass}").unwrap();
    out
}

fn usage() -> ! {
    eprintln!("usage: export_mjcf lift|door|wipe|insert {} FOLDER", RobotName::ALL.map(RobotName::as_str).join("|"));
    process::exit(2)
}
