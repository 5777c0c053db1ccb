//! What a policy may see beyond robosuite's observation.

use serde::{Deserialize, Serialize};

use crate::wipe::MarkerView;

/// Options of the observation, the same for every action space.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ObservationOptions {
    /// How Wipe's markers are seen; other tasks have none.
    pub markers: MarkerView,
    /// Whether the controller's state is seen: goal error, K, F_ff, F_d.
    pub controller: bool,
}

impl ObservationOptions {
    /// What is chosen, and what else could be.
    pub(crate) fn in_words(&self) -> String {
        let markers = format!("{:?}", self.markers).to_lowercase();
        format!("markers = {markers} (condensed, ends or all; Wipe's), controller = {} (its state)", self.controller)
    }
}
