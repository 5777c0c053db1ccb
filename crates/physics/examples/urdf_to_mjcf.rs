//! Prints the arm of a URDF as MJCF: `cargo run --release -p physics --example urdf_to_mjcf FILE TOOL_LINK`.

use physics::robots::urdf::{self, Drives};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(file), Some(tool)) = (arguments.next(), arguments.next()) else {
        return Err("usage: urdf_to_mjcf FILE TOOL_LINK".into());
    };
    let text = std::fs::read_to_string(&file).map_err(|error| format!("{file}: {error}"))?;
    let (scene, _) = urdf::arm(&text, &tool, &Drives { armature: aforce::Arm::FR3.rotor_inertia })?;
    print!("{}", physics::mjcf::export(&scene, 0.002));
    Ok(())
}
