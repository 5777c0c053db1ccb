//! From the pose delta of an action to the next goal.

use nalgebra::{Translation3, UnitQuaternion};
use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, within};
use crate::spatial::{Pose, Vector3, Vector6, limit_norm, linear, rotation_vector, rotational};

/// What the pose delta of an action is added to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum GoalRule {
    /// To the measured pose, at each action. The goal is then never further away than one delta, and the tracking error at the end of the
    /// ramp follows the size of the actions.
    Rebased,
    /// As `rebased`, but a rotation delta of exactly zero keeps the last goal's orientation, as robosuite does.
    Robosuite,
    /// To the previous goal, kept on a leash to the measured pose, both before and after the delta is added.
    Continued {
        /// Longest distance from the measured position to the goal (m).
        leash_position: f64,
        /// Largest angle from the measured orientation to the goal (rad).
        leash_rotation: f64,
    },
    /// To the pose at the start of the episode: an action says where to be, not how far to go. The goal is kept on a leash to
    /// the measured pose.
    Absolute {
        /// Displacement from the start that an action entry of 1 asks for (m).
        reach_position: f64,
        /// Rotation from the start that an action entry of 1 asks for (rad).
        reach_rotation: f64,
        /// As in `continued`.
        leash_position: f64,
        /// As in `continued`.
        leash_rotation: f64,
    },
}

impl GoalRule {
    /// The pose to which an action adds its delta, where the episode began at `start`, the last goal is `previous` and the
    /// tool is at `measured`.
    #[must_use]
    pub fn origin(&self, start: &Pose, previous: &Pose, measured: &Pose) -> Pose {
        match *self {
            Self::Rebased | Self::Robosuite => *measured,
            Self::Continued { leash_position, leash_rotation } => {
                leashed(previous, measured, leash_position, leash_rotation)
            }
            Self::Absolute { .. } => *start,
        }
    }

    /// The goal of an action: `delta` is `[position (m); rotation vector (rad)]` in world axes, so that the rotation
    /// multiplies from the left. The other poses are those of [`origin`](Self::origin).
    #[must_use]
    pub fn next_goal(&self, start: &Pose, previous: &Pose, measured: &Pose, delta: &Vector6) -> Pose {
        let goal = displaced(&self.origin(start, previous, measured), delta);
        match *self {
            Self::Rebased => goal,
            Self::Robosuite => {
                let keep = rotational(delta) == Vector3::zeros();
                Pose::from_parts(goal.translation, if keep { previous.rotation } else { goal.rotation })
            }
            Self::Continued { leash_position, leash_rotation }
            | Self::Absolute { leash_position, leash_rotation, .. } => {
                leashed(&goal, measured, leash_position, leash_rotation)
            }
        }
    }

    /// How far an action entry of 1 moves the goal along or about `axis` (m, rad); `None` where the controller's
    /// configuration says it.
    pub(crate) fn reach(&self, axis: usize) -> Option<f64> {
        match *self {
            Self::Absolute { reach_position, reach_rotation, .. } => {
                Some(if axis < 3 { reach_position } else { reach_rotation })
            }
            _ => None,
        }
    }

    /// How far along or about `axis` the goal may stay from the measured pose (m, rad), if an action entry of 1 moves it by
    /// `step`; `None` where nothing bounds it.
    #[must_use]
    pub fn furthest(&self, axis: usize, step: f64) -> Option<f64> {
        match *self {
            Self::Rebased => Some(step),
            // Actions that do not turn keep the goal's orientation, which may then be far from the measured one.
            Self::Robosuite => (axis < 3).then_some(step),
            Self::Continued { leash_position, leash_rotation }
            | Self::Absolute { leash_position, leash_rotation, .. } => {
                Some(if axis < 3 { leash_position } else { leash_rotation })
            }
        }
    }

    /// How far the goal may be from the measured position (m); `None` where no leash holds it.
    #[must_use]
    pub fn leash(&self) -> Option<f64> {
        match *self {
            Self::Continued { leash_position, .. } | Self::Absolute { leash_position, .. } => Some(leash_position),
            _ => None,
        }
    }

    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        if let Self::Absolute { reach_position, reach_rotation, .. } = *self {
            within("goal.absolute.reach_position", reach_position, 1e-3..=1.0)?;
            // Three entries of 1 turn by sqrt(3) times the reach: less than half a turn.
            within("goal.absolute.reach_rotation", reach_rotation, 1e-3..=1.8)?;
        }
        let (Self::Continued { leash_position, leash_rotation }
        | Self::Absolute { leash_position, leash_rotation, .. }) = *self
        else {
            return Ok(());
        };
        let kind = if self.reach(0).is_some() { "absolute" } else { "continued" };
        within(&format!("goal.{kind}.leash_position"), leash_position, 1e-4..=1.0)?;
        within(&format!("goal.{kind}.leash_rotation"), leash_rotation, 1e-3..=std::f64::consts::FRAC_PI_2)
    }
}

/// `pose` moved by `delta` in world axes.
fn displaced(pose: &Pose, delta: &Vector6) -> Pose {
    let position = pose.translation.vector + linear(delta);
    let mut rotation = UnitQuaternion::from_scaled_axis(rotational(delta)) * pose.rotation;
    rotation.renormalize(); // A continued goal is a long product.
    Pose::from_parts(Translation3::from(position), rotation)
}

/// The pose nearest to `goal` whose distance and angle to `measured` do not exceed the leash.
fn leashed(goal: &Pose, measured: &Pose, leash_position: f64, leash_rotation: f64) -> Pose {
    let offset = limit_norm(goal.translation.vector - measured.translation.vector, leash_position);
    let turn = limit_norm(rotation_vector(&(goal.rotation * measured.rotation.inverse())), leash_rotation);
    Pose::from_parts(
        Translation3::from(measured.translation.vector + offset),
        UnitQuaternion::from_scaled_axis(turn) * measured.rotation,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spatial::pose_error;
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    const LEASH: GoalRule = GoalRule::Continued { leash_position: 0.02, leash_rotation: 0.15 };

    #[test]
    fn rebased_goal_is_the_delta_away_in_world_axes() {
        let measured = Pose::new(Vector3::new(0.5, 0.0, 0.3), Vector3::new(1.0, 0.4, 0.0));
        let delta = Vector6::new(0.01, -0.02, 0.03, 0.1, 0.2, -0.3);
        let goal = GoalRule::Rebased.next_goal(&measured, &Pose::identity(), &measured, &delta);
        assert_relative_eq!(pose_error(&goal, &measured), delta, epsilon = 1e-12);
    }

    #[test]
    fn continued_goal_keeps_the_offset_it_had() {
        let measured = Pose::identity();
        let step = Vector6::new(0.005, 0.0, 0.0, 0.0, 0.0, 0.05);
        let first = LEASH.next_goal(&measured, &measured, &measured, &step);
        let second = LEASH.next_goal(&measured, &first, &measured, &step);
        assert_relative_eq!(pose_error(&second, &measured), 2.0 * step, epsilon = 1e-12);
        // A zero action leaves the goal where it is: no creep under load.
        assert_relative_eq!(
            pose_error(&LEASH.next_goal(&measured, &second, &measured, &Vector6::zeros()), &second).norm(),
            0.0,
            epsilon = 1e-12
        );
        // A tool that is pushed away takes the goal along on the leash, and the next delta is added to that goal.
        let pushed = Pose::translation(-1.0, 0.0, 0.0);
        let origin = LEASH.origin(&measured, &second, &pushed);
        let next = LEASH.next_goal(&measured, &second, &pushed, &-step);
        assert_relative_eq!(pose_error(&next, &origin), -step, epsilon = 1e-12);
    }

    #[test]
    fn robosuites_rule_keeps_the_orientation_of_an_action_that_does_not_turn() {
        let measured = Pose::new(Vector3::new(0.5, 0.0, 0.3), Vector3::new(1.0, 0.4, 0.0));
        let previous = Pose::new(Vector3::new(0.4, 0.1, 0.2), Vector3::new(0.9, 0.5, 0.1));
        let next = |delta: &Vector6| GoalRule::Robosuite.next_goal(&measured, &previous, &measured, delta);
        let straight = next(&Vector6::new(0.01, 0.0, 0.0, 0.0, 0.0, 0.0));
        assert_eq!(straight.rotation, previous.rotation);
        assert_relative_eq!(straight.translation.x, 0.51, epsilon = 1e-12);
        assert!(
            GoalRule::Robosuite.furthest(5, 0.1).is_none(),
            "{} rad away",
            rotational(&pose_error(&straight, &measured)).norm()
        );
        let turn = Vector6::new(0.0, 0.0, 0.0, 0.0, 1e-9, 0.0);
        assert_eq!(next(&turn), GoalRule::Rebased.next_goal(&measured, &previous, &measured, &turn));
    }

    #[test]
    fn an_absolute_goal_counts_from_the_start_and_stays_on_its_leash() {
        let rule =
            GoalRule::Absolute { reach_position: 0.3, reach_rotation: 1.0, leash_position: 0.05, leash_rotation: 0.2 };
        let start = Pose::new(Vector3::new(0.5, 0.0, 0.3), Vector3::new(1.0, 0.4, 0.0));
        let near = Vector6::new(0.02, 0.0, 0.0, 0.0, 0.1, 0.0);
        let goal = rule.next_goal(&start, &Pose::identity(), &start, &near);
        assert_relative_eq!(pose_error(&goal, &start), near, epsilon = 1e-12);
        assert_relative_eq!(
            pose_error(&rule.next_goal(&start, &goal, &goal, &near), &goal).norm(),
            0.0,
            epsilon = 1e-9
        );
        let far = rule.next_goal(&start, &goal, &start, &Vector6::new(0.3, 0.0, 0.0, 0.0, 0.0, 0.9));
        let e = pose_error(&far, &start);
        assert_relative_eq!(linear(&e).norm(), 0.05, epsilon = 1e-9);
        assert_relative_eq!(rotational(&e).norm(), 0.2, epsilon = 1e-9);
    }

    proptest! {
        #[test]
        fn the_leash_is_never_exceeded(
            previous in prop::array::uniform6(-3.0..3.0f64),
            measured in prop::array::uniform6(-3.0..3.0f64),
            delta in prop::array::uniform6(-0.5..0.5f64),
        ) {
            let pose = |v: [f64; 6]| Pose::new(Vector3::new(v[0], v[1], v[2]), Vector3::new(v[3], v[4], v[5]));
            let (previous, measured) = (pose(previous), pose(measured));
            let e = pose_error(&LEASH.next_goal(&measured, &previous, &measured, &Vector6::from(delta)), &measured);
            prop_assert!(linear(&e).norm() <= 0.02 + 1e-9);
            prop_assert!(rotational(&e).norm() <= 0.15 + 1e-9);
        }
    }
}
