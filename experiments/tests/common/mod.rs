//! What the tests of the programs share.
#![allow(dead_code, reason = "every file of tests uses a part of it")]

use std::path::{Path, PathBuf};
use std::process::Child;
use std::time::{Duration, Instant};

use assert_cmd::Command;
use experiments::report::columns::Columns;
use rustix::process::{Pid, Signal, kill_process};

pub fn program(name: &str) -> Command {
    Command::new(assert_cmd::cargo::cargo_bin(name))
}

/// A run small enough for a test, but with every part of a real one.
pub fn train(out: &Path) -> Command {
    train_for(2000, out)
}

/// The same run with `steps` actions.
pub fn train_for(steps: u64, out: &Path) -> Command {
    let mut command = program("train");
    command.args(["--seed", "7", "--quiet", "--set", "evaluate_every=1000", "--steps", &steps.to_string()]);
    command.args(["--set", "evaluation_episodes=1", "--set", "checkpoint_every=500"]);
    command.args(["--set", "learner.random_steps=500", "--set", "learner.hidden=[32, 32]"]);
    command.args(["--set", "learner.batch_size=16", "--set", "env.horizon=100", "--out"]).arg(out);
    command
}

/// Where [`train`] puts its run.
pub fn run_folder(out: &Path) -> PathBuf {
    out.join("lift/aforce/seed_7")
}

/// A sweep of two small runs of `steps` actions.
pub fn few(steps: u64) -> String {
    format!(
        "[run]\nsteps = {steps}\nevaluate_every = 300\nevaluation_episodes = 1\nenv = {{ horizon = 100 }}\n\
         learner = {{ hidden = [8], batch_size = 8, random_steps = 100 }}\n\
         [[group]]\ntasks = [\"lift\"]\nspaces = [\"aforce\", \"osc\"]\nseeds = [1]\n"
    )
}

/// The states of a sweep's runs, as `sweep --list` prints them.
pub fn states(file: &Path, out: &Path) -> Vec<String> {
    let output = program("sweep").arg(file).arg("--list").arg("--out").arg(out).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().skip(1).map(|line| line.split_whitespace().nth(4).unwrap().to_string()).collect()
}

/// A running program, which is stopped if the test fails.
pub struct Running(Child);

pub fn start(command: &Command) -> Running {
    Running(std::process::Command::new(command.get_program()).args(command.get_args()).spawn().unwrap())
}

/// Starts a program whose progress goes to a pipe without a reader.
pub fn start_unheard(command: &Command) -> Running {
    let (_, deaf) = std::io::pipe().unwrap();
    let loud = command.get_args().filter(|argument| *argument != "--quiet");
    Running(std::process::Command::new(command.get_program()).args(loud).stderr(deaf).spawn().unwrap())
}

/// Starts a program whose standard error goes to a file.
pub fn start_loud(command: &Command, errors: &Path) -> Running {
    let file = std::fs::File::create(errors).unwrap();
    Running(std::process::Command::new(command.get_program()).args(command.get_args()).stderr(file).spawn().unwrap())
}

impl Running {
    /// Its process id.
    pub fn id(&self) -> u32 {
        self.0.id()
    }

    /// Waits until it ends by itself; its exit code.
    pub fn ends(&mut self) -> Option<i32> {
        self.0.wait().unwrap().code()
    }

    /// Waits until `done` is true, which the program has to bring about before it ends.
    pub fn wait_until(&mut self, what: &str, mut done: impl FnMut() -> bool) {
        let deadline = Instant::now() + Duration::from_secs(300);
        loop {
            let ended = self.0.try_wait().unwrap().is_some();
            if done() {
                return;
            }
            assert!(!ended, "ended before there was {what}");
            assert!(Instant::now() < deadline, "no {what}");
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Waits until there is a row in `table`.
    pub fn wait_for_a_row(&mut self, table: &Path) {
        self.wait_until(&format!("a row in {}", table.display()), || last_step(table).is_some());
    }

    /// Ends it with SIGKILL.
    pub fn kill(&mut self) {
        self.0.kill().unwrap();
        self.0.wait().unwrap();
    }

    /// Sends it a signal.
    pub fn signal(&mut self, signal: Signal) {
        kill_process(Pid::from_child(&self.0), signal).unwrap();
    }

    /// Sends it SIGHUP, as a closed terminal does; its exit code.
    pub fn hang_up(&mut self) -> Option<i32> {
        self.signal(Signal::HUP);
        self.0.wait().unwrap().code()
    }

    /// Sends it SIGTERM twice, as a scheduler and the sweep that started it would; its exit code.
    pub fn stop(&mut self) -> Option<i32> {
        for _ in 0..2 {
            self.signal(Signal::TERM);
        }
        self.0.wait().unwrap().code()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if matches!(self.0.try_wait(), Ok(None)) {
            self.stop();
        }
    }
}

/// Training action of the last row of a table, if there is one.
pub fn last_step(table: &Path) -> Option<f64> {
    Columns::read(table).ok()?.values("step").ok()?.last().copied()
}

/// The program's own record in a checkpoint, if the checkpoint exists.
pub fn note(checkpoint: &Path) -> Option<serde_json::Value> {
    let state = std::fs::read(checkpoint.join("state.json")).ok()?;
    Some(serde_json::from_slice::<serde_json::Value>(&state).unwrap()["caller"].take())
}

/// A changed `state.json` without its checksum, which earlier versions did not write.
pub fn unsummed(text: &str) -> String {
    text.lines().filter(|line| !line.contains("\"checksum\"")).map(|line| format!("{line}\n")).collect()
}

/// Asserts that the named files have the same bytes in both folders.
pub fn assert_same(a: &Path, b: &Path, names: &[&str]) {
    for name in names {
        let [a, b] = [a, b].map(|folder| std::fs::read(folder.join(name)).unwrap());
        assert!(a == b, "{name} differs");
    }
}

/// A row of the replay buffer.
pub struct Stored {
    pub observation: Vec<f32>,
    pub action: Vec<f32>,
    pub next: Vec<f32>,
    pub reward: f32,
    pub discount: f32,
}

/// The replay buffer in a run's last checkpoint, laid out as `crates/sac/src/replay_file.rs` says. The run has to be so
/// short that no segment of the buffer is full.
pub fn stored(run: &Path) -> Vec<Stored> {
    let bytes = std::fs::read(run.join("checkpoints/last/replay.bin")).unwrap();
    let count = |n: usize| u64::from_le_bytes(bytes[8 + 8 * n..][..8].try_into().unwrap()) as usize;
    let [dim, actions, _capacity, 0, 0, seen, 0, 0, done, waiting] = std::array::from_fn(count) else {
        panic!("nothing is forgotten, and no segment is full");
    };
    assert_eq!(waiting, 0, "nothing waits for further rewards");
    let floats: Vec<f32> = bytes[88..bytes.len() - 32].as_chunks().0.iter().map(|x| f32::from_le_bytes(*x)).collect();
    assert_eq!(floats.len(), seen + done);
    let (observations, rows) = floats.split_at(seen);
    let observation = |place: usize| observations[place * dim..][..dim].to_vec();
    let row = |row: &[f32]| {
        let (action, rest) = row.split_at(actions);
        let [reward, discount, high, low, further] = rest.try_into().unwrap();
        let place = high as usize * (1 << 20) + low as usize;
        let (seen, next) = (observation(place), observation(place + further as usize));
        Stored { observation: seen, action: action.to_vec(), next, reward, discount }
    };
    rows.chunks_exact(actions + 5).map(row).collect()
}

/// Standard error of a command that must fail with `code`: one line, except for help with the command line and for a
/// sweep's list of what failed.
pub fn error(command: &mut Command, code: i32) -> String {
    let output = command.output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{text}");
    if code != 3 && !text.contains("Usage:") && !text.contains("--help") {
        assert!(text.starts_with("error: ") && text.lines().count() == 1, "{text}");
    }
    text
}

pub fn expect(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "{part:?} is not in: {text}");
    }
}
