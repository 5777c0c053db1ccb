//! From Franka's state and model to the state that the law's host reads.

use aforce::host::ArmState;
use aforce::{Jacobian, JointMatrix, Pose, Vector3};
use franka::{Frame, Model, RobotState};
use nalgebra::{Matrix3, Matrix4, Quaternion, Rotation3, UnitQuaternion};

/// How far a rotation's columns may be from orthonormal.
const ORTHONORMAL: f64 = 1e-3;

/// Signs, sides and gravity are the interface's to name ([`aforce::host::ArmInterface::FRANKA`]): numbers pass as they are.
pub fn arm_state(state: &RobotState, model: &Model) -> ArmState {
    ArmState {
        q: state.q.into(),
        qd: state.dq.into(),
        pose: pose(&state.O_T_EE),
        jacobian: Jacobian::from_column_slice(&model.zero_jacobian(Frame::EndEffector, state)),
        mass: JointMatrix::from_column_slice(&model.mass(state)),
        gravity: model.gravity(state).into(),
        coriolis: model.coriolis(state).into(),
        wrench: state.O_F_ext_hat_K.into(),
        tau: state.tau_J_d.into(),
    }
}

/// The tool where the model sees it at the robot's joint angles.
pub fn model_pose(state: &RobotState, model: &Model) -> Pose {
    pose(&model.pose(Frame::EndEffector, state))
}

/// A pose from its matrix. One whose rotation is none has a rotation that is not a number, which the host refuses.
fn pose(column_major: &[f64; 16]) -> Pose {
    let matrix = Matrix4::from_column_slice(column_major);
    let position: Vector3 = matrix.fixed_view::<3, 1>(0, 3).into();
    let rotation: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into();
    let off = (rotation.transpose() * rotation - Matrix3::identity()).amax();
    let rotation = if off < ORTHONORMAL && rotation.determinant() > 0.0 {
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation))
    } else {
        UnitQuaternion::new_unchecked(Quaternion::new(f64::NAN, 0.0, 0.0, 0.0))
    };
    Pose::from_parts(position.into(), rotation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn a_matrix_that_is_no_rotation_is_refused() {
        let (mut state, model) = testing::panda();
        let good = model.to_homogeneous();
        let (mut stretched, mut skewed, mut mirrored, mut unknown) = (good, good, good, good);
        stretched[0] = 3.0;
        skewed[4] += 0.003;
        mirrored.column_mut(1).neg_mut();
        unknown[4] = f64::NAN;
        let pose = |matrix: Matrix4<f64>| super::pose(&std::array::from_fn(|entry| matrix[entry]));
        assert!(pose(good).rotation.angle_to(&model.rotation) < 1e-6);
        for matrix in [stretched, skewed, mirrored, unknown, Matrix4::zeros()] {
            state.pose = pose(matrix);
            let refusal = testing::host().start(&state, &model).unwrap_err().to_string();
            assert!(refusal.starts_with("pose (rotation) of the arm's state is not finite"), "{refusal}");
        }
    }

    /// The Panda's model in franka-rs against this project's sign and side conventions, at two postures.
    #[test]
    fn twist_is_the_derivative_of_the_pose_and_the_mass_is_link_side() {
        let model = Model::native_fer();
        let mut state = RobotState {
            q: [0.1, 0.2, -0.3, -2.0, 0.2, 2.0, 0.7],
            dq: [0.3, -0.2, 0.4, 0.1, -0.5, 0.2, 0.6],
            ..RobotState::default()
        };
        let h = 1e-6;
        let at = |state: &mut RobotState, h: f64| {
            for joint in 0..7 {
                state.q[joint] += h * state.dq[joint];
            }
            model_pose(state, &model)
        };
        let twist = {
            let y = arm_state(&state, &model);
            // Rotors of 0.2 to 0.6 kg m2 would show: the last link alone has hundredths.
            assert!(y.mass[(6, 6)] < 0.1 && y.mass[(6, 6)] > 0.0, "{}", y.mass[(6, 6)]);
            y.jacobian * y.qd
        };
        let (before, after) = (at(&mut state, -h), at(&mut state, 2.0 * h));
        let numeric = aforce::pose_error(&after, &before) / (2.0 * h);
        assert!((twist - numeric).amax() < 1e-6, "{twist} {numeric}");
    }
}
