//! The one exit for torques: limits, rate, finiteness.

use crate::spatial::{JointVector, all_finite};

/// What the plant's joints can take. Part of the plant, not of the controller's configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueLimits {
    /// Largest torque of each joint, either way (Nm).
    pub max: JointVector,
    /// Largest rate of each joint's torque, either way (Nm/s), if there is one.
    pub rate: Option<JointVector>,
}

/// Applies [`TorqueLimits`] and remembers what it did.
#[derive(Debug, Clone)]
pub(crate) struct TorqueExit {
    limits: TorqueLimits,
    previous: JointVector,
    saturated: [bool; 7],
    faults: u64,
}

impl TorqueExit {
    pub(crate) fn new(limits: TorqueLimits) -> Self {
        Self { limits, previous: JointVector::zeros(), saturated: [false; 7], faults: 0 }
    }

    /// The rate limit starts from `torque` (Nm): what has been holding the arm.
    pub(crate) fn reset(&mut self, torque: &JointVector) {
        self.previous = if all_finite(torque) { self.clamp(torque) } else { JointVector::zeros() };
        (self.saturated, self.faults) = ([false; 7], 0);
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
        if let Some(rate) = &self.limits.rate {
            for i in 0..7 {
                let step = rate[i] * dt;
                torque[i] = torque[i].clamp(self.previous[i] - step, self.previous[i] + step);
            }
        }
        self.saturated = std::array::from_fn(|i| torque[i] != finite[i]);
        self.previous = torque;
        torque
    }

    /// Joints whose latest torque was cut by a limit.
    pub(crate) fn saturated(&self) -> [bool; 7] {
        self.saturated
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

    fn limits(rate: Option<f64>) -> TorqueLimits {
        TorqueLimits {
            max: JointVector::from([80.0, 80.0, 80.0, 80.0, 80.0, 12.0, 12.0]),
            rate: rate.map(JointVector::repeat),
        }
    }

    #[test]
    fn within_the_limits_nothing_changes() {
        let mut exit = TorqueExit::new(limits(None));
        let tau = JointVector::from([1.0, -80.0, 3.0, 0.0, 79.0, 12.0, -11.0]);
        assert_eq!(exit.pass(&tau, &tau, 0.002), tau);
        assert_eq!(exit.saturated(), [false; 7]);
    }

    #[test]
    fn clipped_joints_are_named() {
        let mut exit = TorqueExit::new(limits(None));
        let tau = exit.pass(&JointVector::repeat(13.0), &JointVector::zeros(), 0.002);
        assert_eq!((tau[4], tau[5]), (13.0, 12.0));
        assert_eq!(exit.saturated(), [false, false, false, false, false, true, true]);
    }

    #[test]
    fn a_step_becomes_a_ramp() {
        let mut exit = TorqueExit::new(limits(Some(1000.0)));
        exit.reset(&JointVector::repeat(2.0));
        assert_eq!(exit.pass(&JointVector::repeat(10.0), &JointVector::zeros(), 0.001)[0], 3.0);
        assert_eq!(exit.pass(&JointVector::repeat(10.0), &JointVector::zeros(), 0.001)[0], 4.0);
        assert_eq!(exit.saturated(), [true; 7]);
    }

    #[test]
    fn faults_fall_back_and_are_counted() {
        let mut exit = TorqueExit::new(limits(None));
        let mut broken = JointVector::zeros();
        broken[3] = f64::NAN;
        assert_eq!(exit.pass(&broken, &JointVector::repeat(5.0), 0.002), JointVector::repeat(5.0));
        assert_eq!(exit.pass(&broken, &broken, 0.002), JointVector::zeros());
        assert_eq!(exit.faults(), 2);
    }

    proptest! {
        #[test]
        fn limits_and_rates_are_never_broken(torques in prop::collection::vec(prop::array::uniform7(-1e4..1e4f64), 1..40)) {
            let mut exit = TorqueExit::new(limits(Some(1000.0)));
            let mut previous = JointVector::zeros();
            for wanted in torques {
                let tau = exit.pass(&JointVector::from(wanted), &JointVector::zeros(), 0.001);
                for i in 0..7 {
                    prop_assert!(tau[i].abs() <= exit.limits.max[i]);
                    prop_assert!((tau[i] - previous[i]).abs() <= 1.0 + 1e-9);
                }
                previous = tau;
            }
        }
    }
}
