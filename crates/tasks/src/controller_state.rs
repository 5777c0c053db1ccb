//! The controller's state as a part of the observation. Without it the internal state of an adaptive law is hidden from a policy.

use aforce::{Controller, Measurement, pose_error};

use crate::observer::Observer;

/// Largest stiffness in an observation (N/m, Nm/rad). With a stiffness in 1/s2 the value in N/m has no bound near a singularity, as the
/// arm's apparent inertia has none, and a value of millions would dominate the observation.
const MOST_STIFFNESS: [f64; 2] = [10_000.0, 1_000.0];

/// Puts 19 numbers, the same in every action space; a space has zeros for what it lacks. `goal_error` is the goal's
/// pose less the measured one, while the law's e has the other sign and counts from the set-point. `stiffness` is K in
/// N/m and Nm/rad, of the contact axis too while a force controller has taken it over. `feedforward` is F_ff as it
/// acts. `desired_force` is F_d along the contact axis.
pub fn observe_controller(controller: &Controller, y: &Measurement, out: &mut Observer) {
    let missing = -pose_error(&y.pose, controller.goal());
    let mut stiffness = controller.stiffness();
    for (axis, k) in stiffness.iter_mut().enumerate() {
        *k = k.min(MOST_STIFFNESS[axis / 3]);
    }
    out.axes("goal_error", &missing, ["m, world", "rad, world"], [0.0; 2], [20.0, 2.0]);
    out.axes("stiffness", &stiffness, ["N/m", "Nm/rad"], [1000.0, 50.0], [1e-3, 0.02]);
    out.axes("feedforward", controller.feedforward(), ["N, world", "Nm, world"], [0.0; 2], [0.1, 0.5]);
    out.put("desired_force", controller.desired_force(), "N", 0.0, 0.05);
}
