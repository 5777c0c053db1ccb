//! The force and the torque that a policy feels.

use aforce::{Measurement, Vector3, Wrench};

use crate::observer::Observer;

/// What a learner multiplies them with: 20 N and 2 Nm become 1.
const SCALES: [f64; 2] = [0.05, 0.5];

/// A sensor at the tool that was tared when the episode began.
///
/// It reads the wrench that the controller reads, filter, noise and bias included. Taring takes one reading: what a bias is in the
/// tool's axes then is taken off for good, and that reading's noise stays in.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ForceSensor {
    /// What counts as nothing (N, Nm; tool axes).
    tare: Wrench,
}

impl ForceSensor {
    /// What `y` reads counts as nothing from here on.
    pub fn tare(&mut self, y: &Measurement) {
        self.tare = in_tool_axes(y, &y.wrench);
    }

    /// So does `bias` (N, Nm; world axes), in which later measurements differ from `y`.
    pub fn tare_too(&mut self, y: &Measurement, bias: &Wrench) {
        self.tare += in_tool_axes(y, bias);
    }

    /// Puts 6 numbers: what the environment exerts on the tool, the torque about the tool point.
    pub fn observe(&self, y: &Measurement, out: &mut Observer) {
        let wrench = in_tool_axes(y, &y.wrench) - self.tare;
        for (kind, (name, unit)) in [("force", "N, tool"), ("torque", "Nm, tool")].into_iter().enumerate() {
            out.vector(name, wrench.fixed_rows::<3>(3 * kind).into(), unit, SCALES[kind]);
        }
    }
}

/// A wrench in the axes of the tool that `y` has measured.
pub(crate) fn in_tool_axes(y: &Measurement, wrench: &Wrench) -> Wrench {
    let turned = |at: usize| y.pose.rotation.inverse() * Vector3::from(wrench.fixed_rows::<3>(at));
    let [force, torque] = [0, 3].map(turned);
    Wrench::new(force.x, force.y, force.z, torque.x, torque.y, torque.z)
}
