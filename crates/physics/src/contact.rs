//! What presses on the arm: the wrench beyond the wrist, and the force on the links short of it.

use aforce::Wrench;

use crate::engine::ArmContacts;

/// Contact readings after a step.
///
/// The wrench is what the environment, the arm's own links included, exerts on hand and fingers (or tool): world axes, torque about the tool
/// point. Contacts between fingers do not count; the tool's weight and inertia are not in it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ContactReading {
    /// First-order low-pass of `raw` (N, Nm): what a wrist sensor would give a controller.
    pub filtered: Wrench,
    /// A slower low-pass of `raw` (N, Nm), which penalties and safety records use. Rigid contact turns an impact into one
    /// step of kilonewtons. A real impact lasts tens of milliseconds, and so does this reading.
    pub sustained: Wrench,
    /// Impulses of the engine's last step, of 2 ms at most, divided by its length, and the force of the wiping tool's pad at its end (N, Nm).
    /// Single-step peaks of an impact are an artefact of rigid contact.
    pub raw: Wrench,
    /// Whether the environment presses on anything beyond the wrist.
    pub touching: bool,
    /// Contact of the links, which a wrist sensor does not measure.
    pub links: LinkReading,
    /// Whether two parts of the arm press on each other.
    pub touching_itself: bool,
}

/// Contact of the links short of the wrist (between base and wrist), with the scene or with each other.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LinkReading {
    /// Low-pass of `raw` (N), as slow as that of the sustained wrench.
    pub sustained: f64,
    /// Sum over contacts of the size of the force in the last step (N).
    pub raw: f64,
    /// Whether the scene presses on a link.
    pub touching: bool,
}

impl ContactReading {
    /// Size of the sustained force beyond the wrist (N).
    pub fn hand_force(&self) -> f64 {
        self.sustained.fixed_rows::<3>(0).norm()
    }

    /// Size of the sustained force beyond the wrist and of those on the links, added up (N).
    pub fn arm_force(&self) -> f64 {
        self.hand_force() + self.links.sustained
    }

    /// Size of the force beyond the wrist and of those on the links in the last step alone, added up (N).
    pub fn raw_arm_force(&self) -> f64 {
        self.raw.fixed_rows::<3>(0).norm() + self.links.raw
    }

    /// Whether anything presses on a link short of the wrist, or two parts of the arm touch. Contact of the scene with the hand does not count.
    pub fn arm_touches(&self) -> bool {
        self.links.raw > 0.0 || self.touching_itself
    }

    /// Updates the readings with the contacts of a step, `dt` seconds after the last. `cutoffs` (Hz) are those of the
    /// first-order low-passes of the filtered and the sustained reading, which are discretised exactly.
    pub(crate) fn update(&mut self, contacts: &ArmContacts, cutoffs: [f64; 2], dt: f64) {
        let gains = cutoffs.map(|cutoff| 1.0 - libm::exp(-std::f64::consts::TAU * cutoff * dt));
        self.raw = contacts.beyond_wrist.unwrap_or_default();
        self.touching = contacts.beyond_wrist.is_some();
        self.filtered += (self.raw - self.filtered) * gains[0];
        self.sustained += (self.raw - self.sustained) * gains[1];
        self.links.raw = contacts.on_links;
        self.links.touching = contacts.scene_on_links;
        self.links.sustained += (self.links.raw - self.links.sustained) * gains[1];
        self.touching_itself = contacts.itself;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUTOFFS: [f64; 2] = [100.0, 12.0];

    fn push() -> Wrench {
        Wrench::new(0.0, 0.0, 10.0, 0.0, 0.0, 0.0)
    }

    /// 10 N on the hand and 10 N on a link.
    fn pushed() -> ArmContacts {
        ArmContacts { beyond_wrist: Some(push()), on_links: 10.0, scene_on_links: true, itself: false }
    }

    /// Filtered and sustained force along z.
    fn forces(contact: &ContactReading) -> [f64; 2] {
        [contact.filtered[2], contact.sustained[2]]
    }

    fn assert_close(a: [f64; 2], b: [f64; 2]) {
        assert!((0..2).all(|i| (a[i] - b[i]).abs() < 1e-6), "{a:?}, not {b:?}");
    }

    /// The response of a first-order low-pass to 10 N is 10 (1 - exp(-2 pi f t)) N after a time t. After as long again
    /// without force a share exp(-2 pi f t) of that is left.
    #[test]
    fn a_push_comes_and_goes_with_the_cut_offs() {
        let mut contact = ContactReading::default();
        contact.update(&pushed(), CUTOFFS, 0.002);
        assert!(contact.touching);
        assert_eq!(contact.raw, push());
        assert_close(forces(&contact), [7.153905, 1.399773]);
        assert_eq!(contact.filtered.norm(), contact.filtered[2], "nothing but the force along z");
        assert_eq!(contact.links, LinkReading { sustained: contact.hand_force(), raw: 10.0, touching: true });
        assert_eq!((contact.arm_force(), contact.raw_arm_force()), (2.0 * contact.hand_force(), 20.0));

        contact.update(&ArmContacts::default(), CUTOFFS, 0.002);
        assert!(!contact.touching);
        assert_eq!(contact.raw, Wrench::zeros());
        assert_close(forces(&contact), [2.036070, 1.203836]);
    }

    /// The readings do not depend on how a time is divided into steps.
    #[test]
    fn two_short_steps_are_one_long_step() {
        let after = |steps: u32| {
            let mut contact = ContactReading::default();
            (0..steps).for_each(|_| contact.update(&pushed(), CUTOFFS, 0.002 / f64::from(steps)));
            forces(&contact)
        };
        assert_close(after(2), after(1));
    }
}
