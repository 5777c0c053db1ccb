//! The force and the torque in an observation.

use aforce::{Measurement, Vector3, Wrench};
use nalgebra::UnitQuaternion;

use crate::observer::Observer;

/// A learner sees a force of this many newtons as 1.
const FORCE: f64 = 20.0;

/// In which form force and torque are observed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feel {
    /// The point that the torque is about (m, tool axes).
    pub about: Vector3,
    /// A learner sees a torque of this many Nm as 1.
    pub torque: f64,
    /// Whether force and torque are in the world's axes, as an action's entries are; else in the tool's.
    pub in_world: bool,
}

/// About the tool point, in the tool's axes.
impl Default for Feel {
    fn default() -> Self {
        Self { about: Vector3::zeros(), torque: 2.0, in_world: false }
    }
}

/// A sensor at the tool that was tared when the episode began.
///
/// It reads the wrench that the controller reads, filter, noise and bias included. Taring takes one reading in the
/// tool's axes and subtracts it from all later ones. So a bias that is constant in world axes comes back as the tool
/// turns, and the noise of that one reading is in all later readings.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ForceSensor {
    feel: Feel,
    /// What is subtracted from each reading (N, Nm; tool axes, about the tool point).
    tare: Wrench,
}

impl ForceSensor {
    /// A sensor whose tare is the wrench that `y` has.
    pub fn tared(feel: Feel, y: &Measurement) -> Self {
        Self { feel, tare: in_tool_axes(y, &y.wrench) }
    }

    /// Adds to the tare a `bias` (N, Nm; world axes) that later readings have and `y` does not.
    pub fn add_to_tare(&mut self, y: &Measurement, bias: &Wrench) {
        self.tare += in_tool_axes(y, bias);
    }

    /// Puts 6 numbers: force (N) and torque (Nm, about [`Feel::about`]) that the environment exerts on the tool, less
    /// the tare.
    pub fn observe(&self, y: &Measurement, out: &mut Observer) {
        let wrench = in_tool_axes(y, &y.wrench) - self.tare;
        let [force, torque] = [0, 3].map(|at| Vector3::from(wrench.fixed_rows::<3>(at)));
        let Feel { about, torque: much, in_world } = self.feel;
        let torque = torque - about.cross(&force);
        let turn = if in_world { y.pose.rotation } else { UnitQuaternion::identity() };
        let units = if in_world { ["N, world", "Nm, world"] } else { ["N, tool", "Nm, tool"] };
        out.vector("force", turn * force, units[0], 1.0 / FORCE);
        out.vector("torque", turn * torque, units[1], 1.0 / much);
    }
}

/// `wrench` (world axes) in the axes of the tool as `y` has them.
pub(crate) fn in_tool_axes(y: &Measurement, wrench: &Wrench) -> Wrench {
    let turned = |at: usize| y.pose.rotation.inverse() * Vector3::from(wrench.fixed_rows::<3>(at));
    let [force, torque] = [0, 3].map(turned);
    Wrench::new(force.x, force.y, force.z, torque.x, torque.y, torque.z)
}
