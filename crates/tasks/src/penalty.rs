//! The force penalty of the paper's Door and Wipe (robosuite's rule from Wipe).

use serde::{Deserialize, Serialize};

/// Reward lost when the contact force exceeds a limit, before the task scales it: Door and Wipe take off a share, Lift nothing, Insert
/// nothing or all of it, as its options say.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ForcePenalty {
    /// Whose force counts.
    pub of: CountedForce,
    /// Force (N) above which an action is penalised.
    pub limit: f64,
    /// Reward lost per newton: of the whole force, not of the excess.
    pub weight: f64,
}

impl Default for ForcePenalty {
    fn default() -> Self {
        ForcePenalty { of: CountedForce::Arm, limit: 60.0, weight: 0.05 }
    }
}

impl ForcePenalty {
    /// Penalty (unscaled, at least 0) of an action whose largest force was `force` N; `None` within the limit.
    pub fn for_force(&self, force: f64) -> Option<f64> {
        (force > self.limit).then_some(self.weight * force)
    }
}

/// Whose contact force counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CountedForce {
    /// The force beyond the wrist and those on the links, with the scene and with the arm itself. A policy that pushes with
    /// its forearm pays as well.
    Arm,
    /// The force beyond the wrist, as the paper's sensor has it.
    Hand,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_force_counts_once_above_the_limit() {
        let penalty = ForcePenalty::default();
        assert_eq!(penalty.for_force(60.0), None);
        assert_eq!(penalty.for_force(80.0), Some(4.0));
        // With a weight of 0 a force above the limit is still reported.
        assert_eq!(ForcePenalty { weight: 0.0, ..penalty }.for_force(80.0), Some(0.0));
    }
}
