//! One episode: the loop at 1 kHz from the moment at which the law begins until the arm has relaxed.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use aforce::Vector3;
use aforce::host::{ArmState, Command, Fault, Host, HostSetup, Status};
use anyhow::{Context, Result, anyhow, bail};
use franka::{FrankaError, Model, Robot, RobotState, Torques, motion_finished};

use crate::arm::model_pose;
use crate::course::Course;
use crate::csv_log::{Log, Row};
use crate::gripper::Hand;
use crate::policy::Policy;
use crate::protocol::{Answer, Ask, Fingers, Told};
use crate::script::Running;
use crate::speed::too_fast;

/// Cycles per row of the log.
const LOGGED: u64 = 10;

/// Source of the actions.
pub enum Source {
    /// A script of this program.
    Script(Running),
    /// A policy in a process of its own.
    Policy(Policy),
}

/// How an episode ended, or how a request between two episodes turned out.
#[derive(Debug)]
pub enum End {
    /// The script was done, the time limit was reached, or a signal came.
    Over,
    /// The policy sent a request instead of an action.
    Asked(Ask),
    /// The law ended with a fault.
    Fault(Fault),
    /// The host refused to start the law.
    Unstarted(Fault),
    /// The law was stopped because the gripper has failed.
    Gripper,
    /// The robot stopped by itself, with this message.
    Reflex(String),
    /// The robot was recovered at the policy's request.
    Recovered,
    /// The policy's request was refused, for this reason.
    Refused(String),
}

impl End {
    /// Its name in the protocol.
    pub fn status(&self) -> &'static str {
        match self {
            Self::Over | Self::Asked(_) => "over",
            Self::Fault(_) | Self::Unstarted(_) | Self::Gripper => "fault",
            Self::Reflex(_) => "reflex",
            Self::Recovered => "recovered",
            Self::Refused(_) => "refused",
        }
    }

    /// The cause of an end that was not intended.
    pub fn reason(&self) -> Option<String> {
        match self {
            Self::Over | Self::Asked(_) | Self::Recovered => None,
            Self::Fault(fault) | Self::Unstarted(fault) => Some(fault.to_string()),
            Self::Gripper => Some("the gripper has failed".into()),
            Self::Reflex(reason) | Self::Refused(reason) => Some(reason.clone()),
        }
    }

    /// Code of the host's fault.
    pub fn fault(&self) -> Option<u32> {
        match self {
            Self::Fault(fault) | Self::Unstarted(fault) => Some(fault.code()),
            _ => None,
        }
    }

    /// The program's result if it ends with this.
    pub fn result(&self) -> Result<()> {
        match (self, self.reason()) {
            (Self::Reflex(_), Some(reason)) => bail!("the robot has stopped: {reason}"),
            (Self::Refused(_), Some(reason)) => bail!(reason),
            (Self::Unstarted(_), Some(reason)) => bail!("{reason}: the law did not begin"),
            (_, Some(reason)) => bail!("{reason}: the arm held its posture, relaxed, and was let go"),
            (_, None) => Ok(()),
        }
    }
}

/// The robot's message if it has refused or stopped a motion. Any other error ends the program.
pub fn said(error: FrankaError) -> Result<String> {
    match error {
        FrankaError::Control(exception) => Ok(exception.message),
        FrankaError::Command(message) => Ok(message),
        other => Err(other).context("the connection to the robot"),
    }
}

/// What an episode ends with. `ended` is why this program stopped the law, `seen` how the loop ended: [`End::Over`] if the arm has relaxed
/// without a fault of the host. An answer that could not be read ends the program, whatever has happened to the arm meanwhile.
fn outcome(ended: Option<Result<End>>, seen: Result<End>) -> Result<End> {
    match (ended, seen) {
        (Some(Err(error)), _) => Err(error),
        (Some(Ok(end)), Ok(End::Over)) => Ok(end),
        (_, seen) => seen,
    }
}

/// The arm, and the script or policy that acts on it.
pub struct Act<'a> {
    pub robot: &'a Robot,
    pub model: &'a Model,
    /// Converts a state of the robot.
    pub read: &'a dyn Fn(&RobotState) -> ArmState,
    pub setup: &'a HostSetup,
    /// The set-up's contact axis, of length 1.
    pub contact_axis: Vector3,
    pub host: Host,
    pub source: Source,
    pub hand: Option<Hand>,
    pub log: Option<&'a Log>,
    pub stop: Arc<AtomicBool>,
    /// Longest time of an episode (s).
    pub duration: f64,
    /// Joint angles (rad) to which a reset goes.
    pub home: [f64; 7],
    /// Number of the episode, from 1.
    pub episode: u32,
    /// Why the program stopped the law, if it has.
    pub ended: Option<Result<End>>,
}

impl Act<'_> {
    /// Runs an episode until the arm has relaxed or the robot has stopped. `first` is the first action of a policy.
    pub fn episode(&mut self, mut first: Option<Answer>) -> Result<End> {
        let mut control = match self.robot.start_torque_control() {
            Ok(control) => control,
            Err(error) => return said(error).map(End::Reflex),
        };
        let mut course = Course::default();
        self.ended = None;
        let end = loop {
            let (state, period) = match control.read_once() {
                Ok(read) => read,
                Err(error) => break said(error).map(End::Reflex),
            };
            let arm = (self.read)(&state);
            let begins = course.cycles == 0;
            // Starts again, from the pose and the torque of this cycle: the arm may have moved since `get_ready`.
            if begins && let Err(fault) = self.host.start(&arm, &model_pose(&state, self.model)) {
                break Ok(End::Unstarted(fault));
            }
            let dt = if begins { 0.0 } else { period.as_secs_f64() };
            course.add(&arm, self.setup, dt, state.control_command_success_rate);
            self.check_speed(&state);
            let command = self.host.update(&arm, dt);
            self.write_row(&course, &command);
            let tau = Torques::new(command.tau.into());
            if self.host.is_relaxed() {
                let ended = match command.status {
                    Status::Fault(fault) => End::Fault(fault),
                    _ => End::Over,
                };
                break match control.write_once(&motion_finished(tau)) {
                    Ok(()) => Ok(ended),
                    Err(error) => said(error).map(End::Reflex),
                };
            }
            if let Err(error) = control.write_once(&tau) {
                break said(error).map(End::Reflex);
            }
            // Only after the torque has been sent, so that the time that this takes does not delay the torque.
            self.consult(&mut course, &command.status, &mut first);
        };
        println!("{course}, tank {:.2} J", self.host.tank());
        outcome(self.ended.take(), end)
    }

    /// Stops the law if a joint comes close to the speed limit that the robot has at the joint's present angle.
    fn check_speed(&mut self, state: &RobotState) {
        let (lower, upper) =
            (self.robot.lower_joint_velocity_limits(&state.q), self.robot.upper_joint_velocity_limits(&state.q));
        if let Some(fault) = too_fast(&state.dq, &lower, &upper) {
            self.end(Ok(End::Fault(fault)));
        }
    }

    /// A row of the log, if one is due.
    fn write_row(&self, course: &Course, command: &Command) {
        if let Some(log) = self.log
            && course.cycles.is_multiple_of(LOGGED)
            && let Some(mut row) = Row::new(
                course.time,
                self.phase(),
                &self.host,
                command,
                [&course.energy, &course.control_energy],
                &self.contact_axis,
                (self.episode, self.fingers()),
            )
        {
            if let Some(Ok(End::Fault(_) | End::Gripper)) = self.ended {
                row.status = "fault";
            }
            log.add(row);
        }
    }

    /// Asks the script or policy, takes the answer, and stops the law if the gripper has failed, a signal came or time is over.
    fn consult(&mut self, course: &mut Course, status: &Status, first: &mut Option<Answer>) {
        if course.time >= course.next_action {
            course.next_action += 1.0 / f64::from(self.setup.controller.policy_hz);
            self.ask(course.time, status, first.is_some());
        }
        self.answer(first.take());
        if self.hand.as_ref().is_some_and(Hand::has_failed) {
            self.end(Ok(End::Gripper));
        }
        if self.stop.load(Ordering::Relaxed) || course.time > self.duration {
            self.end(Ok(End::Over));
        }
    }

    /// Stops the law. Of several reasons the first is kept.
    fn end(&mut self, end: Result<End>) {
        self.ended.get_or_insert(end);
        self.host.stop();
    }

    fn phase(&self) -> &'static str {
        match &self.source {
            Source::Script(script) => script.phase(),
            Source::Policy(_) => "policy",
        }
    }

    /// State of the gripper, if there is one.
    pub fn fingers(&self) -> Option<Fingers> {
        self.hand.as_ref().map(Hand::fingers)
    }

    /// Takes the script's next action, or sends the arm's state to the policy. A policy whose first action has yet to be taken
    /// (`is_first`) gets no state.
    fn ask(&mut self, time: f64, status: &Status, is_first: bool) {
        if !matches!(status, Status::Running | Status::Limited(_)) {
            return;
        }
        let fingers = self.fingers();
        match &mut self.source {
            Source::Script(script) => match script.action(&self.host, self.setup) {
                Some(action) => {
                    let _ = self.host.set_goal(&action); // After a fault the host refuses actions.
                }
                None => self.end(Ok(End::Over)),
            },
            Source::Policy(policy) => {
                if !is_first && let Some(told) = Told::running(&self.host, self.episode, time, status, fingers) {
                    policy.tell(told);
                }
            }
        }
    }

    /// Takes an answer of the policy, if there is one, in each cycle. An answer that cannot be read stops the law and ends the program.
    fn answer(&mut self, first: Option<Answer>) {
        let Source::Policy(policy) = &mut self.source else { return };
        let answer = first.map_or_else(|| policy.answer(), |first| Ok(Some(first)));
        match answer {
            Ok(Some(Answer::Action(action))) => {
                let (motion, grip) = action.entries().split_at(self.host.controller().space().dim());
                // An action that comes while the arm relaxes is refused; the gripper does not move then either.
                if self.host.set_goal(motion).is_ok()
                    && let (Some(hand), [grip]) = (&mut self.hand, grip)
                {
                    hand.want(*grip);
                }
            }
            Ok(Some(Answer::Ask(ask))) => self.end(Ok(End::Asked(ask))),
            Ok(None) => {}
            Err(error) => self.end(Err(anyhow!(error))),
        }
    }
}

#[cfg(test)]
mod tests {
    use aforce::EnergyLedger;

    use super::*;
    use crate::protocol::Expected;
    use crate::testing;
    use std::time::Duration;

    /// Leaves out reading and writing the robot's packets, which franka-rs tests.
    #[test]
    fn what_a_cycle_does_in_the_control_thread_takes_no_memory() {
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("still");
        std::fs::write(&program, "while read -r line; do echo '{\"action\": [0, 0, 0, 0, 0, 0, -1]}'; done").unwrap();
        let (mut host, (arm, _)) = (testing::host(), testing::panda());
        let expected = Expected::new(host.controller().space(), false).unwrap();
        let mut policy = Policy::start(&format!("sh {}", program.display()), expected).unwrap();
        let log = Log::create(&folder.path().join("log.csv")).unwrap();
        let (energy, axis, fingers) = (EnergyLedger::default(), Vector3::z(), Fingers { width: 0.08, grasped: false });
        let before = testing::allocations();
        let mut answers = 0;
        for cycle in 0..200 {
            let command = host.update(&arm, 0.001);
            let none = too_fast(&[0.0; 7], &[-1.0; 7], &[1.0; 7]);
            let of = (1, Some(fingers));
            let row = Row::new(0.0, "policy", &host, &command, [&energy, &energy], &axis, of);
            assert!(none.is_none() && row.is_some());
            log.add(row.unwrap());
            if cycle % 50 == 0 {
                policy.tell(Told::running(&host, 1, 0.0, &command.status, Some(fingers)).unwrap());
            }
            if let Ok(Some(Answer::Action(action))) = policy.answer() {
                host.set_goal(action.entries()).unwrap();
                answers += 1;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        assert_eq!(testing::allocations() - before, 0);
        assert!(answers > 0);
        assert_eq!(log.finish().unwrap(), 0);
    }

    #[test]
    fn an_answer_that_cannot_be_read_counts_more_than_a_fault() {
        let unreadable = || Some(Err(anyhow!("unreadable")));
        for seen in [Ok(End::Over), Ok(End::Fault(Fault::Mass)), Ok(End::Reflex("tau".into())), Err(anyhow!("lost"))] {
            assert_eq!(outcome(unreadable(), seen).unwrap_err().to_string(), "unreadable");
        }
        assert!(matches!(outcome(Some(Ok(End::Asked(Ask::Reset))), Ok(End::Over)), Ok(End::Asked(Ask::Reset))));
        assert!(matches!(outcome(Some(Ok(End::Over)), Ok(End::Fault(Fault::Mass))), Ok(End::Fault(Fault::Mass))));
        assert!(matches!(outcome(None, Ok(End::Reflex("tau".into()))), Ok(End::Reflex(_))));
        assert!(matches!(outcome(None, Ok(End::Over)), Ok(End::Over)));
        assert_eq!(outcome(Some(Ok(End::Over)), Err(anyhow!("lost"))).unwrap_err().to_string(), "lost");
    }

    #[test]
    fn an_end_is_told_and_is_a_programs_result() {
        for (end, status, of_program) in [
            (End::Over, "over", None),
            (End::Asked(Ask::Reset), "over", None),
            (End::Recovered, "recovered", None),
            (End::Fault(Fault::Mass), "fault", Some(", relaxed, and was let go")),
            (End::Unstarted(Fault::Mass), "fault", Some(": the law did not begin")),
            (End::Gripper, "fault", Some("the gripper has failed: the arm")),
            (End::Reflex("tau".into()), "reflex", Some("the robot has stopped: tau")),
            (End::Refused("why".into()), "refused", Some("why")),
        ] {
            assert_eq!((end.status(), end.reason().is_some()), (status, of_program.is_some()));
            match (end.result(), of_program) {
                (Ok(()), None) => {}
                (Err(error), Some(told)) => assert!(error.to_string().contains(told), "{error}"),
                (found, _) => panic!("{found:?}"),
            }
        }
    }
}
