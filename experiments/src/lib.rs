//! Experiments on contact tasks. Each module may use those before it: `config`, `run`, `report`, `programs`. [`main`] is
//! all programs in one, for a package that brings tasks of its own.

pub mod config;
pub mod programs;
pub mod report;
pub mod run;

pub use programs::main;
