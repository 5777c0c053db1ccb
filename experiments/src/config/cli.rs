//! Flags and exit codes that programs share.

use std::path::{Path, PathBuf};
use std::time::Duration;

use aforce::ActionSpace;
use anyhow::Result;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use physics::robots::RobotChoice;
use serde::Serialize;
use settings::setup::SETUPS;
use settings::{robots, spaces};
use tasks::TaskName;
use toml::Value;

use crate::config::{RunConfig, parse_override};

/// Exit code of a program that left a run unfinished without an error, mostly because a signal stopped it. The run can be continued.
pub const STOPPED: u8 = 75;

/// Exit code of a program for many runs if some of them failed or could not be read.
pub const SOME_FAILED: u8 = 3;

/// Where a configuration comes from, for every program; the command line wins over the file.
#[derive(Debug, Clone, Default, Args)]
pub struct SettingArgs {
    /// TOML file with any part of the configuration (a run's config.toml is a complete one)
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Any key of the configuration, for example env.horizon=200 (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = parse_override)]
    pub overrides: Vec<(String, Value)>,
    /// How far an action may go, and whether the arm stops itself
    #[arg(long, value_parser = setup_parser())]
    pub setup: Option<String>,
}

/// The configuration of an environment.
#[derive(Debug, Clone, Default, Args)]
pub struct EnvArgs {
    /// File and single keys.
    #[command(flatten)]
    pub settings: SettingArgs,
    /// Task (default: lift)
    #[arg(long, value_parser = task_parser())]
    pub task: Option<TaskName>,
    /// Action space (default: aforce): aforce, variable, low, mid, high, osc and others, each also with -force; or a file with a
    /// record of one's own, which ends with .toml
    #[arg(long, value_name = "NAME|FILE", value_parser = parse_space)]
    pub space: Option<ActionSpace>,
    /// Robot (default: robosuite): robosuite (a Panda), identified, fr3, iiwa14, ur5e; or one of one's own, a file that ends with .toml or .urdf
    #[arg(long, value_name = "NAME|FILE", value_parser = parse_robot)]
    pub robot: Option<RobotChoice>,
}

/// The configuration of a run.
#[derive(Debug, Clone, Args)]
pub struct RunArgs {
    #[command(flatten)]
    env: EnvArgs,
    /// Seed of the run, 0 to 4294967295 (default: 1)
    #[arg(long, value_parser = parse_seed, allow_negative_numbers = true)]
    seed: Option<u32>,
    /// Learner's defaults (default: desktop)
    #[arg(long, value_parser = preset_parser())]
    preset: Option<String>,
    /// Training actions, for example 60000 or 6e4 (default: 300000)
    #[arg(long, value_parser = parse_steps, allow_negative_numbers = true)]
    steps: Option<u64>,
}

impl SettingArgs {
    /// The complete configuration.
    ///
    /// # Errors
    /// Names the source and the key of what is wrong.
    pub fn resolve(&self) -> Result<RunConfig> {
        RunConfig::resolve(self.config.as_deref(), &self.overrides(None))
    }

    fn overrides(&self, space: Option<&ActionSpace>) -> Vec<(String, Value)> {
        // The named space comes first, so that a later key, such as `env.space.force`, changes it.
        let space = space.map(|space| ("env.space".into(), record(space)));
        let setup = self.setup.clone().map(|setup| ("setup".into(), Value::String(setup)));
        space.into_iter().chain(self.overrides.iter().cloned()).chain(setup).collect()
    }
}

impl EnvArgs {
    /// The complete configuration.
    ///
    /// # Errors
    /// As [`SettingArgs::resolve`].
    pub fn resolve(&self) -> Result<RunConfig> {
        RunConfig::resolve(self.settings.config.as_deref(), &self.overrides())
    }

    /// The flags as keys of the configuration.
    pub fn overrides(&self) -> Vec<(String, Value)> {
        let task = self.task.map(|task| ("env.task".into(), Value::String(task.as_str().into())));
        let robot = self.robot.as_ref().map(|robot| ("env.robot".into(), value(robot)));
        // The named robot comes first for the same reason: a later key of the robot changes it.
        robot.into_iter().chain(self.settings.overrides(self.space.as_ref())).chain(task).collect()
    }
}

impl RunArgs {
    /// The complete configuration.
    ///
    /// # Errors
    /// As [`SettingArgs::resolve`].
    pub fn resolve(&self) -> Result<RunConfig> {
        let seed = self.seed.map(|seed| ("seed".into(), Value::Integer(seed.into())));
        let preset = self.preset.clone().map(|preset| ("preset".into(), Value::String(preset)));
        let steps = self.steps.map(|steps| ("steps".into(), Value::Integer(steps as i64)));
        let mut overrides = self.env.overrides();
        overrides.extend([seed, preset, steps].into_iter().flatten());
        RunConfig::resolve(self.env.settings.config.as_deref(), &overrides)
    }
}

/// An action space as a value of a configuration.
pub fn record(space: &ActionSpace) -> Value {
    value(space)
}

fn value(setting: &impl Serialize) -> Value {
    Value::try_from(setting).expect("a setting is a value")
}

/// Reads a robot for clap: its name, or a file.
fn parse_robot(text: &str) -> Result<RobotChoice, String> {
    robots::named(text, Path::new(""))
}

/// Reads an action space for clap: its name, or a file.
///
/// # Errors
/// As [`spaces::named`].
pub fn parse_space(text: &str) -> Result<ActionSpace, String> {
    spaces::named(text, Path::new("")).map_err(|error| format!("{error:#}"))
}

fn setup_parser() -> impl TypedValueParser<Value = String> {
    PossibleValuesParser::new(SETUPS.map(|setup| PossibleValue::new(setup.name).help(setup.purpose)))
}

/// Reads a task's name for clap, which lists the known ones.
pub fn task_parser() -> impl TypedValueParser<Value = TaskName> {
    PossibleValuesParser::new(TaskName::all().into_iter().map(TaskName::as_str))
        .map(|name| name.parse().expect("one of the possible values"))
}

fn preset_parser() -> impl TypedValueParser<Value = String> {
    PossibleValuesParser::new(
        sac::Preset::ALL.iter().map(|preset| PossibleValue::new(preset.name).help(preset.summary)),
    )
}

fn parse_seed(text: &str) -> Result<u32, String> {
    text.parse().map_err(|_| format!("{text}: must be a whole number, 0 to {}", u32::MAX))
}

/// A length of time, in minutes.
///
/// # Errors
/// If `text` is not a number above 0 and up to 1e6.
pub fn parse_minutes(text: &str) -> Result<Duration, String> {
    let minutes: f64 = text.parse().map_err(|_| format!("{text:?} is not a number"))?;
    if minutes > 0.0 && minutes <= 1e6 {
        Ok(Duration::from_secs_f64(60.0 * minutes))
    } else {
        Err(format!("{text}: must be above 0 and at most 1e6 minutes"))
    }
}

/// A number of actions: 20000, 20_000 or 2e4.
///
/// # Errors
/// If `text` is not a whole number, at least 1 and below 1e12.
pub fn parse_steps(text: &str) -> Result<u64, String> {
    let value: f64 = text.replace('_', "").parse().map_err(|_| format!("{text:?} is not a number"))?;
    if value >= 1.0 && value.fract() == 0.0 && value < 1e12 {
        Ok(value as u64)
    } else {
        Err(format!("{text}: must be a whole number, at least 1 and below 1e12"))
    }
}
