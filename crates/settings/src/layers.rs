//! Layers of settings, one over the other.

use std::path::Path;

use aforce::record::{self, Problem, overlay};
use anyhow::{Error, Result, anyhow, ensure};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use tasks::EnvConfig;
use toml::{Table, Value};

use crate::source::Source;
use crate::{robots, setup, spaces};

/// What an error says of a file that holds no settings.
pub const WANTED: &str = "a TOML file is wanted, such as a run's config.toml";

/// The file `path` with this text as a layer: its keys, with `env.space` resolved by [`spaces::work_out`].
///
/// # Errors
/// Names the file and what is wrong in it.
pub fn of_file(path: &Path, text: String) -> Result<(Source, Table)> {
    let name = path.display().to_string();
    let mut table: Table = record::parse(&text).map_err(|problem| anyhow!("{name}: {problem}; {WANTED}"))?;
    ensure!(!table.contains_key("group"), "{name}: the file of a sweep: give it to `sweep`");
    let folder = path.parent().unwrap_or(Path::new(""));
    spaces::work_out(&mut table, folder).map_err(|problem| anyhow!("{name}: {problem:#}"))?;
    robots::count_from(&mut table, folder);
    Ok((Source::file(name, text), table))
}

/// The settings that result from laying named tables over `base`, the last one on top. The key `setup` of a table
/// stands for three keys of the environment ([`setup`]), which lie below the table's own.
///
/// # Errors
/// Names the layer and the key, and the nearest known key if it is unknown.
pub fn layered<T: DeserializeOwned>(mut base: Table, layers: Vec<(Source, Table)>) -> Result<T> {
    for (source, mut table) in layers {
        if let Some(setup) = table.remove("setup") {
            let name = setup.as_str().map_or_else(|| setup.to_string(), String::from);
            overlay(&mut base, setup::settings(&name).map_err(|error| anyhow!("{}: {error}", source.at("setup")))?);
        }
        robots::work_out(&mut table).map_err(|problem| anyhow!("{}: {problem}", source.at("env.robot")))?;
        lay_over(&mut base, table).map_err(|problem| anyhow!("{}: {problem}", source.at(&problem.key)))?;
        // The settings are checked after each layer, so that an error names the layer that it is in.
        record::read::<T>(base.clone()).map_err(|problem| anyhow!("{}: {problem}", source.at(&problem.key)))?;
    }
    record::read(base).map_err(Error::from)
}

/// Lays a layer's settings over those below. A space or a robot that the layer names replaces the one below as a whole.
/// Single keys change the one below; a robot that is only named there is written out first.
///
/// # Errors
/// If a robot is not known; if a list, or a table without keys, lies over a table with keys.
pub fn lay_over(base: &mut Table, layer: Table) -> Result<(), Problem> {
    let wrong = |key: String, message: String| Problem { key, place: None, message };
    robots::write_out(base, &layer).map_err(|problem| wrong("env.robot".into(), problem))?;
    if let Some(key) = unfit(base, &layer, "", is_list) {
        let message = format!("{key} is a list; a table is wanted, name = value");
        return Err(wrong(key, message));
    }
    robots::make_room(base, &layer);
    spaces::make_room(base, &layer);
    if let Some(key) = unfit(base, &layer, "", is_empty) {
        let message = format!("{key} = {{}} changes nothing: name its keys, with their neutral values");
        return Err(wrong(key, message));
    }
    overlay(base, layer);
    Ok(())
}

/// The first dotted key, if any, where `base` has a table and `over` a value that `is_unfit` says does not go over it.
fn unfit(base: &Table, over: &Table, above: &str, is_unfit: fn(&str, &Table, &Value) -> bool) -> Option<String> {
    over.iter().find_map(|(key, value)| {
        let path = if above.is_empty() { key.clone() } else { format!("{above}.{key}") };
        match (base.get(key)?, value) {
            (Value::Table(base), value) if is_unfit(&path, base, value) => Some(path),
            (Value::Table(base), Value::Table(over)) => unfit(base, over, &path, is_unfit),
            _ => None,
        }
    })
}

/// serde would take a list for the table's values in their order.
fn is_list(_: &str, _: &Table, over: &Value) -> bool {
    over.is_array()
}

/// An empty table leaves every key of the one below it, though it reads as if there were none. Sections at the top, such
/// as `env`, are no values: they may be empty.
fn is_empty(key: &str, base: &Table, over: &Value) -> bool {
    key.contains('.') && !base.is_empty() && over.as_table().is_some_and(Table::is_empty)
}

/// An environment's settings as they stand in a larger document.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    env: EnvConfig,
}

/// The environment that results from laying tables, each with the keys `env` and `setup`, over `base`. It is checked.
///
/// # Errors
/// As [`layered`]; also the first value that is not allowed.
pub fn env(base: EnvConfig, layers: Vec<(Source, Table)>) -> Result<EnvConfig> {
    let base = Table::try_from(Document { env: base }).expect("a configuration is a table");
    let Document { env } = layered(base, layers)?;
    env.validate()?;
    Ok(env)
}

/// A table with one value, under a dotted key.
pub fn nested(key: &str, value: Value) -> Table {
    let value = |key: &str| match key.split_once('.') {
        None => (key.to_string(), value),
        Some((head, rest)) => (head.to_string(), Value::Table(nested(rest, value))),
    };
    Table::from_iter([value(key)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(text: &str) -> Result<EnvConfig> {
        let mut table: Table = text.parse().unwrap();
        spaces::work_out(&mut table, Path::new(""))?;
        env(EnvConfig::default(), vec![(Source::named("keys"), table)])
    }

    #[test]
    fn a_part_of_a_section_leaves_the_rest() {
        let config = keys("setup = 'small-steps'\n[env]\nspace = 'osc'\nforce_penalty.limit = 40").unwrap();
        assert_eq!((config.force_penalty.limit, config.force_penalty.weight), (40.0, 0.05));
        assert_eq!((config.space.name.as_str(), config.controller.position_step), ("osc", 0.02));
    }

    #[test]
    fn an_empty_table_over_one_with_keys_is_refused() {
        let layers = |texts: &[&str]| {
            let named = texts.iter().map(|text| (Source::named("keys"), text.parse().unwrap()));
            env(EnvConfig::default(), named.collect())
        };
        let slick = "env.disturbance.friction = 0.5";
        for (emptied, key) in
            [("env.disturbance = {}", "env.disturbance"), ("env.controller.force = {}", "env.controller.force")]
        {
            let error = layers(&[slick, emptied]).unwrap_err().to_string();
            assert_eq!(error, format!("keys: {key} = {{}} changes nothing: name its keys, with their neutral values"));
        }
        for harmless in ["", "[env]", "env.disturbance = {}"] {
            assert_eq!(layers(&[harmless]).unwrap(), EnvConfig::default(), "{harmless}");
        }
        assert_eq!(layers(&["env.disturbance = {}", slick]).unwrap(), layers(&[slick]).unwrap());
    }

    /// For each number in `settings`: its dotted key, and a table that sets this one number to NaN.
    fn one_spoilt(settings: &Table) -> Vec<(String, Table)> {
        let mut spoilt = vec![];
        for (key, value) in settings {
            let mut with = |path, value| spoilt.push((path, Table::from_iter([(key.clone(), value)])));
            match value {
                Value::Table(inner) => {
                    for (path, inner) in one_spoilt(inner) {
                        with(format!("{key}.{path}"), inner.into());
                    }
                }
                Value::Array(numbers) if numbers.first().is_some_and(Value::is_float) => {
                    let rest = numbers[1..].iter().cloned();
                    with(key.clone(), [Value::Float(f64::NAN)].into_iter().chain(rest).collect::<Vec<_>>().into());
                }
                Value::Float(_) | Value::Integer(_) => with(key.clone(), f64::NAN.into()),
                _ => {}
            }
        }
        spoilt
    }

    /// Every number has a check, and the key that the check names is the number's own.
    #[test]
    fn no_number_is_taken_unchecked() {
        for name in ["aforce-psi-force", "variable", "osc", "robosuite-osc"] {
            let whole = EnvConfig { space: name.parse().unwrap(), ..EnvConfig::default() };
            let table = Table::try_from(Document { env: whole.clone() }).unwrap();
            let spoilt = one_spoilt(&table);
            assert!(spoilt.len() > 20, "{} numbers", spoilt.len());
            for (key, settings) in spoilt {
                let result = env(whole.clone(), vec![(Source::named("keys"), settings)]);
                let error = result.map_or_else(|error| error.to_string(), |_| "taken".into());
                assert!(error.contains(&key), "{name}: {key}: {error}");
            }
        }
    }

    #[test]
    fn what_is_wrong_is_told_with_its_key() {
        for (text, words) in [
            ("env.horzon = 3", "keys: unknown key \"env.horzon\"; did you mean \"env.horizon\"?"),
            (
                "env.disturbance.frction = 2",
                "unknown key \"env.disturbance.frction\"; did you mean \"env.disturbance.friction\"?",
            ),
            ("learner.gamma = 1", "unknown key \"learner\""),
            ("env.task = 3", "keys: env.task: a name in quotes is wanted"),
            (
                "env.robot = 'ur5'",
                "keys: env.robot: no robot is called \"ur5\"; did you mean \"ur5e\"? known are robosuite, identified, fr3, iiwa14, ur5e, or a \
                 file that ends with .toml or .urdf",
            ),
            (
                "env.robot = 3",
                "keys: env.robot: invalid type: integer `3`, expected a robot's name in quotes, or a file",
            ),
            ("env.robot = 'none.urdf'", "keys: env.robot: none.urdf: "),
            ("env.robot.home = [0.0]", "keys: env.robot.home: invalid length 1"),
            (
                "env.space.stiffness.adaptive.delta_sign = 3",
                "env.space.stiffness.adaptive.delta_sign: a name in quotes is wanted",
            ),
            ("env.disturbance = [0.5, 2.0]", "keys: env.disturbance is a list; a table is wanted"),
            ("env.controller.force = [10.0]", "env.controller.force is a list; a table is wanted"),
            ("env.horizon = 0", "env.horizon = 0 is not allowed; allowed: 1 to 1000000"),
            ("env.space = 'aforze'", "did you mean `aforce`"),
            ("setup = 'tiny'", "known are paper-steps, small-steps, solve"),
        ] {
            let error = format!("{:#}", keys(text).unwrap_err());
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
