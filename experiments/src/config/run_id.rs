//! Who a run is.

use serde::{Deserialize, Serialize};

use crate::config::RunConfig;

/// Who a run is: in its rows, in its checkpoints and in a sweep.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct RunId {
    /// Task name.
    pub task: String,
    /// Action space name.
    pub space: String,
    /// Seed of the run; 0 in checkpoints that do not tell it.
    #[serde(default)]
    pub seed: u64,
}

impl RunId {
    /// Of the run with this configuration.
    pub fn of(config: &RunConfig) -> Self {
        RunId { task: config.env.task.as_str().into(), space: config.env.space.name().into(), seed: config.seed }
    }
}
