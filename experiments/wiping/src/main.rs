//! `wiping`: the whole experiment with one command.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Result, ensure};
use clap::Parser;
use output::{file, program};
use serde::{Deserialize, Serialize};
use wiping::comparison::Comparison;
use wiping::{AFORCE, HIGH, Setup, conditions, delta_sign, evolution};

/// The paper's wiping experiment in simulation, without learning.
///
/// Wipes a spot eight times round at 1 kHz, driven by a script, with AFORCE and with low, mid and high stiffness, and
/// leaves tables and figures: one wipe over time, the comparison, the sign of delta, disturbances, other settings. The
/// same seed gives the same bytes.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Folder for tables and figures: new, empty, or with results of this program, which are replaced
    #[arg(long, value_name = "FOLDER", default_value = "runs/wiping")]
    out: PathBuf,
    /// Another set-up: a complete config.toml of an earlier run, changed
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Seed of the trials (1 was used while the experiment was set up)
    #[arg(long, default_value_t = 2)]
    seed: u64,
    /// Trials of each action space in the comparison, and under each disturbance
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u64).range(2..=1000))]
    trials: u64,
}

/// Trials with each other setting of arm or law.
const SETTING_TRIALS: u64 = 2;

/// Where the tables and figures come from; `config.toml` beside it holds every setting.
#[derive(Serialize, Deserialize)]
struct Manifest {
    command: Vec<String>,
    commit: String,
    seed: u64,
    /// `running` or `done`.
    status: String,
}

impl Manifest {
    const FILE: &str = "manifest.json";

    /// Writes a manifest into `out`, where nothing else than results of this program may lie.
    fn begin(out: &Path, seed: u64) -> Result<Self> {
        fs_err::create_dir_all(out)?;
        let command = output::command();
        let text = fs_err::read_to_string(out.join(Self::FILE)).unwrap_or_default();
        match serde_json::from_str::<Manifest>(&text) {
            Ok(old) if old.command.first() == command.first() => {
                program::tell(format_args!("replacing the results of commit {} in {}", old.commit, out.display()));
            }
            _ => ensure!(
                fs_err::read_dir(out)?.next().is_none(),
                "{}: holds something other than results of this program; nothing was overwritten",
                out.display()
            ),
        }
        let manifest = Manifest { command, commit: output::commit(), seed, status: "running".into() };
        manifest.write(out)?;
        Ok(manifest)
    }

    fn end(mut self, out: &Path) -> Result<()> {
        self.status = "done".into();
        self.write(out)
    }

    fn write(&self, out: &Path) -> Result<()> {
        file::replace(&out.join(Self::FILE), (serde_json::to_string_pretty(self)? + "\n").as_bytes())
    }
}

fn main() -> ExitCode {
    program::run(|| run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<ExitCode> {
    let Arguments { out, config, seed, trials } = arguments;
    let setup = config.as_ref().map_or_else(|| Ok(Setup::default()), |path| Setup::read(path))?;
    let manifest = Manifest::begin(out, *seed)?;
    file::replace(&out.join("config.toml"), toml::to_string(&setup)?.as_bytes())?;
    program::tell("one wipe over time");
    evolution::write(&setup, out)?;
    program::tell(format_args!("{trials} trials with every action space"));
    Comparison::run(&setup, *seed, *trials)?.write(out)?;
    program::tell("the sign of delta");
    delta_sign::write(&delta_sign::grid(&setup)?, out)?;
    let tables = [
        ("disturbances", conditions::disturbances(), &[0, 1, 2, 3][..], *trials),
        ("variants", conditions::variants(), &[AFORCE, HIGH][..], SETTING_TRIALS),
        ("laws", conditions::laws(), &[AFORCE][..], SETTING_TRIALS),
    ];
    for (name, conditions, spaces, trials) in tables {
        program::tell(name);
        conditions::write(&conditions, spaces, &setup, *seed, trials, &out.join(name).with_extension("csv"))?;
    }
    manifest.end(out)?;
    program::tell(format_args!("tables and figures are in {}", out.display()));
    Ok(ExitCode::SUCCESS)
}
