//! The command line.

use std::path::PathBuf;

use clap::{ArgGroup, Parser, ValueEnum};

/// The AFORCE control law on a Franka arm: 1 kHz below a script or a policy at 20 Hz. Nothing here was tried on hardware: read
/// docs/drive-your-own-arm.md, and keep the user stop at hand.
#[derive(Debug, Parser)]
#[command(name = "franka-host", version, group = ArgGroup::new("who").required(true))]
pub struct Args {
    /// Address of the robot, with :PORT if it is not 1337
    #[arg(long)]
    pub robot: String,
    /// What the arm does
    #[arg(long, group = "who")]
    pub script: Option<Script>,
    /// A program, with its arguments, that reads a line of JSON and answers with one, up to 20 times a second
    #[arg(long, group = "who")]
    pub policy: Option<String>,
    /// The arm, its limits and the action space, as TOML [default: configs/fr3.toml of this package]
    #[arg(long)]
    pub setup: Option<PathBuf>,
    /// Joint angles to move to first, and when a policy asks for a reset (rad)
    #[arg(long, num_args = 7, allow_negative_numbers = true, value_name = "Q")]
    pub start: Option<Vec<f64>>,
    /// Longest script, or episode of a policy (s)
    #[arg(long, default_value_t = 120.0)]
    pub duration: f64,
    /// Where to write every tenth cycle, as CSV
    #[arg(long)]
    pub log: Option<PathBuf>,
    /// Begin without the push by hand that shows sign and axes of the wrench
    #[arg(long)]
    pub no_push_check: bool,
    /// Run on a kernel without real-time scheduling
    #[arg(long)]
    pub no_realtime: bool,
    /// Add the push of a table at this height (m) that is not there, to rehearse contact in the air
    #[arg(long, value_name = "HEIGHT", allow_negative_numbers = true)]
    pub rehearse_table: Option<f64>,
}

/// What the arm can do by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Script {
    /// Stay where it is
    Hold,
    /// Circle in the air: 5 cm of radius in 2.5 s, eight times
    Circle,
    /// Down to contact, press with 10 N, circle eight times
    Wipe,
}
