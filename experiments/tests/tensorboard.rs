//! TensorBoard's own reader finds the scalars of a run. Skipped, with a word, where Python has no
//! tensorboard; `PYTHON` names another Python.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use experiments::tensorboard::events::EventFile;

/// Step and value of every scalar of every tag.
type Scalars = BTreeMap<String, Vec<(u64, f64)>>;

fn python() -> Command {
    Command::new(std::env::var_os("PYTHON").unwrap_or_else(|| "python3".into()))
}

/// What TensorBoard reads in `folder`; `None` without TensorBoard.
fn read(folder: &Path) -> Option<Scalars> {
    let found = python().args(["-c", "import tensorboard"]).output().is_ok_and(|output| output.status.success());
    if !found {
        eprintln!("skipped: no Python with tensorboard (PYTHON can name one)");
        return None;
    }
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../scripts/read_events.py");
    let output = python().arg(script).arg(folder).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(serde_json::from_slice(&output.stdout).unwrap())
}

/// A run that was killed at step 5, after its last checkpoint at step 3, says steps 4 and 5 anew.
#[test]
fn a_resumed_run_leaves_one_curve() {
    let folder = tempfile::tempdir().unwrap();
    let mut first = EventFile::create(folder.path(), 0).unwrap();
    (1..=5).for_each(|step| first.write(step, &[("a/one", step as f64), ("two", -0.5)]).unwrap());
    let mut second = EventFile::create(folder.path(), 3).unwrap();
    (4..=300).for_each(|step| second.write(step, &[("a/one", 1000.0)]).unwrap());
    let Some(scalars) = read(folder.path()) else { return };
    let expected: Vec<_> = (1..=300).map(|step| (step, if step > 3 { 1000.0 } else { step as f64 })).collect();
    assert_eq!(scalars["a/one"], expected);
    assert_eq!(scalars["two"], [(1, -0.5), (2, -0.5), (3, -0.5)]);
}

#[test]
fn a_run_says_what_its_tables_say() {
    let folder = tempfile::tempdir().unwrap();
    let mut train = assert_cmd::Command::new(assert_cmd::cargo::cargo_bin("train"));
    train.args(["--tensorboard", "--quiet", "--seed", "3", "--steps", "2000", "--set", "evaluate_every=1000"]);
    train.args(["--set", "evaluation_episodes=2", "--set", "learner.random_steps=500", "--set", "env.horizon=100"]);
    train.args(["--set", "learner.hidden=[16]", "--set", "learner.batch_size=8", "--out"]).arg(folder.path());
    train.assert().success();
    let run = folder.path().join("lift/aforce/seed_3");
    let Some(scalars) = read(&run) else { return };

    let column = |table: &str, name: &str| {
        let mut reader = csv::Reader::from_path(run.join(table)).unwrap();
        let headers = reader.headers().unwrap().clone();
        let [step, value] = ["step", name].map(|name| headers.iter().position(|h| h == name).unwrap());
        let row = |row: csv::StringRecord| (row[step].parse().unwrap(), row[value].parse().unwrap());
        reader.records().map(|record| row(record.unwrap())).collect::<Vec<(u64, f64)>>()
    };
    let same = |tag: &str, expected: &[(u64, f64)]| {
        let seen = &scalars[tag];
        assert_eq!(seen.len(), expected.len(), "{tag}");
        for (a, b) in seen.iter().zip(expected) {
            assert!(a.0 == b.0 && (a.1 - b.1).abs() <= 1e-6 * b.1.abs(), "{tag}: {a:?} {b:?}");
        }
    };
    same("charts/episodic_return", &column("episodes.csv", "return"));
    same("energy/per_action_j", &column("episodes.csv", "energy_per_action_j"));
    same("contact/max_force_n", &column("episodes.csv", "max_contact_force_n"));
    same("charts/SPS", &column("progress.csv", "env_steps_per_s"));
    same("losses/alpha", &column("progress.csv", "alpha"));
    let pairs = column("eval.csv", "return");
    let means: Vec<_> = pairs.chunks(2).map(|pair| (pair[0].0, (pair[0].1 + pair[1].1) / 2.0)).collect();
    same("eval/episodic_return", &means);
}
