//! `wiping`: the whole experiment with one command.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::Parser;
use serde::Serialize;
use wiping::comparison::Comparison;
use wiping::{Setup, conditions, delta_sign, evolution, spaces};

/// The paper's wiping experiment in simulation: tables and figures into a folder.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Folder for tables and figures
    #[arg(long, value_name = "FOLDER", default_value = "results/wiping")]
    out: PathBuf,
    /// Seed of the trials (1 was used while the experiment was set up)
    #[arg(long, default_value_t = 2)]
    seed: u64,
    /// Trials of each action space in the comparison
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u64).range(2..))]
    trials: u64,
}

/// Trials under each condition other than that of the comparison.
const CONDITION_TRIALS: u64 = 2;

/// Where the tables and figures come from; `config.toml` beside it holds every setting.
#[derive(Serialize)]
struct Manifest {
    command: Vec<String>,
    commit: String,
    seed: u64,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<()> {
    let setup = Setup::default();
    let out = &arguments.out;
    fs_err::create_dir_all(out)?;
    fs_err::write(out.join("config.toml"), toml::to_string(&setup)?)?;
    let manifest = Manifest { command: output::command(), commit: output::commit(), seed: arguments.seed };
    fs_err::write(out.join("manifest.json"), serde_json::to_string_pretty(&manifest)? + "\n")?;
    println!("one wipe over time");
    evolution::write(&setup, out)?;
    println!("{} trials with every action space", arguments.trials);
    Comparison::run(&setup, arguments.seed, arguments.trials)?.write(out)?;
    println!("the sign of delta");
    delta_sign::write(&delta_sign::grid(&setup)?, out)?;
    let all = spaces();
    let tables = [
        ("disturbances", conditions::disturbances(), &all[..]),
        ("variants", conditions::variants(), &all[..]),
        ("laws", conditions::laws(), &all[..1]),
    ];
    for (name, conditions, spaces) in tables {
        println!("{name}");
        let path = out.join(name).with_extension("csv");
        conditions::write(&conditions, spaces, &setup, arguments.seed, CONDITION_TRIALS, &path)?;
    }
    println!("tables and figures are in {}", out.display());
    Ok(())
}
