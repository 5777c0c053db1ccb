//! Plays the fixed evaluation episodes and prints what they cost and earned.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Result, bail};
use clap::Parser;
use experiments::config::RunId;
use experiments::run::csv_writer::CsvWriter;
use experiments::run::rollout::evaluate;
use experiments::run::seeds::evaluation_seed;
use experiments::show::source::{Player, SourceArgs};
use output::statistics::{deviation, mean, range};
use output::{file, program};
use tasks::Outcome;

/// Evaluate a trained policy, a scripted expert or random actions.
///
/// The episodes are the same for every policy and action space; none of them chose a run's best checkpoint
/// (but in runs whose tables have schema 1).
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    source: SourceArgs,
    /// Episodes to play
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..))]
    episodes: u32,
    /// Also write a row per episode to this CSV file, which must not exist
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
}

fn main() -> ExitCode {
    program::run(|| run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<ExitCode> {
    let Player { config, mut env, mut policy, step } = arguments.source.open()?;
    let mut table = match &arguments.csv {
        Some(path) if path.exists() => bail!("{}: exists; nothing was overwritten", path.display()),
        // It appears when it is complete.
        Some(path) => {
            file::prepare(path)?;
            CsvWriter::append(&file::unfinished(path))?
        }
        None => CsvWriter::discard(),
    };
    let id = RunId::of(&config);
    let starts = (0..arguments.episodes).map(evaluation_seed);
    let outcomes = evaluate(&mut env, &mut policy, starts, step, &id, &mut table)?;
    if let Some(path) = &arguments.csv {
        fs_err::rename(file::unfinished(path), path)?;
    }
    println!("{} with {}, {} policy, {} episodes", id.task, id.space, policy.name(), arguments.episodes);
    for (name, column) in COLUMNS {
        let values: Vec<f64> = outcomes.iter().map(column).collect();
        let (mean, spread) = (mean(&values), if values.len() > 1 { deviation(&values) } else { 0.0 });
        let [low, high] = range(&values);
        println!("  {name:<28} {mean:10.3} +- {spread:<9.3} {low:10.3} .. {high:.3}");
    }
    Ok(ExitCode::SUCCESS)
}

type Column = (&'static str, fn(&Outcome) -> f64);

/// Mean, deviation and range over episodes are printed of these.
const COLUMNS: [Column; 12] = [
    ("return", |o| o.total),
    ("success at the end", |o| f64::from(u8::from(o.success))),
    ("success at any time", |o| f64::from(u8::from(o.success_any))),
    ("energy, J per action", |o| o.energy_per_action_j),
    ("stiffness, N/m", |o| o.stiffness_translation_n_per_m),
    ("stiffness, Nm/rad", |o| o.stiffness_rotation_nm_per_rad),
    ("largest force, N", |o| o.max_contact_force_n),
    ("penalised actions", |o| o.penalised_steps as f64),
    ("penalty", |o| o.penalty),
    ("excess impulse, N s", |o| o.excess_impulse_ns),
    ("torques at their limit", |o| o.saturated_fraction),
    ("diverged", |o| f64::from(u8::from(o.diverged))),
];
