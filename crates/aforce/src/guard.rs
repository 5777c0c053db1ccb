//! Where something may stand between the law and the arm: a simulated arm has nothing there, a host has its limits.

use crate::force::ForceAxis;
use crate::operational_space::OperationalSpace;
use crate::spatial::{JointVector, Measurement, Pose, Vector6, Wrench};
use crate::stiffness::StiffnessUnit;

/// What can put energy into the arm besides the set-point: the parts of the law that are no passive spring or damper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Active {
    /// K in the space's unit.
    pub(crate) stiffness: Vector6,
    /// F_ff in the space's unit.
    pub(crate) feedforward: Vector6,
    /// F_cmd (N, Nm).
    pub(crate) force: Wrench,
}

/// What a guard knows of the present sample.
pub(crate) struct Sample<'a> {
    pub(crate) y: &'a Measurement,
    pub(crate) arm: &'a OperationalSpace,
    pub(crate) unit: StiffnessUnit,
    pub(crate) axis: &'a ForceAxis,
    /// e (m, rad).
    pub(crate) e: Vector6,
    /// Since the last sample (s).
    pub(crate) dt: f64,
}

/// Each method is handed what the law wants and gives back what may be; as written here, the same.
pub(crate) trait Guard {
    /// The goal of an action.
    fn goal(&mut self, goal: Pose) -> Pose {
        goal
    }

    /// e = x - x_d (m, rad), as spring and adaptation see it.
    fn error(&mut self, e: Vector6) -> Vector6 {
        e
    }

    /// What limits have cut off, seen at the tool at an error `e` of the spring: K does not grow along it.
    fn excess(&self, excess: Vector6, _e: &Vector6) -> Vector6 {
        excess
    }

    /// K, F_ff and F_cmd.
    fn active(&mut self, wanted: Active, _sample: &Sample) -> Active {
        wanted
    }

    /// The wrench of the task (N, Nm), of which the damper is -`viscous`.
    fn wrench(&mut self, wanted: Wrench, _viscous: &Wrench, _sample: &Sample) -> Wrench {
        wanted
    }

    /// The torque (Nm), before the limits of the joints.
    fn torque(&mut self, wanted: JointVector, _y: &Measurement) -> JointVector {
        wanted
    }
}

/// The simulated tables: nothing stands in between.
pub(crate) struct Unguarded;

impl Guard for Unguarded {}
