//! A time-optimal, jerk-limited path, re-anchored at each goal.

use nalgebra::{Translation3, UnitQuaternion};
use rsruckig::prelude::{InputParameter, Ruckig, ThrowErrorHandler, Trajectory};

use crate::arm::CartesianLimits;
use crate::spatial::{Pose, Twist, Vector3, Vector6, linear, pose_error, rotational, stack};

/// Travels along position and rotation vector relative to the anchor, the pose where the present move began.
///
/// The limits hold for the length of the three-vectors, so each axis gets 1/sqrt(3) of them. Those of rotation hold for the
/// rotation vector: while it is long, angular velocity may exceed them by a tenth, acceleration and jerk by a third.
#[derive(Clone)]
pub(crate) struct JerkLimited {
    generator: Ruckig<6, ThrowErrorHandler>,
    input: InputParameter<6>,
    trajectory: Trajectory<6>,
    anchor: Pose,
    /// Time since the anchor (s).
    time: f64,
    /// Position relative to the anchor (m) and rotation vector from the anchor (rad), world axes; and their rates.
    travel: Vector6,
    rate: Vector6,
    acceleration: Vector6,
    /// False while the set-point rests.
    moving: bool,
}

impl JerkLimited {
    /// `dynamics` is the share of the limits to use.
    pub(crate) fn new(dynamics: f64, limits: &CartesianLimits, dt: f64) -> Self {
        let mut input = InputParameter::new(None);
        for axis in 0..6 {
            let of_axis = if axis < 3 { limits.translation } else { limits.rotation };
            let [velocity, acceleration, jerk] = of_axis.map(|limit| dynamics * limit);
            input.max_velocity[axis] = velocity / 3f64.sqrt();
            input.max_acceleration[axis] = acceleration / 3f64.sqrt();
            input.max_jerk[axis] = jerk / 3f64.sqrt();
        }
        Self {
            generator: Ruckig::new(None, dt),
            input,
            trajectory: Trajectory::new(None),
            anchor: Pose::identity(),
            time: 0.0,
            travel: Vector6::zeros(),
            rate: Vector6::zeros(),
            acceleration: Vector6::zeros(),
            moving: false,
        }
    }

    pub(crate) fn reset(&mut self, pose: &Pose) {
        self.anchor = *pose;
        self.travel = Vector6::zeros();
        self.rate = Vector6::zeros();
        self.acceleration = Vector6::zeros();
        self.moving = false;
    }

    /// Plans from the present pose, velocity and acceleration to rest at `goal`. Returns false if planning fails (no such case is known);
    /// the set-point then stops where it is.
    pub(crate) fn set_goal(&mut self, goal: &Pose) -> bool {
        // At the anchor the rotation vector is zero: there its rates are the angular velocity and acceleration.
        let (omega, omega_dot) =
            angular_rates(&rotational(&self.travel), &rotational(&self.rate), &rotational(&self.acceleration));
        let rate = stack(&linear(&self.rate), &omega);
        let acceleration = stack(&linear(&self.acceleration), &omega_dot);
        let anchor = self.pose();
        let target = pose_error(goal, &anchor);
        for axis in 0..6 {
            self.input.current_position[axis] = 0.0;
            self.input.current_velocity[axis] = rate[axis];
            self.input.current_acceleration[axis] = acceleration[axis];
            self.input.target_position[axis] = target[axis];
        }
        let planned = self.generator.calculate(&self.input, &mut self.trajectory).is_ok();
        (self.anchor, self.travel, self.rate, self.acceleration) = (anchor, Vector6::zeros(), rate, acceleration);
        if !planned {
            // After a failed plan the trajectory is invalid, so the set-point stops.
            (self.rate, self.acceleration) = (Vector6::zeros(), Vector6::zeros());
        }
        (self.time, self.moving) = (0.0, planned);
        planned
    }

    /// The set-point `dt` seconds later and its velocity (m/s, rad/s).
    pub(crate) fn step(&mut self, dt: f64) -> (Pose, Twist) {
        if self.moving {
            self.time = (self.time + dt).min(self.trajectory.get_duration());
            self.sample();
            self.moving = self.time < self.trajectory.get_duration();
            if !self.moving {
                (self.rate, self.acceleration) = (Vector6::zeros(), Vector6::zeros());
            }
        }
        let (omega, _) = angular_rates(&rotational(&self.travel), &rotational(&self.rate), &Vector3::zeros());
        (self.pose(), stack(&linear(&self.rate), &omega))
    }

    fn sample(&mut self) {
        let (mut position, mut velocity, mut acceleration) = (zeros(), zeros(), zeros());
        self.trajectory.at_time(
            self.time,
            &mut Some(&mut position),
            &mut Some(&mut velocity),
            &mut Some(&mut acceleration),
            &mut None,
            &mut None,
        );
        self.travel = Vector6::from_column_slice(&position);
        self.rate = Vector6::from_column_slice(&velocity);
        self.acceleration = Vector6::from_column_slice(&acceleration);
    }

    fn pose(&self) -> Pose {
        let position = self.anchor.translation.vector + linear(&self.travel);
        let mut rotation = UnitQuaternion::from_scaled_axis(rotational(&self.travel)) * self.anchor.rotation;
        rotation.renormalize(); // The anchor is itself the end of an earlier product.
        Pose::from_parts(Translation3::from(position), rotation)
    }
}

impl std::fmt::Debug for JerkLimited {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("JerkLimited").field("anchor", &self.anchor).field("time", &self.time).finish_non_exhaustive()
    }
}

fn zeros() -> rsruckig::prelude::DataArrayOrVec<f64, 6> {
    rsruckig::prelude::DataArrayOrVec::Stack([0.0; 6])
}

/// Angular velocity and acceleration (rad/s, rad/s^2, world axes) of R(t) = exp(phi(t)) R_0.
///
/// omega = phi' + a phi x phi' + b phi x (phi x phi') with a = (1 - cos t)/t^2, b = (t - sin t)/t^3, t = |phi|
/// (left Jacobian of the rotation group), and its time derivative.
fn angular_rates(phi: &Vector3, rate: &Vector3, acceleration: &Vector3) -> (Vector3, Vector3) {
    let t = phi.norm();
    let t2 = t * t;
    // a, b and (da/dt)/t, (db/dt)/t; below the threshold by their series, exact to rounding there.
    let (a, b, da, db) = if t < 0.05 {
        (
            0.5 - t2 / 24.0 + t2 * t2 / 720.0,
            1.0 / 6.0 - t2 / 120.0 + t2 * t2 / 5040.0,
            -1.0 / 12.0 + t2 / 180.0 - t2 * t2 / 6720.0,
            -1.0 / 60.0 + t2 / 1260.0 - t2 * t2 / 60_480.0,
        )
    } else {
        let (sin, cos) = libm::sincos(t);
        (
            (1.0 - cos) / t2,
            (t - sin) / (t2 * t),
            (t * sin - 2.0 * (1.0 - cos)) / (t2 * t2),
            (3.0 * sin - 2.0 * t - t * cos) / (t2 * t2 * t),
        )
    };
    let turning = phi.dot(rate); // t dt/dtime, t being the angle |phi|
    let cross = phi.cross(rate);
    let double = phi.cross(&cross);
    let omega = rate + a * cross + b * double;
    let omega_dot = acceleration
        + a * phi.cross(acceleration)
        + da * turning * cross
        + b * (rate.cross(&cross) + phi.cross(&phi.cross(acceleration)))
        + db * turning * double;
    (omega, omega_dot)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::Arm;
    use approx::assert_relative_eq;

    const DT: f64 = 0.001;

    #[test]
    fn angular_rates_match_finite_differences() {
        // phi(t) a cubic; R(t + h) R(t - h)^T is exp(2 h omega) to second order.
        for size in [1e-3, 0.02, 0.049, 0.051, 0.5, 2.0] {
            let c = [Vector3::new(0.6, -0.3, 0.2), Vector3::new(-1.0, 0.5, 2.0), Vector3::new(3.0, 1.0, -2.0)];
            let phi = |t: f64| size * c[0] + c[1] * t + c[2] * t * t;
            let rate = |t: f64| c[1] + 2.0 * c[2] * t;
            let h = 1e-4;
            let turn = |t: f64| UnitQuaternion::from_scaled_axis(phi(t));
            let numeric = crate::spatial::rotation_vector(&(turn(h) * turn(-h).inverse())) / (2.0 * h);
            let (omega, omega_dot) = angular_rates(&phi(0.0), &rate(0.0), &(2.0 * c[2]));
            assert_relative_eq!(omega, numeric, epsilon = 1e-6);
            let later = angular_rates(&phi(h), &rate(h), &(2.0 * c[2])).0;
            let earlier = angular_rates(&phi(-h), &rate(-h), &(2.0 * c[2])).0;
            assert_relative_eq!(omega_dot, (later - earlier) / (2.0 * h), epsilon = 1e-5);
        }
    }

    #[test]
    fn velocity_and_acceleration_are_continuous_across_goals_and_jerk_is_limited() {
        for dynamics in [1.0, 0.2] {
            stays_within_limits(dynamics);
        }
    }

    fn stays_within_limits(dynamics: f64) {
        let mut path = JerkLimited::new(dynamics, &Arm::PANDA.cartesian, DT);
        let home = Pose::new(Vector3::new(0.5, 0.0, 0.3), Vector3::new(3.1, 0.0, 0.0));
        path.reset(&home);
        let mut state: u64 = 7;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
        };
        let (mut pose, mut twist) = path.step(DT);
        let mut last_acceleration = Vector6::zeros();
        for _ in 0..200 {
            let offset = Vector3::new(random(), random(), random()) * 0.05;
            let turn = UnitQuaternion::from_scaled_axis(Vector3::new(random(), random(), random()) * 0.5);
            path.set_goal(&Pose::from_parts(
                Translation3::from(home.translation.vector + offset),
                turn * home.rotation,
            ));
            for _ in 0..50 {
                let (next_pose, next_twist) = path.step(DT);
                // The twist is the derivative of the pose (trapezium, error jerk dt^2/12), with no step at a new goal.
                let moved = pose_error(&next_pose, &pose) / DT;
                assert!((moved - (next_twist + twist) / 2.0).amax() < 2e-3);
                let acceleration = (next_twist - twist) / DT;
                assert!(linear(&acceleration).norm() < 13.0 * 1.001 * dynamics);
                // Each axis of the rotation vector keeps its limit; the angular velocity may exceed by curvature.
                assert!(rotational(&acceleration).norm() < 25.0 * 1.3 * dynamics);
                assert!(linear(&next_twist).norm() <= 1.7 * dynamics + 1e-9);
                assert!(rotational(&next_twist).norm() <= 2.5 * 1.1 * dynamics);
                // A new goal that forgot the present acceleration would step by up to 13 m/s^2, twice what jerk allows.
                let jerk = (acceleration - last_acceleration) / DT;
                assert!(linear(&jerk).norm() < 6500.0 * 1.001 * dynamics, "{}", linear(&jerk).norm());
                assert!(rotational(&jerk).norm() < 12_500.0 * 1.3 * dynamics, "{}", rotational(&jerk).norm());
                (pose, twist, last_acceleration) = (next_pose, next_twist, acceleration);
            }
        }
    }

    #[test]
    fn the_goal_is_reached_and_held() {
        let mut path = JerkLimited::new(1.0, &Arm::PANDA.cartesian, DT);
        path.reset(&Pose::identity());
        let goal = Pose::new(Vector3::new(0.03, -0.01, 0.02), Vector3::new(0.1, 0.4, -0.2));
        path.set_goal(&goal);
        let mut last = path.step(DT);
        for _ in 0..1000 {
            last = path.step(DT);
        }
        assert_relative_eq!(pose_error(&last.0, &goal).norm(), 0.0, epsilon = 1e-9);
        assert_eq!(last.1, Twist::zeros());
    }
}
