//! What the environment exerts on everything beyond the wrist.

use aforce::Wrench;

/// The contact wrench beyond the wrist: the force the environment exerts on hand and
/// fingers (or tool), world axes, torque about the tool point. Contacts between fingers
/// do not count; the tool's weight and inertia are not in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactReading {
    /// First-order low-pass of `raw` (N, Nm). What controllers and penalties use.
    pub filtered: Wrench,
    /// Impulses of the last step divided by its length (N, Nm). Single-step peaks of an
    /// impact are an artefact of rigid contact.
    pub raw: Wrench,
    /// Whether anything beyond the wrist touches the environment.
    pub touching: bool,
}

impl Default for ContactReading {
    fn default() -> Self {
        ContactReading { filtered: Wrench::zeros(), raw: Wrench::zeros(), touching: false }
    }
}

impl ContactReading {
    /// Takes in a raw reading, `dt` seconds after the last, through a first-order
    /// low-pass of cut-off `cutoff` (Hz), discretised exactly.
    pub(crate) fn update(&mut self, raw: Option<Wrench>, cutoff: f64, dt: f64) {
        self.raw = raw.unwrap_or_else(Wrench::zeros);
        self.touching = raw.is_some();
        let gain = 1.0 - (-std::f64::consts::TAU * cutoff * dt).exp();
        self.filtered += (self.raw - self.filtered) * gain;
    }
}
