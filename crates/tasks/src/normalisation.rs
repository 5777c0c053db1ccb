//! robosuite's scale of Wipe's rewards. Door's force penalty has the same scale.

/// Number of Wipe's markers.
pub(crate) const MARKERS: usize = 100;

// robosuite's rewards in Wipe, before normalisation.
/// For a wiped marker.
pub(crate) const MARKER_REWARD: f64 = 50.0;
/// For an action in contact.
pub(crate) const CONTACT_REWARD: f64 = 0.01;
/// For each action once everything is wiped.
pub(crate) const COMPLETION_REWARD: f64 = MARKER_REWARD * (CONTACT_REWARD + 0.5);

/// robosuite's factor on every reward in an episode of `horizon` actions. With a horizon of 500 an action earns at most
/// 0.738 once everything is wiped.
pub(crate) fn normalisation(horizon: u32) -> f64 {
    let horizon = f64::from(horizon);
    let full = MARKERS as f64 * MARKER_REWARD + horizon * (CONTACT_REWARD + COMPLETION_REWARD);
    horizon / full
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normalisation_follows_the_horizon() {
        assert!((normalisation(500) - 0.0281611).abs() < 5e-8);
        assert!((normalisation(1000) - 0.0327761).abs() < 5e-8);
    }
}
