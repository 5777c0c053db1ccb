//! Detects contact: a threshold with hysteresis that the force must pass for a while.

/// Contact along the force axis.
#[derive(Debug, Clone)]
pub(crate) struct ContactDetector {
    /// Force that begins contact, and force below which contact ends (N).
    on: f64,
    off: f64,
    /// Time for which the force must stay past either threshold (s).
    hold: f64,
    /// Time for which the force has contradicted the present state (s).
    lasted: f64,
    in_contact: bool,
}

impl ContactDetector {
    pub(crate) fn new(on: f64, off: f64, hold: f64) -> Self {
        Self { on, off, hold, lasted: 0.0, in_contact: false }
    }

    pub(crate) fn reset(&mut self) {
        (self.lasted, self.in_contact) = (0.0, false);
    }

    pub(crate) fn in_contact(&self) -> bool {
        self.in_contact
    }

    /// One sample of the normal force (N, positive when the environment pushes).
    pub(crate) fn update(&mut self, force: f64, dt: f64) {
        let opposite = if self.in_contact { force < self.off } else { force >= self.on };
        self.lasted = if opposite { self.lasted + dt } else { 0.0 };
        // Half a sample of slack: the sum of dt is not exact.
        if opposite && self.lasted + 0.5 * dt > self.hold {
            self.in_contact = !self.in_contact;
            self.lasted = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn feed(detector: &mut ContactDetector, force: f64, samples: usize) -> bool {
        for _ in 0..samples {
            detector.update(force, 0.002);
        }
        detector.in_contact()
    }

    #[test]
    fn without_a_hold_every_sample_decides() {
        let mut detector = ContactDetector::new(4.0, 1.5, 0.0);
        for (force, contact) in [(3.0, false), (3.0, false), (5.0, true), (5.0, true), (2.0, true), (1.0, false)] {
            assert_eq!(feed(&mut detector, force, 1), contact, "{force} N");
        }
    }

    #[test]
    fn on_off_and_hold() {
        let mut detector = ContactDetector::new(4.0, 1.5, 0.010);
        assert!(!feed(&mut detector, 3.9, 100), "below the threshold");
        assert!(!feed(&mut detector, 20.0, 4), "8 ms are too short");
        assert!(!feed(&mut detector, 0.0, 1), "and the count starts over");
        assert!(!feed(&mut detector, 20.0, 4));
        assert!(feed(&mut detector, 20.0, 1), "10 ms make contact");
        assert!(feed(&mut detector, 1.6, 100), "between the thresholds contact stays");
        assert!(feed(&mut detector, 0.0, 4), "8 ms without force are no loss");
        assert!(feed(&mut detector, 2.0, 1));
        assert!(!feed(&mut detector, 0.0, 5), "10 ms are");
        assert!(!feed(&mut detector, 3.0, 100), "between the thresholds it stays lost");
    }
}
