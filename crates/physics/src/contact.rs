//! What the environment exerts on everything beyond the wrist.

use aforce::Wrench;

/// The contact wrench beyond the wrist: the force the environment exerts on hand and
/// fingers (or tool), world axes, torque about the tool point. Contacts between fingers
/// do not count; the tool's weight and inertia are not in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactReading {
    /// First-order low-pass of `raw` (N, Nm): what a wrist sensor would give a controller.
    pub filtered: Wrench,
    /// A slower low-pass of `raw` (N, Nm): what penalties and safety records use. Rigid
    /// contact turns an impact into one step of kilonewtons; a real one lasts tens of
    /// milliseconds, and so does this one.
    pub sustained: Wrench,
    /// Impulses of the last step divided by its length (N, Nm). Single-step peaks of an
    /// impact are an artefact of rigid contact.
    pub raw: Wrench,
    /// Whether anything beyond the wrist and the environment press on each other.
    pub touching: bool,
}

impl Default for ContactReading {
    fn default() -> Self {
        ContactReading { filtered: Wrench::zeros(), sustained: Wrench::zeros(), raw: Wrench::zeros(), touching: false }
    }
}

impl ContactReading {
    /// Size of the sustained force (N).
    pub fn sustained_force(&self) -> f64 {
        self.sustained.fixed_rows::<3>(0).norm()
    }

    /// Takes in a raw reading, `dt` seconds after the last, through first-order low-passes
    /// with the given cut-offs (Hz) of the filtered and the sustained wrench, discretised
    /// exactly.
    pub(crate) fn update(&mut self, raw: Option<Wrench>, cutoffs: [f64; 2], dt: f64) {
        self.raw = raw.unwrap_or_else(Wrench::zeros);
        self.touching = raw.is_some();
        for (wrench, cutoff) in [&mut self.filtered, &mut self.sustained].into_iter().zip(cutoffs) {
            let gain = 1.0 - (-std::f64::consts::TAU * cutoff * dt).exp();
            *wrench += (self.raw - *wrench) * gain;
        }
    }
}
