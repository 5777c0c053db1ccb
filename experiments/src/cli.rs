//! Flags and exit codes that all programs share.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use aforce::ActionSpace;
use anyhow::Result;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use signal_hook::consts::SIGPIPE;
use signal_hook::flag;
use tasks::TaskName;
use toml::Value;

use crate::config::{BadSetting, RunConfig, bad, parse_override};
use crate::folder::RunFolder;

/// Exit code of a run that a signal stopped after it saved itself: try again.
pub const STOPPED: u8 = 75;

/// Exit code of a sweep of which some runs failed.
pub const SOME_FAILED: u8 = 3;

/// Exit code of wrong usage, the same that clap uses.
const USAGE: u8 = 2;

/// Where a configuration comes from; later sources win.
#[derive(Debug, Clone, Default, Args)]
pub struct ConfigArgs {
    /// TOML file with any part of the configuration (a run's config.toml is a complete one)
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Any key of the configuration, for example learner.gamma=0.99 (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = parse_override)]
    pub overrides: Vec<(String, Value)>,
    /// Task
    #[arg(long, value_parser = task_parser())]
    pub task: Option<TaskName>,
    /// Action space: aforce, variable, low, mid, high, osc, or one of them with -force
    #[arg(long)]
    pub space: Option<ActionSpace>,
    /// Seed of the run
    #[arg(long)]
    pub seed: Option<u32>,
    /// Learner's defaults
    #[arg(long)]
    pub preset: Option<PresetArg>,
    /// Training actions, for example 300000 or 3e5
    #[arg(long, value_parser = parse_steps)]
    pub steps: Option<u64>,
}

/// The presets by name.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum PresetArg {
    /// The paper's learner: 2 x 1024, batch 1024; days on a CPU
    Paper,
    /// A learner for one CPU core: 2 x 256, batch 128; minutes
    Desktop,
}

impl ConfigArgs {
    /// The complete configuration.
    ///
    /// # Errors
    /// Names the source and the key of what is wrong.
    pub fn resolve(&self) -> Result<RunConfig> {
        RunConfig::resolve(self.config.as_deref(), &self.overrides())
    }

    /// The configuration of an existing run with these flags on top.
    ///
    /// # Errors
    /// As [`ConfigArgs::resolve`]; also if a flag says what the run has decided.
    pub fn on_top_of(&self, folder: &RunFolder) -> Result<RunConfig> {
        let decided = [
            ("--config", self.config.is_some()),
            ("--seed", self.seed.is_some()),
            ("--preset", self.preset.is_some()),
            ("--steps", self.steps.is_some()),
        ];
        if let Some((flag, _)) = decided.into_iter().find(|&(_, given)| given) {
            return Err(bad(format!("{flag} cannot be combined with --run: the run has its own configuration")));
        }
        RunConfig::resolve(Some(&folder.config()), &self.overrides())
    }

    fn overrides(&self) -> Vec<(String, Value)> {
        let mut overrides = self.overrides.clone();
        let mut flag = |key: &str, value: Option<Value>| overrides.extend(value.map(|v| (key.to_string(), v)));
        flag("env.task", self.task.map(|task| Value::String(task.as_str().into())));
        flag("env.space", self.space.map(|space| Value::String(space.to_string())));
        flag("seed", self.seed.map(|seed| Value::Integer(seed.into())));
        let preset = self.preset.map(|preset| match preset {
            PresetArg::Paper => "paper",
            PresetArg::Desktop => "desktop",
        });
        flag("preset", preset.map(|name| Value::String(name.into())));
        flag("steps", self.steps.map(|steps| Value::Integer(steps as i64)));
        overrides
    }
}

/// Reads a task's name for clap, which lists the known ones.
pub fn task_parser() -> impl TypedValueParser<Value = TaskName> {
    PossibleValuesParser::new(TaskName::ALL.map(TaskName::as_str))
        .map(|name| TaskName::ALL.into_iter().find(|task| task.as_str() == name).expect("one of the possible values"))
}

fn parse_steps(text: &str) -> Result<u64, String> {
    let value: f64 = text.replace('_', "").parse().map_err(|_| format!("{text:?} is not a number"))?;
    if value >= 1.0 && value.fract() == 0.0 && value < 1e12 {
        Ok(value as u64)
    } else {
        Err(format!("{text}: must be a whole number, at least 1"))
    }
}

/// Runs a program and turns its result into the exit code: an error is printed on one line, its
/// causes after colons. A reader of the output that goes away, as `| head` does, ends the program
/// without a word.
pub fn run(program: impl FnOnce() -> Result<ExitCode>) -> ExitCode {
    let gone = flag::register_conditional_default(SIGPIPE, Arc::new(AtomicBool::new(true)));
    gone.map_err(Into::into).and_then(|_| program()).unwrap_or_else(|error| {
        eprintln!("error: {}", format!("{error:#}").replace('\n', " "));
        if error.is::<BadSetting>() { ExitCode::from(USAGE) } else { ExitCode::FAILURE }
    })
}
