//! Conversions between the arrays of the C header and the law's types.

use aforce::host::{ArmState, Command, Status, pose_from_matrix};
use aforce::{Jacobian, JointMatrix, Pose};

use crate::{AforceCommand, AforceState, AforceStatus};

pub(crate) fn state(state: &AforceState) -> ArmState {
    ArmState {
        q: state.q.into(),
        qd: state.qd.into(),
        pose: pose_from_matrix(&state.pose),
        jacobian: Jacobian::from_column_slice(&state.jacobian),
        mass: JointMatrix::from_column_slice(&state.mass),
        gravity: state.gravity.into(),
        coriolis: state.coriolis.into(),
        wrench: state.wrench.into(),
        tau: state.tau.into(),
    }
}

pub(crate) fn command(command: &Command) -> AforceCommand {
    let (status, limited, fault) = match command.status {
        Status::Running => (AforceStatus::Running, 0, 0),
        Status::Limited(limited) => (AforceStatus::Limited, limited.bits(), 0),
        Status::Fault(fault) => (AforceStatus::Fault, 0, fault.code()),
        Status::Stopped => (AforceStatus::Stopped, 0, 0),
    };
    AforceCommand { tau: command.tau.into(), status, limited, fault, reserved: 0 }
}

pub(crate) fn pose_matrix(pose: &Pose) -> [f64; 16] {
    let matrix = pose.to_homogeneous();
    std::array::from_fn(|entry| matrix[entry])
}
