//! Prints 20 spread states of an arm as its own model has them: `cargo run --release -p physics --example urdf_states FILE.urdf TOOL [BASE]`.
//! The first line is the number n of joints. Each other line has, in the frame of BASE (by default the root), which stands upright: n joint
//! angles (rad) and velocities (rad/s), place (m) and quaternion (w, x, y, z) of TOOL, the mass matrix (kg m2) without rotors, the bias torques
//! (Nm), and the Jacobian, whose first three rows are linear. Matrices are written by rows. `scripts/urdf_compared.py` reads this.

use std::path::Path;
use std::process::ExitCode;

use aforce::{JointVector, Pose};
use physics::model::Model;
use physics::robots::RobotName;
use physics::robots::urdf::{self, Choices, Document};
use physics::scene::Scene;

/// The first primes, a column for each joint angle and velocity. The fractional parts of the multiples of their square
/// roots spread the states over the ranges of all joints.
const STEPS: [f64; 14] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0, 31.0, 37.0, 41.0, 43.0];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let states = match arguments.as_slice() {
        [file, tool] => states(Path::new(file), tool, None),
        [file, tool, base] => states(Path::new(file), tool, Some(base.clone())),
        _ => Err("usage: urdf_states FILE.urdf TOOL [BASE]".into()),
    };
    match states {
        Ok(text) => {
            print!("{text}");
            ExitCode::SUCCESS
        }
        Err(problem) => {
            eprintln!("{problem}");
            ExitCode::FAILURE
        }
    }
}

fn states(file: &Path, tool: &str, base: Option<String>) -> Result<String, String> {
    let text = std::fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?;
    let document = Document::parse(&text).map_err(|error| error.to_string())?;
    let choices = Choices { tool: Some(tool.into()), base, without_shapes: true, ..Choices::default() };
    let mut robot = urdf::robot(&document, &choices, &RobotName::Fr3.robot()).map_err(|error| error.to_string())?;
    // A URDF has no rotor inertia.
    robot.arm.rotor_inertia = [0.0; 7];
    let mut scene = Scene::default();
    let flange = robot.add_to(&mut scene, Pose::identity());
    let model = Model::new(&scene, flange, [0.0; 3]);
    let n = model.joints();
    let mut text = format!("{n}\n");
    for state in 1..=20 {
        // Between -1 and 1.
        let spread = |column: usize| 2.0 * (f64::from(state) * STEPS[column].sqrt()).fract() - 1.0;
        let moving = |i: usize, value: f64| if i < n { value } else { 0.0 };
        let q = JointVector::from_fn(|i, _| {
            let [low, high] = robot.arm.range[i].map(|end| end.clamp(-std::f64::consts::PI, std::f64::consts::PI));
            moving(i, low + (high - low) * (spread(i) + 1.0) / 2.0)
        });
        let qd = JointVector::from_fn(|i, _| moving(i, 1.5 * spread(7 + i)));
        let k = model.kinematics(&q);
        let (mass, bias, jacobian) = (model.mass(&k), model.bias(&k, &qd), model.jacobian(&k));
        let (place, turn) = (k.tool.translation, k.tool.rotation);
        let mut numbers: Vec<f64> = q.iter().chain(&qd).copied().collect();
        numbers = [&numbers[..n], &numbers[7..7 + n]].concat();
        numbers.extend([place.x, place.y, place.z, turn.w, turn.i, turn.j, turn.k]);
        numbers.extend((0..n).flat_map(|i| (0..n).map(move |j| mass[(i, j)])));
        numbers.extend(&bias.as_slice()[..n]);
        numbers.extend((0..6).flat_map(|i| (0..n).map(move |j| jacobian[(i, j)])));
        let words: Vec<String> = numbers.iter().map(f64::to_string).collect();
        text += &(words.join(" ") + "\n");
    }
    Ok(text)
}
