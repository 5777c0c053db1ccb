//! Plays the fixed evaluation episodes and prints what they cost and earned.

use std::path::PathBuf;
use std::process::ExitCode;

use crate::config::RunId;
use crate::run::csv_writer::CsvWriter;
use crate::run::disturbances::{self, Case};
use crate::run::rollout::{evaluate, mean_of_column};
use crate::run::rows::{CaseKey, EvaluationKey};
use crate::run::seeds::{episode_seed, evaluation_seed};
use crate::run::source::{Player, SourceArgs};
use anyhow::{Context, Result, ensure};
use clap::Parser;
use output::statistics::{deviation, mean, quantile, range};
use output::{file, program};
use settings::setup;
use tasks::columns::COLUMNS;
use tasks::{Env, EnvConfig, Outcome};

/// Evaluate a trained policy, a scripted expert or random actions.
///
/// The episodes are the same for every policy and action space; none of them chose a run's best checkpoint.
#[derive(Parser)]
#[command(name = "evaluate", version = output::VERSION, after_help = "Example: evaluate --run runs/train/lift/aforce/seed_1 --episodes 100")]
pub struct Arguments {
    #[command(flatten)]
    source: SourceArgs,
    /// Episodes to play
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    episodes: u32,
    /// The start with this number in the column episode_seed of a table, in place of the evaluation's (repeatable)
    #[arg(long, value_name = "SEED", value_parser = episode_seed, conflicts_with = "episodes")]
    episode_seed: Vec<u64>,
    /// Play the episodes undisturbed and under every disturbance that this TOML file lists, each in place of env.disturbance
    #[arg(long, value_name = "FILE")]
    disturb: Option<PathBuf>,
    /// Also write a row per episode to this CSV file, which must not exist
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
}

/// Runs the program and returns its exit code.
///
/// # Errors
/// If a setting is wrong, a run cannot be read, or the table exists or cannot be written.
pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let mut player = arguments.source.open()?;
    // Every environment is made before the first episode is played, so that a wrong case is an error at once.
    let cases = match &arguments.disturb {
        Some(path) => disturbances::read(path, player.config.env.task)?
            .into_iter()
            .map(|case| {
                let mut env = EnvConfig { disturbance: case.disturbance.clone(), ..player.config.env.clone() };
                // A policy that only plays needs no critic, which may see a disturbance that a case does not have.
                env.observation.critic.clear();
                let env = Env::new(env, 0).with_context(|| format!("{}: case {:?}", path.display(), case.name))?;
                Ok((case, env))
            })
            .collect::<Result<_>>()?,
        None => vec![],
    };
    if let Some(path) = &arguments.csv {
        ensure!(!path.exists(), "{}: exists; nothing was overwritten", path.display());
        file::prepare(path)?;
    }
    // The file gets its name when it is complete.
    let file = arguments.csv.as_deref().map(file::unfinished).transpose()?;
    let mut table = file.as_ref().map_or_else(|| Ok(CsvWriter::discard()), |file| CsvWriter::append(file.path()))?;
    let starts = match &arguments.episode_seed[..] {
        [] => (0..arguments.episodes).map(evaluation_seed).collect(),
        named => named.to_vec(),
    };
    introduce(arguments, &player, starts.len());
    let outcomes = if arguments.disturb.is_some() {
        compare(&mut player, cases, &starts, &mut table)?
    } else {
        let outcomes = play(&mut player, &starts, |key, outcome| table.write((key, outcome)))?;
        print(&outcomes);
        outcomes
    };
    if let Some((file, path)) = file.zip(arguments.csv.as_ref()) {
        file::finish_new(file, path)?;
        program::written(&[path]);
    }
    if let Some(run) = arguments.run_to_replay() {
        let run = run.to_string_lossy();
        let which = arguments.source.checkpoint.map(|which| ["--checkpoint", which.name()]);
        let words = [&["--run", &run][..], which.as_ref().map_or(&[], |words| words), &["--html", "replay.html"]];
        program::next("replay", &words.concat());
    }
    let undisturbed = if arguments.disturb.is_some() { "undisturbed episodes" } else { "episodes" };
    program::result(format_args!("{} {undisturbed}", in_words(&outcomes)));
    Ok(ExitCode::SUCCESS)
}

impl Arguments {
    /// The run of which `replay` plays one of these episodes. `None` if flags change the run's settings, or choose other
    /// starts or sampled actions: the suggested command lacks these flags, and would play another episode.
    fn run_to_replay(&self) -> Option<&PathBuf> {
        let changed = !self.source.env.overrides().is_empty();
        let others = self.source.sample || !self.episode_seed.is_empty();
        self.source.run.as_ref().filter(|_| !changed && !others)
    }
}

/// Prints the policy, the environment and the number of episodes.
fn introduce(arguments: &Arguments, player: &Player, episodes: usize) {
    let (source, config) = (&arguments.source, &player.config);
    let env = &config.env;
    program::say(format_args!("{:<12}{}", "policy", source.describe()));
    if let Some(checkpoint) = player.checkpoint {
        let (name, step) = (checkpoint.name(), player.step);
        program::say(format_args!("{:<12}{name}, after {step} of {} actions", "checkpoint", config.steps));
    }
    program::say(format_args!("{:<12}{} with {}, {}", "set-up", env.task.as_str(), env.space, setup::in_words(env)));
    if let Some(changed) = &player.changed {
        program::say(format_args!("{:<12}since training: {changed}", "changed"));
    }
    let seconds = f64::from(env.horizon) / f64::from(env.controller.policy_hz);
    program::say(format_args!(
        "{:<12}{episodes} of {} actions ({seconds} s), the same starts for every policy",
        "episodes", env.horizon
    ));
}

/// Plays an episode from each of `starts`; `write` gets a row for each.
fn play(
    player: &mut Player,
    starts: &[u64],
    write: impl FnMut(EvaluationKey, &Outcome) -> Result<()>,
) -> Result<Vec<Outcome>> {
    let Player { config, env, policy, step, .. } = player;
    evaluate(env, policy, starts.iter().copied(), *step, &RunId::of(config), write)
}

/// Mean return and success, in words.
fn in_words(outcomes: &[Outcome]) -> String {
    let mean = |name: &str| mean_of_column(outcomes, name);
    let (total, success) = (mean("return"), 100.0 * mean("success"));
    format!("return {total:.1}, success {success:.0} %: means over {}", outcomes.len())
}

/// Plays the same episodes under every disturbance, and prints by how much each changes them. Returns the undisturbed episodes.
fn compare(
    player: &mut Player,
    cases: Vec<(Case, Env)>,
    starts: &[u64],
    table: &mut CsvWriter,
) -> Result<Vec<Outcome>> {
    program::say("changes are means over pairs of episodes with the same start, +- their standard error");
    program::say(format_args!(
        "  {:<28} {:>7} {:>7} {:>8} {:>18} {:>18} {:>18}",
        "disturbance", "success", "held", "return", "change of return", "of J per action", "of largest N"
    ));
    let mut undisturbed = vec![];
    let policy = player.policy.clone();
    for (case, env) in cases {
        // The same noise in every case: episodes are compared in pairs.
        player.policy = policy.clone();
        player.config.env.disturbance = case.disturbance.clone();
        player.env = env;
        let key = CaseKey { disturbance: &case.name };
        let outcomes = play(player, starts, |row, outcome| table.write((&key, row, outcome)))?;
        if undisturbed.is_empty() {
            undisturbed = outcomes.clone();
        }
        let known = |outcome: &Outcome, name: &str| outcome.number(name).unwrap_or(f64::NAN);
        let change = |name: &str| {
            let pairs = outcomes.iter().zip(&undisturbed);
            let changes: Vec<f64> = pairs.map(|(o, u)| known(o, name) - known(u, name)).collect();
            let error = deviation(&changes) / (changes.len() as f64).sqrt();
            let error = if changes.len() > 1 { format!(" +- {error:.2}") } else { String::new() };
            format!("{:+.2}{error}", mean(&changes))
        };
        program::say(format_args!(
            "  {:<28} {:>7.2} {:>7.2} {:>8.1} {:>18} {:>18} {:>18}",
            case.name,
            mean_of_column(&outcomes, "success"),
            mean_of_column(&outcomes, "success_held"),
            mean_of_column(&outcomes, "return"),
            change("return"),
            change("energy_per_action_j"),
            change("arm_max_contact_force_n"),
        ));
    }
    Ok(undisturbed)
}

fn print(outcomes: &[Outcome]) {
    program::say(format_args!(
        "  {:<32} {:>10} +- {:<9} {:>10} {:>10}  {:>10} .. highest of the episodes",
        "", "mean", "deviation", "median", "90 %", "lowest"
    ));
    for (column, name) in COLUMNS.iter().filter_map(|column| Some((column.name, column.printed?))) {
        let values: Vec<f64> = outcomes.iter().filter_map(|outcome| outcome.number(column)).collect();
        if values.is_empty() {
            program::say(format_args!("  {name:<32} {:>10}", "none"));
            continue;
        }
        let mean = mean(&values);
        // A single value has no standard deviation.
        let spread = if values.len() > 1 { format!("+- {:<9.3}", deviation(&values)) } else { String::new() };
        let [low, high] = range(&values);
        let [median, most] = [0.5, 0.9].map(|share| quantile(&values, share));
        program::say(format_args!(
            "  {name:<32} {mean:10.3} {spread:<12} {median:10.3} {most:10.3}  {low:10.3} .. {high:.3}"
        ));
    }
}
