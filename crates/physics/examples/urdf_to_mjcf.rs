//! Prints an arm as MJCF: `cargo run --release -p physics --example urdf_to_mjcf FILE [TOOL_LINK]`. FILE is a URDF, or without TOOL_LINK
//! also a robot file. The arm's joints are called joint1 to joint7, and its flange `right_hand`.

use std::path::Path;
use std::process::ExitCode;

use aforce::Pose;
use physics::robots::urdf::{self, Choices, Document};
use physics::robots::{self, Robot, RobotName};
use physics::scene::Scene;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let robot = match arguments.as_slice() {
        [file] => robots::read(Path::new(file)).map_err(|error| error.to_string()),
        [file, tool] => of_urdf(file, tool).map_err(|error| format!("{file}: {error}")),
        _ => Err("usage: urdf_to_mjcf FILE [TOOL_LINK]".into()),
    };
    match robot {
        Ok(robot) => {
            let mut scene = Scene::default();
            robot.add_to(&mut scene, Pose::identity());
            print!("{}", physics::mjcf::export(&scene, 0.002));
            ExitCode::SUCCESS
        }
        Err(problem) => {
            eprintln!("{problem}");
            ExitCode::FAILURE
        }
    }
}

/// The arm of a URDF, whether or not it reaches the start of the tasks. Rotor inertia, which a URDF does not have, is the
/// FR3's.
fn of_urdf(file: &str, tool: &str) -> Result<Robot, String> {
    let text = std::fs::read_to_string(file).map_err(|error| error.to_string())?;
    let choices = Choices { tool: Some(tool.into()), without_shapes: true, ..Choices::default() };
    let document = Document::parse(&text).map_err(|error| error.to_string())?;
    urdf::robot(&document, &choices, &RobotName::Fr3.robot()).map_err(|error| error.to_string())
}
