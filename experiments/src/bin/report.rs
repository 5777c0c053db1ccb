//! Run folders to one table and one picture.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use clap::Parser;
use experiments::cli;
use experiments::summary::{RunSummary, evaluations, find_runs};
use output::plot::{self, Panel, Series};

/// Summarise all runs below a folder: runs.csv with a row per run, curves with every seed.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Folder with run folders somewhere below it
    runs: PathBuf,
    /// Where to write runs.csv, curves.svg and curves.png (default: the same folder)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

fn main() -> ExitCode {
    cli::exit(run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<ExitCode> {
    let runs = find_runs(&arguments.runs)?;
    ensure!(!runs.is_empty(), "{}: no run folder below it", arguments.runs.display());
    let out = arguments.out.as_ref().unwrap_or(&arguments.runs);
    fs_err::create_dir_all(out)?;

    let rows = runs.iter().map(RunSummary::of).collect::<Result<Vec<_>>>()?;
    let path = out.join("runs.csv");
    let mut table = csv::Writer::from_path(&path).with_context(|| path.display().to_string())?;
    println!(
        "{:<5} {:<16} {:>5} {:>7} {:>13} {:>12} {:>8} {:>9} {:>11}",
        "task", "space", "seed", "steps", "final return", "best return", "sampled", "success", "J/action"
    );
    for row in &rows {
        table.serialize(row)?;
        println!(
            "{:<5} {:<16} {:>5} {:>7} {:>13.1} {:>12.1} {:>8.1} {:>9.2} {:>11.2}",
            row.task,
            row.space,
            row.seed,
            row.env_steps,
            row.final_return,
            row.best_return,
            row.sampled_return,
            row.final_success,
            row.energy_per_action_j
        );
    }
    table.flush()?;

    let panel = |title: &str, unit: &str, column: &str| -> Result<Panel> {
        let curves = runs.iter().zip(&rows).map(|(run, row)| {
            let label = format!("{} {} seed {}", row.task, row.space, row.seed);
            Ok(Series { label, points: evaluations(run, column)? })
        });
        Ok(Panel {
            title: title.into(),
            x_label: "environment steps (thousands)".into(),
            y_label: unit.into(),
            series: curves.collect::<Result<_>>()?,
        })
    };
    let panels = [
        panel("Evaluation return, mean action", "return", "return")?,
        panel("Success at the end of an episode", "share of episodes", "success")?,
        panel("Mechanical energy", "J per action", "energy_per_action_j")?,
        panel("Stiffness, mean over time and axes", "1/s2 or N/m", "mean_stiffness")?,
    ];
    plot::write(&panels, &out.join("curves"))?;
    Ok(ExitCode::SUCCESS)
}
