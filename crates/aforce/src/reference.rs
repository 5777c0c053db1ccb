//! Where the next goal is counted from.

use nalgebra::{Translation3, UnitQuaternion};
use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, within};
use crate::spatial::{Pose, Vector6, limit_norm, linear, rotation_vector, rotational};

/// What the pose delta of an action is added to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Reference {
    /// To the measured pose, each action anew (robosuite's habit). The goal is then never further away than one delta, and
    /// the tracking error at the end of the ramp follows the size of the actions.
    ///
    /// Unlike robosuite, a rotation delta of exactly zero is no exception: it re-bases like any other. (The braces make serde
    /// refuse the keys of the other kind.)
    Rebased {},
    /// To the previous goal, kept on a leash to the measured pose before and after the delta is added.
    Continued {
        /// Longest distance from the measured position to the goal (m).
        leash_position: f64,
        /// Largest angle from the measured orientation to the goal (rad).
        leash_rotation: f64,
    },
}

impl Reference {
    /// The goal of an action: `delta` is `[position (m); rotation vector (rad)]` in world axes, so that the rotation
    /// multiplies from the left.
    #[must_use]
    pub fn next_goal(&self, previous: &Pose, measured: &Pose, delta: &Vector6) -> Pose {
        match *self {
            Self::Rebased {} => displaced(measured, delta),
            Self::Continued { leash_position, leash_rotation } => {
                let leash = |goal: &Pose| leashed(goal, measured, leash_position, leash_rotation);
                leash(&displaced(&leash(previous), delta))
            }
        }
    }

    pub(crate) fn validate(&self, form: &str) -> Result<(), ConfigError> {
        if let Self::Continued { leash_position, leash_rotation } = *self {
            within(&format!("{form}.reference.leash_position"), leash_position, 1e-4..=1.0)?;
            within(&format!("{form}.reference.leash_rotation"), leash_rotation, 1e-3..=std::f64::consts::FRAC_PI_2)?;
        }
        Ok(())
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
    use crate::spatial::{Vector3, pose_error};
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    const LEASH: Reference = Reference::Continued { leash_position: 0.02, leash_rotation: 0.15 };

    #[test]
    fn rebased_goal_is_the_delta_away_in_world_axes() {
        let measured = Pose::new(Vector3::new(0.5, 0.0, 0.3), Vector3::new(1.0, 0.4, 0.0));
        let delta = Vector6::new(0.01, -0.02, 0.03, 0.1, 0.2, -0.3);
        let goal = (Reference::Rebased {}).next_goal(&Pose::identity(), &measured, &delta);
        assert_relative_eq!(pose_error(&goal, &measured), delta, epsilon = 1e-12);
    }

    #[test]
    fn continued_goal_keeps_the_offset_it_had() {
        let measured = Pose::identity();
        let step = Vector6::new(0.005, 0.0, 0.0, 0.0, 0.0, 0.05);
        let first = LEASH.next_goal(&measured, &measured, &step);
        let second = LEASH.next_goal(&first, &measured, &step);
        assert_relative_eq!(pose_error(&second, &measured), 2.0 * step, epsilon = 1e-12);
        // A zero action leaves the goal where it is: no creep under load.
        assert_relative_eq!(
            pose_error(&LEASH.next_goal(&second, &measured, &Vector6::zeros()), &second).norm(),
            0.0,
            epsilon = 1e-12
        );
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
            let e = pose_error(&LEASH.next_goal(&previous, &measured, &Vector6::from(delta)), &measured);
            prop_assert!(linear(&e).norm() <= 0.02 + 1e-9);
            prop_assert!(rotational(&e).norm() <= 0.15 + 1e-9);
        }
    }
}
