//! From the entries of an action to physical quantities, and back.

use crate::action_space::{ActionSpace, Impedance};
use crate::config::ControllerConfig;
use crate::spatial::Vector6;

/// What an action asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Command {
    /// Stiffness, in the units of the `variable` setting's convention.
    pub(crate) stiffness: Option<Vector6>,
    /// Position (m) and rotation vector (rad) to add to the reference, world axes.
    pub(crate) delta: Vector6,
    /// Normal force (N).
    pub(crate) force: Option<f64>,
}

/// Decodes an action; entries are clipped to [-1, 1], and one that is not a number counts as 0.
///
/// # Panics
/// If the action has not the length of its space.
pub(crate) fn decode(space: ActionSpace, config: &ControllerConfig, action: &[f64]) -> Command {
    assert_eq!(action.len(), space.dim(), "length of an action of `{space}`");
    let mut entries = action.iter().map(|&a| if a.is_nan() { 0.0 } else { a.clamp(-1.0, 1.0) });
    let mut next = || entries.next().expect("the length was checked");
    let between = |a: f64, [low, high]: [f64; 2]| low + 0.5 * (a + 1.0) * (high - low);

    let stiffness = (space.impedance == Impedance::Commanded)
        .then(|| Vector6::from_fn(|axis, _| between(next(), config.impedance.variable.range(axis))));
    let delta = Vector6::from_fn(|axis, _| next() * config.step(axis));
    let force = space.force.then(|| between(next(), [0.0, config.force.force_max]));
    Command { stiffness, delta, force }
}

/// The action with which a script moves the goal by `delta` (m, rad; world axes), as far as one action can, and asks for a
/// normal `force` (N) where the space commands one. Commanded stiffness is the middle of its range.
#[must_use]
pub fn encode(space: ActionSpace, config: &ControllerConfig, delta: &Vector6, force: f64) -> Vec<f64> {
    let mut action = Vec::with_capacity(space.dim());
    if space.impedance == Impedance::Commanded {
        action.extend([0.0; 6]);
    }
    for axis in 0..6 {
        action.push((delta[axis] / config.step(axis)).clamp(-1.0, 1.0));
    }
    if space.force {
        action.push((2.0 * force / config.force.force_max - 1.0).clamp(-1.0, 1.0));
    }
    action
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::robosuite_steps;
    use approx::assert_relative_eq;

    #[test]
    fn what_is_encoded_is_decoded() {
        let delta = Vector6::new(0.02, -0.05, 0.0, 0.1, -0.3, 0.5);
        for space in ActionSpace::ALL {
            let action = encode(space, &robosuite_steps(), &delta, 30.0);
            let command = decode(space, &robosuite_steps(), &action);
            assert_relative_eq!(command.delta, delta, epsilon = 1e-12);
            assert_eq!(command.force.is_some(), space.force);
            assert!(command.force.is_none_or(|force| (force - 30.0).abs() < 1e-12));
            assert!(command.stiffness.is_none_or(|stiffness| stiffness == Vector6::repeat(150.0)));
        }
        let far = encode("osc".parse().unwrap(), &robosuite_steps(), &Vector6::repeat(-9.0), 0.0);
        assert_eq!(far, [-1.0; 6]);
    }

    #[test]
    fn layout_and_scaling() {
        let space: ActionSpace = "variable-force".parse().unwrap();
        let action = [-1.0, 0.0, 1.0, 0.5, -0.5, 2.0, 1.0, -0.5, f64::NAN, 0.1, 0.0, -7.0, 0.2];
        let command = decode(space, &robosuite_steps(), &action);
        assert_eq!(command.stiffness, Some(Vector6::new(0.0, 150.0, 300.0, 225.0, 75.0, 300.0)));
        assert_eq!(command.delta, Vector6::new(0.05, -0.025, 0.0, 0.05, 0.0, -0.5));
        assert_eq!(command.force, Some(30.0));
    }

    #[test]
    fn plain_spaces_command_a_pose_only() {
        let command = decode("osc".parse().unwrap(), &ControllerConfig::default(), &[1.0; 6]);
        assert_eq!((command.stiffness, command.force), (None, None));
    }

    #[test]
    #[should_panic(expected = "length of an action of `low-force`")]
    fn a_wrong_length_is_a_bug() {
        decode("low-force".parse().unwrap(), &ControllerConfig::default(), &[0.0; 6]);
    }
}
