//! Every write of a program may fail: once, on a disk that is full from then on, or because the program is killed.
//! Afterwards its output is complete, or an error of one line names a file; and the same command, given again, gives the
//! same bytes.
//!
//! `FAILING_WRITES=all cargo test --release -p experiments --test failing_writes` tries every write in all three ways, and `FAILING_WRITES=10` about ten of
//! each program.
#![cfg(all(target_os = "linux", target_arch = "x86_64"))]

mod common;
#[path = "common/tracer.rs"]
mod tracer;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicU64, Ordering};

use common::{few, program};
use tracer::{Fault, Traced};

/// What a program left below a folder, by name.
type Files = BTreeMap<PathBuf, Vec<u8>>;

/// Whether a file may differ after a failure: it holds a time, or is an unfinished or outdated file that the next save removes.
fn differs(name: &Path) -> bool {
    let text = name.to_string_lossy();
    let unfinished = text.ends_with(".tmp") || name.iter().any(|part| part.to_string_lossy().starts_with('.'));
    unfinished
        || ["manifest.json", "progress.csv", "log.txt", "lock", "last/state.json"].iter().any(|end| text.ends_with(end))
}

fn files(folder: &Path) -> Files {
    let below = walkdir::WalkDir::new(folder).into_iter().flatten().filter(|entry| entry.file_type().is_file());
    let of = |entry: walkdir::DirEntry| {
        let name = entry.path().strip_prefix(folder).unwrap().to_path_buf();
        (!differs(&name)).then(|| (name, fs::read(entry.path()).unwrap()))
    };
    below.filter_map(of).collect()
}

fn named(program: &str) -> Command {
    Command::new(assert_cmd::cargo::cargo_bin(program))
}

/// A program that writes below a folder.
struct Trial<'a> {
    /// What the folder contains before, if anything.
    before: Option<&'a Path>,
    /// The command that writes below a folder.
    command: &'a (dyn Fn(&Path) -> Command + Sync),
    /// Arguments that are added for the second call.
    again: &'a [&'a str],
    /// Whether every file that exists after a failure has to be complete.
    whole_files: bool,
    /// One of so many writes is made to fail, unless `FAILING_WRITES` says otherwise: neighbouring writes are of the same code.
    stride: u64,
}

impl Trial<'_> {
    fn place(&self) -> tempfile::TempDir {
        let place = tempfile::tempdir().unwrap();
        if let Some(before) = self.before {
            let copied = Command::new("cp").arg("-r").arg(before).arg(place.path().join("out")).status().unwrap();
            assert!(copied.success());
        }
        place
    }

    fn run(&self) {
        let reference = self.place();
        let out = reference.path().join("out");
        let traced = tracer::run((self.command)(&out), &out, None).unwrap();
        assert!(traced.status.success(), "{}", traced.stderr);
        let (writes, wanted) = (traced.writes, files(&out));
        let asked = std::env::var("FAILING_WRITES").unwrap_or_default();
        let stride = asked.parse().map_or(self.stride, |trials: u64| (writes / trials).max(1));
        let faults = [Fault::Once, Fault::Full, Fault::Kill];
        let trials: Vec<(u64, Fault)> = if asked == "all" {
            (1..=writes).flat_map(|at| faults.map(|fault| (at, fault))).collect()
        } else {
            (1..=writes).step_by(stride as usize).map(|at| (at, faults[(at / stride % 3) as usize])).collect()
        };
        assert!(trials.len() > 4, "{writes} writes");
        println!("{} of {writes} writes and faults", trials.len());
        let next = AtomicU64::new(0);
        let work = || {
            while let Some(&(at, fault)) = trials.get(next.fetch_add(1, Ordering::Relaxed) as usize) {
                self.one(at, fault, &wanted);
            }
        };
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        std::thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
    }

    /// Runs the command with a fault, and then again without.
    fn one(&self, at: u64, fault: Fault, wanted: &Files) {
        let place = self.place();
        let out = place.path().join("out");
        let Traced { status, stderr, failed, .. } = tracer::run((self.command)(&out), &out, Some((at, fault))).unwrap();
        let what = format!("{fault:?} at {at}, {}", failed.unwrap_or_default());
        let found = files(&out);
        if fault != Fault::Kill {
            let (told, lost) = (stderr.contains(&*out.to_string_lossy()), found != *wanted);
            assert!(!lost || told, "{what}: lost without a word ({status}): {stderr}");
            assert!(status.success() || told, "{what}: names no file: {stderr}");
            let errors = stderr.lines().filter(|line| line.starts_with("error: ")).count();
            assert!(errors <= 1 && !stderr.contains("panicked"), "{what}: {stderr}");
        }
        if self.whole_files {
            for (name, bytes) in &found {
                let before = self.before.and_then(|before| fs::read(before.join(name)).ok());
                let whole = wanted.get(name) == Some(bytes) || before.as_ref() == Some(bytes);
                assert!(whole, "{what}: {} is neither the old one nor the new one", name.display());
            }
        }
        let again = (self.command)(&out).args(self.again).output().unwrap();
        assert!(again.status.success(), "{what}: then {}", String::from_utf8_lossy(&again.stderr));
        let found = files(&out);
        let names = |files: &Files| files.keys().cloned().collect::<Vec<_>>();
        assert_eq!(names(&found), names(wanted), "{what}");
        for (name, bytes) in &found {
            assert!(wanted[name] == *bytes, "{what}: {} differs", name.display());
        }
    }
}

/// A short run, in which a checkpoint replaces another.
fn train(out: &Path) -> Command {
    let mut command = named("train");
    command.args(["--seed", "7", "--quiet", "--steps", "60", "--set", "env.horizon=20", "--set", "evaluate_every=20"]);
    command.args([
        "--set",
        "evaluation_episodes=1",
        "--set",
        "checkpoint_every=30",
        "--set",
        "learner.random_steps=20",
    ]);
    command.args(["--set", "learner.hidden=[8]", "--set", "learner.batch_size=4", "--out"]).arg(out);
    command
}

#[test]
fn a_run_loses_nothing() {
    Trial { before: None, command: &train, again: &["--resume"], whole_files: false, stride: 2 }.run();
}

/// A sweep of two runs that are as short, in the folder `place`.
fn sweep(place: &Path) -> PathBuf {
    let file = place.join("few.toml");
    let text = few(40).replace("evaluate_every = 300", "evaluate_every = 20").replace("horizon = 100", "horizon = 20");
    fs::write(&file, text.replace("random_steps = 100", "random_steps = 20")).unwrap();
    file
}

#[test]
fn a_sweep_loses_nothing() {
    let place = tempfile::tempdir().unwrap();
    let file = sweep(place.path());
    let command = |out: &Path| {
        let mut command = named("sweep");
        command.arg(&file).args(["--jobs", "1", "--out"]).arg(out);
        command
    };
    Trial { before: None, command: &command, again: &[], whole_files: false, stride: 13 }.run();
}

/// Output of `report` and `archive` for the runs of a sweep.
#[test]
fn tables_and_archives_are_whole_or_not_there() {
    let place = tempfile::tempdir().unwrap();
    let runs = place.path().join("runs");
    program("sweep").arg(sweep(place.path())).args(["--jobs", "1", "--out"]).arg(&runs).assert().success();
    let command = |program: &'static str, option: &'static str, runs: &Path| {
        let runs = runs.to_path_buf();
        move |out: &Path| {
            let mut command = named(program);
            command.arg(&runs).arg(option).arg(out);
            command
        }
    };
    let report = command("report", "--out", &runs);
    Trial { before: None, command: &report, again: &[], whole_files: true, stride: 5 }.run();

    let first = place.path().join("first");
    let archived = place.path().join("archived");
    fs::create_dir_all(first.join("lift")).unwrap();
    let copied = Command::new("cp").arg("-r").args([runs.join("lift/aforce"), first.join("lift")]).status();
    assert!(copied.unwrap().success());
    program("archive").arg(&first).arg("--out").arg(&archived).assert().success();
    // A second run is added to an archive of one.
    let archive = command("archive", "--out", &runs);
    Trial { before: Some(&archived), command: &archive, again: &[], whole_files: true, stride: 1 }.run();
}

#[test]
fn episodes_of_an_evaluation_are_whole_or_not_there() {
    let command = |out: &Path| {
        fs::create_dir_all(out).unwrap();
        let mut command = named("evaluate");
        command.args(["--random", "--episodes", "1", "--set", "env.horizon=20", "--csv"]).arg(out.join("episodes.csv"));
        command
    };
    let again = |out: &Path| {
        // `evaluate` does not overwrite its table.
        let _ = fs::remove_file(out.join("episodes.csv"));
        command(out)
    };
    Trial { before: None, command: &again, again: &[], whole_files: true, stride: 1 }.run();
}
