//! The programs as functions of their arguments. A file of `src/bin` per program calls one of them; [`main`] offers all as
//! subcommands of one program that has tasks of its own.

pub mod archive;
pub mod baselines;
pub mod evaluate;
pub mod replay;
pub mod report;
pub mod sweep;
pub mod train;

use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};
use output::program::{self, bad};
use tasks::{TaskKind, register};

/// A program by itself: reads its arguments and runs it.
pub fn alone<A: Parser>(run: fn(&A) -> Result<ExitCode>) -> ExitCode {
    program::run(|| run(&A::parse()))
}

/// All programs in one, with tasks of one's own beside the built-in ones: the whole `main` of a package that brings a task.
///
/// ```no_run
/// # fn create(_: &tasks::EnvConfig) -> Result<Box<dyn tasks::Task>, aforce::ConfigError> { unimplemented!() }
/// fn main() -> std::process::ExitCode {
///     experiments::main(&[tasks::TaskKind::new("drawer", "pull a drawer open", create)])
/// }
/// ```
///
/// The first argument names the program: `train`, `sweep`, `evaluate`, `replay`, `baselines`, `report` or `archive`. What follows are the
/// program's own arguments. Exit codes are those of the programs; 2 also if a task's name is taken.
pub fn main(tasks: &[TaskKind]) -> ExitCode {
    program::run(|| {
        program::as_subcommands();
        // The tasks are registered before the arguments are read, because flags list them.
        register(tasks).map_err(|error| bad(error.to_string()))?;
        match Programs::parse().program {
            Program::Train(arguments) => train::run(&arguments),
            Program::Sweep(arguments) => sweep::run(&arguments),
            Program::Evaluate(arguments) => evaluate::run(&arguments),
            Program::Replay(arguments) => replay::run(&arguments),
            Program::Baselines(arguments) => baselines::run(&arguments),
            Program::Report(arguments) => report::run(&arguments),
            Program::Archive(arguments) => archive::run(&arguments),
        }
    })
}

/// Train and evaluate policies on contact tasks, with tasks of one's own.
#[derive(Parser)]
#[command(version = output::VERSION)]
struct Programs {
    #[command(subcommand)]
    program: Program,
}

#[derive(Subcommand)]
enum Program {
    Train(train::Arguments),
    Sweep(sweep::Arguments),
    Evaluate(evaluate::Arguments),
    Replay(replay::Arguments),
    Baselines(baselines::Arguments),
    Report(report::Arguments),
    Archive(archive::Arguments),
}
