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
    /// Impulses of the engine's last step, of 2 ms at most, divided by its length (N, Nm).
    /// Single-step peaks of an impact are an artefact of rigid contact.
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
            let gain = 1.0 - libm::exp(-std::f64::consts::TAU * cutoff * dt);
            *wrench += (self.raw - *wrench) * gain;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUTOFFS: [f64; 2] = [100.0, 12.0];

    fn push() -> Wrench {
        Wrench::new(0.0, 0.0, 10.0, 0.0, 0.0, 0.0)
    }

    /// Filtered and sustained force along z.
    fn forces(contact: &ContactReading) -> [f64; 2] {
        [contact.filtered[2], contact.sustained[2]]
    }

    fn assert_close(a: [f64; 2], b: [f64; 2]) {
        assert!((0..2).all(|i| (a[i] - b[i]).abs() < 1e-6), "{a:?}, not {b:?}");
    }

    /// The answer of a first-order low-pass to 10 N is 10 (1 - exp(-2 pi f t)) N after a time t, and when they are gone
    /// exp(-2 pi f t) of it is left after as long again.
    #[test]
    fn a_push_comes_and_goes_with_the_cut_offs() {
        let mut contact = ContactReading::default();
        contact.update(Some(push()), CUTOFFS, 0.002);
        assert!(contact.touching);
        assert_eq!(contact.raw, push());
        assert_close(forces(&contact), [7.153905, 1.399773]);
        assert_eq!(contact.filtered.norm(), contact.filtered[2], "nothing but the force along z");

        contact.update(None, CUTOFFS, 0.002);
        assert!(!contact.touching);
        assert_eq!(contact.raw, Wrench::zeros());
        assert_close(forces(&contact), [2.036070, 1.203836]);
    }

    /// What is read does not depend on how a time is divided into steps.
    #[test]
    fn two_short_steps_are_one_long_step() {
        let after = |steps: u32| {
            let mut contact = ContactReading::default();
            (0..steps).for_each(|_| contact.update(Some(push()), CUTOFFS, 0.002 / f64::from(steps)));
            forces(&contact)
        };
        assert_close(after(2), after(1));
    }
}
