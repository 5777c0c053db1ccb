//! The time per run that `report` takes does not grow with the number of runs.

mod common;

use std::fs;
use std::path::Path;

use common::{program, run_folder, train_for};

/// User and system time (s) of the programs that have ended.
fn cpu_s() -> f64 {
    // SAFETY: the system fills a struct of plain numbers.
    let usage = unsafe {
        let mut usage: libc::rusage = std::mem::zeroed();
        assert_eq!(libc::getrusage(libc::RUSAGE_CHILDREN, &raw mut usage), 0);
        usage
    };
    [usage.ru_utime, usage.ru_stime].iter().map(|time| time.tv_sec as f64 + 1e-6 * time.tv_usec as f64).sum()
}

/// The same run with another seed.
fn copy(run: &Path, to: &Path, seed: usize) {
    fs::create_dir_all(to).unwrap();
    for name in ["config.toml", "manifest.json", "episodes.csv", "eval.csv", "progress.csv", "DONE"] {
        let text = fs::read_to_string(run.join(name)).unwrap();
        let text =
            text.replace("seed = 7\n", &format!("seed = {seed}\n")).replace(",aforce,7,", &format!(",aforce,{seed},"));
        fs::write(to.join(name), text).unwrap();
    }
}

/// Compares the CPU time of a further run among many runs with that among few. A step that is quadratic in the number of
/// runs makes it three times as much. Both times are differences, so that the start of the program does not enter.
#[test]
fn a_further_run_costs_a_report_the_same_among_many() {
    let folder = tempfile::tempdir().unwrap();
    train_for(600, folder.path()).args(["--set", "evaluate_every=300"]).assert().success();
    let run = run_folder(folder.path());
    let counts = [40, 400, 1600];
    let times = counts.map(|runs| {
        let root = folder.path().join(runs.to_string());
        (1..=runs).for_each(|seed| copy(&run, &root.join("lift/aforce").join(format!("seed_{seed}")), seed));
        let before = cpu_s();
        program("report").arg(&root).assert().success();
        let rows = fs::read_to_string(root.join("runs.csv")).unwrap().lines().count();
        assert_eq!(rows, runs + 1);
        cpu_s() - before
    });
    let cost = |from: usize, to: usize| (times[to] - times[from]) / (counts[to] - counts[from]) as f64;
    println!("{times:.2?} s for {counts:?} runs");
    assert!(cost(1, 2) < 2.2 * cost(0, 1), "{times:.2?} s for {counts:?} runs");
}
