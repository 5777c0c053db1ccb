//! What every checkpoint of a run says of itself, in the `caller` part of its `state.json`.

use anyhow::{Result, ensure};
use serde::{Deserialize, Serialize};

use crate::config::RunId;

/// Whose it is, and when it was taken.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CheckpointRecord {
    /// The run.
    #[serde(flatten)]
    pub run: RunId,
    /// Training actions so far.
    pub step: u64,
}

impl CheckpointRecord {
    /// Whether it may be of this run. Old ones do not tell their seed (0), and some runs were given another variant since.
    ///
    /// # Errors
    /// Says of which run it is.
    pub fn belongs_to(&self, wanted: &RunId) -> Result<()> {
        let RunId { task, space, seed, .. } = &self.run;
        ensure!(
            (task, space) == (&wanted.task, &wanted.space),
            "trained for {task} with {space}, not for {} with {}",
            wanted.task,
            wanted.space
        );
        ensure!(*seed == 0 || *seed == wanted.seed, "of a run with seed {seed}, not {}", wanted.seed);
        Ok(())
    }
}
