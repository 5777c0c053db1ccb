//! The way to the start: a smooth move of the joints by the arm's own position controller.

use std::sync::atomic::{AtomicBool, Ordering};

use franka::{ControllerMode, Duration, FciVersion, FrankaResult, JointPositions, Robot, RobotState, motion_finished};

/// Largest speed of a joint on the way (rad/s): about a fifth of the slowest joint's limit.
const SPEED: f64 = 0.4;
/// Time in which the arm comes to rest when it is told to stop (s).
const BRAKING: f64 = 0.5;

/// Moves to `goal` (rad), or brakes to rest on the way as soon as `stop` is set.
pub fn move_to(robot: &Robot, goal: [f64; 7], stop: &AtomicBool) -> FrankaResult<()> {
    println!("moving to the start");
    let version = robot.fci_version();
    let mut way: Option<Way> = None;
    robot.control_joint_positions(
        |state: &RobotState, period: Duration| {
            let way = way.get_or_insert_with(|| Way::new(beginning(state, version), goal));
            way.advance(period.as_secs_f64(), stop.load(Ordering::Relaxed));
            let positions = JointPositions::new(way.target());
            if way.is_over() { motion_finished(positions) } else { positions }
        },
        ControllerMode::JointImpedance,
        true,
        franka::DEFAULT_CUTOFF_FREQUENCY,
    )
}

/// Joint angles at which the way begins (rad). A Panda's first set-point (protocol version 5), unlike an FR3's, is filtered and limited
/// against the robot's previous set-point: a way from the measured angles would begin with a jump.
fn beginning(state: &RobotState, version: FciVersion) -> [f64; 7] {
    match version {
        FciVersion::V5 => state.q_d,
        FciVersion::V10 => state.q,
    }
}

/// A quintic polynomial in time with zero speed and acceleration at both ends.
struct Way {
    start: [f64; 7],
    goal: [f64; 7],
    /// Duration of the way, and the part of it that is done (s).
    duration: f64,
    done: f64,
    /// Time since it was told to stop (s).
    braking: Option<f64>,
}

impl Way {
    fn new(start: [f64; 7], goal: [f64; 7]) -> Self {
        let furthest = goal.iter().zip(start).map(|(goal, start)| (goal - start).abs()).fold(0.0, f64::max);
        // A quintic's peak speed is 1.875 times its mean speed.
        Self { start, goal, duration: (1.875 * furthest / SPEED).max(0.5), done: 0.0, braking: None }
    }

    /// Advances by `dt` (s). Once told to `stop`, the time along the way slows down smoothly to a standstill.
    fn advance(&mut self, dt: f64, stop: bool) {
        let rate = match &mut self.braking {
            Some(elapsed) => {
                *elapsed += dt;
                let share = (*elapsed / BRAKING).min(1.0);
                1.0 - share * share * (3.0 - 2.0 * share)
            }
            None => {
                self.braking = stop.then_some(0.0);
                1.0
            }
        };
        self.done += rate * dt;
    }

    fn target(&self) -> [f64; 7] {
        let t = (self.done / self.duration).min(1.0);
        let share = t * t * t * (10.0 - 15.0 * t + 6.0 * t * t);
        std::array::from_fn(|joint| self.start[joint] + share * (self.goal[joint] - self.start[joint]))
    }

    /// At the goal, or at rest on the way.
    fn is_over(&self) -> bool {
        self.done >= self.duration || self.braking.is_some_and(|elapsed| elapsed >= BRAKING)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first joint's angles (rad) in cycles of 1 ms. The way is told to stop after `stop` cycles.
    fn angles(stop: usize) -> Vec<f64> {
        let mut way = Way::new([0.0; 7], [1.0, -0.5, 0.0, 0.0, 0.0, 0.0, 0.2]);
        let mut angles = vec![0.0];
        while !way.is_over() {
            way.advance(0.001, angles.len() > stop);
            angles.push(way.target()[0]);
        }
        angles
    }

    fn differences(of: &[f64]) -> Vec<f64> {
        of.windows(2).map(|pair| (pair[1] - pair[0]) / 0.001).collect()
    }

    #[test]
    fn it_begins_where_the_robot_takes_the_arm_to_be() {
        let state = RobotState { q: [0.1; 7], q_d: [0.2; 7], ..RobotState::default() };
        assert_eq!(beginning(&state, FciVersion::V5), [0.2; 7]);
        assert_eq!(beginning(&state, FciVersion::V10), [0.1; 7]);
    }

    #[test]
    fn it_goes_to_the_goal_or_comes_to_rest_without_a_jerk() {
        for stop in [usize::MAX, 0, 700, 2500, 4600] {
            let angles = angles(stop);
            let speeds = differences(&angles);
            let accelerations = differences(&speeds);
            let (last, end) = (angles[angles.len() - 1], speeds[speeds.len() - 1]);
            assert!(speeds.iter().all(|speed| (-1e-9..SPEED + 1e-3).contains(speed)));
            assert!(accelerations.iter().all(|a| a.abs() < 1.5), "{stop}");
            assert!(differences(&accelerations).iter().all(|jerk| jerk.abs() < 20.0), "{stop}");
            assert!(end.abs() < 1e-3, "it ends at rest: {end} rad/s");
            if stop == usize::MAX {
                assert!((last - 1.0).abs() < 1e-9);
            } else {
                assert!(angles.len() - stop <= 502, "within half a second");
            }
        }
    }
}
