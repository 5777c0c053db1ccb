//! From the entries of an action to physical quantities, and back.

use crate::law::action_space::ActionSpace;
use crate::law::config::ControllerConfig;
use crate::law::entry::clip;
use crate::law::stiffness::Stiffness;
use crate::spatial::Vector6;

/// The physical quantities that an action asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Decoded<'a> {
    /// Stiffness, in the space's unit, if the space commands it.
    pub(crate) stiffness: Option<Vector6>,
    /// Entries that command psi.
    pub(crate) psi: &'a [f64],
    /// Position (m) and rotation vector (rad) to add to the goal's origin, world axes.
    pub(crate) delta: Vector6,
    /// Normal force (N), if the space commands it.
    pub(crate) force: Option<f64>,
}

/// Decodes an action. NaN entries ask for no force and the middle of a range, and add nothing to the goal's origin, which an absolute goal
/// has where the episode began. A host refuses them.
///
/// # Panics
/// If the action has another length than the space's.
pub(crate) fn decode<'a>(space: &ActionSpace, config: &ControllerConfig, action: &'a [f64]) -> Decoded<'a> {
    assert_eq!(action.len(), space.dim(), "length of an action of `{space}`");
    let (stiffness, rest) = action.split_at(space.commanded_stiffness());
    let (psi, pose_and_force) = rest.split_at(rest.len() - 6 - usize::from(space.force));
    let range = match &space.stiffness {
        Stiffness::Commanded(range) => Some(range),
        _ => None,
    };
    Decoded {
        stiffness: range.map(|range| range.commanded(stiffness)),
        psi,
        delta: Vector6::from_fn(|axis, _| clip(pose_and_force[axis], 0.0) * space.step(config, axis)),
        force: space.force.then(|| 0.5 * (clip(pose_and_force[6], -1.0) + 1.0) * config.force.force_max),
    }
}

/// The action with which a script moves the goal by `delta` (m, rad; world axes) from its origin, as far as one action can,
/// and asks for a normal `force` (N) where the space commands one. Commanded stiffness and psi are the middle of their
/// ranges.
#[must_use]
pub fn encode(space: &ActionSpace, config: &ControllerConfig, delta: &Vector6, force: f64) -> Vec<f64> {
    let mut action = vec![0.0; space.dim() - 6 - usize::from(space.force)];
    for axis in 0..6 {
        action.push((delta[axis] / space.step(config, axis)).clamp(-1.0, 1.0));
    }
    if space.force {
        action.push((2.0 * force / config.force.force_max - 1.0).clamp(-1.0, 1.0));
    }
    action
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::gains::Gains;
    use approx::assert_relative_eq;

    #[test]
    fn what_is_encoded_is_decoded() {
        let delta = Vector6::new(0.02, -0.05, 0.0, 0.1, -0.3, 0.5);
        for space in ActionSpace::built_in() {
            let action = encode(&space, &ControllerConfig::default(), &delta, 30.0);
            let command = decode(&space, &ControllerConfig::default(), &action);
            assert_relative_eq!(command.delta, delta, epsilon = 1e-12);
            assert_eq!(command.force.is_some(), space.force);
            assert!(command.force.is_none_or(|force| (force - 30.0).abs() < 1e-12));
            assert!(command.stiffness.is_none_or(|stiffness| stiffness == Vector6::repeat(150.0)));
        }
        let far = encode(&"osc".parse().unwrap(), &ControllerConfig::default(), &Vector6::repeat(-9.0), 0.0);
        assert_eq!(far, [-1.0; 6]);
    }

    #[test]
    fn layout_and_scaling() {
        let space: ActionSpace = "variable-force".parse().unwrap();
        let action = [-1.0, 0.0, 1.0, 0.5, -0.5, 2.0, 1.0, -0.5, f64::NAN, 0.1, 0.0, -7.0, 0.2];
        let command = decode(&space, &ControllerConfig::default(), &action);
        assert_eq!(command.stiffness, Some(Vector6::new(0.0, 150.0, 300.0, 225.0, 75.0, 300.0)));
        assert_eq!(command.delta, Vector6::new(0.05, -0.025, 0.0, 0.05, 0.0, -0.5));
        assert_eq!(command.force, Some(30.0));
    }

    #[test]
    fn a_shared_entry_commands_every_axis() {
        let mut space: ActionSpace = "variable".parse().unwrap();
        let Stiffness::Commanded(range) = &mut space.stiffness else { unreachable!() };
        (range.shared, range.high) = (true, Gains::pair(300.0, 100.0));
        let config = ControllerConfig::default();
        assert_eq!((space.dim(), space.entries(&config)[0].name, space.entries(&config).len()), (7, "kp", 7));
        let command = decode(&space, &config, &[0.5, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0]);
        assert_eq!(command.stiffness, Some(Vector6::new(225.0, 225.0, 225.0, 75.0, 75.0, 75.0)));
        assert_eq!(command.delta, Vector6::new(0.05, 0.0, 0.0, 0.0, 0.0, -0.5));
        assert_eq!(toml::from_str::<ActionSpace>(&space.to_toml()).unwrap(), space);
    }

    #[test]
    fn what_is_not_a_number_adds_nothing() {
        let command = |name: &str, action: &[f64]| {
            let command = decode(&name.parse().unwrap(), &ControllerConfig::default(), action);
            (command.stiffness, command.delta, command.force)
        };
        let (stiffness, delta, force) = command("variable-force", &[f64::NAN; 13]);
        assert_eq!(stiffness, Some(Vector6::repeat(150.0)));
        assert_eq!((delta, force), (Vector6::zeros(), Some(0.0)));
    }

    #[test]
    fn plain_spaces_command_a_pose_only() {
        let space = "osc".parse().unwrap();
        let command = decode(&space, &ControllerConfig::default(), &[1.0; 6]);
        assert_eq!((command.stiffness, command.force, command.psi), (None, None, &[][..]));
    }

    #[test]
    #[should_panic(expected = "length of an action of `low-force`")]
    fn a_wrong_length_is_a_bug() {
        decode(&"low-force".parse().unwrap(), &ControllerConfig::default(), &[0.0; 6]);
    }
}
