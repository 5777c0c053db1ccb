//! A policy in a process of its own: a line of observations in, a line of actions out.

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TryRecvError, sync_channel};
use std::time::{Duration, Instant};

use aforce::host::Host;
use anyhow::{Context, Result, anyhow, bail, ensure};

use crate::checks::go_on;

/// Time that a policy has for its first answer, and how long a signal may wait meanwhile.
const PATIENCE: Duration = Duration::from_secs(30);
const LOOK: Duration = Duration::from_millis(50);

/// The running policy. The host does not watch its process: when no action comes in time, the watchdog stops the arm.
pub struct Policy {
    child: Child,
    observations: SyncSender<String>,
    actions: Receiver<Result<Vec<f64>>>,
    /// Asked, and not yet answered.
    waiting: bool,
}

impl Policy {
    /// Starts `command` (words at spaces).
    pub fn start(command: &str) -> Result<Self> {
        let mut words = command.split_whitespace();
        let program = words.next().context("--policy: no program")?;
        let mut child = Command::new(program)
            .args(words)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| format!("--policy {command}"))?;
        let mut input = child.stdin.take().context("the policy's input")?;
        let answers = BufReader::new(child.stdout.take().context("the policy's output")?);
        // Writing and reading block: not in the control thread.
        let (observations, lines) = sync_channel::<String>(1);
        std::thread::spawn(move || {
            for line in lines {
                if writeln!(input, "{line}").and_then(|()| input.flush()).is_err() {
                    break;
                }
            }
        });
        let (sender, actions) = sync_channel(4);
        std::thread::spawn(move || {
            for line in answers.lines() {
                let action = line.map_err(Into::into).and_then(|line| numbers(&line));
                if sender.send(action).is_err() {
                    break;
                }
            }
        });
        Ok(Self { child, observations, actions, waiting: false })
    }

    /// The first action, before any torque flows: a policy for another space is refused here.
    pub fn first(&mut self, host: &Host, stop: &AtomicBool) -> Result<Vec<f64>> {
        let expected = host.controller().space().dim();
        let begin = Instant::now();
        let action = loop {
            go_on(stop)?;
            match self.actions.recv_timeout(LOOK) {
                Ok(action) => break action?,
                Err(RecvTimeoutError::Timeout) if begin.elapsed() < PATIENCE => (),
                Err(RecvTimeoutError::Timeout) => bail!("the policy did not answer within {} s", PATIENCE.as_secs()),
                Err(RecvTimeoutError::Disconnected) => bail!("the policy ended without an answer"),
            }
        };
        self.waiting = false;
        let found = action.len();
        ensure!(
            found == expected,
            "the policy answers with {found} numbers, actions of `{}` have {expected}",
            host.controller().space()
        );
        Ok(action)
    }

    /// Asks for an action, unless an answer is still due: questions that queue up would be answered late. A policy that
    /// is gone is noticed by its silence.
    pub fn ask(&mut self, host: &Host) {
        if !self.waiting {
            self.waiting = true;
            let _ = self.observations.try_send(observation(host));
        }
    }

    /// The latest action since the last call, if there is one.
    pub fn answer(&mut self) -> Result<Option<Vec<f64>>> {
        let mut latest = None;
        loop {
            match self.actions.try_recv() {
                Ok(action) => {
                    self.waiting = false;
                    latest = Some(action?);
                }
                Err(TryRecvError::Empty | TryRecvError::Disconnected) => return Ok(latest),
            }
        }
    }
}

impl Drop for Policy {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// What a policy is told: joint angles and velocities (7 + 7), tool position and quaternion x, y, z, w (3 + 4), its velocity (6), the
/// wrench on it (6), K that acts in N/m and Nm/rad (6), F_ff (6), F_d (1); all in base axes.
fn observation(host: &Host) -> String {
    let Some(y) = host.measurement() else { return String::new() };
    let controller = host.controller();
    let stiffness = host.effective_stiffness();
    let parts: [&[f64]; 9] = [
        y.q.as_slice(),
        y.qd.as_slice(),
        y.pose.translation.vector.as_slice(),
        y.pose.rotation.coords.as_slice(),
        y.twist.as_slice(),
        y.wrench.as_slice(),
        stiffness.as_slice(),
        controller.feedforward().as_slice(),
        &[controller.desired_force()],
    ];
    parts.concat().iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}

fn numbers(line: &str) -> Result<Vec<f64>> {
    let number = |word: &str| word.parse::<f64>().map_err(|_| anyhow!("the policy answers {word:?}: no number"));
    let numbers: Vec<f64> = line.split_whitespace().map(number).collect::<Result<_>>()?;
    if numbers.is_empty() {
        bail!("the policy answers with an empty line");
    }
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    /// It takes ten times as long as passes between two questions, and answers with the last joint's angle.
    #[test]
    fn a_slow_policy_answers_to_what_was_measured_after_its_last_answer() {
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("slow");
        std::fs::write(&program, "while read -r line; do set -- $line; sleep 0.05; echo $7; done").unwrap();
        let mut policy = Policy::start(&format!("sh {}", program.display())).unwrap();
        let (mut host, (mut arm, _)) = (testing::host(), testing::panda());
        let (begin, mut answers, mut at_last_answer) = (Instant::now(), 0, arm.q[6]);
        while answers < 10 {
            assert!(begin.elapsed() < PATIENCE, "{answers} answers");
            arm.q[6] += 1e-4;
            host.update(&arm, 0.001);
            policy.ask(&host);
            std::thread::sleep(Duration::from_millis(5));
            if let Some(answer) = policy.answer().unwrap() {
                assert!(answer[0] > at_last_answer, "answer {answers}: {} rad, now {}", answer[0], arm.q[6]);
                (answers, at_last_answer) = (answers + 1, arm.q[6]);
            }
        }
    }
}
