//! Turns what a scripted expert wants into an action of any action space.

use aforce::{ActionSpace, ControllerConfig, Impedance, Pose, pose_error};

use crate::task::Waypoint;

/// Action in [-1, 1]^n that moves the goal from `reference` towards the waypoint.
/// Commanded stiffness stays in the middle of its range.
pub fn encode(
    waypoint: &Waypoint,
    reference: &Pose,
    space: ActionSpace,
    config: &ControllerConfig,
    has_gripper: bool,
) -> Vec<f64> {
    let mut action = Vec::with_capacity(space.dim() + 1);
    if space.impedance == Impedance::Commanded {
        action.extend([0.0; 6]);
    }
    let delta = pose_error(&waypoint.pose, reference);
    for i in 0..6 {
        let step = if i < 3 { config.position_step } else { config.rotation_step };
        action.push((delta[i] / step).clamp(-1.0, 1.0));
    }
    if space.force {
        action.push((2.0 * waypoint.force / config.force.force_max - 1.0).clamp(-1.0, 1.0));
    }
    if has_gripper {
        action.push(waypoint.grip);
    }
    action
}
