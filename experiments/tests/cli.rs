//! The programs as a user meets them: bad input is answered in one line that names what is
//! wrong, nothing is overwritten, and a run that was killed goes on to the same bytes.

mod common;

use std::path::Path;
use std::time::{Duration, Instant};

use common::{
    assert_same, error, expect, few, last_step, note, program, run_folder, start, start_unheard, states, stored, train,
    train_for,
};
use experiments::config::RunConfig;
use experiments::report::columns::Columns;
use experiments::run::csv_table::CsvTable;
use experiments::run::folder::RunFolder;
use rustix::process::Signal;
use walkdir::WalkDir;

#[test]
fn bad_input_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    expect(&error(train(out).args(["--set", "learner.gama=0.9"]), 2), &["gama", "did you mean \"learner.gamma\""]);
    expect(&error(train(out).args(["--set", "learner.gamma=1.5"]), 2), &["gamma", "1.5"]);
    expect(&error(train(out).args(["--set", "env.controller.control_hz=510"]), 2), &["control_hz", "510", "20"]);
    expect(&error(train(out).args(["--set", "env.simulation.substeps=1000000000"]), 2), &["substeps", "1 to 64"]);
    let alpha = "env.space.stiffness.adaptive.alpha=50000";
    expect(
        &error(train(out).args(["--set", "env.space.stiffness.adaptive.delta_sign=literal", "--set", alpha]), 2),
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
    expect(&error(replay().args(["--beside", "aforc"]), 2), &["aforc", "did you mean `aforce`"]);
    let doubled = ["--png", "x.png", "--plot", "x.svg"];
    expect(&error(replay().current_dir(out).args(doubled), 2), &["x.png", "two of the options"]);
    let spelt_otherwise = ["--csv", "./page.html"];
    expect(&error(replay().current_dir(out).args(spelt_otherwise), 2), &["page.html", "two of the options"]);
    expect(&error(program("replay").args(["--expert", "--csv", "/dev/null"]), 1), &["/dev/null", "no file"]);
    let disturbed = out.join("disturbed.toml");
    std::fs::write(&disturbed, "[[case]]\nname = \"high\"\ndisturbance.table_height_m = 0.2\n").unwrap();
    let mut evaluate = program("evaluate");
    evaluate.args(["--expert", "--task", "wipe", "--disturb"]).arg(&disturbed);
    expect(&error(&mut evaluate, 1), &["disturbed.toml", "\"high\"", "table_height_m"]);
    std::fs::write(&disturbed, "[[case]]\nname = \"slick\"\ndisturbance.friction = \"low\"\n").unwrap();
    expect(&error(&mut evaluate, 1), &["disturbed.toml", "a number, or [low, high]"]);
    assert!(!out.join("page.html").exists());
    assert!(!out.join("lift").exists(), "a refused run leaves nothing behind");
}

#[test]
fn a_description_is_text_or_data() {
    let print = |json: bool| {
        let mut command = program("train");
        command.args(["--task", "wipe", "--space", "aforce-force", "--describe"]).args(json.then_some("--json"));
        String::from_utf8(command.assert().success().get_output().stdout.clone()).unwrap()
    };
    let (text, data) = (print(false), serde_json::from_str::<serde_json::Value>(&print(true)).unwrap());
    let (action, observation) = (data["action"].as_array().unwrap(), data["observation"].as_array().unwrap());
    assert_eq!((action.len(), &action[6]["name"], &action[6]["high"]), (7, &"normal_force".into(), &50.0.into()));
    for part in action.iter().chain(observation) {
        assert!(text.contains(part["name"].as_str().unwrap()), "{part}");
    }
    assert_eq!(data["env"]["space"]["name"], "aforce-force");
    expect(&error(program("train").arg("--json"), 2), &["--describe"]);
}

/// What people do to files and flags, each answered in one line.
#[test]
fn what_was_tampered_with_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    expect(&error(program("train").args(["--seed", "18446744073709551616"]), 2), &["--seed", "0 to 4294967295"]);
    expect(&error(program("train").args(["--set", "seed=4294967296"]), 2), &["seed = 4294967296", "0 to 4294967295"]);
    expect(&error(train(out).args(["--set", "learner.gamma=0.9\nseed=5"]), 2), &["one line"]);
    expect(&error(train(out).arg("--config").arg(out), 1), &["TOML file", &out.display().to_string()]);
    let sweep = out.join("sweep.toml");
    std::fs::write(&sweep, few(600)).unwrap();
    expect(&error(train(out).arg("--config").arg(&sweep), 2), &["sweep.toml", "give it to `sweep`"]);
    let misspelt = out.join("misspelt.toml");
    std::fs::write(&misspelt, "seed = 1\n\n[learner]\ngama = 0.9\n").unwrap();
    expect(&error(train(out).arg("--config").arg(&misspelt), 2), &["misspelt.toml, line 4: ", "gama", "learner.gamma"]);
    let episodes = ["expert", "--episodes", "4294967295", "--out", "table.csv"];
    expect(&error(program("baselines").args(episodes), 2), &["--episodes", "1000000"]);
    let occupied = out.join("occupied");
    std::fs::write(&occupied, "").unwrap();
    expect(&error(program("sweep").arg(&sweep).arg("--out").arg(&occupied), 1), &["occupied"]);

    let runs = out.join("runs");
    train_for(1500, &runs).args(["--set", "checkpoint_every=1000"]).assert().success();
    let run = run_folder(&runs);
    let report = |folder: &Path| {
        let mut command = program("report");
        command.arg(folder).arg("--out").arg(out.join("report"));
        command
    };
    // A folder that holds itself: every run once.
    std::os::unix::fs::symlink(&runs, runs.join("again")).unwrap();
    report(&runs).assert().success();
    assert_eq!(std::fs::read_to_string(out.join("report/runs.csv")).unwrap().lines().count(), 2);
    std::fs::remove_file(runs.join("again")).unwrap();
    std::fs::write(out.join("report/summary.csv"), "date,price\n").unwrap();
    expect(&error(&mut report(&runs), 1), &["summary.csv", "not a table of ours", "nothing was overwritten"]);
    std::fs::remove_dir_all(out.join("report")).unwrap();

    let whole = std::fs::read_to_string(run.join("episodes.csv")).unwrap();
    let row = whole.lines().nth(1).unwrap();
    let with_length = |length: &str| {
        let mut cells: Vec<&str> = row.split(',').collect();
        cells[7] = length;
        cells.join(",")
    };
    for (edited, words) in [
        (with_length("maybe"), ["episodes.csv, line 2", "\"maybe\""]),
        (row.replacen("5,", "99,", 1), ["episodes.csv, line 2", "schema \"99\""]),
    ] {
        std::fs::write(run.join("episodes.csv"), whole.replacen(row, &edited, 1)).unwrap();
        let output = report(&runs).output().unwrap();
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && words.iter().all(|word| told.contains(word)), "{told}");
    }
    // A row taken out of the middle.
    std::fs::write(run.join("episodes.csv"), whole.replacen(&format!("{row}\n"), "", 1)).unwrap();
    expect(&error(train_for(2000, &runs).arg("--resume"), 1), &["episodes.csv", "rows were taken out or added"]);
    // Tables, checkpoint and settings of another run.
    let mut resumed = train_for(2000, &runs);
    resumed.arg("--resume");
    let mut exchange = |file: &str, from: &str, to: &str, words: &[&str]| {
        let ours = std::fs::read_to_string(run.join(file)).unwrap();
        assert!(ours.contains(from), "{from:?} is not in {file}");
        std::fs::write(run.join(file), ours.replace(from, to)).unwrap();
        let command = if file == "config.toml" {
            let mut command = program("train");
            command
                .arg("--config")
                .arg(run.join(file))
                .args(["--resume", "--quiet", "--steps", "2000", "--out"])
                .arg(&runs);
            &mut { command }
        } else {
            &mut resumed
        };
        expect(&error(command, 1), words);
        std::fs::write(run.join(file), ours).unwrap();
    };
    std::fs::write(run.join("episodes.csv"), whole).unwrap();
    exchange("episodes.csv", "aforce,7,", "aforce,8,", &["episodes.csv", "another run, with seed 8, not 7"]);
    exchange("eval.csv", "lift,", "door,", &["eval.csv", "another run, with task door, not lift"]);
    exchange("checkpoints/last/state.json", "\"seed\": 7", "\"seed\": 8", &["of a run with seed 8, not 7"]);
    exchange(
        "config.toml",
        "motion_price = 0.0",
        "motion_price = 5.0",
        &["config.toml", "is not what the run was begun with"],
    );

    // Weights that are none, and weights of the same sizes from elsewhere.
    let best = run.join("checkpoints/best/actor.safetensors");
    let evaluate = || {
        let mut command = program("evaluate");
        command.args(["--episodes", "1", "--run"]).arg(&run);
        command
    };
    let weights = std::fs::read(&best).unwrap();
    let mut damaged = weights.clone();
    damaged[2000..2400].fill(0xff);
    std::fs::write(&best, &damaged).unwrap();
    expect(&error(&mut evaluate(), 1), &["actor.safetensors", "NaN", "damaged"]);
    let mut foreign = weights.clone();
    let last = foreign.len() - 4;
    foreign[last..].copy_from_slice(&0.5f32.to_le_bytes());
    std::fs::write(&best, &foreign).unwrap();
    expect(&error(&mut evaluate(), 1), &["actor.safetensors", "not the policy"]);
    std::fs::write(&best, &weights).unwrap();
    evaluate().assert().success();
}

/// A folder whose name is no Unicode is one like any other.
#[cfg(unix)]
#[test]
fn a_name_that_is_no_unicode_is_taken() {
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join(std::ffi::OsStr::from_bytes(b"runs\xff"));
    train_for(600, &out).assert().success();
    assert!(run_folder(&out).join("DONE").exists());
}

/// Killed long after its last checkpoint: what it did since then is undone and done again. With all that a preset switches on: pink
/// noise, an actor that learns at every second update, a script's episodes, and layer norm.
#[test]
fn a_killed_run_goes_on_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, killed) = (folder.path().join("whole"), folder.path().join("killed"));
    let often = ["--set", "evaluate_every=200", "--set", "checkpoint_every=1000"];
    let learner = ["--preset", "swift-prior", "--set", "learner.prior_episodes=2", "--set", "learner.layer_norm=true"];
    let settings = [often.as_slice(), &learner].concat();
    train(&whole).args(&settings).assert().success();

    let run = run_folder(&killed);
    let (last, tables) = (run.join("checkpoints/last"), ["episodes.csv", "eval.csv"].map(|name| run.join(name)));
    let saved = || note(&last).and_then(|note| note["step"].as_f64());
    let far = || saved().is_some() && last_step(&tables[0]) >= Some(1300.0);
    let kill = || {
        let _ = std::fs::remove_dir_all(&killed);
        let mut child = start(train(&killed).args(&settings));
        child.wait_until("an episode long after a checkpoint", far);
        child.kill();
        saved().is_some_and(|saved| tables.iter().all(|table| last_step(table) > Some(saved)))
    };
    // A kill that comes too late leaves nothing to undo: then once more.
    assert!((0..5).any(|_| kill()));
    assert!(note(&last).unwrap()["best_return"].is_f64(), "there is an evaluation to be remembered");
    assert!(!run.join("DONE").exists(), "killed before its end");

    let again = || {
        let mut command = train(&killed);
        command.args(&settings);
        command
    };
    expect(&error(&mut again(), 1), &["already holds a run", "--resume"]);
    expect(&error(again().args(["--resume", "--set", "learner.gamma=0.5"]), 1), &["another configuration", "gamma"]);
    again().arg("--resume").assert().success();
    let manifest = std::fs::read_to_string(run.join("manifest.json")).unwrap();
    assert!(manifest.contains("continued") && manifest.contains("--resume"), "{manifest}");
    expect(&error(train_for(1500, &killed).args(&settings).arg("--resume"), 1), &["2000", "not to 1500"]);

    assert_same(&run_folder(&whole), &run, &["config.toml", "episodes.csv", "eval.csv"]);
    let networks = ["actor", "online_actor", "critic", "target", "optimizer"].map(|n| format!("{n}.safetensors"));
    for checkpoint in ["checkpoints/last", "checkpoints/best"] {
        let [whole, killed] = [&run_folder(&whole), &run].map(|run| run.join(checkpoint));
        assert_same(&whole, &killed, &networks.each_ref().map(String::as_str));
    }
    assert_same(&run_folder(&whole), &run, &["checkpoints/last/replay.bin", "checkpoints/best/state.json"]);
}

#[cfg(unix)]
#[test]
fn sigterm_saves_and_exits_with_75() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = start(&train_for(1_000_000, folder.path()));
    let run = run_folder(folder.path());
    child.wait_for_a_row(&run.join("episodes.csv"));
    assert_eq!(child.stop(), Some(75));
    assert!(run.join("checkpoints/last/replay.bin").exists());
    assert!(!run.join("DONE").exists());
    assert_eq!(RunFolder::open(&run).unwrap().manifest().unwrap().status, "stopped");
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
    let told = evaluate().arg("--csv").arg(&table).assert().success().get_output().stdout.clone();
    let told = String::from_utf8(told).unwrap();
    expect(&told, &["seed_7", "best, after", "lift with aforce", "paper-steps", "written: ", "table.csv", "next: "]);
    expect(
        &String::from_utf8(evaluate().args(["--setup", "small-steps"]).output().unwrap().stdout).unwrap(),
        &["changed", "env.controller.position_step: there 0.05, here 0.02"],
    );
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
    let told = replay(run.to_str().unwrap()).assert().success().get_output().stdout.clone();
    expect(&String::from_utf8(told).unwrap(), &["in 3 actions", "written: ", "page.html"]);
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

/// A feed-forward force that overflows counts as a divergence: the episode ends, is counted, and training goes on.
#[test]
fn a_diverged_simulation_is_counted() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = train(folder.path());
    command.args(["--space", "aforce-shaped", "--set", "learner.n_step=1"]);
    for set in ["alpha=1e308", "f_ff_max=1e308", "f_ff_rate_max=1e308", "allow_unstable=true"] {
        command.args(["--set", &format!("env.space.stiffness.adaptive.{set}")]);
    }
    command.assert().success();
    let run = folder.path().join("lift/aforce-shaped/seed_7");
    let table = Columns::read(&run.join("episodes.csv")).unwrap();
    let [step, diverged, total] = ["step", "diverged", "return"].map(|column| table.values(column).unwrap());
    assert!(total.iter().all(|total| total.is_finite()));
    assert!(diverged[..diverged.len() - 1].contains(&1.0), "an episode follows one that diverged: {diverged:?}");

    // Nothing follows a divergence, and only a divergence: so the critic is told.
    assert_eq!(table.values("terminated").unwrap(), diverged);
    let ends = step.iter().zip(&diverged).filter(|(_, diverged)| **diverged == 1.0).map(|(step, _)| *step as usize);
    let stored = stored(&run);
    let futureless = (1..=stored.len()).filter(|action| stored[action - 1].discount == 0.0);
    assert_eq!(futureless.collect::<Vec<_>>(), ends.collect::<Vec<_>>());
}

/// A sweep does what it can, names what failed, and does the rest when called again.
#[test]
fn a_sweep_hides_no_run_and_repeats_none() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("few.toml"), folder.path().join("out"));
    std::fs::write(&file, few(600)).unwrap();
    let sweep = |arguments: &[&str]| {
        let mut command = program("sweep");
        command.arg(&file).arg("--out").arg(&out).args(arguments);
        command
    };
    let states = || states(&file, &out);
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
    for name in ["runs.csv", "summary.csv", "comparison.csv", "tables_lift.md", "curves_lift.svg", "energy_return.svg"]
    {
        assert!(out.join(name).is_file(), "{name}");
    }
    let (again, config) = (out.join("again"), std::fs::read_to_string(first.join("config.toml")).unwrap());
    std::fs::create_dir(&again).unwrap();
    for table in ["episodes.csv", "eval.csv", "progress.csv", "manifest.json", "DONE"] {
        std::fs::copy(first.join(table), again.join(table)).unwrap();
    }
    std::fs::write(again.join("config.toml"), &config).unwrap();
    expect(&error(program("report").arg(&out), 1), &["again", "lift/aforce/seed_1", "same seed"]);
    let other = config.replace("seed = 1\n", "seed = 2\n").replace("gamma = 0.97", "gamma = 0.9");
    std::fs::write(again.join("config.toml"), other).unwrap();
    expect(&error(program("report").arg(&out), 1), &["again", "learner.gamma: there 0.9, here 0.97"]);
    let larger = config.replace("seed = 1\n", "seed = 2\n").replace("position_step = 0.05", "position_step = 0.02");
    std::fs::write(again.join("config.toml"), larger).unwrap();
    expect(&error(program("report").arg(&out), 1), &["again", "position_step: there 0.02, here 0.05"]);
}

/// What people read in `results` is what the runs beside it say.
#[test]
fn committed_tables_and_curves_are_of_the_committed_runs() {
    let results = Path::new(env!("CARGO_MANIFEST_DIR")).join("../results");
    let out = tempfile::tempdir().unwrap();
    // The study's tables are made first, with what was expected.
    let mut study = program("report");
    study.arg(results.join("study")).arg("--out").arg(out.path().join("study"));
    let files = WalkDir::new(results.join("study")).max_depth(1).sort_by_file_name().into_iter();
    for file in files.map(|file| file.unwrap().into_path()) {
        if file.file_name().is_some_and(|name| name.to_string_lossy().starts_with("hypotheses")) {
            study.arg("--hypotheses").arg(file);
        }
    }
    study.assert().success();
    program("report").arg(&results).arg("--out").arg(out.path()).assert().success();
    let made = WalkDir::new(out.path()).into_iter().map(|entry| entry.unwrap().into_path());
    let texts: Vec<_> = made.filter(|path| path.is_file()).collect();
    for filled in ["claims.md", "table-1/README.md", "small-steps/README.md"] {
        assert!(texts.contains(&out.path().join(filled)), "{filled}");
    }
    for text in texts {
        let text = text.strip_prefix(out.path()).unwrap();
        let [made, committed] = [out.path(), &results].map(|root| std::fs::read_to_string(root.join(text)).unwrap());
        assert!(
            made == committed,
            "{}: run report results/study with its hypotheses, then report results",
            text.display()
        );
    }
}

#[test]
fn output_may_be_cut_short() {
    let list = concat!(env!("CARGO_MANIFEST_DIR"), "/configs/study/table-1.toml");
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let mut command = std::process::Command::new(assert_cmd::cargo::cargo_bin("sweep"));
    let output = command.args([list, "--list"]).stdout(writer).stderr(std::process::Stdio::piped()).spawn();
    assert!(output.unwrap().wait_with_output().unwrap().stderr.is_empty());
}

/// Between two ends of episodes that lie further apart than it may lose.
#[test]
fn a_slow_run_saves_itself_by_the_clock() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = train_for(1_000_000, folder.path());
    command.args(["--set", "checkpoint_every=1000000", "--set", "checkpoint_minutes=0.01"]);
    let last = run_folder(folder.path()).join("checkpoints/last");
    let mut child = start(&command);
    let saved = || note(&last).and_then(|note| note["step"].as_u64());
    child.wait_until("a checkpoint", || saved().is_some());
    child.kill();
    expect(&error(train(folder.path()).arg("--resume"), 1), &["holds a run of 1000000 steps"]);
    // When it saves itself is no part of what it is.
    let config = RunConfig::resolve(Some(&run_folder(folder.path()).join("config.toml")), &[]).unwrap();
    let other = RunConfig { checkpoint_every: 7, checkpoint_minutes: 5.0, ..config.clone() };
    assert_eq!((config.hash(), config.difference(&other)), (other.hash(), None));
}

/// As a terminal that goes away does; what `nohup` started stays.
#[test]
fn a_hang_up_is_asked_to_stop() {
    let folder = tempfile::tempdir().unwrap();
    let episodes = run_folder(folder.path()).join("episodes.csv");
    let mut child = start(&train_for(1_000_000, folder.path()));
    child.wait_for_a_row(&episodes);
    assert_eq!(child.hang_up(), Some(75));
    // Its reader goes with it, as the `tee` behind a pipe does.
    let mut unheard = train_for(1_000_000, folder.path());
    let mut child = start_unheard(unheard.arg("--resume"));
    let before = last_step(&episodes);
    child.wait_until("a row", || last_step(&episodes) > before);
    assert_eq!(child.hang_up(), Some(75));

    let ours = train_for(1_000_000, folder.path());
    let mut deaf = assert_cmd::Command::new("sh");
    deaf.args(["-c", "trap '' HUP; exec \"$0\" \"$@\" --resume"]).arg(ours.get_program()).args(ours.get_args());
    let mut child = start(&deaf);
    let before = last_step(&episodes);
    child.wait_until("a row", || last_step(&episodes) > before);
    child.signal(Signal::HUP);
    let before = last_step(&episodes);
    child.wait_until("two more rows", || last_step(&episodes) > before.map(|step| step + 100.0));
    assert_eq!(child.stop(), Some(75));
}

/// Nobody would look after its runs: they save themselves.
#[test]
fn the_runs_of_a_killed_sweep_stop() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("few.toml"), folder.path().join("out"));
    std::fs::write(&file, few(1_000_000)).unwrap();
    let run = out.join("lift/aforce/seed_1");
    let mut sweep = start(program("sweep").arg(&file).arg("--out").arg(&out).args(["--jobs", "1"]));
    sweep.wait_for_a_row(&run.join("episodes.csv"));
    // Left to the process that is at work, as by a sweep of all.
    let mut second = program("sweep");
    second.arg(&file).arg("--out").arg(&out).args(["--index", "0"]);
    assert!(String::from_utf8(second.assert().code(75).get_output().stderr.clone()).unwrap().contains("at work there"));
    sweep.kill();
    let deadline = Instant::now() + Duration::from_secs(60);
    while states(&file, &out)[0] != "begun" {
        assert!(Instant::now() < deadline, "the run goes on");
        std::thread::sleep(Duration::from_millis(50));
    }
    assert_eq!(RunFolder::open(&run).unwrap().manifest().unwrap().status, "stopped");
    assert!(run.join("checkpoints/last/replay.bin").exists());
}

/// Two processes in one folder would mix their rows.
#[test]
fn a_folder_belongs_to_one_process() {
    let folder = tempfile::tempdir().unwrap();
    let mut first = start(&train(folder.path()));
    first.wait_for_a_row(&run_folder(folder.path()).join("episodes.csv"));
    expect(&error(train(folder.path()).arg("--resume"), 1), &["another process is at work"]);
    first.kill();
    train(folder.path()).arg("--resume").assert().success();
}

/// Where the table goes need not exist, and no flag is taken and then ignored.
#[test]
fn baselines_make_their_folder() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("new/folder/table.csv");
    let mut command = program("baselines");
    command.args(["random", "--spaces", "osc", "--episodes", "1", "--set", "env.horizon=2", "--out"]).arg(&table);
    command.assert().success();
    let text = std::fs::read_to_string(&table).unwrap();
    assert!(text.lines().count() == 2 && text.contains("lift,osc,,random") && !text.contains("NaN"), "{text}");
    expect(&error(&mut command, 1), &["table.csv", "nothing was overwritten"]);
    let (sweep, table) = (folder.path().join("sweep.toml"), folder.path().join("variants.csv"));
    let groups = "[run]\nenv.horizon = 2\n[variants]\na = {}\nb.env.space.damping_ratio = 0.5\n[[group]]\ntasks = ['lift', 'door']\nspaces = ['osc']\nseeds = [1, 2]";
    std::fs::write(&sweep, groups).unwrap();
    let of_sweep = || {
        let mut command = program("baselines");
        command.args(["random", "--episodes", "1", "--plot"]).arg(folder.path().join("variants"));
        command.arg("--sweep").arg(&sweep).arg("--out").arg(&table);
        command
    };
    for other in [["--spaces", "osc"], ["--set", "env.horizon=3"], ["--setup", "paper-steps"]] {
        expect(&error(of_sweep().args(other), 2), &["--sweep", "cannot be used with"]);
    }
    of_sweep().assert().success();
    let text = std::fs::read_to_string(&table).unwrap();
    let named: Vec<String> =
        text.lines().skip(1).map(|row| row.split(',').skip(1).take(3).collect::<Vec<_>>().join(" ")).collect();
    assert_eq!(named, ["lift osc a", "door osc a", "lift osc b", "door osc b"]);
    let picture = std::fs::read_to_string(folder.path().join("variants.svg")).unwrap();
    assert!(picture.contains("osc,b") && picture.contains("Door"));
    for learners in ["--steps", "--preset", "--seed", "--space"] {
        expect(&error(program("baselines").args(["random", "--out", "unmade.csv", learners, "5"]), 2), &[learners]);
    }
    for learners in ["--steps", "--preset", "--seed"] {
        expect(&error(program("evaluate").args(["--random", learners, "5"]), 2), &[learners]);
    }
}

/// A policy is played undisturbed and under every case, from the same starts; what its task has not is refused before.
#[test]
fn a_grid_of_disturbances_becomes_one_table() {
    let folder = tempfile::tempdir().unwrap();
    let grid = |text: &str| {
        let path = folder.path().join("grid.toml");
        std::fs::write(&path, text).unwrap();
        path
    };
    let table = folder.path().join("grid.csv");
    let evaluate = |grid: &Path| {
        let mut command = program("evaluate");
        command.args(["--expert", "--task", "lift", "--space", "osc", "--episodes", "2", "--set", "env.horizon=30"]);
        command.arg("--disturb").arg(grid).arg("--csv").arg(&table);
        command
    };
    let two = grid(
        "case = [\n  { name = \"heavy\", disturbance = { payload_kg = [0.5, 2.0] } },\n  { name = \"table\", task = \"wipe\", \
         disturbance = { table_height_m = 0.01 } },\n]\n",
    );
    let printed = evaluate(&two).assert().success().get_output().stdout.clone();
    expect(&String::from_utf8(printed).unwrap(), &["none", "heavy", "+0.00 +- 0.00"]);
    let rows = CsvTable::read(&table).unwrap();
    assert_eq!(rows.column("disturbance").unwrap(), ["none", "none", "heavy", "heavy"]);
    let starts = rows.column("episode_seed").unwrap();
    assert_eq!(starts[..2], starts[2..]);
    let energy = rows.column("energy_j").unwrap();
    assert!(energy[0] != energy[2] && energy[1] != energy[3]);

    std::fs::remove_file(&table).unwrap();
    let refused = [
        (
            "{ name = \"a\", disturbance = { hinge_spring = 1.0 } }",
            "case \"a\": disturbance.hinge_spring: door has it, lift has not",
        ),
        (
            "{ name = \"a\", disturbance = { cube_mass = -1 } }",
            "disturbance.cube_mass = -1 is not allowed; allowed: 0.1 to 100",
        ),
        ("{ name = \"a\", disturbance = { friction = [2.0, 1.0] } }", "upside down"),
        ("{ name = \"a\", disturbance = { frictoin = 2.0 } }", "frictoin"),
        ("{ name = \"none\", disturbance = {} }", "\"none\" is what undisturbed episodes are called"),
    ];
    for (case, message) in refused {
        let text = grid(&format!("case = [{case}]\n"));
        expect(&error(&mut evaluate(&text), 1), &["grid.toml", message]);
        assert!(!table.exists());
    }
}
