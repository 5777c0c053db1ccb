//! The last step of the law: torque limits, torque rates, finiteness.

use crate::error::{ConfigError, within};
use crate::spatial::{JointVector, all_finite};

/// Limits of the arm's joint torques. They belong to the arm, not to the controller's configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TorqueLimits {
    max: JointVector,
    rate: JointVector,
}

impl TorqueLimits {
    /// The largest torque of each joint (Nm), and the largest rate of each joint's torque (Nm/s), either way; infinite where
    /// there is none.
    ///
    /// # Errors
    /// If one is NaN or negative.
    pub(crate) fn new(max: JointVector, rate: JointVector) -> Result<Self, ConfigError> {
        for (name, limits) in [("max", max), ("rate", rate)] {
            for (joint, &limit) in limits.iter().enumerate() {
                within(&format!("torque_limits.{name} (joint {})", joint + 1), limit, 0.0..=f64::INFINITY)?;
            }
        }
        Ok(Self { max, rate })
    }
}

/// Applies [`TorqueLimits`], and keeps what was cut.
#[derive(Debug, Clone)]
pub(crate) struct TorqueLimiter {
    limits: TorqueLimits,
    previous: JointVector,
    /// What was cut off the latest torque (Nm).
    excess: JointVector,
    faults: u64,
}

impl TorqueLimiter {
    pub(crate) fn new(limits: TorqueLimits) -> Self {
        Self { limits, previous: JointVector::zeros(), excess: JointVector::zeros(), faults: 0 }
    }

    /// The rate limit starts from `torque` (Nm): what has been holding the arm.
    pub(crate) fn reset(&mut self, torque: &JointVector) {
        self.previous = if all_finite(torque) { self.clamp(torque) } else { JointVector::zeros() };
        (self.excess, self.faults) = (JointVector::zeros(), 0);
    }

    /// Limits the rate of the next torque relative to `torque` (Nm), which is finite: the torque that the arm took.
    pub(crate) fn count_from(&mut self, torque: &JointVector) {
        self.previous = self.clamp(torque);
    }

    /// The torque to send instead of `wanted`. A `wanted` that is not finite is a fault and becomes `fallback`, which
    /// becomes zero if it is not finite either.
    pub(crate) fn pass(&mut self, wanted: &JointVector, fallback: &JointVector, dt: f64) -> JointVector {
        let finite = if all_finite(wanted) {
            *wanted
        } else {
            self.faults += 1;
            if all_finite(fallback) { *fallback } else { JointVector::zeros() }
        };
        let mut torque = self.clamp(&finite);
        for i in 0..7 {
            let step = self.limits.rate[i] * dt;
            torque[i] = torque[i].clamp(self.previous[i] - step, self.previous[i] + step);
        }
        self.excess = finite - torque;
        self.previous = torque;
        torque
    }

    /// The latest torque (Nm).
    pub(crate) fn previous(&self) -> &JointVector {
        &self.previous
    }

    /// Joints whose latest torque was cut by a limit.
    pub(crate) fn saturated(&self) -> [bool; 7] {
        std::array::from_fn(|i| self.excess[i] != 0.0)
    }

    /// What the limits cut off the latest torque (Nm); zero where they did not.
    pub(crate) fn excess(&self) -> &JointVector {
        &self.excess
    }

    /// Samples since reset whose torque was not finite.
    pub(crate) fn faults(&self) -> u64 {
        self.faults
    }

    fn clamp(&self, torque: &JointVector) -> JointVector {
        torque.zip_map(&self.limits.max, |t, max| t.clamp(-max, max))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn limits(rate: f64) -> TorqueLimits {
        let max = JointVector::from([80.0, 80.0, 80.0, 80.0, 80.0, 12.0, 12.0]);
        TorqueLimits::new(max, JointVector::repeat(rate)).unwrap()
    }

    #[test]
    fn within_the_limits_nothing_changes() {
        let mut limiter = TorqueLimiter::new(limits(f64::INFINITY));
        let tau = JointVector::from([1.0, -80.0, 3.0, 0.0, 79.0, 12.0, -11.0]);
        assert_eq!(limiter.pass(&tau, &tau, 0.002), tau);
        assert_eq!(limiter.saturated(), [false; 7]);
    }

    #[test]
    fn limits_that_are_none_are_refused() {
        let with = |max: f64, rate: f64| {
            let mut limits = [JointVector::repeat(10.0), JointVector::repeat(10.0)];
            (limits[0][2], limits[1][6]) = (max, rate);
            TorqueLimits::new(limits[0], limits[1]).map_err(|error| error.to_string())
        };
        assert!(with(80.0, f64::INFINITY).is_ok());
        assert!(with(f64::NAN, 1.0).unwrap_err().starts_with("torque_limits.max (joint 3) = NaN"));
        assert!(with(1.0, -1.0).unwrap_err().starts_with("torque_limits.rate (joint 7) = -1"));
    }

    #[test]
    fn clipped_joints_are_named() {
        let mut limiter = TorqueLimiter::new(limits(f64::INFINITY));
        let tau = limiter.pass(&JointVector::repeat(13.0), &JointVector::zeros(), 0.002);
        assert_eq!((tau[4], tau[5]), (13.0, 12.0));
        assert_eq!(limiter.saturated(), [false, false, false, false, false, true, true]);
    }

    #[test]
    fn a_step_becomes_a_ramp() {
        let mut limiter = TorqueLimiter::new(limits(1000.0));
        limiter.reset(&JointVector::repeat(2.0));
        assert_eq!(limiter.pass(&JointVector::repeat(10.0), &JointVector::zeros(), 0.001)[0], 3.0);
        assert_eq!(limiter.pass(&JointVector::repeat(10.0), &JointVector::zeros(), 0.001)[0], 4.0);
        assert_eq!(limiter.saturated(), [true; 7]);
    }

    /// If the torque that held the arm is not finite, the rate counts from zero.
    #[test]
    fn a_start_that_is_not_finite_counts_from_zero() {
        let mut limiter = TorqueLimiter::new(limits(1000.0));
        limiter.reset(&JointVector::repeat(f64::NAN));
        assert_eq!(limiter.previous(), &JointVector::zeros());
        assert_eq!(limiter.pass(&JointVector::repeat(10.0), &JointVector::zeros(), 0.001), JointVector::repeat(1.0));
    }

    #[test]
    fn faults_fall_back_and_are_counted() {
        let mut limiter = TorqueLimiter::new(limits(f64::INFINITY));
        let mut broken = JointVector::zeros();
        broken[3] = f64::NAN;
        assert_eq!(limiter.pass(&broken, &JointVector::repeat(5.0), 0.002), JointVector::repeat(5.0));
        assert_eq!(limiter.pass(&broken, &broken, 0.002), JointVector::zeros());
        assert_eq!(limiter.faults(), 2);
    }

    proptest! {
        #[test]
        fn limits_and_rates_are_never_broken(torques in prop::collection::vec(prop::array::uniform7(-1e4..1e4f64), 1..40)) {
            let mut limiter = TorqueLimiter::new(limits(1000.0));
            let mut previous = JointVector::zeros();
            for wanted in torques {
                let tau = limiter.pass(&JointVector::from(wanted), &JointVector::zeros(), 0.001);
                for i in 0..7 {
                    prop_assert!(tau[i].abs() <= limiter.limits.max[i]);
                    prop_assert!((tau[i] - previous[i]).abs() <= 1.0 + 1e-9);
                }
                previous = tau;
            }
        }
    }
}
