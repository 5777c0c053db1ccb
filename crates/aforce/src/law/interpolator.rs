//! From one goal per action to one set-point per control sample.

use serde::{Deserialize, Serialize};

use crate::arm::CartesianLimits;
use crate::error::{ConfigError, within};
use crate::law::jerk_limited::JerkLimited;
use crate::law::linear_ramp::LinearRamp;
use crate::spatial::{Pose, Twist};

/// How the set-point travels to a new goal.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Interpolation {
    /// A straight ramp, then hold. (In the paper's simulations it takes a fifth of the action; robosuite's default is none.)
    Linear {
        /// Share of the action's duration that the ramp takes, above 0 and at most 1. A short ramp is a fast one: 5 cm
        /// over one fifth of 50 ms is 5 m/s of reference velocity.
        ramp_ratio: f64,
    },
    /// A time-optimal, jerk-limited move (the paper's real arm).
    JerkLimited {
        /// Share of the arm's Cartesian limits of velocity, acceleration and jerk, above 0 and at most 1. Each action
        /// plans to come to rest at its goal: with all of the limits the set-point stops and goes at the policy's rate.
        dynamics: f64,
    },
}

impl Interpolation {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        let (field, share) = match *self {
            Self::Linear { ramp_ratio } => ("interpolation.linear.ramp_ratio", ramp_ratio),
            Self::JerkLimited { dynamics } => ("interpolation.jerk-limited.dynamics", dynamics),
        };
        within(field, share, f64::MIN_POSITIVE..=1.0)
    }
}

/// The running set-point x_d(t) with its velocity.
#[derive(Debug, Clone)]
pub struct Interpolator {
    path: Path,
    pose: Pose,
}

#[derive(Debug, Clone)]
enum Path {
    Linear(LinearRamp),
    /// Boxed for its size; built once, so that no control step allocates.
    JerkLimited(Box<JerkLimited>),
}

impl Interpolator {
    /// A set-point that is its goal from the first sample on.
    #[must_use]
    pub fn jump(dt: f64) -> Self {
        Self { path: Path::Linear(LinearRamp::new(1, dt)), pose: Pose::identity() }
    }

    /// `samples_per_action` control samples of `dt` seconds make one action. Jerk-limited moves keep a share of `limits`.
    #[must_use]
    pub fn new(interpolation: &Interpolation, limits: &CartesianLimits, samples_per_action: u32, dt: f64) -> Self {
        let path = match *interpolation {
            Interpolation::Linear { ramp_ratio } => {
                // 1e-6 less, because 0.28 * 25 is 7.000000000000001 in floating point and would be rounded up to 8.
                let samples = (ramp_ratio * f64::from(samples_per_action) - 1e-6).ceil().max(1.0);
                Path::Linear(LinearRamp::new(samples as u32, dt))
            }
            Interpolation::JerkLimited { dynamics } => {
                Path::JerkLimited(Box::new(JerkLimited::new(dynamics, limits, dt)))
            }
        };
        Self { path, pose: Pose::identity() }
    }

    /// Puts the set-point at `pose`, at rest.
    pub fn reset(&mut self, pose: &Pose) {
        self.pose = *pose;
        match &mut self.path {
            Path::Linear(ramp) => ramp.reset(pose),
            Path::JerkLimited(path) => path.reset(pose),
        }
    }

    /// Starts a move from the present set-point to `goal`; false if none can be planned.
    pub fn set_goal(&mut self, goal: &Pose) -> bool {
        match &mut self.path {
            Path::Linear(ramp) => {
                ramp.set_goal(goal);
                true
            }
            Path::JerkLimited(path) => path.set_goal(goal),
        }
    }

    /// The set-point x_d `dt` seconds later and its velocity (m/s, rad/s; world axes).
    pub fn step(&mut self, dt: f64) -> (Pose, Twist) {
        let (pose, twist) = match &mut self.path {
            Path::Linear(ramp) => ramp.step(dt),
            Path::JerkLimited(path) => path.step(dt),
        };
        self.pose = pose;
        (pose, twist)
    }

    /// The set-point of the latest sample.
    #[must_use]
    pub fn pose(&self) -> &Pose {
        &self.pose
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::Arm;
    use crate::spatial::{Vector3, Vector6, pose_error};
    use approx::assert_relative_eq;

    const DT: f64 = 0.002;

    fn start() -> Pose {
        Pose::new(Vector3::new(0.5, 0.1, 0.3), Vector3::new(3.0, 0.2, 0.1))
    }

    fn goal() -> Pose {
        Pose::new(Vector3::new(0.54, 0.07, 0.31), Vector3::new(2.8, 0.5, 0.1))
    }

    #[test]
    fn the_ramp_has_equal_increments_and_then_holds() {
        for (ramp_ratio, samples) in [(1.0, 25), (0.2, 5), (0.28, 7), (0.5, 13)] {
            let mut path = Interpolator::new(&Interpolation::Linear { ramp_ratio }, &Arm::PANDA.cartesian, 25, DT);
            path.reset(&start());
            path.set_goal(&goal());
            let increment = pose_error(&goal(), &start()) / f64::from(samples);
            let mut previous = start();
            for sample in 1..=25 {
                let (pose, twist) = path.step(DT);
                let moved = pose_error(&pose, &previous);
                let expected = if sample <= samples { increment } else { Vector6::zeros() };
                assert_relative_eq!(moved, expected, epsilon = 1e-12);
                assert_relative_eq!(twist * DT, expected, epsilon = 1e-12);
                previous = pose;
            }
            assert_relative_eq!(pose_error(&previous, &goal()).norm(), 0.0, epsilon = 1e-12);
        }
    }

    #[test]
    fn a_new_goal_starts_from_the_set_point_not_from_the_old_goal() {
        let mut path = Interpolator::new(&Interpolation::Linear { ramp_ratio: 1.0 }, &Arm::PANDA.cartesian, 25, DT);
        path.reset(&start());
        path.set_goal(&goal());
        for _ in 0..10 {
            path.step(DT);
        }
        let halfway = *path.pose();
        path.set_goal(&start());
        let (next, _) = path.step(DT);
        let back = pose_error(&start(), &halfway) / 25.0;
        assert_relative_eq!(pose_error(&next, &halfway), back, epsilon = 1e-12);
    }

    #[test]
    fn after_reset_the_set_point_rests_at_the_measured_pose() {
        for kind in [Interpolation::Linear { ramp_ratio: 0.2 }, Interpolation::JerkLimited { dynamics: 1.0 }] {
            let mut path = Interpolator::new(&kind, &Arm::PANDA.cartesian, 25, DT);
            path.reset(&start());
            path.set_goal(&goal());
            path.step(DT);
            path.reset(&start());
            let (pose, twist) = path.step(DT);
            assert_relative_eq!(pose_error(&pose, &start()).norm(), 0.0, epsilon = 1e-12);
            assert_eq!(twist, Twist::zeros());
        }
    }
}
