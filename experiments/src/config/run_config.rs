//! The complete configuration of a run, and how it comes together: the preset, then a
//! TOML file, then `--robot`, `--space` and `--setup`, then `--set key=value`, then the other flags; the last wins.

use std::collections::BTreeSet;
use std::path::Path;

use aforce::{name, within};
use anyhow::{Context, Result, ensure};
use output::program::bad;
use serde::{Deserialize, Serialize};
use settings::{Source, lay_over, layered, nested, spaces};
use tasks::{EnvConfig, TaskName};
use toml::{Table, Value};

/// Maximum length of a variant (characters): the folder's name is the action space's name with the variant.
const LONGEST_VARIANT: usize = 160;

/// Everything that decides the outcome of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunConfig {
    /// Where the learner's defaults come from: `desktop`, `swift`, `swift-prior`, `plain` or `paper`.
    pub preset: sac::Preset,
    /// What tells the run from others of its sweep with the same task, space and seed; mostly empty.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub variant: String,
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
    /// Longest time between checkpoints (min), 5 unless set. At the end of an episode a checkpoint is saved if the next
    /// episode, as long as this one, would exceed it.
    #[serde(default = "five_minutes")]
    pub checkpoint_minutes: f64,
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
            variant: String::new(),
            seed: 1,
            steps: 300_000,
            evaluate_every: 10_000,
            evaluation_episodes: 10,
            checkpoint_every: 50_000,
            checkpoint_minutes: five_minutes(),
            env: EnvConfig::default(),
            learner: preset.settings(),
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
            layers.push(layer(path, settings::text(path).context(settings::WANTED)?)?);
        }
        let mut flags = Table::new();
        let wrong = |problem: String| bad(format!("command line: {problem}"));
        for (key, value) in overrides {
            if let Some(whole) = in_its_section(key) {
                return Err(wrong(format!("unknown key \"{key}\"; did you mean \"{whole}\"?")));
            }
            let mut flag = nested(key, value.clone());
            // Resolved at once, because a later key may change the space that is named here.
            spaces::work_out(&mut flag, Path::new("")).map_err(|problem| wrong(format!("{problem:#}")))?;
            lay_over(&mut flags, flag).map_err(|problem| wrong(problem.to_string()))?;
        }
        layers.push((Source::named("command line"), flags));
        Self::from_layers(layers)
    }

    /// The configuration in `text`, the content of the file `path`.
    ///
    /// # Errors
    /// As [`RunConfig::resolve`].
    pub fn of_text(text: &str, path: &Path) -> Result<Self> {
        Self::from_layers(vec![layer(path, text.into())?])
    }

    /// Resolves named tables, of which the last wins, and checks the result.
    ///
    /// # Errors
    /// As [`RunConfig::resolve`].
    pub fn from_layers(layers: Vec<(Source, Table)>) -> Result<Self> {
        let mut named: Option<(&str, sac::Preset)> = None;
        for (source, table) in &layers {
            let Some(value) = table.get("preset") else { continue };
            let preset = value.clone().try_into();
            let preset =
                preset.map_err(|error| bad(format!("{}: preset: {}", source.at("preset"), error.message())))?;
            match named {
                // Otherwise the run would have the name of one preset and the settings of the other.
                Some((earlier, other)) if other != preset => {
                    let here = source.name();
                    let twice = if here == earlier { ", where another stands above the groups" } else { "" };
                    return Err(bad(format!(
                        "preset = {value} ({here}) contradicts {earlier}{twice}: take it out of one"
                    )));
                }
                _ => named = Some((source.name(), preset)),
            }
        }
        let preset = named.map_or(sac::Preset::DESKTOP, |(_, preset)| preset);
        // An unknown task is skipped here. It becomes an error, with its place in the file, when the layers are merged below.
        let named = |table: &Table| table.get("env")?.get("task")?.as_str()?.parse().ok();
        let task: TaskName = layers.iter().rev().find_map(|(_, table)| named(table)).unwrap_or_default();
        let defaults = RunConfig { env: EnvConfig::of(task), ..Self::preset(preset) };
        let base = Table::try_from(defaults).expect("a configuration is a table");
        let config: Self = layered(base, layers).map_err(|error| bad(error.to_string()))?;
        config.validate().map_err(|e| bad(e.to_string()))?;
        Ok(config)
    }

    fn validate(&self) -> Result<()> {
        for (key, value, range) in [
            ("seed", self.seed as f64, 0.0..=f64::from(u32::MAX)),
            ("steps", self.steps as f64, 1.0..=f64::INFINITY),
            ("evaluate_every", self.evaluate_every as f64, 1.0..=f64::INFINITY),
            ("evaluation_episodes", f64::from(self.evaluation_episodes), 1.0..=1e4),
            ("checkpoint_every", self.checkpoint_every as f64, 1.0..=f64::INFINITY),
            ("checkpoint_minutes", self.checkpoint_minutes, f64::MIN_POSITIVE..=f64::INFINITY),
        ] {
            within(key, value, range)?;
        }
        for part in self.variant.split(',').filter(|_| !self.variant.is_empty()) {
            name::check_part(part).map_err(|reason| bad(format!("variant: {reason}, commas between names")))?;
        }
        let is_number = self.variant.parse::<f64>().is_ok();
        ensure!(!is_number, "variant = {:?}: reads as a number, which tables would round", self.variant);
        let long = self.variant.len();
        ensure!(
            long <= LONGEST_VARIANT,
            "variant: {long} characters: at most {LONGEST_VARIANT} fit into a folder's name"
        );
        self.env.validate()?;
        let camera = self.env.observation.camera.is_none();
        ensure!(
            camera,
            "env.observation.camera: the learner has no network for pixels; they are for learners in Python"
        );
        self.learner.validate().map_err(|error| bad(format!("learner.{error}")))?;
        Ok(())
    }

    /// The configuration as a TOML document that `--config` reads back.
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).expect("a configuration is a table")
    }

    /// The settings that decide the bytes of a run's tables: all but its length, which may be extended, and the intervals
    /// between checkpoints.
    fn decisive(&self) -> RunConfig {
        RunConfig { steps: 0, checkpoint_every: 0, checkpoint_minutes: 0.0, ..self.clone() }
    }

    /// First 16 hex digits of the hash of all settings but the run's length and the intervals between checkpoints.
    pub fn hash(&self) -> String {
        blake3::hash(self.decisive().to_toml().as_bytes()).to_hex()[..16].to_string()
    }

    /// The first setting, of those in the hash, in which another run differs from this one, in words.
    pub fn difference(&self, other: &RunConfig) -> Option<String> {
        let (key, there, here) = self.differences(other).into_iter().next()?;
        Some(format!("{key}: there {}, here {}", word(there), word(here)))
    }

    /// Every setting, of those in the hash, in which another run differs from this one: its dotted key, the value here
    /// and the other's; in alphabetical order.
    pub fn differences(&self, other: &RunConfig) -> Vec<Difference> {
        let table = |config: &RunConfig| Table::try_from(config.decisive()).expect("a configuration is a table");
        differences(&table(self), &table(other))
    }
}

/// The full key where its section was left out: `learner.gamma` for `gamma`. `None` unless exactly one section has such
/// a key.
fn in_its_section(key: &str) -> Option<String> {
    let table = Table::try_from(RunConfig::preset(sac::Preset::DESKTOP)).expect("a configuration is a table");
    if key.contains('.') || table.contains_key(key) {
        return None;
    }
    let below = |(section, value): (&String, &Value)| value.get(key).map(|_| format!("{section}.{key}"));
    let mut sections = table.iter().filter_map(below);
    sections.next().filter(|_| sections.next().is_none())
}

/// Dotted key of a setting, and its values in two configurations; `None` where one has no such setting.
pub type Difference = (String, Option<Value>, Option<Value>);

/// A value in words; of a table with a name, such as a robot with all its numbers, the name alone.
fn word(value: Option<Value>) -> String {
    let Some(value) = value else { return "absent".into() };
    value.get("name").map_or_else(|| value.to_string(), |name| format!("{{ name = {name}, .. }}"))
}

fn five_minutes() -> f64 {
    5.0
}

fn differences(a: &Table, b: &Table) -> Vec<Difference> {
    let keys: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
    let of_key = |key: &String| match (a.get(key), b.get(key)) {
        (Some(Value::Table(a)), Some(Value::Table(b))) => {
            let inner = differences(a, b).into_iter();
            inner.map(|(inner, a, b)| (format!("{key}.{inner}"), a, b)).collect()
        }
        (a, b) if a == b => vec![],
        (a, b) => vec![(key.clone(), a.cloned(), b.cloned())],
    };
    keys.into_iter().flat_map(of_key).collect()
}

/// Parses `key=value` as given to `--set`; a value that is not TOML is a string.
///
/// # Errors
/// If there is no `=`, or more than one line.
pub fn parse_override(text: &str) -> Result<(String, Value), String> {
    let (key, value) = text.split_once('=').ok_or("expected KEY=VALUE, for example learner.gamma=0.99")?;
    if text.contains(['\n', '\r']) {
        return Err("one line, please: give --set once for each key".into());
    }
    let table: Result<Table, _> = format!("value = {value}").parse();
    let value = table.ok().and_then(|mut t| t.remove("value")).unwrap_or_else(|| Value::String(value.into()));
    Ok((key.trim().into(), value))
}

/// The settings in `text`, with the name of their file for messages.
fn layer(path: &Path, text: String) -> Result<(Source, Table)> {
    settings::of_file(path, text).map_err(|problem| bad(problem.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use aforce::{Gains, Stiffness};

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

    /// The Python environments ignore these keys of a run's configuration, and refuse all other unknown keys.
    #[test]
    fn a_run_has_the_keys_that_environments_pass_over() {
        let table: Table = RunConfig::preset(sac::Preset::DESKTOP).to_toml().parse().unwrap();
        let keys: BTreeSet<_> =
            table.keys().map(String::as_str).chain(["variant"]).filter(|key| *key != "env").collect();
        assert_eq!(keys, settings::RUN_KEYS.into());
    }

    #[test]
    fn a_preset_sets_the_learner_and_nothing_else() {
        let paper = RunConfig::resolve(None, &[set("preset=paper")]).unwrap();
        assert_eq!(paper.learner, sac::Preset::PAPER.settings());
        assert_eq!(paper.env, RunConfig::preset(sac::Preset::DESKTOP).env);
    }

    #[test]
    fn a_preset_does_not_change_under_another_name() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("run.toml");
        fs_err::write(&file, RunConfig::preset(sac::Preset::DESKTOP).to_toml()).unwrap();
        assert!(RunConfig::resolve(Some(&file), &[set("preset=desktop")]).is_ok());
        let error = RunConfig::resolve(Some(&file), &[set("preset=paper")]).unwrap_err().to_string();
        assert!(error.contains("paper") && error.contains("run.toml"), "{error}");
    }

    #[test]
    fn the_resolved_file_reads_back() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("config.toml");
        // Observations that a task has by default, and that a run switches off, stay off when its config.toml is read.
        let off = [
            "env.task=insert",
            "env.observation.force=false",
            "env.observation.action=false",
            "env.observation.critic=[]",
        ];
        for settings in [&["seed=3", "env.space=aforce-force"][..], &off] {
            let settings: Vec<_> = settings.iter().map(|text| set(text)).collect();
            let config = RunConfig::resolve(None, &settings).unwrap();
            fs_err::write(&file, config.to_toml()).unwrap();
            assert_eq!(RunConfig::resolve(Some(&file), &[]).unwrap(), config);
        }
    }

    #[test]
    fn an_unknown_key_is_answered_with_the_nearest() {
        let error = RunConfig::resolve(None, &[set("learner.gama=0.9")]).unwrap_err().to_string();
        assert_eq!(error, "command line: unknown key \"learner.gama\"; did you mean \"learner.gamma\"?");
        let error = RunConfig::resolve(None, &[set("stps=7")]).unwrap_err().to_string();
        assert_eq!(error, "command line: unknown key \"stps\"; did you mean \"steps\"?");
        for (key, whole) in [("gamma", "learner.gamma"), ("horizon", "env.horizon")] {
            let error = RunConfig::resolve(None, &[set(&format!("{key}=1"))]).unwrap_err().to_string();
            assert_eq!(error, format!("command line: unknown key \"{key}\"; did you mean \"{whole}\"?"));
        }
    }

    #[test]
    fn a_value_of_the_wrong_type_is_answered_with_its_key() {
        let error = |text: &str| RunConfig::resolve(None, &[set(text)]).unwrap_err().to_string();
        let gamma = error("learner.gamma=abc");
        assert!(gamma.starts_with("command line: learner.gamma: ") && gamma.contains("abc"), "{gamma}");
        let kind = error("env.controller.interpolation.jerk-limited={}");
        assert!(kind.contains("env.controller.interpolation") && kind.contains("dynamics"), "{kind}");
    }

    #[test]
    fn a_space_is_a_name_a_file_or_changes() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| fs_err::write(folder.path().join(name), text).unwrap();
        write("soft.toml", "extends = 'low'\nstiffness.fixed = [90, 9]");
        write("run.toml", "[env]\nspace = 'soft.toml'");
        let resolve = |sets: &[&str]| {
            let sets: Vec<_> = sets.iter().map(|s| set(s)).collect();
            RunConfig::resolve(Some(&folder.path().join("run.toml")), &sets).map(|config| config.env.space)
        };
        assert_eq!(resolve(&[]).unwrap().name, "soft");
        let forced = resolve(&["env.space.force=true"]).unwrap();
        assert_eq!((forced.name.as_str(), forced.force), ("soft", true));
        // Naming a space replaces the whole record, here with the psi that the file's space lets the policy command.
        write("run.toml", "[env]\nspace = 'aforce-psi'");
        assert!(resolve(&[]).unwrap().commanded_psi.is_some());
        assert_eq!(resolve(&["env.space=osc"]).unwrap(), "osc".parse().unwrap());
        let changed = resolve(&["env.space=osc", "env.space.force=true"]).unwrap();
        assert_eq!((changed.name.as_str(), changed.force), ("osc", true));
        // Another kind of stiffness replaces the first as a whole. Keys of the same kind change single values.
        write("run.toml", "[env]\nspace = { name = 'mine', extends = 'aforce' }");
        assert_eq!(resolve(&["env.space.stiffness.fixed=4"]).unwrap().stiffness, Stiffness::Fixed(Gains::all(4.0)));
        let psi = *resolve(&["env.space.stiffness.adaptive.alpha=0"]).unwrap().psi().unwrap();
        assert_eq!((psi.alpha, psi.mu), (Gains::all(0.0), Gains::all(1.0)));
    }

    #[test]
    fn what_is_wrong_with_a_space_is_told_with_its_key() {
        let error = |text: &str| RunConfig::resolve(None, &[set(text)]).unwrap_err().to_string();
        let leash = error("env.space.goal={rebased={leash_position=0.02}}");
        assert!(leash.contains("env.space.goal"), "{leash}");
        let typo = error("env.space.stiffness.adaptive.k_mn=3");
        assert!(
            typo.contains("\"env.space.stiffness.adaptive.k_mn\"; did you mean") && typo.contains("k_min"),
            "{typo}"
        );
        let six = error("env.space.stiffness.adaptive.alpha=[1.0, nan, 1.0, 1.0, 1.0, 1.0]");
        assert!(six.contains("env.space.stiffness.adaptive.alpha (axis y) = NaN"), "{six}");
        let unstable = error("env.space.stiffness.adaptive.alpha=1e5");
        assert!(unstable.contains("unstable") && unstable.contains("the limit is"), "{unstable}");
        assert!(error("env.space=aforze").contains("did you mean `aforce`"));
    }

    #[test]
    fn of_two_spaces_on_the_command_line_the_last_is_meant() {
        let space = |sets: &[&str]| {
            RunConfig::resolve(None, &sets.iter().map(|s| set(s)).collect::<Vec<_>>()).unwrap().env.space
        };
        let mine = "env.space={ name = 'mine', extends = 'aforce' }";
        assert_eq!(space(&["env.space=low", mine]), space(&[mine]));
        assert_eq!(space(&[mine, "env.space=low"]), space(&["env.space=low"]));
        assert_eq!(space(&["env.space=low", "env.space.name=soft"]).goal, space(&["env.space=low"]).goal);
    }

    #[test]
    fn a_key_changes_the_robot_that_is_named_before_it() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("run.toml");
        fs_err::write(&file, "env.robot = 'ur5e'").unwrap();
        let robot = |file: Option<&Path>, sets: &[&str]| {
            let sets: Vec<_> = sets.iter().map(|s| set(s)).collect();
            RunConfig::resolve(file, &sets).map(|config| config.env.robot.robot())
        };
        let (fr3, raise) = ("env.robot=fr3", "env.robot.mount.height=0.8");
        for (file, sets, name, height) in [
            (None, &[fr3, raise][..], "fr3", 0.8),
            (None, &[raise], "robosuite", 0.8),
            (Some(&*file), &[raise], "ur5e", 0.8),
            (Some(&*file), &[fr3, raise], "fr3", 0.8),
            (Some(&*file), &[raise, fr3], "fr3", 0.912),
        ] {
            let robot = robot(file, sets).unwrap();
            assert_eq!((robot.name.as_str(), robot.mount.height), (name, height), "{sets:?}");
        }
        let error = robot(None, &["env.robot=fr4", raise]).unwrap_err().to_string();
        assert!(error.starts_with("command line: env.robot: no robot is called \"fr4\"; did you mean"), "{error}");
    }

    /// What a flag says is not undone by an empty table in a later one, which would change nothing.
    #[test]
    fn an_empty_table_does_not_pass_for_neutral_values() {
        let sets = ["env.disturbance.friction=2.0", "env.disturbance={}"].map(set);
        let error = RunConfig::resolve(None, &sets).unwrap_err().to_string();
        assert!(error.starts_with("command line: env.disturbance = {} changes nothing: "), "{error}");
        assert!(RunConfig::resolve(None, &sets[1..]).is_ok());
    }

    #[test]
    fn a_setup_is_two_keys_under_those_of_its_layer() {
        let steps = |sets: &[&str]| {
            let config = RunConfig::resolve(None, &sets.iter().map(|s| set(s)).collect::<Vec<_>>()).unwrap();
            (config.env.controller.position_step, config.env.controller.rotation_step)
        };
        assert_eq!(steps(&[]), (0.05, 0.5));
        assert_eq!(steps(&["setup=small-steps"]), (0.02, 0.15));
        assert_eq!(steps(&["env.controller.rotation_step=0.03", "setup=small-steps"]), (0.02, 0.03));
        assert!(RunConfig::resolve(None, &[set("setup=tiny")]).unwrap_err().to_string().contains("small-steps"));
    }

    #[test]
    fn a_file_that_is_no_toml_is_answered_with_the_line() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.toml");
        fs_err::write(&file, "steps = 7\n[learner\ngamma = 0.5\n").unwrap();
        let error = RunConfig::resolve(Some(&file), &[]).unwrap_err().to_string();
        assert!(error.contains("a.toml: line 2, column "), "{error}");
    }

    #[test]
    fn the_difference_of_two_configurations_is_told_with_its_key() {
        let resolve =
            |sets: &[&str]| RunConfig::resolve(None, &sets.iter().map(|s| set(s)).collect::<Vec<_>>()).unwrap();
        let ours = resolve(&["steps=7"]);
        let difference = |sets: &[&str]| ours.difference(&resolve(sets));
        assert_eq!(difference(&["steps=9"]), None);
        let mu = "env.space.stiffness.adaptive.mu";
        assert_eq!(difference(&[&format!("{mu}=2.0")]).unwrap(), format!("{mu}: there 1.0, here 2.0"));
        let target = difference(&["learner.target_entropy=0.0"]).unwrap();
        assert!(target.starts_with("learner.target_entropy: there ") && target.ends_with("here 0.0"), "{target}");
        assert!(difference(&["learner.hidden=[8]"]).unwrap().starts_with("learner.hidden: "));
        let robot = difference(&["env.robot=fr3", "env.robot.mount.height=0.8"]).unwrap();
        assert_eq!(robot, "env.robot: there \"robosuite\", here { name = \"fr3\", .. }");
    }

    #[test]
    fn the_hash_sees_everything_but_the_length() {
        let hash =
            |sets: &[&str]| RunConfig::resolve(None, &sets.iter().map(|s| set(s)).collect::<Vec<_>>()).unwrap().hash();
        assert_eq!(hash(&[]), hash(&["steps=5"]));
        assert_eq!(hash(&[]), hash(&["checkpoint_every=5", "checkpoint_minutes=0.5"]));
        assert_ne!(hash(&[]), hash(&["seed=5"]));
        assert_ne!(hash(&[]), hash(&["env.controller.position_step=0.01"]));
        assert_ne!(hash(&["env.space=osc"]), hash(&["env.space=osc", "env.space.stiffness.fixed=160.0"]));
    }
}
