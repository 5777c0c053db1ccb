//! Robots as settings name them: a built-in name, a URDF, or a robot file.
//!
//! A file is read once. From then on the configuration has the robot with every number, so that a run, a copy of the
//! run elsewhere and a run that continues it do not depend on the file.

use std::path::Path;

use physics::robots::{self, RobotChoice, RobotName};
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

/// Writes out the robot that `base` names, with every number, if the layer changes single keys of it: these would
/// otherwise take the place of the name.
///
/// # Errors
/// As [`named`]; also if the layer gives a robot the name of a built-in one, which would not make it that one.
pub(crate) fn write_out(base: &mut Table, layer: &Table) -> Result<(), String> {
    let Some(Value::Table(changes)) = in_layer(layer).filter(|robot| !is_whole(robot)) else { return Ok(()) };
    let name = changes.get("name").and_then(Value::as_str);
    if let Some(name) = name.filter(|name| name.parse::<RobotName>().is_ok()) {
        return Err(format!("env.robot.name = {name:?} renames a robot and chooses none: write env.robot = {name:?}"));
    }
    let Some(robot) = of(base) else { return Ok(()) };
    if let Some(text) = robot.as_str() {
        let whole = named(text, Path::new("")).map_err(|problem| format!("env.robot: {problem}"))?.robot();
        *robot = Value::try_from(whole).expect("a robot is a table");
    }
    Ok(())
}

/// Removes the robot from `base` if the layer replaces it as a whole, so that no value of one robot stays in another.
pub(crate) fn make_room(base: &mut Table, layer: &Table) {
    if in_layer(layer).is_some_and(is_whole)
        && let Some(Value::Table(env)) = base.get_mut("env")
    {
        env.remove("robot");
    }
}

/// Whether a value stands for a whole robot: a name, a file or a complete record, not changes of one.
fn is_whole(robot: &Value) -> bool {
    let complete = |record: &Table| ["name", "joints", "links"].iter().all(|key| record.contains_key(*key));
    robot.as_table().is_none_or(complete)
}

fn in_layer(layer: &Table) -> Option<&Value> {
    layer.get("env")?.get("robot")
}

fn of(layer: &mut Table) -> Option<&mut Value> {
    layer.get_mut("env")?.get_mut("robot")
}

#[cfg(test)]
mod tests {
    use physics::robots::Robot;
    use tasks::EnvConfig;

    use super::*;
    use crate::{Source, env, lay_over};

    fn table(text: &str) -> Table {
        text.parse().unwrap()
    }

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

    /// A key changes the robot that is named below it, and no other.
    #[test]
    fn a_key_changes_the_robot_that_is_named_below_it() {
        let raise = || table("env.robot.mount.height = 0.8");
        for name in RobotName::ALL {
            let mut raised = name.robot();
            raised.mount.height = 0.8;
            let named = table(&format!("env.robot = '{name}'"));
            assert_eq!(layers(vec![named, raise()]).unwrap().robot.robot(), raised);
        }
        assert_eq!(layers(vec![raise()]).unwrap().robot.name(), RobotName::default().as_str());
        let error = layers(vec![table("env.robot = { name = 'fr3', mount = { height = 0.8 } }")]).unwrap_err();
        assert!(error.contains("keys: env.robot.name = \"fr3\"") && error.contains("write env.robot"), "{error}");
        // What a complete record lacks is not taken from the robot below.
        let mut lacking = own("mine");
        of(&mut lacking).unwrap().as_table_mut().unwrap().remove("drives");
        assert!(layers(vec![lacking]).unwrap_err().contains("missing field `drives`"));
    }

    /// A URDF of an arm without shapes, its axes by turns along and across it.
    fn urdf() -> String {
        let mut text = String::from("<robot name='arm'><link name='l0'/>");
        for (i, height) in [0.3, 0.0, 0.3, 0.0, 0.3, 0.0, 0.1].into_iter().enumerate() {
            let (axis, link) = (["0 0 1", "0 1 0"][i % 2], i + 1);
            text += &format!(
                "<link name='l{link}'><inertial><mass value='2'/>\
                 <inertia ixx='0.02' ixy='0' ixz='0' iyy='0.02' iyz='0' izz='0.02'/></inertial></link>\
                 <joint name='j{link}' type='revolute'><parent link='l{i}'/><child link='l{link}'/>\
                 <origin xyz='0 0 {height}'/><axis xyz='{axis}'/>\
                 <limit lower='-2.8' upper='2.8' effort='80' velocity='2'/></joint>"
            );
        }
        text + "</robot>"
    }

    /// Keys that follow a robot's file in the same layer change the robot of the file.
    #[test]
    fn a_key_changes_the_robot_of_a_file_that_is_named_before_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mine.urdf");
        fs_err::write(&path, urdf()).unwrap();
        let mut layer = table(&format!("env.robot = '{}'", path.display()));
        let mut raised = layers(vec![layer.clone()]).unwrap().robot.robot();
        assert_ne!(raised.mount.height, 0.8);
        raised.mount.height = 0.8;
        lay_over(&mut layer, table("env.robot.mount.height = 0.8")).unwrap();
        assert_eq!(layers(vec![layer]).unwrap().robot.robot(), raised);
        let problem = lay_over(&mut table("env.robot = 'fr4'"), table("env.robot.joints = 6")).unwrap_err();
        assert!(problem.message.starts_with("env.robot: no robot is called \"fr4\""), "{problem}");
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
