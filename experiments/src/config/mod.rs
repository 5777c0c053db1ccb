//! What a run is to be: its settings, from files and flags, its identity, and sweeps of many runs.

pub mod cli;
mod draws;
mod run_config;
mod run_id;
pub mod setup;
pub mod spaces;
pub mod sweep;
mod toml_text;

pub use run_config::{RunConfig, parse_override};
pub use run_id::{RunId, label};
pub use toml_text::{Source, parse};
