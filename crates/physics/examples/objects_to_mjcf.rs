//! Shows what is read from a file of objects: `objects_to_mjcf FILE.xml|FILE.urdf` checks the objects as a scene and
//! prints the scene as MJCF.

use std::error::Error;
use std::path::Path;
use std::{env, process};

use aforce::Pose;
use physics::mjcf;
use physics::objects::{Root, read_mjcf, read_urdf};
use physics::scene::Scene;

fn main() {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [file] = arguments.as_slice() else {
        eprintln!("usage: objects_to_mjcf FILE.xml|FILE.urdf");
        process::exit(2)
    };
    match convert(Path::new(file)) {
        Ok(text) => print!("{text}"),
        Err(error) => {
            eprintln!("{error}");
            process::exit(1)
        }
    }
}

fn convert(file: &Path) -> Result<String, Box<dyn Error>> {
    let is_urdf = file.extension().is_some_and(|kind| kind == "urdf");
    let part = if is_urdf { read_urdf(file, Root::Fixed, 1.0)? } else { read_mjcf(file)? };
    let mut scene = Scene::default();
    scene.add_part(part, &Pose::identity());
    scene.check()?;
    Ok(mjcf::export(&scene, 0.002))
}
