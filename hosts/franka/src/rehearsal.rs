//! A virtual table for rehearsals in the air: its contact force is added to the wrench that the arm reports.

use aforce::Vector3;
use aforce::host::{ArmState, WrenchSign};

/// Stiffness (N/m) and damping (Ns/m) of the table's top.
const STIFFNESS: f64 = 5e3;
const DAMPING: f64 = 100.0;

/// Adds the contact force of a table at `height` (m, base frame) to the wrench, which has base axes and this `sign`.
pub fn add_table(state: &mut ArmState, height: f64, sign: WrenchSign) {
    let depth = height - state.pose.translation.z;
    if depth > 0.0 {
        let velocity: Vector3 = (state.jacobian * state.qd).fixed_rows::<3>(0).into();
        let push = (STIFFNESS * depth - DAMPING * velocity.z).max(0.0);
        state.wrench[2] += if sign == WrenchSign::OnTool { push } else { -push };
    }
}
