//! A contact force over one action.

/// The size of a contact force during one action. All but `max_raw` are of the sustained force, which is low-passed
/// ([`SimulationConfig::sustained_cutoff_hz`](physics::SimulationConfig::sustained_cutoff_hz)).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ForceRecord {
    /// Largest (N).
    pub max: f64,
    /// Integral (N s).
    pub impulse: f64,
    /// After the last sample (N): the reading of a sensor that is read once per action.
    pub last: f64,
    /// Largest unfiltered force of a single step of the engine (N).
    pub max_raw: f64,
}

impl ForceRecord {
    /// Adds `dt` seconds of a force (N): the sustained one, and the unfiltered one of a single step.
    pub(crate) fn add(&mut self, sustained: f64, raw: f64, dt: f64) {
        self.max = self.max.max(sustained);
        self.impulse += sustained * dt;
        self.last = sustained;
        self.max_raw = self.max_raw.max(raw);
    }
}
