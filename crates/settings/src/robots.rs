//! Robots as settings name them: a built-in name, a URDF, or a robot file.
//!
//! A file is read once. From then on the configuration has the robot with every number, so that a run, a copy of the
//! run elsewhere and a run that continues it do not depend on the file.

use std::path::Path;

use physics::robots::{self, Robot, RobotChoice};
use toml::{Table, Value};

/// A built-in robot by its name, or a robot from a file, whose path is relative to `folder`.
///
/// # Errors
/// Names the file and what is wrong in it; for an unknown name the nearest known one and all others.
pub fn named(text: &str, folder: &Path) -> Result<RobotChoice, String> {
    if robots::is_file(text) {
        let robot = robots::read(&folder.join(text)).map_err(|error| error.to_string())?;
        return Ok(RobotChoice::Own(Box::new(robot)));
    }
    text.parse().map(RobotChoice::Named)
}

/// Rewrites the path of a robot's file in the `env.robot` of a layer of settings: it is relative to `folder` before, and to
/// the current folder after.
pub fn count_from(layer: &mut Table, folder: &Path) {
    if let Some(Value::String(text)) = of(layer) {
        *text = counted_from(text, folder);
    }
}

/// The value of `env.robot` in a file in `folder`, for use in the current folder: a robot's file with its path, a name
/// unchanged.
pub fn counted_from(text: &str, folder: &Path) -> String {
    if robots::is_file(text) { folder.join(text).to_string_lossy().into_owned() } else { text.into() }
}

/// Replaces the file that a layer of settings names as its `env.robot` by the robot itself.
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

/// Removes the robot from `base` if the layer replaces it as a whole, so that no value of one robot stays in another.
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

#[cfg(test)]
mod tests {
    use physics::robots::RobotName;
    use tasks::EnvConfig;

    use super::*;
    use crate::{Source, env};

    /// A configuration with a user's own robot, as it is read from the robot's file.
    fn own(name: &str) -> Table {
        let robot = Robot { name: name.into(), ..RobotName::Ur5e.robot() };
        let choice = Value::try_from(RobotChoice::Own(Box::new(robot))).unwrap();
        Table::from_iter([("env".into(), Value::Table(Table::from_iter([("robot".into(), choice)])))])
    }

    fn layers(tables: Vec<Table>) -> Result<EnvConfig, String> {
        let named = tables.into_iter().map(|table| (Source::named("keys"), table)).collect();
        env(EnvConfig::default(), named).map_err(|error| error.to_string())
    }

    /// What stands in a run's `config.toml` reads back to the last bit, and one robot replaces another as a whole.
    #[test]
    fn a_robot_stands_in_a_configuration_with_every_number() {
        let table = |text: &str| text.parse::<Table>().unwrap();
        let mine = layers(vec![own("mine")]).unwrap();
        assert_eq!(mine.robot.robot(), Robot { name: "mine".into(), ..RobotName::Ur5e.robot() });
        let text = toml::to_string_pretty(&own("mine")).unwrap();
        assert_eq!(layers(vec![table(&text)]).unwrap(), mine);
        assert_eq!(layers(vec![own("other"), own("mine")]).unwrap(), mine);
        assert_eq!(layers(vec![own("mine"), table("env.robot = 'fr3'")]).unwrap().robot, RobotName::Fr3.into());
        assert_eq!(layers(vec![table("env.robot = 'fr3'"), own("mine")]).unwrap(), mine);
        // A key of it is changed as any other, and checked.
        let raised = layers(vec![own("mine"), table("env.robot.mount.height = 0.8")]).unwrap();
        assert_eq!(raised.robot.robot().mount.height, 0.8);
        let error = layers(vec![own("mine"), table("env.robot.mount.height = 80.0")]).unwrap_err();
        assert_eq!(error, "env.robot.mount.height = 80 is not allowed; allowed: -10 to 10");
    }

    #[test]
    fn files_count_from_the_folder_of_who_names_them() {
        let mut layer: Table = "env.robot = 'arms/mine.toml'".parse().unwrap();
        count_from(&mut layer, Path::new("a"));
        assert_eq!(layer["env"]["robot"].as_str(), Some("a/arms/mine.toml"));
        let mut layer: Table = "env.robot = 'fr3'".parse().unwrap();
        count_from(&mut layer, Path::new("a"));
        assert_eq!(layer["env"]["robot"].as_str(), Some("fr3"));
        assert!(named("none.urdf", Path::new("a")).unwrap_err().starts_with("a/none.urdf: "));
    }
}
