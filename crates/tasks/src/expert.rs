//! Turns what a scripted expert wants into an action of any action space.

use aforce::{Controller, ControllerConfig, Measurement, encode, pose_error};
use nalgebra::UnitVector3;

use crate::task::Waypoint;

/// Share of the missing force that one action corrects.
const CORRECTION: f64 = 0.5;
/// Largest change per action of the depth of the goal behind the tool (m): a tool that feels nothing
/// yet comes down at a few cm/s.
const DEPTH_STEP: f64 = 0.002;

/// The controller's part of an action in [-1, 1]^n: moves its goal to the waypoint. Commanded stiffness stays in
/// the middle of its range.
///
/// To press is to aim behind the surface: the depth of the goal follows from the missing force and the
/// stiffness. Where force control holds the axis it makes no difference.
pub fn action_towards(
    waypoint: &Waypoint,
    controller: &Controller,
    config: &ControllerConfig,
    y: &Measurement,
    contact_axis: UnitVector3<f64>,
) -> Vec<f64> {
    let mut goal = waypoint.pose;
    if waypoint.force > 0.0 {
        let n = contact_axis.into_inner();
        let along = |v: nalgebra::Vector3<f64>| v.dot(&n);
        let missing = waypoint.force - along(y.wrench.fixed_rows::<3>(0).into());
        let stiffness = along(controller.stiffness().fixed_rows::<3>(0).component_mul(&n));
        let depth = along(controller.error().fixed_rows::<3>(0).into())
            + (CORRECTION * missing / stiffness).clamp(-DEPTH_STEP, DEPTH_STEP);
        let target = along(y.pose.translation.vector) - depth;
        goal.translation.vector += n * (target - along(goal.translation.vector));
    }
    encode(controller.space(), config, &pose_error(&goal, &controller.origin(y)), waypoint.force)
}
