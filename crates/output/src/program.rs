//! How every program ends.

use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::Result;
use signal_hook::consts::SIGPIPE;
use signal_hook::flag;

/// Exit code of wrong usage, the same that clap uses.
const USAGE: u8 = 2;

/// A setting that cannot be: wrong usage, as opposed to a failure.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct BadSetting(String);

/// A [`BadSetting`] with this text.
pub fn bad(message: String) -> anyhow::Error {
    BadSetting(message).into()
}

/// Runs a program and turns its result into the exit code: an error is printed on one line, its
/// causes after colons; 2 for a [`BadSetting`], 1 for any other. A reader of the output that goes
/// away, as `| head` does, ends the program without a word.
pub fn run(program: impl FnOnce() -> Result<ExitCode>) -> ExitCode {
    let gone = flag::register_conditional_default(SIGPIPE, Arc::new(AtomicBool::new(true)));
    gone.map_err(Into::into).and_then(|_| program()).unwrap_or_else(|error| {
        eprintln!("error: {}", format!("{error:#}").replace('\n', " "));
        if error.is::<BadSetting>() { ExitCode::from(USAGE) } else { ExitCode::FAILURE }
    })
}

/// Says what a program wrote, a line each.
pub fn written(files: &[impl AsRef<Path>]) {
    for file in files {
        println!("written: {}", file.as_ref().display());
    }
}

/// Says what to do next: a command of this workspace.
pub fn next(program: &str, arguments: &str) {
    println!("next:    cargo run --release --bin {program} -- {arguments}");
}
