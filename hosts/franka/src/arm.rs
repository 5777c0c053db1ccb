//! Converts Franka's state and model into the state that the law's host reads.

use aforce::host::{ArmState, pose_from_matrix};
use aforce::{Jacobian, JointMatrix, Pose};
use franka::{Frame, FrankaResult, Model, Robot, RobotState};

/// Copies the robot's numbers unchanged. [`aforce::host::ArmInterface::FRANKA`] names their conventions: the wrench's sign, the side of the
/// inertia, who compensates gravity.
pub fn arm_state(state: &RobotState, model: &Model) -> ArmState {
    ArmState {
        q: state.q.into(),
        qd: state.dq.into(),
        pose: pose_from_matrix(&state.O_T_EE),
        jacobian: Jacobian::from_column_slice(&model.zero_jacobian(Frame::EndEffector, state)),
        mass: JointMatrix::from_column_slice(&model.mass(state)),
        gravity: model.gravity(state).into(),
        coriolis: model.coriolis(state).into(),
        wrench: state.O_F_ext_hat_K.into(),
        tau: state.tau_J_d.into(),
    }
}

/// The robot's present state. While the program does not read, states queue in the socket, and a full queue drops the newest. The
/// first read empties the queue, the second waits for the next state.
pub fn now(robot: &Robot) -> FrankaResult<RobotState> {
    robot.read_once()?;
    robot.read_once()
}

/// Pose of the tool point by the model's kinematics at the robot's joint angles (m, base frame).
pub fn model_pose(state: &RobotState, model: &Model) -> Pose {
    pose_from_matrix(&model.pose(Frame::EndEffector, state))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks the Panda's model in franka-rs against this project's conventions of sign and side, at one posture.
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
            // With rotors the last joint would have more than 0.2 kg m^2; the last link alone has a few hundredths.
            assert!(y.mass[(6, 6)] < 0.1 && y.mass[(6, 6)] > 0.0, "{}", y.mass[(6, 6)]);
            y.jacobian * y.qd
        };
        let (before, after) = (at(&mut state, -h), at(&mut state, 2.0 * h));
        let numeric = aforce::pose_error(&after, &before) / (2.0 * h);
        assert!((twist - numeric).amax() < 1e-6, "{twist} {numeric}");
    }
}
