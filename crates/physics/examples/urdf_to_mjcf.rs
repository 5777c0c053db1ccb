//! Prints the arm of a URDF as MJCF: `cargo run --release -p physics --example urdf_to_mjcf FILE TOOL_LINK`. Its joints are called
//! joint1 to joint7, and its flange `right_hand`.

use aforce::Pose;
use physics::robots::{RobotName, urdf};
use physics::scene::Scene;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(file), Some(tool)) = (arguments.next(), arguments.next()) else {
        return Err("usage: urdf_to_mjcf FILE TOOL_LINK".into());
    };
    let text = std::fs::read_to_string(&file).map_err(|error| format!("{file}: {error}"))?;
    // Rotors, which a URDF does not have, are the FR3's.
    let robot = urdf::robot(&text, &tool, &RobotName::Fr3.robot())?;
    let mut scene = Scene::default();
    robot.add_to(&mut scene, Pose::identity());
    print!("{}", physics::mjcf::export(&scene, 0.002));
    Ok(())
}
