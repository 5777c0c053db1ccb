//! How fast a joint may be where it is: an FR3's limits shrink towards the ends of its range.

use std::fmt::{self, Display, Formatter};

/// Of the robot's limits the law uses so much; a joint slower than the other (rad/s) rests.
const SHARE: f64 = 0.95;
const REST: f64 = 0.02;

/// A joint near the speed at which the robot would stop by itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TooFast {
    /// From 1.
    joint: usize,
    /// rad, rad/s.
    q: f64,
    speed: f64,
    /// rad/s.
    allowed: [f64; 2],
}

/// The first that is, between the robot's own limits at these angles.
pub fn too_fast(q: &[f64; 7], speeds: &[f64; 7], lower: &[f64; 7], upper: &[f64; 7]) -> Option<TooFast> {
    (0..7).find_map(|i| {
        let allowed = [SHARE * lower[i] - REST, SHARE * upper[i] + REST];
        let is_within = (allowed[0]..=allowed[1]).contains(&speeds[i]);
        (!is_within).then_some(TooFast { joint: i + 1, q: q[i], speed: speeds[i], allowed })
    })
}

impl Display for TooFast {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { joint, q, speed, allowed: [low, high] } = self;
        write!(f, "joint {joint} moves at {speed:.3} rad/s; at {q:.3} rad the robot allows {low:.3} to {high:.3}")
    }
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
            too_fast(&q, &speeds, &lower, &upper)
        };
        assert_eq!(at(0.0, 2.2), None);
        assert_eq!(at(2.6, -2.2), None, "away from the end");
        assert_eq!(at(2.74, 0.01), None, "at rest, at the end");
        // Franka's curve for the first joint: sqrt(12 (2.7501 - 2.6)) - 0.3 = 1.04 rad/s.
        let told = at(2.6, 2.2).unwrap().to_string();
        assert!(told.starts_with("joint 1 moves at 2.200 rad/s; at 2.600 rad the robot allows -"), "{told}");
        let [_, high] = at(2.6, 2.2).unwrap().allowed;
        assert!((high - (0.95 * 1.04 + 0.02)).abs() < 0.02, "{high}");
        assert!(at(0.0, 2.6).is_some());
        assert!(at(0.0, f64::NAN).is_some());
    }
}
