//! A straight ramp from one set-point to the next goal.

use nalgebra::{Translation3, UnitQuaternion};

use crate::spatial::{Pose, Twist, Vector3, Vector6, pose_error, rotational};

/// Moves the set-point in equal increments, then holds it.
///
/// robosuite's linear interpolator adds a growing fraction of a start that never moves; this one is a true ramp.
#[derive(Debug, Clone)]
pub(crate) struct LinearRamp {
    /// Samples that the ramp takes.
    samples: f64,
    /// Samples taken of the present ramp; whole ones unless a sample's time differs from `dt`.
    taken: f64,
    /// Time of a sample (s).
    dt: f64,
    /// Duration of the ramp (s).
    duration: f64,
    start: Pose,
    /// `[position; rotation vector]` from start to goal, world axes (m, rad).
    travel: Vector6,
}

impl LinearRamp {
    pub(crate) fn new(samples: u32, dt: f64) -> Self {
        let samples = f64::from(samples);
        Self { samples, taken: samples, dt, duration: samples * dt, start: Pose::identity(), travel: Vector6::zeros() }
    }

    pub(crate) fn reset(&mut self, pose: &Pose) {
        self.start = *pose;
        self.travel = Vector6::zeros();
        self.taken = self.samples;
    }

    pub(crate) fn set_goal(&mut self, goal: &Pose) {
        self.start = self.pose();
        self.travel = pose_error(goal, &self.start);
        self.taken = 0.0;
    }

    /// The set-point `dt` seconds later and its velocity over that time (m/s, rad/s).
    pub(crate) fn step(&mut self, dt: f64) -> (Pose, Twist) {
        if self.taken >= self.samples {
            return (self.pose(), Twist::zeros());
        }
        let step = dt / self.dt;
        let left = self.samples - self.taken;
        let mut velocity = self.travel / self.duration;
        if step > left {
            // A sample that is longer than what is left of the ramp travels only that.
            velocity *= left / step;
        }
        self.taken = (self.taken + step).min(self.samples);
        (self.pose(), velocity)
    }

    fn pose(&self) -> Pose {
        let travelled = self.travel * (self.taken / self.samples);
        let position: Vector3 = self.start.translation.vector + travelled.fixed_rows::<3>(0);
        let turn = UnitQuaternion::from_scaled_axis(rotational(&travelled));
        let mut rotation = turn * self.start.rotation;
        rotation.renormalize(); // The start is itself the end of an earlier product.
        Pose::from_parts(Translation3::from(position), rotation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocities_add_up_to_the_travel_whatever_the_samples_take() {
        let dt = 0.002;
        let mut ramp = LinearRamp::new(10, dt);
        let goal = Pose::from_parts(Translation3::new(0.03, 0.0, -0.01), UnitQuaternion::identity());
        ramp.reset(&Pose::identity());
        ramp.set_goal(&goal);
        let mut travelled = Vector6::zeros();
        for share in [1.0, 0.7, 1.4, 1.0].into_iter().cycle().take(20) {
            let (_, velocity) = ramp.step(share * dt);
            travelled += velocity * (share * dt);
        }
        assert!((travelled - pose_error(&goal, &Pose::identity())).norm() < 1e-12, "{travelled}");
    }
}
