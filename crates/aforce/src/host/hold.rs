//! Holds the arm's posture when the law does not act, with a stiffness that falls over time.

use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, not_negative, positive, within};
use crate::spatial::JointVector;

/// A spring and a damper at each joint. The hold works in joint space because after a fault the pose, the Jacobian or the mass matrix may
/// be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HoldConfig {
    /// Stiffness of each joint when the hold begins (Nm/rad).
    pub stiffness: [f64; 7],
    /// Stiffness of each joint after `relax_time` (Nm/rad), at most `stiffness`: low, so that a person can push the arm
    /// away.
    pub relaxed: [f64; 7],
    /// Damping of each joint (Nm s/rad).
    pub damping: [f64; 7],
    /// Time in which the stiffness falls from `stiffness` to `relaxed` (s).
    pub relax_time: f64,
}

impl Default for HoldConfig {
    fn default() -> Self {
        Self {
            stiffness: [60.0, 60.0, 60.0, 60.0, 20.0, 15.0, 10.0],
            relaxed: [20.0, 20.0, 20.0, 20.0, 8.0, 6.0, 4.0],
            damping: [10.0, 10.0, 10.0, 10.0, 3.0, 2.5, 2.0],
            relax_time: 1.0,
        }
    }
}

impl HoldConfig {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        for (name, values) in [("stiffness", self.stiffness), ("relaxed", self.relaxed), ("damping", self.damping)] {
            for (joint, value) in values.into_iter().enumerate() {
                not_negative(&format!("hold.{name} (joint {})", joint + 1), value)?;
            }
        }
        for (joint, (relaxed, stiffness)) in self.relaxed.into_iter().zip(self.stiffness).enumerate() {
            within(&format!("hold.relaxed (joint {})", joint + 1), relaxed, 0.0..=stiffness)?;
        }
        positive("hold.relax_time", self.relax_time)
    }
}

/// The running hold.
#[derive(Debug, Clone)]
pub(crate) struct Hold {
    config: HoldConfig,
    /// The posture to keep (rad); `None` until joint positions have been read.
    anchor: Option<JointVector>,
    /// Time since the hold began (s).
    elapsed: f64,
}

impl Hold {
    pub(crate) fn new(config: HoldConfig) -> Self {
        Self { config, anchor: None, elapsed: 0.0 }
    }

    /// Starts a new hold, at the next posture that can be read.
    pub(crate) fn begin(&mut self) {
        (self.anchor, self.elapsed) = (None, 0.0);
    }

    /// Whether the stiffness has fallen to `relaxed`.
    pub(crate) fn is_relaxed(&self) -> bool {
        self.elapsed >= self.config.relax_time
    }

    /// Torque of spring and damper (Nm) for the present joints, `dt` seconds after the last sample.
    pub(crate) fn torque(&mut self, q: &JointVector, qd: &JointVector, dt: f64) -> JointVector {
        let anchor = *self.anchor.get_or_insert(*q);
        self.pass(dt);
        let share = (self.elapsed / self.config.relax_time).min(1.0);
        let HoldConfig { stiffness, relaxed, damping, .. } = &self.config;
        let (from, to) = (JointVector::from(*stiffness), JointVector::from(*relaxed));
        let stiffness = from + share * (to - from);
        stiffness.component_mul(&(anchor - q)) - JointVector::from(*damping).component_mul(qd)
    }

    /// Adds `dt` seconds to the time since the hold began.
    pub(crate) fn pass(&mut self, dt: f64) {
        self.elapsed += dt;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_does_not_stiffen() {
        let mut config = HoldConfig::default();
        config.validate().unwrap();
        (config.stiffness, config.relaxed) = (config.relaxed, config.stiffness);
        let told = config.validate().unwrap_err().to_string();
        assert!(told.starts_with("hold.relaxed (joint 1) = 60 is not allowed; allowed: 0 to 20"), "{told}");
    }

    #[test]
    fn it_keeps_the_first_posture_and_relaxes() {
        let config = HoldConfig::default();
        let mut hold = Hold::new(config);
        let (q, rest) = (JointVector::repeat(0.3), JointVector::zeros());
        assert_eq!(hold.torque(&q, &rest, 0.0), rest);
        let pushed = q + JointVector::repeat(0.1);
        let first = hold.torque(&pushed, &rest, 0.0);
        assert!((first[0] + 6.0).abs() < 1e-9, "60 Nm/rad push it back: {first}");
        assert!(!hold.is_relaxed());
        let last = hold.torque(&pushed, &rest, config.relax_time);
        assert!(hold.is_relaxed());
        assert!((last[0] + 2.0).abs() < 1e-9, "20 Nm/rad at last: {last}");
        assert!(hold.torque(&q, &JointVector::repeat(1.0), 0.0)[0] < 0.0, "damped");
        hold.begin();
        assert_eq!(hold.torque(&pushed, &rest, 0.0), rest, "a new hold, a new posture");
    }
}
