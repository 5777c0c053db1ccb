//! Experiments on contact tasks: what the programs of this package share, in rooms of which each may use those before it:
//! `config`, `run`, `report`.

pub mod config;
pub mod report;
pub mod run;
