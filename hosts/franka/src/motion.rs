//! The way to the start: a smooth move of the joints by the arm's own position controller.

use anyhow::{Context, Result};
use franka::{ControllerMode, Duration, JointPositions, Robot, RobotState, motion_finished};

/// Largest speed of a joint on the way (rad/s): a fifth of what the slowest may.
const SPEED: f64 = 0.4;

/// Moves to `goal` (rad) along a quintic: at rest, without acceleration, at both ends.
pub fn move_to(robot: &Robot, goal: [f64; 7]) -> Result<()> {
    let (mut start, mut time) = ([0.0; 7], 0.0);
    let mut duration = 0.0f64;
    robot
        .control_joint_positions(
            |state: &RobotState, period: Duration| {
                time += period.as_secs_f64();
                if time == 0.0 {
                    start = state.q;
                    let furthest = goal.iter().zip(start).map(|(goal, start)| (goal - start).abs()).fold(0.0, f64::max);
                    duration = (1.875 * furthest / SPEED).max(0.5); // A quintic's peak speed is 1.875 of its mean.
                }
                let t = (time / duration).min(1.0);
                let share = t * t * t * (10.0 - 15.0 * t + 6.0 * t * t);
                let target = std::array::from_fn(|joint| start[joint] + share * (goal[joint] - start[joint]));
                let positions = JointPositions::new(target);
                if t >= 1.0 { motion_finished(positions) } else { positions }
            },
            ControllerMode::JointImpedance,
            true,
            franka::DEFAULT_CUTOFF_FREQUENCY,
        )
        .context("the move to the start")
}
