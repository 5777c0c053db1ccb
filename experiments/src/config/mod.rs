//! What a run is to be: its settings, from files and flags, its identity, and sweeps of many runs.

pub mod cli;
mod draws;
mod run_config;
mod run_id;
pub mod sweep;

pub use run_config::{RunConfig, parse_override};
pub use run_id::{RunId, label};
