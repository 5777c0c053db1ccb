//! What every checkpoint of a run says of itself, in the `caller` part of its `state.json`.

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
