//! A policy in a process of its own: a line of JSON in, a line of JSON out.

use std::io::{BufRead, BufReader, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TryRecvError, sync_channel};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};

use crate::protocol::{Answer, Expected, Told};

/// Time that a policy has for its first answer, and the interval at which a wait looks for signals.
const PATIENCE: Duration = Duration::from_secs(30);
const LOOK: Duration = Duration::from_millis(50);
/// Time that a policy has to save what it has learned, once its input is closed.
const LEAVE: Duration = Duration::from_secs(10);

/// The running policy. The host does not watch its process: when no action comes in time, the watchdog stops the arm.
pub struct Policy {
    child: Child,
    /// Queue of states for the policy; `None` once the policy is to end.
    told: Option<SyncSender<Told>>,
    answers: Receiver<Result<Answer>>,
    /// Whether the policy has yet to answer the latest state.
    waiting: bool,
    /// Whether the policy has answered at least once.
    begun: bool,
}

impl Policy {
    /// Starts `command`, split into words at spaces, which is to answer with the `expected` actions.
    pub fn start(command: &str, expected: Expected) -> Result<Self> {
        let mut words = command.split_whitespace();
        let program = words.next().context("--policy: no program")?;
        let mut child = Command::new(program)
            .args(words)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            // Ctrl-C in a terminal thus reaches the host alone, which closes the policy's input so that the policy can save what it has learned.
            .process_group(0)
            .spawn()
            .with_context(|| format!("--policy {command}"))?;
        let mut input = child.stdin.take().context("the policy's input")?;
        let output = BufReader::new(child.stdout.take().context("the policy's output")?);
        // Serialising, writing and reading take too long for the control thread.
        let (told, received) = sync_channel::<Told>(1);
        std::thread::spawn(move || {
            for told in received {
                let Ok(line) = serde_json::to_string(&told) else { break };
                if writeln!(input, "{line}").and_then(|()| input.flush()).is_err() {
                    break;
                }
            }
        });
        let (sender, answers) = sync_channel(4);
        std::thread::spawn(move || {
            for line in output.lines() {
                let answer = line.map_err(Into::into).and_then(|line| Answer::read(&line, &expected));
                if sender.send(answer).is_err() {
                    break;
                }
            }
        });
        Ok(Self { child, told: Some(told), answers, waiting: false, begun: false })
    }

    /// Sends the arm's state to the policy, unless an answer is still due: a queued state would be answered late. A policy that has died
    /// is noticed because no action comes.
    pub fn tell(&mut self, told: Told) {
        if !self.waiting
            && let Some(to) = &self.told
        {
            self.waiting = true;
            let _ = to.try_send(told);
        }
    }

    /// The latest answer since the last call, if there is one. An action that nobody asked for is dropped: it is no sign that the policy
    /// still reads what the arm does. A request is taken whenever it comes, because it ends the episode.
    pub fn answer(&mut self) -> Result<Option<Answer>> {
        let mut latest = None;
        loop {
            match self.answers.try_recv() {
                Ok(answer) => {
                    let is_asked_for = std::mem::take(&mut self.waiting);
                    let answer = answer?;
                    if is_asked_for || matches!(answer, Answer::Ask(_)) {
                        latest = Some(answer);
                    }
                }
                Err(TryRecvError::Empty | TryRecvError::Disconnected) => return Ok(latest),
            }
        }
    }

    /// Between two episodes: the policy's answer to `told`. Only its first answer of all has a time limit. A late answer to an earlier
    /// state is dropped, and so is what came before `told` was sent. `None` if the policy has ended, or after a signal.
    pub fn answer_to(&mut self, told: Told, stop: &AtomicBool) -> Result<Option<Answer>> {
        let begin = Instant::now();
        let mut late = self.waiting;
        if !late {
            self.answer()?;
            self.tell(told.clone());
        }
        while !stop.load(Ordering::Relaxed) {
            match self.answers.recv_timeout(LOOK) {
                Ok(answer) => {
                    (self.waiting, self.begun) = (false, true);
                    if !std::mem::take(&mut late) {
                        return answer.map(Some);
                    }
                    self.tell(told.clone());
                }
                Err(RecvTimeoutError::Timeout) if self.begun || begin.elapsed() < PATIENCE => (),
                Err(RecvTimeoutError::Timeout) => bail!("the policy did not answer within {} s", PATIENCE.as_secs()),
                Err(RecvTimeoutError::Disconnected) => {
                    self.leave()?;
                    ensure!(self.begun, "the policy ended without an answer");
                    return Ok(None);
                }
            }
        }
        Ok(None)
    }

    /// Closes the policy's input and gives the policy time to end by itself.
    ///
    /// # Errors
    /// If the policy has ended with an error.
    fn leave(&mut self) -> Result<()> {
        self.told = None;
        let begin = Instant::now();
        while begin.elapsed() < LEAVE {
            match self.child.try_wait()? {
                Some(status) if status.success() => break,
                Some(status) => bail!("the policy has ended: {status}"),
                None => std::thread::sleep(LOOK),
            }
        }
        Ok(())
    }
}

impl Drop for Policy {
    fn drop(&mut self) {
        // The exit status is ignored: `answer_to` reports a policy that ends without being asked to.
        let _ = self.leave();
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::Ask;
    use crate::testing;
    use aforce::host::{Fault, Status};

    /// A policy may end while the arm rests between two episodes. An exit code other than 0 is an error.
    #[test]
    fn a_policy_that_ends_between_two_episodes_says_how() {
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("failing");
        let (host, stop) = (testing::host(), AtomicBool::new(false));
        let told = || Told::running(&host, 1, 0.0, &Status::Stopped, None).unwrap();
        for (code, expected) in [(0, None), (3, Some("exit status: 3"))] {
            let lines = format!("read -r line; echo '{{\"ask\": \"reset\"}}'; read -r line; exit {code}");
            std::fs::write(&program, lines).unwrap();
            let expected_actions = Expected::new(&"aforce".parse().unwrap(), false).unwrap();
            let mut policy = Policy::start(&format!("sh {}", program.display()), expected_actions).unwrap();
            assert!(policy.answer_to(told(), &stop).unwrap().is_some());
            match (policy.answer_to(told(), &stop), expected) {
                (Ok(None), None) => {}
                (Err(error), Some(words)) => assert!(error.to_string().contains(words), "{error}"),
                (found, _) => panic!("{:?}", found.map(|answer| answer.is_some())),
            }
        }
    }

    /// A program that goes on printing actions whatever the arm does: the watchdog stops the arm, at the goal that it had. What cannot be
    /// read is told nevertheless, and a request is taken.
    #[test]
    fn actions_that_nobody_asked_for_keep_no_watchdog_quiet() {
        let folder = tempfile::tempdir().unwrap();
        let [program, enough] = ["talking", "enough"].map(|name| folder.path().join(name));
        let lines = format!(
            "say() {{ echo '{{\"action\": [1, 0, 0, 0, 0, 0, -1]}}'; }}
read -r line; say
while [ ! -e {} ]; do sleep 0.01; say; done
echo hello; echo '{{\"ask\": \"end\"}}'",
            enough.display()
        );
        std::fs::write(&program, lines).unwrap();
        let (mut host, (arm, _), begin) = (testing::host(), testing::panda(), Instant::now());
        let expected = Expected::new(host.controller().space(), false).unwrap();
        let mut policy = Policy::start(&format!("sh {}", program.display()), expected).unwrap();
        let told = Told::running(&host, 1, 0.0, &Status::Stopped, None).unwrap();
        assert!(matches!(policy.answer_to(told, &AtomicBool::new(false)).unwrap(), Some(Answer::Action(_))));
        let goal = *host.controller().goal();
        let mut status = Status::Stopped;
        for _ in 0..300 {
            status = host.update(&arm, 0.001).status;
            if let Some(Answer::Action(action)) = policy.answer().unwrap() {
                let _ = host.set_goal(action.entries());
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        assert!(matches!(status, Status::Fault(Fault::Silence { .. })), "{status:?}");
        assert_eq!(*host.controller().goal(), goal);

        std::fs::write(&enough, "").unwrap();
        let mut next = || loop {
            assert!(begin.elapsed() < PATIENCE, "nothing comes");
            match policy.answer() {
                Ok(None) => std::thread::sleep(LOOK),
                found => break found,
            }
        };
        let unreadable = next().unwrap_err().to_string();
        assert!(unreadable.starts_with("the policy answers \"hello\""), "{unreadable}");
        assert_eq!(next().unwrap(), Some(Answer::Ask(Ask::End)));
    }

    /// A program that answers twice would otherwise stay one answer behind.
    #[test]
    fn what_came_before_a_question_is_no_answer_to_it() {
        let folder = tempfile::tempdir().unwrap();
        let [program, twice] = ["talking", "twice"].map(|name| folder.path().join(name));
        let lines = format!(
            "read -r line; echo '{{\"ask\": \"reset\"}}'; echo '{{\"ask\": \"reset\"}}'; touch {}
read -r line; echo '{{\"ask\": \"end\"}}'",
            twice.display()
        );
        std::fs::write(&program, lines).unwrap();
        let (host, stop, begin) = (testing::host(), AtomicBool::new(false), Instant::now());
        let told = || Told::running(&host, 1, 0.0, &Status::Stopped, None).unwrap();
        let expected = Expected::new(&"aforce".parse().unwrap(), false).unwrap();
        let mut policy = Policy::start(&format!("sh {}", program.display()), expected).unwrap();
        assert_eq!(policy.answer_to(told(), &stop).unwrap(), Some(Answer::Ask(Ask::Reset)));
        while !twice.exists() {
            assert!(begin.elapsed() < PATIENCE, "no second answer");
            std::thread::sleep(LOOK);
        }
        // The thread that reads the program's output takes the second answer meanwhile.
        std::thread::sleep(10 * LOOK);
        assert_eq!(policy.answer_to(told(), &stop).unwrap(), Some(Answer::Ask(Ask::End)));
    }

    /// The policy takes ten times as long as passes between two states, and answers with the last joint's angle.
    #[test]
    fn a_slow_policy_answers_to_what_was_measured_after_its_last_answer() {
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("slow");
        let lines = r#"while read -r line; do q=${line#*'"q":['}; q=${q%%]*}; sleep 0.05; echo "{\"action\": [${q##*,}, 0, 0, 0, 0, 0]}"; done"#;
        std::fs::write(&program, lines).unwrap();
        let expected = Expected::new(&"aforce".parse().unwrap(), false).unwrap();
        let mut policy = Policy::start(&format!("sh {}", program.display()), expected).unwrap();
        let (mut host, (mut arm, _)) = (testing::host(), testing::panda());
        let group = std::fs::read_to_string(format!("/proc/{}/stat", policy.child.id())).unwrap();
        let group = group.rsplit(')').next().and_then(|fields| fields.split_whitespace().nth(2)).unwrap();
        assert_eq!(group, policy.child.id().to_string(), "a group of its own");
        let (begin, mut answers, mut at_last_answer) = (Instant::now(), 0, arm.q[6]);
        while answers < 10 {
            assert!(begin.elapsed() < PATIENCE, "{answers} answers");
            arm.q[6] += 1e-4;
            host.update(&arm, 0.001);
            policy.tell(Told::running(&host, 1, 0.0, &Status::Stopped, None).unwrap());
            std::thread::sleep(Duration::from_millis(5));
            if let Some(Answer::Action(answer)) = policy.answer().unwrap() {
                let answer = answer.entries()[0];
                assert!(answer > at_last_answer, "answer {answers}: {answer} rad, now {}", arm.q[6]);
                (answers, at_last_answer) = (answers + 1, arm.q[6]);
            }
        }
    }
}
