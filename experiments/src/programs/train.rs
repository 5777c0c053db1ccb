//! Trains one policy: `train --task lift --space aforce --seed 1`.

use std::path::PathBuf;
use std::process::ExitCode;

use crate::config::cli::RunArgs;
use crate::report::record::Record;
use crate::report::summary::RunSummary;
use crate::report::train_and_draw::train_and_draw;
use crate::run::folder::RunFolder;
use crate::run::stop::Stop;
use crate::run::train::RunOptions;
use anyhow::Result;
use clap::Parser;
use output::program;
use tasks::{Description, Env};

/// Train a policy with SAC.
///
/// Writes OUT/TASK/SPACE/seed_N: config.toml, manifest.json, episodes.csv, eval.csv,
/// progress.csv, curves, checkpoints. Ctrl-C, SIGTERM or SIGHUP saves at the end of the running
/// episode and exits with 75; --resume goes on from there to the same bytes of
/// episodes.csv and eval.csv.
#[derive(Parser)]
#[command(name = "train", version = output::VERSION, after_help = "Example: train --task lift --preset swift --setup solve --steps 6e4", arg_required_else_help = true)]
pub struct Arguments {
    #[command(flatten)]
    run: RunArgs,
    /// Folder of the experiment
    #[arg(long, default_value = "runs/train", value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    options: RunOptions,
    /// Print what an action and an observation consist of, the action space's record and what follows from it; train nothing
    #[arg(long)]
    describe: bool,
    /// Print the description as JSON
    #[arg(long, requires = "describe")]
    json: bool,
}

/// Runs the program and returns its exit code.
///
/// # Errors
/// If a setting is wrong, or the folder cannot be written.
pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let stop = Stop::on_signals()?;
    let config = arguments.run.resolve()?;
    if arguments.describe {
        let description = Description::of(&Env::new(config.env, 0)?);
        if arguments.json {
            program::print(format_args!("{}\n", serde_json::to_string_pretty(&description)?))?;
        } else {
            program::print(description.in_words())?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    let ending = train_and_draw(&config, &arguments.out, arguments.options, &stop)?;
    if ending == ExitCode::SUCCESS && !arguments.options.quiet {
        let folder = RunFolder::below(&arguments.out, &config);
        let run = folder.path().to_string_lossy();
        program::written(&[folder.curves().with_extension("svg"), folder.eval(), folder.best()]);
        program::next("evaluate", &["--run", &run]);
        program::next("replay", &["--run", &run, "--html", &format!("{run}/replay.html")]);
        program::result(in_words(&RunSummary::of(&Record::of_folder(&folder)?, &arguments.out)?));
    }
    Ok(ending)
}

/// The run's final return and success, in words.
fn in_words(run: &RunSummary) -> String {
    let [total, success] = ["final_return", "final_success"].map(|name| run.number(name));
    format!("return {total:.1}, success {:.0} %: means over the last evaluations", 100.0 * success)
}
