//! Experiments on contact tasks: what the programs `train`, `evaluate` and `replay` share.

pub mod cli;
pub mod columns;
pub mod config;
pub mod curves;
pub mod display;
pub mod folder;
pub mod pool;
pub mod published;
pub mod report;
pub mod rollout;
pub mod rows;
pub mod seeds;
pub mod source;
pub mod stop;
pub mod summary;
pub mod sweep;
pub mod table;
pub mod traces;
pub mod train;
