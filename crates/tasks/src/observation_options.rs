//! What a policy may see beyond robosuite's observation.

use aforce::ConfigError;
use serde::{Deserialize, Serialize};

use crate::pixels::ObservedCamera;
use crate::privileged::Privileged;

/// Options of the observation, the same for every action space.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ObservationOptions {
    /// How Wipe's markers are seen; other tasks have none.
    pub markers: MarkerView,
    /// Whether the controller's state is seen: goal error, K, F_ff, F_d.
    pub controller: bool,
    /// Whether the force and the torque at the tool are seen: as the controller measures them, tared when the episode begins.
    pub force: bool,
    /// Whether the last action is seen, as it was given; zeros after a reset.
    pub action: bool,
    /// What a critic sees besides.
    pub critic: Vec<Privileged>,
    /// The camera whose pictures are observed beside the numbers, for learners in Python: `train` has no network for them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera: Option<ObservedCamera>,
}

/// How Wipe's markers are seen.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MarkerView {
    /// Share of the wiped ones; centroid and radius of the others: robosuite's default. Where the line lies is hidden.
    Condensed,
    /// As `condensed`, and where the nearest and the farthest of the others lie, seen from the tool: the default here.
    #[default]
    Ends,
    /// Every marker's place, whether it is wiped, and where it lies seen from the tool: robosuite's form without
    /// condensation.
    All,
}

impl ObservationOptions {
    /// Checks every value.
    ///
    /// # Errors
    /// If the critic's list names something twice, or something that the policy sees; if a picture is too large.
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        let seen = [(self.controller, Privileged::Controller), (self.force, Privileged::Force)];
        let seen: Vec<Privileged> = seen.into_iter().filter_map(|(is_seen, entry)| is_seen.then_some(entry)).collect();
        Privileged::validate(&self.critic, &seen)?;
        self.camera.map_or(Ok(()), |camera| camera.validate())
    }

    /// The chosen options as text, with the values that each may have.
    pub(crate) fn in_words(&self) -> String {
        let markers = format!("{:?}", self.markers).to_lowercase();
        let Self { controller, force, action, critic, .. } = self;
        let critic: Vec<&str> = critic.iter().map(|entry| entry.as_str()).collect();
        format!(
            "markers = {markers} (condensed, ends or all; Wipe's), controller = {controller} (its state), force = {force} (measured), \
             action = {action} (the last one), critic = {critic:?} (what it sees besides)"
        )
    }
}
