//! Writes a scene for MuJoCo: `export_mjcf lift|door|wipe robosuite|identified FOLDER` makes
//! FOLDER/<scene>_<set>.xml and FOLDER/<scene>_<set>.csv, the table of what the file must
//! contain.

use std::fmt::Write;
use std::path::Path;
use std::{env, fs, process};

use aforce::Vector3;
use physics::mjcf;
use physics::panda::ParameterSet;
use physics::scene::{Joint, Scene};
use physics::scenes::{door, lift, wipe};

fn main() {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [place, set, folder] = arguments.as_slice() else { usage() };
    let parameters = match set.as_str() {
        "robosuite" => ParameterSet::Robosuite.parameters(),
        "identified" => ParameterSet::Identified.parameters(),
        _ => usage(),
    };
    let scene = match place.as_str() {
        "lift" => lift::scene(&parameters, Vector3::repeat(0.021)).0,
        "door" => door::scene(&parameters, &door::root(door::MIDDLE)).0,
        "wipe" => wipe::scene(&parameters, wipe::TABLE_HEIGHT, wipe::TABLE_FRICTION).0,
        _ => usage(),
    };
    let (folder, name) = (Path::new(folder), format!("{place}_{set}"));
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
    eprintln!("usage: export_mjcf lift|door|wipe robosuite|identified FOLDER");
    process::exit(2)
}
