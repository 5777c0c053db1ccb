//! The record in every checkpoint of a run, in the `caller` part of its `state.json`.

use anyhow::{Result, ensure};
use serde::{Deserialize, Serialize};

use crate::config::RunId;

/// The run to which a checkpoint belongs, and when it was taken.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CheckpointRecord {
    /// The run.
    #[serde(flatten)]
    pub run: RunId,
    /// Training actions so far.
    pub step: u64,
}

impl CheckpointRecord {
    /// Checks that the checkpoint may belong to the run `wanted`. Old checkpoints do not store the seed (0). The variant
    /// is not compared, because some runs were given another one later.
    ///
    /// # Errors
    /// Names the run to which it belongs.
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
