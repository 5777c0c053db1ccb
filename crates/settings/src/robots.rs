//! Robots as people name them: a built-in name, a URDF, or a robot file.
//!
//! A file is read once. What was read stands in the configuration from then on with every number, so that a run, its copy elsewhere and
//! what goes on from it do not hang on the file.

use std::path::Path;

use physics::robots::{self, Robot, RobotChoice};
use toml::{Table, Value};

/// A built-in robot by its name, or a file, counted from `folder`.
///
/// # Errors
/// Names the file and what is wrong in it; of an unknown name the nearest known one and all others.
pub fn named(text: &str, folder: &Path) -> Result<RobotChoice, String> {
    if robots::is_file(text) {
        let robot = robots::read(&folder.join(text)).map_err(|error| error.to_string())?;
        return Ok(RobotChoice::Own(Box::new(robot)));
    }
    text.parse().map(RobotChoice::Named)
}

/// Counts the file that a layer of settings names as its `env.robot` from `folder`.
pub fn count_from(layer: &mut Table, folder: &Path) {
    if let Some(Value::String(text)) = of(layer) {
        *text = counted_from(text, folder);
    }
}

/// What a setting `env.robot` in a file of `folder` is from the current folder.
pub fn counted_from(text: &str, folder: &Path) -> String {
    if robots::is_file(text) { folder.join(text).to_string_lossy().into_owned() } else { text.into() }
}

/// Puts the robot in the place of the file that a layer of settings names as its `env.robot`.
///
/// # Errors
/// As [`named`].
pub(crate) fn work_out(layer: &mut Table) -> Result<(), String> {
    let Some(robot) = of(layer) else { return Ok(()) };
    let Some(text) = robot.as_str().filter(|text| robots::is_file(text)) else { return Ok(()) };
    let choice = named(text, Path::new("")).map_err(|problem| format!("env.robot: {problem}"))?;
    *robot = Value::try_from(choice).expect("a robot is a table");
    Ok(())
}

/// Takes the robot out of `base` that a layer replaces as a whole: nothing of one robot may stay in another.
pub(crate) fn make_room(base: &mut Table, layer: &Table) {
    let robot = layer.get("env").and_then(|env| env.get("robot"));
    let is_whole = |robot: &Value| robot.clone().try_into::<Robot>().is_ok() || !robot.is_table();
    if robot.is_some_and(is_whole)
        && let Some(Value::Table(env)) = base.get_mut("env")
    {
        env.remove("robot");
    }
}

fn of(layer: &mut Table) -> Option<&mut Value> {
    layer.get_mut("env")?.get_mut("robot")
}
