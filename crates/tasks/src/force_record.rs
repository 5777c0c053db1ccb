//! How hard something was pressed on.

/// A contact force during one action. It is the sustained one, but for `max_raw`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ForceRecord {
    /// Largest (N).
    pub max: f64,
    /// Integral (N s).
    pub impulse: f64,
    /// After the last sample (N): what a sensor that is read once per action tells.
    pub last: f64,
    /// Largest of a single step (N).
    pub max_raw: f64,
}

impl ForceRecord {
    /// Takes in `dt` seconds of a force (N), the sustained one and that of a single step.
    pub(crate) fn add(&mut self, sustained: f64, raw: f64, dt: f64) {
        self.max = self.max.max(sustained);
        self.impulse += sustained * dt;
        self.last = sustained;
        self.max_raw = self.max_raw.max(raw);
    }
}
