//! `franka-host`: the AFORCE control law on a Franka arm. Nothing here was tried on hardware.

#![deny(unsafe_code)]

use std::process::ExitCode;

use clap::Parser;

mod arm;
mod checks;
mod cli;
mod course;
mod csv_log;
mod episode;
mod episodes;
mod gripper;
mod memory;
mod motion;
mod policy;
mod protocol;
mod rehearsal;
mod robot_setup;
mod run;
mod script;
mod speed;
#[cfg(test)]
mod testing;

fn main() -> ExitCode {
    match run::run(&cli::Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
