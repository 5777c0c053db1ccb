//! Between two episodes: a policy is told how the last one ended, and asks for a reset, a recovery or the end.

use std::sync::atomic::Ordering;
use std::time::Duration;

use aforce::host::{Host, Status};
use aforce::{ActionSpace, stable_on};
use anyhow::{Context, Result, bail, ensure};
use franka::RobotMode;

use crate::arm::{model_pose, now};
use crate::episode::{Act, End, Source, said};
use crate::gripper::Hand;
use crate::motion;
use crate::protocol::{Answer, Ask, Told};

/// Pause before a policy is told that its request was refused or that the robot has stopped. It slows down a policy that
/// repeats its request.
const REFUSED: Duration = Duration::from_millis(500);

/// Ends the program if the user stop is pressed or the arm is guided by hand: a policy that repeats its request would move the arm as
/// soon as the stop is released.
fn in_our_hands(mode: RobotMode) -> Result<()> {
    match mode {
        RobotMode::UserStopped => bail!("the user stop is pressed: release it and start the program again"),
        RobotMode::Guiding => bail!("the arm is guided by hand: start the program again after that"),
        _ => Ok(()),
    }
}

/// Refuses a law that is unstable on the arm in its present posture.
fn stable(space: &ActionSpace, host: &Host) -> Result<(), String> {
    let y = host.measurement().ok_or("the robot's state was not read")?;
    stable_on(space, y).map_err(|error| error.below("space").to_string())
}

impl Act<'_> {
    /// Runs the one episode of a script, or as many episodes as the policy asks for.
    pub fn episodes(&mut self) -> Result<()> {
        if let Source::Script(_) = self.source {
            return self.episode(None)?.result();
        }
        // How the last episode ended; `None` if the arm is ready for the next.
        let mut last = None::<End>;
        loop {
            let answer = self.answer_between(last.as_ref())?;
            last = match (answer, last) {
                (Some(action @ Answer::Action(_)), None) => match self.episode(Some(action))? {
                    End::Asked(Ask::End) => return Ok(()),
                    End::Asked(Ask::Reset) => self.reset()?,
                    end => Some(end),
                },
                (Some(Answer::Ask(Ask::Reset)), None) => None,
                (Some(Answer::Ask(Ask::Reset)), Some(_)) => self.reset()?,
                (Some(Answer::Ask(Ask::Recover)), last) => Some(self.recover(last)?),
                (Some(Answer::Ask(Ask::End)), _) => return Ok(()),
                // The policy has ended, or sends an action although the episode is over.
                (None | Some(Answer::Action(_)), Some(last)) => return last.result(),
                (None, None) => return Ok(()),
            };
        }
    }

    /// Tells the policy how the last episode ended, or that the arm is ready, and waits for its answer.
    fn answer_between(&mut self, last: Option<&End>) -> Result<Option<Answer>> {
        let fingers = self.fingers();
        let mut told = Told::running(&self.host, self.episode, 0.0, &Status::Stopped, fingers)
            .context("the robot's state was not read")?;
        told.status = last.map_or("ready", End::status);
        (told.reason, told.fault) = (last.and_then(End::reason), last.and_then(End::fault));
        if let Some(end) = last {
            let reason = told.reason.as_ref().map_or(String::new(), |reason| format!(": {reason}"));
            println!("episode {}: {}{reason}", self.episode, end.status());
        }
        if let Some(End::Refused(_) | End::Reflex(_)) = last {
            std::thread::sleep(REFUSED);
        }
        let Source::Policy(policy) = &mut self.source else { return Ok(None) };
        policy.answer_to(told, &self.stop)
    }

    /// Moves back to the start. `None` if the next episode can begin there.
    fn reset(&mut self) -> Result<Option<End>> {
        if self.stop.load(Ordering::Relaxed) {
            return Ok(Some(End::Over));
        }
        Ok(match self.get_ready(true)? {
            Ok(()) => {
                self.episode += 1;
                None
            }
            // The arm may have collided on its way to the start.
            Err(reason) if now(self.robot)?.robot_mode == RobotMode::Reflex => Some(End::Reflex(reason)),
            Err(reason) => Some(End::Refused(reason)),
        })
    }

    /// Checks that the law can start, after a move to the start if `move_home`. The inner error says why it cannot.
    pub fn get_ready(&mut self, move_home: bool) -> Result<Result<(), String>> {
        ensure!(!self.hand.as_ref().is_some_and(Hand::has_failed), "the gripper has failed: start the program again");
        let mode = now(self.robot)?.robot_mode;
        in_our_hands(mode)?;
        if mode == RobotMode::Reflex {
            return Ok(Err("a reflex is to be cleared: recover comes before reset".into()));
        }
        if move_home && let Err(error) = motion::move_to(self.robot, self.home, &self.stop) {
            return said(error).map(Err);
        }
        let state = now(self.robot)?;
        let started = self.host.start(&(self.read)(&state), &model_pose(&state, self.model));
        Ok(started.map_err(|fault| format!("{fault}: refused")).and_then(|()| stable(&self.setup.space, &self.host)))
    }

    /// Clears a reflex. The episode that it ended does not go on: the policy asks for a reset next.
    fn recover(&mut self, last: Option<End>) -> Result<End> {
        in_our_hands(now(self.robot)?.robot_mode)?;
        match self.robot.automatic_error_recovery() {
            Ok(()) => Ok(End::Recovered),
            Err(error) => {
                let reason = said(error)?;
                Ok(End::Refused(
                    last.and_then(|last| last.reason()).map_or(reason.clone(), |why| format!("{why}; {reason}")),
                ))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use aforce::{Gains, Stiffness};

    #[test]
    fn an_arm_that_a_person_has_taken_ends_the_program() {
        for (mode, told) in [(RobotMode::UserStopped, "user stop"), (RobotMode::Guiding, "guided by hand")] {
            assert!(in_our_hands(mode).unwrap_err().to_string().contains(told));
        }
        assert!(
            [RobotMode::Idle, RobotMode::Move, RobotMode::Reflex].into_iter().all(|mode| in_our_hands(mode).is_ok())
        );
    }

    #[test]
    fn a_law_that_would_swing_is_refused_where_the_arm_stands() {
        let host = testing::host();
        let mut space = host.controller().space().clone();
        assert_eq!(stable(&space, &host), Ok(()));
        let Stiffness::Adaptive(psi) = &mut space.stiffness else { panic!() };
        psi.alpha = Gains::all(1e5);
        let refused = stable(&space, &host).unwrap_err();
        assert!(
            refused.starts_with("space.stiffness.adaptive.alpha: unstable on this arm in its present posture"),
            "{refused}"
        );
    }
}
