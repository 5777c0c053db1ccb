//! A run with its learning curves: what `train` and every run of a sweep do.

use std::path::Path;
use std::process::ExitCode;

use anyhow::Result;
use output::program;

use crate::config::{RunConfig, cli};
use crate::report::curves;
use crate::run::folder::RunFolder;
use crate::run::stop::Stop;
use crate::run::train::{self, Ending, RunOptions};

/// Trains as `config` says in its folder below `out` and draws the learning curves, anew after every evaluation; the exit code of a
/// program that does nothing else.
///
/// # Errors
/// As [`train::in_folder`].
pub fn train_and_draw(config: &RunConfig, out: &Path, options: RunOptions, stop: &Stop) -> Result<ExitCode> {
    let folder = RunFolder::below(out, config);
    let ending = train::in_folder(config, &folder, options, stop, &|| draw(&folder))?;
    // Drawn also for a run that was done before: the picture may be missing, or older than its tables.
    draw(&folder);
    Ok(if ending == Some(Ending::Stopped) { ExitCode::from(cli::STOPPED) } else { ExitCode::SUCCESS })
}

/// Draws the learning curves of a run if they are missing or older than its tables: its process may have been killed in between.
pub fn make_up_curves(folder: &RunFolder) {
    let written = |path: &Path| path.metadata().and_then(|file| file.modified()).ok();
    let picture = written(&folder.curves().with_extension("svg"));
    // File systems record times in steps of milliseconds: a table as old as the picture may be newer.
    if [folder.episodes(), folder.eval(), folder.progress()].iter().any(|table| written(table) >= picture) {
        draw(folder);
    }
}

/// Draws the learning curves. An error is printed but does not fail the run, whose exit code says how it ended.
fn draw(folder: &RunFolder) {
    // A run that is stopped while its script plays has no table yet.
    if !folder.episodes().exists() {
        return;
    }
    if let Err(error) = curves::draw(folder) {
        program::tell(format_args!("learning curves could not be drawn: {error:#}"));
    }
}
