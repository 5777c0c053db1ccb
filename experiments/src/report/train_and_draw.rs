//! A run with its learning curves: what `train` and every run of a sweep do.

use std::path::Path;
use std::process::ExitCode;

use anyhow::Result;
use output::program;

use crate::config::{RunConfig, cli};
use crate::report::curves;
use crate::run::folder::RunFolder;
use crate::run::train::{self, Ending, RunOptions};

/// Trains as `config` says in its folder below `out` and draws the learning curves, anew after every evaluation; the exit code of a
/// program that does nothing else.
///
/// # Errors
/// As [`train::in_folder`].
pub fn train_and_draw(config: &RunConfig, out: &Path, options: RunOptions) -> Result<ExitCode> {
    let folder = RunFolder::below(out, config);
    let draw = || {
        // A run that is stopped while its script plays has none yet.
        if !folder.episodes().exists() {
            return;
        }
        if let (Err(error), false) = (curves::draw(&folder), options.quiet) {
            // The run goes on all the same: its exit code says how it ended.
            program::tell(format_args!("learning curves could not be drawn: {error:#}"));
        }
    };
    let ending = train::in_folder(config, &folder, options, &draw)?;
    // Of a run that was done before, the picture may be missing.
    if ending.is_some() || !folder.curves().with_extension("svg").exists() {
        draw();
    }
    Ok(if ending == Some(Ending::Stopped) { ExitCode::from(cli::STOPPED) } else { ExitCode::SUCCESS })
}
