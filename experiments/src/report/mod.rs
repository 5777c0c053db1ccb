//! Tables and pictures made from run folders.

pub mod archive;
pub mod columns;
pub mod comparable;
pub mod comparison;
pub mod curves;
pub mod derived;
pub mod disturbed;
pub mod energy_ratio;
pub mod groups;
pub mod markdown;
pub mod npz;
pub mod outside;
pub mod over_tasks;
pub mod pooled;
pub mod published;
pub mod reached;
pub mod record;
pub mod run_tables;
pub mod search;
pub mod summary;
pub mod table;
pub mod text;
pub mod tournament;
pub mod train_and_draw;
pub mod verdicts;
