//! Runs and sweeps that are stopped or killed: nothing that was saved is lost, and a resumed run gives the same bytes.

mod common;

use std::path::Path;
use std::time::{Duration, Instant};

use common::{
    assert_same, error, expect, few, last_step, note, program, run_folder, start, start_loud, start_unheard, states,
    train, train_for, unsummed,
};
use experiments::config::RunConfig;
use experiments::run::csv_table::CsvTable;
use experiments::run::folder::RunFolder;
use experiments::run::place::Place;
use experiments::run::pool::{self, Job, Pool};
use experiments::run::stop::Stop;
use rustix::process::Signal;

/// A run that is killed long after its last checkpoint does again what it did since then. It has all that a preset
/// switches on: pink noise, an actor that learns at every second update, a script's episodes, and layer norm.
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
    // If a checkpoint was saved just before the kill there is nothing to undo, and the kill is tried again.
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

/// The rows of its progress.csv may cover more time than the interval between checkpoints.
#[test]
fn a_run_that_was_killed_in_its_first_episode_begins_anew() {
    let folder = tempfile::tempdir().unwrap();
    train(folder.path()).assert().success();
    let run = run_folder(folder.path());
    let bytes = std::fs::read(run.join("episodes.csv")).unwrap();
    std::fs::remove_file(run.join("DONE")).unwrap();
    std::fs::remove_dir_all(run.join("checkpoints")).unwrap();
    for name in ["episodes.csv", "eval.csv", "progress.csv"] {
        let text = std::fs::read_to_string(run.join(name)).unwrap();
        let head = text.lines().next().unwrap();
        // Half an episode, which took a day.
        let cells = "6,50,0,90000".to_string() + &",".repeat(head.matches(',').count() - 3);
        let rows = if name == "progress.csv" { cells + "\n" } else { String::new() };
        std::fs::write(run.join(name), format!("{head}\n{rows}")).unwrap();
    }
    train(folder.path()).arg("--resume").assert().success();
    assert_eq!(std::fs::read(run.join("episodes.csv")).unwrap(), bytes);
}

/// A kill after an evaluation may leave its policy as the best one without its rows in eval.csv. On another processor the
/// repeated evaluation may return less. The best policy is still one whose evaluation is in the table.
#[test]
fn a_best_policy_is_of_an_evaluation_in_the_table() {
    let folder = tempfile::tempdir().unwrap();
    let often = ["--set", "evaluate_every=200"];
    train_for(1000, folder.path()).args(often).assert().success();
    let run = run_folder(folder.path());
    let best = run.join("checkpoints/best");
    for (checkpoint, key) in [("last", "best_return"), ("best", "evaluation_return")] {
        let state = run.join("checkpoints").join(checkpoint).join("state.json");
        let mut said: serde_json::Value = serde_json::from_slice(&std::fs::read(&state).unwrap()).unwrap();
        said["caller"][key] = 1e6.into();
        if checkpoint == "best" {
            said["caller"]["step"] = 1400.into();
        }
        std::fs::write(&state, unsummed(&serde_json::to_string_pretty(&said).unwrap())).unwrap();
    }
    train_for(2000, folder.path()).args(often).arg("--resume").assert().success();
    let said = note(&best).unwrap();
    let table = CsvTable::read(&run.join("eval.csv")).unwrap();
    let [steps, policies, returns] = ["step", "policy", "return"].map(|column| table.column(column).unwrap());
    let kept_at = said["step"].to_string();
    let is_it = |row: &usize| policies[*row] == "mean" && steps[*row] == kept_at;
    let row = (0..steps.len()).find(is_it).unwrap();
    assert!(said["step"].as_u64() >= Some(1400), "{said}");
    // The table is rounded to seven digits.
    let difference = said["evaluation_return"].as_f64().unwrap() - returns[row].parse::<f64>().unwrap();
    assert!(difference.abs() < 1e-6, "{said}, {}", returns[row]);
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

/// The run may lose 0.6 s. An episode may take longer, and then the run saves a checkpoint at the end of each.
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
    // The intervals between checkpoints have no part in the hash that identifies a run.
    let config = RunConfig::resolve(Some(&run_folder(folder.path()).join("config.toml")), &[]).unwrap();
    let other = RunConfig { checkpoint_every: 7, checkpoint_minutes: 5.0, ..config.clone() };
    assert_eq!((config.hash(), config.difference(&other)), (other.hash(), None));
}

/// A closed terminal (SIGHUP) stops a run, unless `nohup` started it.
#[test]
fn a_hang_up_is_asked_to_stop() {
    // `nohup cargo test` ignores SIGHUP, and children inherit that. With this handler SIGHUP has its default effect in children.
    signal_hook::flag::register(Signal::HUP.as_raw(), std::sync::Arc::default()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let episodes = run_folder(folder.path()).join("episodes.csv");
    let mut child = start(&train_for(1_000_000, folder.path()));
    child.wait_for_a_row(&episodes);
    assert_eq!(child.hang_up(), Some(75));
    // The reader of its output ends too, as the `tee` behind a pipe does.
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

/// The runs of a killed sweep save a checkpoint and end: otherwise they would go on without a sweep.
#[test]
fn the_runs_of_a_killed_sweep_stop() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("few.toml"), folder.path().join("out"));
    std::fs::write(&file, few(1_000_000)).unwrap();
    let run = out.join("lift/aforce/seed_1");
    let mut sweep = start(program("sweep").arg(&file).arg("--out").arg(&out).args(["--jobs", "1"]));
    sweep.wait_for_a_row(&run.join("episodes.csv"));
    // `--index` leaves a run to the process that is at work on it, as a whole sweep does.
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

/// Open tables move with their folder, and a checkpoint written to the old path would be separated from them.
#[test]
fn a_folder_that_is_moved_or_deleted_is_not_written_anew() {
    let folder = tempfile::tempdir().unwrap();
    for delete in [false, true] {
        let out = folder.path().join(format!("delete-{delete}"));
        let (run, moved) = (run_folder(&out), out.join("moved"));
        let mut command = train_for(1_000_000, &out);
        command.args(["--set", "checkpoint_every=300"]);
        let mut child = start_loud(&command, &out.with_extension("txt"));
        child.wait_until("a checkpoint", || run.join("checkpoints/last/state.json").exists());
        std::fs::rename(&run, &moved).unwrap();
        if delete {
            std::fs::remove_dir_all(&moved).unwrap();
        }
        assert_eq!(child.ends(), Some(1));
        assert!(!run.exists(), "nothing is split");
        let told = std::fs::read_to_string(out.with_extension("txt")).unwrap();
        expect(&told, &["error: ", "seed_7", "moved or deleted while the run was at work", "--resume"]);
        if !delete {
            // Moved back, the run can be resumed.
            std::fs::rename(&moved, &run).unwrap();
            let saved = || note(&run.join("checkpoints/last")).and_then(|note| note["step"].as_u64());
            let before = saved();
            let mut child = start(command.arg("--resume"));
            child.wait_until("a later checkpoint", || saved() > before);
            assert_eq!(child.stop(), Some(75));
        }
    }
}

/// Whether a process holds SIGTERM back, or has a handler for it.
fn heeds(status: &str) -> bool {
    let has = |mask: &str| {
        let mask = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix(mask)?.trim(), 16).ok());
        mask.is_some_and(|mask| mask & (1 << (Signal::TERM.as_raw() - 1)) != 0)
    };
    has("SigBlk:") || has("SigCgt:")
}

/// A signal between the start of the process and that of training is obeyed, as soon as the process holds signals back or handles them.
#[test]
fn a_signal_in_the_first_moment_is_heard() {
    for (at, signal) in [Signal::TERM, Signal::HUP, Signal::INT].into_iter().enumerate() {
        // `nohup cargo test` ignores SIGHUP, a shell's background job ignores SIGINT, and children inherit that. With
        // this handler the signal has its default effect in children.
        signal_hook::flag::register(signal.as_raw(), std::sync::Arc::default()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let mut child = start(&train_for(1_000_000, folder.path()));
        std::thread::sleep(Duration::from_millis(30 * at as u64));
        let status = format!("/proc/{}/status", child.id());
        child.wait_until("signals that are held or heard", || heeds(&std::fs::read_to_string(&status).unwrap()));
        child.signal(signal);
        assert_eq!(child.ends(), Some(75), "{signal:?}");
        let run = run_folder(folder.path());
        assert!(run.join("checkpoints/last/replay.bin").exists() && !run.join("DONE").exists());
    }
}

/// Without a limit, a run that hangs or is suspended (SIGSTOP) would keep its sweep from ending.
#[test]
fn a_run_beyond_its_limit_of_time_saves_itself() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("few.toml"), folder.path().join("out"));
    std::fs::write(&file, few(1_000_000).replace("\"aforce\", \"osc\"", "\"aforce\"")).unwrap();
    let run = out.join("lift/aforce/seed_1");
    let mut sweep = start(program("sweep").arg(&file).arg("--out").arg(&out).args(["--limit", "0.02"]));
    sweep.wait_until("a lock", || run.join("lock").exists());
    assert_eq!(sweep.ends(), Some(75));
    assert!(run.join("checkpoints/last/replay.bin").exists());
    expect(&error(program("sweep").arg(&file).args(["--limit", "0"]), 2), &["--limit", "above 0"]);
}

/// Runs scripts as the jobs of a pool, with a limit of 0.3 s and 0.3 s more until the kill: name, exit code and last words of each.
fn jobs(folder: &Path, place: &Place, scripts: &[(&str, &str)]) -> Vec<(String, Option<i32>, String)> {
    let job = |(name, script): &(&str, &str)| {
        let mut command = std::process::Command::new("sh");
        command.args(["-c", script]);
        Job { name: name.to_string(), command, log: folder.join(name) }
    };
    let stop = Stop::default();
    let [limit, grace] = [300, 300].map(Duration::from_millis);
    let pool = Pool { parallel: scripts.len(), limit: Some(limit), grace, out: place, stop: &stop };
    let mut ended: Vec<_> = pool::run(scripts.iter().map(job).collect(), &pool)
        .into_iter()
        .map(|job| (job.name, job.code, job.words))
        .collect();
    ended.sort();
    ended
}

fn place(folder: &Path) -> Place {
    Place::of(folder, &std::fs::File::open(folder).unwrap()).unwrap()
}

/// Two jobs ignore SIGTERM. One of them is killed; the other, which suspended itself, is continued and ends.
#[test]
fn a_job_that_does_not_end_is_killed_and_hides_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let scripts = [
        ("deaf", "trap '' TERM; while true; do sleep 0.1; done"),
        ("halted", "trap '' TERM; kill -STOP $$; echo goes on"),
        ("quick", "echo fine"),
    ];
    let ended = jobs(folder.path(), &place(folder.path()), &scripts);
    let by_itself = |name: &str, word: &str| (name.to_string(), Some(0), word.to_string());
    let killed = ("deaf".to_string(), None, pool::TOO_LATE.to_string());
    assert_eq!(ended, [killed, by_itself("halted", "goes on"), by_itself("quick", "fine")]);
}

#[test]
fn no_job_is_begun_in_a_folder_that_was_moved() {
    let folder = tempfile::tempdir().unwrap();
    let below = folder.path().join("out");
    std::fs::create_dir(&below).unwrap();
    let place = place(&below);
    assert!(place.is_there());
    std::fs::rename(&below, folder.path().join("moved")).unwrap();
    std::fs::create_dir(&below).unwrap();
    let ended = jobs(&below, &place, &[("late", "echo begun")]);
    assert!(ended[0].1 == Some(126) && ended[0].2.contains("moved or deleted"), "{ended:?}");
    assert!(!below.join("late").exists());
}
