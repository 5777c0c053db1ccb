//! Turns a scripted expert's waypoint into an action of any action space.

use aforce::{Controller, ControllerConfig, Measurement, OperationalSpace, StiffnessUnit, Vector3, encode, pose_error};
use nalgebra::UnitVector3;

use crate::task::Waypoint;

/// Share of the missing force that one action corrects.
const CORRECTION: f64 = 0.5;
/// Largest change per action of the depth of the goal behind the tool (m): a tool without contact comes down at a few cm/s.
const DEPTH_STEP: f64 = 0.002;

/// The controller's part of an action in [-1, 1]^n: moves its goal to the waypoint. Commanded stiffness stays in
/// the middle of its range.
///
/// To press, the goal lies behind the surface: its depth follows from the missing force and the stiffness. Where force
/// control holds the contact axis the depth has no effect. With a stiffness in 1/s2 the arm's inertia changes the direction
/// of the spring's force. Then the goal is shifted sideways as well, so that the spring presses along the axis alone.
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
        let along = |v: Vector3| v.dot(&n);
        let missing = waypoint.force - along(y.wrench.fixed_rows::<3>(0).into());
        let stiffness = along(controller.stiffness().fixed_rows::<3>(0).component_mul(&n));
        let depth = along(controller.error().fixed_rows::<3>(0).into())
            + (CORRECTION * missing / stiffness).clamp(-DEPTH_STEP, DEPTH_STEP);
        let target = along(y.pose.translation.vector) - depth;
        goal.translation.vector += n * (target - along(goal.translation.vector));
        if controller.space().unit == StiffnessUnit::PerSecondSquared {
            let owned = 1.0 - controller.engagement();
            goal.translation.vector -= owned * depth * aside(y, &n);
        }
    }
    encode(controller.space(), config, &pose_error(&goal, &controller.origin(y)), waypoint.force)
}

/// Sideways displacement of the tool from its goal (m, world), for each metre that the goal lies behind the tool along a
/// surface's normal `n`, with which a spring in 1/s2 presses along `n` alone. The spring's force is Lambda K e, with the
/// same K along all axes. With a goal straight behind the tool and a sloping forearm, the spring would also pull along the
/// surface: on an FR3 with its tool at the far end of the table 49 N at 28 N of pressure, enough to hold the tool 25 mm
/// short of where it should wipe.
fn aside(y: &Measurement, n: &Vector3) -> Vector3 {
    let lambda = OperationalSpace::new(&y.mass, &y.jacobian).and_then(|lambda| lambda.lambda_p.try_inverse());
    let goal = lambda.map_or(*n, |inverse| inverse * n);
    goal / goal.dot(n) - n
}
