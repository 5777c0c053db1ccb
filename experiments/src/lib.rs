//! Experiments on contact tasks: what the programs of this package share.

pub mod arrow;
pub mod cli;
pub mod columns;
pub mod config;
pub mod curves;
pub mod display;
pub mod folder;
pub mod page;
pub mod pool;
pub mod published;
pub mod recording;
pub mod report;
pub mod rollout;
pub mod rows;
pub mod seeds;
pub mod sheet;
pub mod source;
pub mod stop;
pub mod summary;
pub mod sweep;
pub mod table;
pub mod take;
pub mod tensorboard;
pub mod traces;
pub mod train;
pub mod view;
