//! Experiments on contact tasks, in modules of which each may use those before it: `config`, `run`, `report`,
//! `programs`. [`main`] is all programs in one, for a package that brings tasks of its own.

pub mod config;
pub mod programs;
pub mod report;
pub mod run;

pub use programs::main;
