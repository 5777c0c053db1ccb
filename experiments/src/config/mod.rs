//! Configuration of runs: settings from files and flags, a run's identity, and sweeps of many runs.

pub mod cli;
mod draws;
mod run_config;
mod run_id;
pub mod sweep;

pub use run_config::{RunConfig, parse_override};
pub use run_id::{RunId, label};
