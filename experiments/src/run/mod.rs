//! Runs: training and playing, and the folder of tables and checkpoints that they leave.

pub mod checkpoint_record;
pub mod clock;
pub mod csv_table;
pub mod csv_writer;
pub mod disturbances;
mod experience;
pub mod folder;
pub mod kept;
mod learner;
mod learner_log;
pub mod manifest;
pub mod packed;
pub mod place;
pub mod playable;
pub mod pool;
pub mod progress_bar;
pub mod rollout;
pub mod rows;
pub mod seeds;
pub mod source;
pub mod stop;
pub mod tables;
pub mod tensorboard;
pub mod train;
pub mod which;
