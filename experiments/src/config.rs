//! The complete configuration of a run, and how it comes together: the preset, then a
//! TOML file, then `--set key=value`, then named flags; the last wins.

use std::path::Path;

use anyhow::{Result, ensure};
use serde::{Deserialize, Serialize};
use tasks::EnvConfig;
use toml::{Table, Value};

/// A setting that cannot be: wrong usage, as opposed to a failure.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct BadSetting(String);

/// A [`BadSetting`] with this text.
pub fn bad(message: String) -> anyhow::Error {
    BadSetting(message).into()
}

/// Everything that decides the outcome of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunConfig {
    /// Where the learner's defaults come from.
    pub preset: sac::Preset,
    /// The seed of everything random in the run.
    pub seed: u64,
    /// Training actions.
    pub steps: u64,
    /// Actions between evaluations.
    pub evaluate_every: u64,
    /// Episodes per evaluation.
    pub evaluation_episodes: u32,
    /// Actions between checkpoints; they are taken at the next end of an episode.
    pub checkpoint_every: u64,
    /// Task, action space, controller, physics.
    pub env: EnvConfig,
    /// The learner.
    pub learner: sac::Config,
}

impl RunConfig {
    /// The defaults under a preset.
    pub fn preset(preset: sac::Preset) -> Self {
        RunConfig {
            preset,
            seed: 1,
            steps: 300_000,
            evaluate_every: 10_000,
            evaluation_episodes: 10,
            checkpoint_every: 50_000,
            env: EnvConfig::default(),
            learner: sac::Config::preset(preset),
        }
    }

    /// Resolves the layers, `overrides` being dotted keys with TOML values, and checks the
    /// result.
    ///
    /// # Errors
    /// Names the layer and the key, and the nearest known key if it is unknown.
    pub fn resolve(file: Option<&Path>, overrides: &[(String, Value)]) -> Result<Self> {
        let mut layers = vec![];
        if let Some(path) = file {
            let text = fs_err::read_to_string(path)?;
            let table: Table = text
                .parse()
                .map_err(|e: toml::de::Error| bad(format!("{}: not valid TOML: {}", path.display(), e.message())))?;
            layers.push((path.display().to_string(), table));
        }
        let mut flags = Table::new();
        for (key, value) in overrides {
            insert(&mut flags, key, value.clone()).map_err(|head| bad(format!("{key}: {head} is not a section")))?;
        }
        layers.push(("command line".into(), flags));
        Self::from_layers(layers)
    }

    /// Resolves named tables, of which the last wins, and checks the result.
    ///
    /// # Errors
    /// As [`RunConfig::resolve`].
    pub fn from_layers(layers: Vec<(String, Table)>) -> Result<Self> {
        let mut named: Option<(&str, sac::Preset)> = None;
        for (source, table) in &layers {
            let Some(value) = table.get("preset") else { continue };
            let preset =
                value.clone().try_into().map_err(|_| bad(format!("preset = {value}: known are paper, desktop")))?;
            match named {
                // One of them would give its name to the other's settings.
                Some((earlier, other)) if other != preset => {
                    return Err(bad(format!("preset = {value} ({source}) contradicts {earlier}: take it out of one")));
                }
                _ => named = Some((source, preset)),
            }
        }
        let preset = named.map_or(sac::Preset::Desktop, |(_, preset)| preset);
        let mut merged = Table::try_from(Self::preset(preset)).expect("a configuration is a table");
        for (source, table) in layers {
            merge(&mut merged, table);
            let check: Result<Self, _> = merged.clone().try_into();
            check.map_err(|e| bad(format!("{source}: {}", explain(&e))))?;
        }
        let config: Self = merged.try_into().expect("checked with the last layer");
        config.validate().map_err(|e| bad(e.to_string()))?;
        Ok(config)
    }

    fn validate(&self) -> Result<()> {
        let counts = [
            ("steps", self.steps),
            ("evaluate_every", self.evaluate_every),
            ("evaluation_episodes", self.evaluation_episodes.into()),
            ("checkpoint_every", self.checkpoint_every),
            ("env.horizon", self.env.horizon.into()),
        ];
        for (name, value) in counts {
            ensure!(value > 0, "{name} = 0: must be at least 1");
        }
        self.env.validate()?;
        self.learner.validate().map_err(|error| bad(format!("learner.{error}")))?;
        Ok(())
    }

    /// The configuration as a TOML document that `--config` reads back.
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).expect("a configuration is a table")
    }

    /// First 16 hex digits of the hash of everything but the length of the run, which may
    /// be extended.
    pub fn hash(&self) -> String {
        let endless = RunConfig { steps: 0, ..self.clone() };
        blake3::hash(endless.to_toml().as_bytes()).to_hex()[..16].to_string()
    }

    /// The first setting but the length in which another configuration differs from this one, in words.
    pub fn difference(&self, other: &RunConfig) -> Option<String> {
        let (there, here) = (self.to_toml(), RunConfig { steps: self.steps, ..other.clone() }.to_toml());
        let differs = there.lines().zip(here.lines()).find(|(a, b)| a != b);
        differs.map(|(a, b)| format!("there {a}, here {b}"))
    }
}

/// Parses `key=value` as given to `--set`; a value that is not TOML is a string.
///
/// # Errors
/// If there is no `=`.
pub fn parse_override(text: &str) -> Result<(String, Value), String> {
    let (key, value) = text.split_once('=').ok_or("expected KEY=VALUE, for example learner.gamma=0.99")?;
    let table: Result<Table, _> = format!("value = {value}").parse();
    let value = table.ok().and_then(|mut t| t.remove("value")).unwrap_or_else(|| Value::String(value.into()));
    Ok((key.trim().into(), value))
}

/// Puts a value under a dotted key; the error is the part of the key that is no section.
fn insert(table: &mut Table, key: &str, value: Value) -> Result<(), String> {
    match key.split_once('.') {
        None => {
            table.insert(key.into(), value);
        }
        Some((head, rest)) => {
            let inner = table.entry(head).or_insert_with(|| Value::Table(Table::new()));
            insert(inner.as_table_mut().ok_or(head)?, rest, value)?;
        }
    }
    Ok(())
}

fn merge(base: &mut Table, over: Table) {
    for (key, value) in over {
        match (base.get_mut(&key), value) {
            // A variant of another kind replaces the old one with all its fields.
            (Some(Value::Table(old)), Value::Table(new)) if same_kind(old, &new) => merge(old, new),
            (_, value) => {
                base.insert(key, value);
            }
        }
    }
}

fn same_kind(old: &Table, new: &Table) -> bool {
    new.get("kind").is_none_or(|kind| old.get("kind") == Some(kind))
}

/// The parser's message with the nearest known key added to an unknown one.
fn explain(error: &toml::de::Error) -> String {
    let message = error.message().to_string();
    let mut quoted = message.split('`').skip(1).step_by(2);
    let Some(unknown) = quoted.next().filter(|_| message.starts_with("unknown field")) else {
        return message;
    };
    match quoted.max_by(|a, b| strsim::jaro(a, unknown).total_cmp(&strsim::jaro(b, unknown))) {
        Some(nearest) => format!("unknown key {unknown:?}; did you mean {nearest:?}?"),
        None => message,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(text: &str) -> (String, Value) {
        parse_override(text).unwrap()
    }

    #[test]
    fn the_last_layer_wins() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.toml");
        fs_err::write(&file, "steps = 7\n[learner]\ngamma = 0.5\nbatch_size = 8\n").unwrap();
        let config = RunConfig::resolve(Some(&file), &[set("learner.gamma=0.6"), set("env.space=osc")]).unwrap();
        assert_eq!((config.steps, config.learner.gamma, config.learner.batch_size), (7, 0.6, 8));
        assert_eq!(config.env.space.to_string(), "osc");
    }

    #[test]
    fn a_preset_sets_the_learner_and_nothing_else() {
        let paper = RunConfig::resolve(None, &[set("preset=paper")]).unwrap();
        assert_eq!(paper.learner, sac::Config::preset(sac::Preset::Paper));
        assert_eq!(paper.env, RunConfig::preset(sac::Preset::Desktop).env);
    }

    #[test]
    fn a_preset_does_not_change_under_another_name() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("run.toml");
        fs_err::write(&file, RunConfig::preset(sac::Preset::Desktop).to_toml()).unwrap();
        assert!(RunConfig::resolve(Some(&file), &[set("preset=desktop")]).is_ok());
        let error = RunConfig::resolve(Some(&file), &[set("preset=paper")]).unwrap_err().to_string();
        assert!(error.contains("paper") && error.contains("run.toml"), "{error}");
    }

    #[test]
    fn the_resolved_file_reads_back() {
        let config = RunConfig::resolve(None, &[set("seed=3"), set("env.space=aforce-force")]).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("config.toml");
        fs_err::write(&file, config.to_toml()).unwrap();
        assert_eq!(RunConfig::resolve(Some(&file), &[]).unwrap(), config);
    }

    #[test]
    fn an_unknown_key_is_answered_with_the_nearest() {
        let error = RunConfig::resolve(None, &[set("learner.gama=0.9")]).unwrap_err().to_string();
        assert!(error.contains("gama") && error.contains("did you mean \"gamma\"?"), "{error}");
    }

    #[test]
    fn the_hash_sees_everything_but_the_length() {
        let hash =
            |sets: &[&str]| RunConfig::resolve(None, &sets.iter().map(|s| set(s)).collect::<Vec<_>>()).unwrap().hash();
        assert_eq!(hash(&[]), hash(&["steps=5"]));
        assert_ne!(hash(&[]), hash(&["seed=5"]));
        assert_ne!(hash(&[]), hash(&["env.controller.position_step=0.01"]));
    }
}
