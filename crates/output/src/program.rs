//! How every program ends, and what it prints.

use std::fmt::Display;
use std::io::{ErrorKind, Write};
use std::os::unix::process::CommandExt;
use std::panic::PanicHookInfo;
use std::path::Path;
use std::process::{Command, ExitCode};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock};

use anyhow::{Context, Result, anyhow};
use signal_hook::consts::SIGPIPE;
use signal_hook::flag;

/// Exit code of wrong usage, the same that clap uses.
const USAGE: u8 = 2;

/// A setting that is not possible: wrong usage, as opposed to a failure.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct BadSetting(String);

/// A [`BadSetting`] with this text.
pub fn bad(message: String) -> anyhow::Error {
    BadSetting(message).into()
}

/// Runs a program and turns its result into the exit code: an error is printed on one line, its
/// causes after colons; 2 for a [`BadSetting`], 1 for any other.
///
/// A pipe whose reader has gone, as in `report | head`, would make the next line that is printed fail. The user asked for no more lines, so
/// that is no error: the program ends silently, as other command-line programs do. A program that trains has work to lose and calls
/// [`outlive_readers`] first.
///
/// A panic is reported on one line too. With `RUST_BACKTRACE` set, Rust's own report is printed.
pub fn run(program: impl FnOnce() -> Result<ExitCode>) -> ExitCode {
    if std::env::var_os("RUST_BACKTRACE").is_none() {
        std::panic::set_hook(Box::new(tell_panic));
    }
    let gone = flag::register_conditional_default(SIGPIPE, Arc::clone(&ENDS_WITH_READERS));
    let ending = gone.map_err(Into::into).and_then(|_| program());
    let lost = ending.as_ref().is_ok_and(|code| *code == ExitCode::SUCCESS) && LOST.load(Ordering::Relaxed);
    let ending = if lost { Err(anyhow!("some of what was printed could not be written")) } else { ending };
    ending.unwrap_or_else(|error| {
        tell(format!("error: {}", format!("{error:#}").replace('\n', " ")));
        if error.is::<BadSetting>() { ExitCode::from(USAGE) } else { ExitCode::FAILURE }
    })
}

fn tell_panic(panic: &PanicHookInfo) {
    let what = panic.payload_as_str().unwrap_or("something that is no text").replace('\n', " ");
    let place = panic.location().map_or(String::new(), |place| format!(" ({}, line {})", place.file(), place.line()));
    tell(format_args!("error: {what}{place}"));
}

static ENDS_WITH_READERS: LazyLock<Arc<AtomicBool>> = LazyLock::new(|| Arc::new(AtomicBool::new(true)));

/// From now on the program goes on if the reader of its output is gone, because it has work that would be lost.
pub fn outlive_readers() {
    ENDS_WITH_READERS.store(false, Ordering::Relaxed);
}

/// Prints to standard output what a program was asked for.
///
/// # Errors
/// If standard output cannot be written.
pub fn print(text: impl Display) -> Result<()> {
    write!(std::io::stdout(), "{text}").context("standard output")
}

/// Whether a line was lost, on a full disk for example. The program goes on, and fails at its end.
static LOST: AtomicBool = AtomicBool::new(false);

/// Prints a line to standard output. It is no error if the output's reader is gone.
pub fn say(line: impl Display) {
    if writeln!(std::io::stdout(), "{line}").is_err_and(|error| error.kind() != ErrorKind::BrokenPipe) {
        LOST.store(true, Ordering::Relaxed);
    }
}

/// Prints a line to standard error, where progress and errors go.
pub fn tell(line: impl Display) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Prints the files that a program wrote, a line each.
pub fn written(files: &[impl AsRef<Path>]) {
    for file in files {
        say(format_args!("written: {}", file.as_ref().display()));
    }
}

/// Prints the result of a program, in the last line that the program prints.
pub fn result(line: impl Display) {
    say(format_args!("result:  {line}"));
}

/// Whether this executable has several programs, of which its first argument names one.
static SUBCOMMANDS: AtomicBool = AtomicBool::new(false);

/// From now on the programs are subcommands of this executable.
pub fn as_subcommands() {
    SUBCOMMANDS.store(true, Ordering::Relaxed);
}

/// The command that starts `program`, this one, again under the name `path`. It is the file that runs now: a build in the meantime
/// changes the file at `path`, not what is started.
pub fn again(program: &str, path: &Path) -> Command {
    let mut command = Command::new("/proc/self/exe");
    command.arg0(path).args(SUBCOMMANDS.load(Ordering::Relaxed).then_some(program));
    command
}

/// Columns of a narrow terminal.
const COLUMNS: usize = 80;

/// Prints what to do next: a command of this workspace, or of the package that has the programs as subcommands. A command that is longer
/// than `COLUMNS` is continued on a second line after a backslash: copied from a terminal that wraps it, it would be two commands.
pub fn next(program: &str, arguments: &[&str]) {
    let called = if SUBCOMMANDS.load(Ordering::Relaxed) { "-- " } else { "--bin " };
    let ends = if SUBCOMMANDS.load(Ordering::Relaxed) { "" } else { " --" };
    let command = format!("next:    cargo run --release {called}{program}{ends}");
    let arguments = shlex::try_join(arguments.iter().copied()).unwrap_or_else(|_| arguments.join(" "));
    let fits = command.len() + 1 + arguments.len() <= COLUMNS;
    let between = if fits { " " } else { " \\\n           " };
    say(format_args!("{command}{between}{arguments}"));
}
