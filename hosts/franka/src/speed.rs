//! Speed limits of the joints at their present angles: an FR3's limits shrink towards the ends of a joint's range.

use aforce::host::Fault;

/// Allowed speed of a joint: this share of the robot's limit at the joint's angle, but at least this speed (rad/s). The limit goes to 0
/// at the end of the range, where the measured speed of a resting joint is still not quite 0.
const SHARE: f64 = 0.95;
const REST: f64 = 0.02;

/// A fault for the first joint that comes close to the speed at which the robot stops by itself. `lower` and `upper` are the robot's limits
/// at the present joint angles; all values in rad/s.
pub fn too_fast(speeds: &[f64; 7], lower: &[f64; 7], upper: &[f64; 7]) -> Option<Fault> {
    (0..7).find_map(|i| {
        let limit = if speeds[i] < 0.0 { -lower[i] } else { upper[i] };
        let (speed, max) = (speeds[i].abs(), (SHARE * limit).max(REST));
        // NaN counts as too fast.
        let is_within = speed <= max;
        (!is_within).then_some(Fault::JointSpeed { joint: i + 1, speed, max })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn towards_the_end_of_its_range_a_joint_must_be_slower() {
        let at = |angle: f64, speed: f64| {
            let (mut q, mut speeds) = ([0.0, 0.0, 0.0, -1.5, 0.0, 2.0, 0.0], [0.0; 7]);
            (q[0], speeds[0]) = (angle, speed);
            let upper = franka::compute_upper_limits_joint_velocity(&q);
            let lower = franka::compute_lower_limits_joint_velocity(&q);
            too_fast(&speeds, &lower, &upper)
        };
        assert_eq!(at(0.0, 2.2), None);
        assert_eq!(at(2.6, -2.2), None, "away from the end");
        assert_eq!(at(2.74, 0.01), None, "at rest, at the end");
        // Franka's curve for the first joint: sqrt(12 (2.7501 - 2.6)) - 0.3 = 1.04 rad/s.
        let Some(Fault::JointSpeed { joint: 1, speed: 2.2, max }) = at(2.6, 2.2) else { panic!() };
        assert!((max - 0.95 * 1.04).abs() < 0.02, "{max}");
        assert!(at(-2.6, -2.2).is_some() && at(0.0, 2.6).is_some() && at(0.0, f64::NAN).is_some());
    }

    #[test]
    fn every_limit_is_kept_with_room_however_low_it_is() {
        for limit in [0.03, 0.1, 0.39, 1.0, 2.62] {
            let at = |share: f64, sign: f64| too_fast(&[sign * share * limit; 7], &[-limit; 7], &[limit; 7]);
            for sign in [-1.0, 1.0] {
                assert_eq!(at(0.949, sign), None, "of {limit} rad/s");
                assert!(at(0.951, sign).is_some(), "of {limit} rad/s");
            }
        }
        let at_the_end = |speed: f64| too_fast(&[speed; 7], &[0.0; 7], &[0.0; 7]);
        assert!(at_the_end(0.019).is_none() && at_the_end(-0.019).is_none() && at_the_end(0.021).is_some());
    }
}
