//! A table that is not there: its push, added to what the arm reports.

use aforce::Vector3;
use aforce::host::ArmState;

/// Stiffness (N/m) and damping (Ns/m) of its top.
const STIFFNESS: f64 = 5e3;
const DAMPING: f64 = 100.0;

/// Adds what a table at `height` (m, base frame) would push with to the wrench, in Franka's sign: what the tool exerts.
pub fn add_table(state: &mut ArmState, height: f64) {
    let depth = height - state.pose.translation.z;
    if depth > 0.0 {
        let velocity: Vector3 = (state.jacobian * state.qd).fixed_rows::<3>(0).into();
        state.wrench[2] -= (STIFFNESS * depth - DAMPING * velocity.z).max(0.0);
    }
}
