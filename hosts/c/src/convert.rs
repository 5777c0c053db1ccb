//! Between the header's arrays and the law's types.

use aforce::host::{ArmState, Command, Status};
use aforce::{Jacobian, JointMatrix, Pose, Vector3};
use nalgebra::{Matrix3, Matrix4, Quaternion, Rotation3, Translation3, UnitQuaternion};

use crate::{AforceCommand, AforceState, AforceStatus};

/// How far a rotation's columns may be from orthonormal.
const ORTHONORMAL: f64 = 1e-3;

pub(crate) fn state(state: &AforceState) -> ArmState {
    ArmState {
        q: state.q.into(),
        qd: state.qd.into(),
        pose: pose(&state.pose),
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

/// A pose from its matrix. One whose rotation is none has a rotation that is not a number, which the host refuses.
pub(crate) fn pose(matrix: &[f64; 16]) -> Pose {
    let matrix = Matrix4::from_column_slice(matrix);
    let position: Vector3 = matrix.fixed_view::<3, 1>(0, 3).into();
    let rotation: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into();
    let off = (rotation.transpose() * rotation - Matrix3::identity()).amax();
    let rotation = if off < ORTHONORMAL && rotation.determinant() > 0.0 {
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation))
    } else {
        UnitQuaternion::new_unchecked(Quaternion::new(f64::NAN, 0.0, 0.0, 0.0))
    };
    Pose::from_parts(Translation3::from(position), rotation)
}

pub(crate) fn pose_matrix(pose: &Pose) -> [f64; 16] {
    let matrix = pose.to_homogeneous();
    std::array::from_fn(|entry| matrix[entry])
}
