//! The programs as a user meets them: bad input is answered in one line that names what is
//! wrong, nothing is overwritten, and a run that was killed goes on to the same bytes.

use std::path::Path;
use std::time::{Duration, Instant};

use assert_cmd::Command;

fn program(name: &str) -> Command {
    Command::new(assert_cmd::cargo::cargo_bin(name))
}

/// A run small enough for a test, but with every part of a real one.
fn train(out: &Path) -> Command {
    let mut command = program("train");
    command.args(["--seed", "7", "--steps", "2000", "--quiet", "--set", "evaluate_every=1000"]);
    command.args(["--set", "evaluation_episodes=1", "--set", "checkpoint_every=500"]);
    command.args(["--set", "learner.random_steps=500", "--set", "learner.hidden=[32, 32]"]);
    command.args(["--set", "learner.batch_size=16", "--set", "env.horizon=100", "--out"]).arg(out);
    command
}

/// Waits until `path` is there; `child` is to write it.
fn wait_for(path: &Path, child: &mut std::process::Child) {
    let deadline = Instant::now() + Duration::from_secs(300);
    while !path.exists() {
        assert!(child.try_wait().unwrap().is_none(), "ended before there was {}", path.display());
        assert!(Instant::now() < deadline, "no {}", path.display());
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Standard error of a command that must fail with `code`, as one line.
fn error(command: &mut Command, code: i32) -> String {
    let output = command.output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{text}");
    if text.starts_with("error: ") && !text.contains("Usage:") && !text.contains("--help") {
        assert_eq!(text.lines().count(), 1, "{text}");
    }
    text
}

fn expect(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "{part:?} is not in: {text}");
    }
}

#[test]
fn bad_input_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    expect(&error(train(out).args(["--set", "learner.gama=0.9"]), 2), &["gama", "did you mean \"gamma\""]);
    expect(&error(train(out).args(["--set", "learner.gamma=1.5"]), 2), &["gamma", "1.5"]);
    expect(&error(train(out).args(["--set", "env.controller.control_hz=510"]), 2), &["control_hz", "510", "20"]);
    expect(&error(train(out).args(["--set", "env.simulation.substeps=1000000000"]), 2), &["substeps", "1 to 64"]);
    let alpha = "env.controller.impedance.aforce.translation.feedforward_gain=50000";
    expect(
        &error(train(out).args(["--set", "env.controller.impedance.aforce.sign=literal", "--set", alpha]), 2),
        &["50000", "allow_unstable"],
    );
    expect(&error(train(out).args(["--config", "/nowhere.toml"]), 1), &["/nowhere.toml"]);
    expect(&error(train(out).args(["--space", "aforc"]), 2), &["aforc", "aforce"]);
    expect(&error(train(out).args(["--steps", "0"]), 2), &["--steps"]);
    let file = out.join("a_file");
    std::fs::write(&file, "").unwrap();
    expect(&error(&mut train(&file.join("below")), 1), &["a_file"]);
    expect(&error(program("evaluate").arg("--run").arg(out), 1), &["not a run folder"]);
    let replay = || {
        let mut command = program("replay");
        command.args(["--expert", "--actions", "3", "--html"]).arg(out.join("page.html"));
        command
    };
    expect(&error(program("replay").arg("--expert"), 2), &["--html", "--png"]);
    expect(&error(program("replay").args(["--expert", "--png", "x.png", "--beside", "osc"]), 2), &["--html"]);
    expect(&error(replay().args(["--beside", "aforc"]), 1), &["aforc", "not an action space", "not a run folder"]);
    assert!(!out.join("page.html").exists());
    assert!(!out.join("lift").exists(), "a refused run leaves nothing behind");
}

#[test]
fn a_killed_run_goes_on_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, killed) = (folder.path().join("whole"), folder.path().join("killed"));
    train(&whole).assert().success();

    let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin("train"))
        .args(train(&killed).get_args())
        .spawn()
        .unwrap();
    let run = killed.join("lift/aforce/seed_7");
    wait_for(&run.join("checkpoints/last/state.json"), &mut child);
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!run.join("DONE").exists(), "killed before its end");
    expect(&error(&mut train(&killed), 1), &["already holds a run", "--resume"]);
    expect(
        &error(train(&killed).args(["--resume", "--set", "learner.gamma=0.5"]), 1),
        &["another configuration", "gamma"],
    );
    train(&killed).arg("--resume").assert().success();
    let manifest = std::fs::read_to_string(run.join("manifest.json")).unwrap();
    assert!(manifest.contains("continued") && manifest.contains("--resume"), "{manifest}");
    let shorter =
        train(&killed).get_args().map(|a| if a == "2000" { "1500".into() } else { a.to_owned() }).collect::<Vec<_>>();
    expect(&error(program("train").args(shorter).arg("--resume"), 1), &["2000", "not to 1500"]);

    let same = |name: &str| {
        let read = |root: &Path| std::fs::read(root.join("lift/aforce/seed_7").join(name)).unwrap();
        assert!(read(&whole) == read(&killed), "{name} differs");
    };
    for name in ["config.toml", "episodes.csv", "eval.csv", "checkpoints/last/actor.safetensors"] {
        same(name);
    }
    for name in ["online_actor", "critic", "target", "optimizer"] {
        same(&format!("checkpoints/last/{name}.safetensors"));
    }
    same("checkpoints/last/replay.bin");
}

#[cfg(unix)]
#[test]
fn sigterm_saves_and_exits_with_75() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = train(folder.path());
    command.args(["--set", "steps=1000000"]);
    let args: Vec<_> = command.get_args().map(ToOwned::to_owned).filter(|a| a != "2000" && a != "--steps").collect();
    let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin("train")).args(args).spawn().unwrap();
    let run = folder.path().join("lift/aforce/seed_7");
    wait_for(&run.join("episodes.csv"), &mut child);
    std::thread::sleep(Duration::from_millis(300));
    let pid = child.id().to_string();
    // Twice, as a scheduler and the sweep that started it would.
    assert!(std::process::Command::new("kill").args(["-TERM", &pid, &pid]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(75));
    assert!(run.join("checkpoints/last/replay.bin").exists());
    assert!(!run.join("DONE").exists());
}

#[test]
fn a_trained_run_is_evaluated_and_checked() {
    let folder = tempfile::tempdir().unwrap();
    train(folder.path()).assert().success();
    let run = folder.path().join("lift/aforce/seed_7");
    let table = folder.path().join("table.csv");
    let evaluate = || {
        let mut command = program("evaluate");
        command.args(["--episodes", "2", "--run"]).arg(&run);
        command
    };
    evaluate().arg("--csv").arg(&table).assert().success();
    let rows = std::fs::read_to_string(&table).unwrap();
    assert_eq!(rows.lines().count(), 3);
    assert!(
        rows.contains("lift,aforce,7,1000,") || rows.contains("lift,aforce,7,2000,"),
        "an evaluation's step: {rows}"
    );
    expect(&error(evaluate().arg("--csv").arg(&table), 1), &["table.csv", "nothing was overwritten"]);
    let page = folder.path().join("page.html");
    let replay = |beside: &str| {
        let mut command = program("replay");
        command.arg("--run").arg(&run).args(["--actions", "3", "--beside", beside, "--html"]).arg(&page);
        command
    };
    replay(run.to_str().unwrap()).assert().success();
    assert_eq!(std::fs::read_to_string(&page).unwrap().matches(r#""title":"lift aforce""#).count(), 2);
    expect(&error(&mut replay("variable"), 2), &["variable", "one action space"]);
    let mut wipe = program("replay");
    wipe.args(["--expert", "--task", "wipe", "--actions", "3", "--beside"]).arg(&run).arg("--html").arg(&page);
    expect(&error(&mut wipe, 2), &["--beside", "plays lift, not wipe"]);

    // The same sizes, another action space: the sizes alone would not tell.
    expect(&error(evaluate().args(["--space", "osc"]), 1), &["trained for lift with aforce", "osc"]);
    expect(&error(evaluate().args(["--space", "variable"]), 1), &["state.json"]);

    let actor = run.join("checkpoints/best/actor.safetensors");
    let bytes = std::fs::read(&actor).unwrap();
    std::fs::write(&actor, &bytes[..bytes.len() / 2]).unwrap();
    expect(&error(&mut evaluate(), 1), &["actor.safetensors"]);
    std::fs::remove_file(&actor).unwrap();
    expect(&error(&mut evaluate(), 1), &["actor.safetensors"]);
}

/// Control at 20 Hz with a stiff arm blows the simulation up: the episode ends, is counted,
/// and training goes on.
#[test]
fn a_diverged_simulation_is_counted() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = train(folder.path());
    command.args(["--space", "osc", "--set", "env.controller.control_hz=20"]);
    command.args(["--set", "env.controller.impedance.osc.translation=30000"]);
    command.assert().success();
    let table = std::fs::read_to_string(folder.path().join("lift/osc/seed_7/episodes.csv")).unwrap();
    let mut rows = csv::Reader::from_reader(table.as_bytes());
    let headers = rows.headers().unwrap().clone();
    let column = |name| headers.iter().position(|h| h == name).unwrap();
    let (diverged, total) = (column("diverged"), column("return"));
    let rows: Vec<_> = rows.records().map(Result::unwrap).collect();
    assert!(rows.iter().any(|row| &row[diverged] == "true"), "{table}");
    assert!(rows.iter().all(|row| row[total].parse::<f64>().unwrap().is_finite()));
}

/// A sweep does what it can, names what failed, and does the rest when called again.
#[test]
fn a_sweep_hides_no_run_and_repeats_none() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("few.toml"), folder.path().join("out"));
    let text = "[run]\nsteps = 600\nevaluate_every = 300\nevaluation_episodes = 1\nenv = { horizon = 100 }\n\
                learner = { hidden = [8], batch_size = 8, random_steps = 100 }\n\
                [[group]]\ntasks = [\"lift\"]\nspaces = [\"aforce\", \"osc\"]\nseeds = [1]\n";
    std::fs::write(&file, text).unwrap();
    let sweep = |arguments: &[&str]| {
        let mut command = program("sweep");
        command.arg(&file).arg("--out").arg(&out).args(arguments);
        command
    };
    let states = || {
        let output = sweep(&["--list"]).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        text.lines().skip(1).map(|line| line.split_whitespace().nth(4).unwrap().to_string()).collect::<Vec<_>>()
    };
    assert_eq!(states(), ["new", "new"]);
    expect(&error(&mut sweep(&["--index", "2"]), 2), &["--index 2", "0 to 1"]);

    // Somebody else's run in the first folder.
    let first = out.join("lift/aforce/seed_1");
    std::fs::create_dir_all(&first).unwrap();
    std::fs::write(first.join("config.toml"), "seed = 8\n").unwrap();
    expect(&error(&mut sweep(&[]), 3), &["failed: lift aforce 1", "another configuration", "log.txt"]);
    assert_eq!(states(), ["begun", "done"]);

    std::fs::remove_file(first.join("config.toml")).unwrap();
    let table = std::fs::read(out.join("lift/osc/seed_1/eval.csv")).unwrap();
    sweep(&[]).assert().success();
    assert_eq!(states(), ["done", "done"]);
    assert!(std::fs::read(out.join("lift/osc/seed_1/eval.csv")).unwrap() == table, "a run was repeated");

    // A report is of runs that differ in their seeds.
    program("report").arg(&out).assert().success();
    let (again, config) = (out.join("again"), std::fs::read_to_string(first.join("config.toml")).unwrap());
    std::fs::create_dir(&again).unwrap();
    for table in ["episodes.csv", "eval.csv", "progress.csv", "manifest.json"] {
        std::fs::copy(first.join(table), again.join(table)).unwrap();
    }
    std::fs::write(again.join("config.toml"), &config).unwrap();
    expect(&error(program("report").arg(&out), 1), &["again", "lift/aforce/seed_1", "same seed"]);
    let other = config.replace("seed = 1\n", "seed = 2\n").replace("gamma = 0.97", "gamma = 0.9");
    std::fs::write(again.join("config.toml"), other).unwrap();
    expect(&error(program("report").arg(&out), 1), &["again", "gamma = 0.97", "0.9"]);
    let larger = config.replace("seed = 1\n", "seed = 2\n").replace("position_step = 0.02", "position_step = 0.05");
    std::fs::write(again.join("config.toml"), larger).unwrap();
    expect(&error(program("report").arg(&out), 1), &["again", "action steps", "0.02", "0.05"]);
}

#[test]
fn output_may_be_cut_short() {
    let list = concat!(env!("CARGO_MANIFEST_DIR"), "/configs/table-1.toml");
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let mut command = std::process::Command::new(assert_cmd::cargo::cargo_bin("sweep"));
    let output = command.args([list, "--list"]).stdout(writer).stderr(std::process::Stdio::piped()).spawn();
    assert!(output.unwrap().wait_with_output().unwrap().stderr.is_empty());
}

/// Two processes in one folder would mix their rows.
#[test]
fn a_folder_belongs_to_one_process() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = std::process::Command::new(assert_cmd::cargo::cargo_bin("train"));
    let mut first = command.args(train(folder.path()).get_args()).spawn().unwrap();
    wait_for(&folder.path().join("lift/aforce/seed_7/episodes.csv"), &mut first);
    expect(&error(train(folder.path()).arg("--resume"), 1), &["another process is at work"]);
    first.kill().unwrap();
    first.wait().unwrap();
    train(folder.path()).arg("--resume").assert().success();
}

/// Where the table goes need not exist, and no flag is taken and then ignored.
#[test]
fn baselines_make_their_folder() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("new/folder/table.csv");
    let mut command = program("baselines");
    command.args(["random", "--space", "osc", "--episodes", "1", "--set", "env.horizon=2", "--out"]).arg(&table);
    command.assert().success();
    let text = std::fs::read_to_string(&table).unwrap();
    assert!(text.lines().count() == 2 && text.contains("lift,osc,random") && !text.contains("NaN"), "{text}");
    expect(&error(&mut command, 1), &["table.csv", "nothing was overwritten"]);
    expect(&error(command.args(["--spaces", "aforce"]), 2), &["--space"]);
}
