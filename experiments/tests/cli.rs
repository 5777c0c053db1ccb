//! The programs as a user meets them: what each prints and writes.

mod common;

use std::io::Cursor;
use std::path::Path;

use common::{error, expect, program, run_folder, stored, train};
use experiments::config::RunConfig;
use experiments::report::columns::Columns;
use experiments::run::csv_table::CsvTable;
use walkdir::WalkDir;
use zip::ZipArchive;

/// Without arguments `train` only prints its help, with the defaults and a command that can be copied.
#[test]
fn train_without_arguments_explains_itself() {
    let folder = tempfile::tempdir().unwrap();
    let help = error(program("train").current_dir(&folder), 2);
    let config = RunConfig::resolve(None, &[]).unwrap();
    for default in [
        format!("Task (default: {})", config.env.task.as_str()),
        format!("Action space (default: {})", config.env.space),
        format!("Robot (default: {})", config.env.robot.robot().name),
        format!("0 to 4294967295 (default: {})", config.seed),
        format!("Learner's defaults (default: {})", config.preset.name),
        format!("6e4 (default: {})", config.steps),
    ] {
        assert!(help.contains(&default), "{default} is not in {help}");
    }
    let example = help.lines().find_map(|line| line.strip_prefix("Example: ")).expect("an example");
    let mut words = example.split_whitespace();
    let program = words.next().unwrap();
    let mut described = common::program(program);
    described.args(words).arg("--describe").current_dir(&folder).assert().success();
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0, "nothing was written");
}

#[test]
fn every_program_tells_its_commit() {
    for name in ["train", "sweep", "evaluate", "replay", "baselines", "report", "archive"] {
        let version = program(name).arg("--version").assert().success().get_output().stdout.clone();
        expect(
            &String::from_utf8(version).unwrap(),
            &[&format!("{name} {}", env!("CARGO_PKG_VERSION")), &output::commit()],
        );
    }
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
    expect(
        &told,
        &[
            "seed_7",
            "best, after",
            "lift with aforce",
            "paper-steps",
            "written: ",
            "table.csv",
            "next: ",
            "result:  return ",
        ],
    );
    expect(
        &String::from_utf8(evaluate().args(["--setup", "small-steps"]).output().unwrap().stdout).unwrap(),
        &["changed", "env.controller.position_step: there 0.05, here 0.02"],
    );
    // `replay` without these flags would play another episode, so it is not suggested.
    let mut of_start = program("evaluate");
    of_start.args(["--episode-seed", "5", "--run"]).arg(&run);
    for other in [evaluate().arg("--sample"), &mut of_start, evaluate().args(["--set", "env.horizon=50"])] {
        let told = String::from_utf8(other.assert().success().get_output().stdout.clone()).unwrap();
        assert!(told.contains("result:  return ") && !told.contains("next: "), "{told}");
    }
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

    // `osc` has the same sizes of observation and action as `aforce`: only the stored name of the space tells the difference.
    expect(&error(evaluate().args(["--space", "osc"]), 1), &["trained for lift with aforce", "osc"]);
    expect(&error(evaluate().args(["--space", "variable"]), 1), &["state.json"]);

    let actor = run.join("checkpoints/best/actor.safetensors");
    let bytes = std::fs::read(&actor).unwrap();
    std::fs::write(&actor, &bytes[..bytes.len() / 2]).unwrap();
    expect(&error(&mut evaluate(), 1), &["actor.safetensors"]);
    std::fs::remove_file(&actor).unwrap();
    expect(&error(&mut evaluate(), 1), &["actor.safetensors"]);
}

/// The next command that a program suggests works when it is copied from a terminal of 80 columns, also if a folder's name has a space.
#[test]
fn what_to_do_next_can_be_copied() {
    let folder = tempfile::tempdir().unwrap();
    let mut trained = train(Path::new("my runs"));
    let mut evaluated = program("evaluate");
    evaluated.args(["--episodes", "1", "--run", "my runs/lift/aforce/seed_7"]);
    trained.current_dir(&folder).assert().success();
    let told = evaluated.current_dir(&folder).assert().success().get_output().stdout.clone();
    let told = String::from_utf8(told).unwrap();
    let advice = told.split("next:").nth(1).and_then(|advice| advice.split("\nresult:").next()).expect("advice");
    assert!(format!("next:{advice}").lines().all(|line| line.len() <= 80), "{advice}");
    let (_, copied) = advice.split_once("--bin ").unwrap();
    let copied = format!("{}/{copied}", assert_cmd::cargo::cargo_bin("replay").parent().unwrap().display());
    let mut shell = std::process::Command::new("sh");
    shell.arg("-c").arg(copied.replacen(" --", "", 1).replace("--html", "--actions 3 --html")).current_dir(&folder);
    assert!(shell.status().unwrap().success());
    assert!(folder.path().join("replay.html").is_file());
}

/// A run of another library has no configuration of this one, so `archive` leaves it where it is.
#[test]
fn curves_of_another_learner_are_not_archived() {
    let folder = tempfile::tempdir().unwrap();
    let archive = folder.path().join("archive");
    let reference = Path::new(env!("CARGO_MANIFEST_DIR")).join("reference/sb3/lift/aforce,sb3/seed_3");
    let curves = folder.path().join("curves");
    // The second run cannot be read.
    for (name, bytes) in [("3", std::fs::read(reference.join("evaluations.npz")).unwrap()), ("4", vec![])] {
        let run = curves.join("lift/aforce,sb3").join(format!("seed_{name}"));
        std::fs::create_dir_all(&run).unwrap();
        std::fs::write(run.join("evaluations.npz"), bytes).unwrap();
    }
    let output = program("archive").arg(curves).arg("--out").arg(&archive).assert().code(1).get_output().stderr.clone();
    expect(
        &String::from_utf8(output).unwrap(),
        &[
            "aforce,sb3/seed_3: curves of another learner",
            "aforce,sb3/seed_4: curves of",
            "no run below it that is done",
        ],
    );
    assert!(!archive.exists());
}

/// A kept policy is one file, and plays as its run does.
#[test]
fn a_kept_policy_plays_as_its_run() {
    let folder = tempfile::tempdir().unwrap();
    let [runs, archived, copied] = ["runs", "archived", "copied"].map(|name| folder.path().join(name));
    train(&runs).assert().success();
    let run = run_folder(&runs);
    let archive = |from: &Path, to: &Path| {
        program("archive").arg(from).arg("--out").arg(to).assert().success();
        std::fs::read(to.join("lift/aforce/seed_7.zip")).unwrap()
    };
    let bytes = archive(&runs, &archived);
    let kept = archived.join("lift/aforce/seed_7.zip");
    let episodes = |run: &Path| {
        let table = folder.path().join("episodes.csv");
        program("evaluate").args(["--episodes", "1", "--run"]).arg(run).arg("--csv").arg(&table).assert().success();
        let rows = std::fs::read_to_string(&table).unwrap();
        std::fs::remove_file(table).unwrap();
        rows
    };
    assert_eq!(episodes(&run), episodes(&kept));
    let mut replay = program("replay");
    replay.args(["--actions", "3", "--run"]).arg(&run).arg("--beside").arg(&kept);
    replay.arg("--html").arg(folder.path().join("page.html")).assert().success();
    let asked = |which: &str, run: &Path| {
        let mut command = program("evaluate");
        command.args(["--episodes", "1", "--checkpoint", which, "--run"]).arg(run);
        command
    };
    expect(&error(&mut asked("last", &kept), 1), &["--checkpoint last", "keeps the other one"]);
    // With `--checkpoint last` the last policy is kept, and then plays by default.
    let ends = folder.path().join("ends");
    program("archive").arg(&runs).args(["--checkpoint", "last", "--out"]).arg(&ends).assert().success();
    let end = ends.join("lift/aforce/seed_7.zip");
    let told = |command: &mut assert_cmd::Command| {
        String::from_utf8(command.assert().success().get_output().stdout.clone()).unwrap()
    };
    let is_number = |line: &&str| line.starts_with("  ") && !line.contains("--run");
    let numbers = |text: String| text.lines().filter(is_number).map(String::from).collect::<Vec<_>>();
    let of_end = told(program("evaluate").args(["--episodes", "1", "--run"]).arg(&end));
    assert!(of_end.contains("last, after 2000 of 2000 actions"), "{of_end}");
    assert_eq!(numbers(of_end), numbers(told(&mut asked("last", &run))));
    expect(&error(&mut asked("best", &end), 1), &["--checkpoint best", "keeps the other one"]);
    let described = |config: &Path| {
        let output = program("train").arg("--describe").arg("--config").arg(config).assert().success();
        output.get_output().stdout.clone()
    };
    assert_eq!(described(&run.join("config.toml")), described(&kept));

    // If a policy is played after its run was archived, its episodes are added. A damaged kept policy is written again.
    let (played, rows) = (run.join("end.csv"), archived.join("end.csv.zst"));
    asked("last", &run).arg("--csv").arg(&played).assert().success();
    assert!(!rows.exists() && archive(&runs, &archived) == bytes && rows.is_file());
    std::fs::write(&kept, &bytes[..bytes.len() / 2]).unwrap();
    assert!(archive(&runs, &archived) == bytes);
    let checkpoints = run.join("checkpoints");
    std::fs::rename(&checkpoints, folder.path().join("checkpoints")).unwrap();
    assert!(archive(&runs, &archived) == bytes, "a run without its checkpoints");
    std::fs::rename(folder.path().join("checkpoints"), &checkpoints).unwrap();

    assert!(archive(&archived, &copied) == bytes, "from one archive to another");
    let mut last = program("archive");
    last.args(["--checkpoint", "last"]).arg(&archived).arg("--out").arg(&copied).assert().success();
    let told = String::from_utf8(last.output().unwrap().stderr).unwrap();
    expect(&told, &["seed_7.zip: keeps the other policy of its run"]);
    // The last policy replaces the best one if the run's folder is read. Archived again without --checkpoint, it stays.
    program("archive").arg(&runs).args(["--checkpoint", "last", "--out"]).arg(&copied).assert().success();
    assert!(archive(&runs, &copied) == std::fs::read(&end).unwrap());
    // Earlier versions kept a policy as a folder.
    let old = archived.join("lift/aforce/seed_7");
    ZipArchive::new(Cursor::new(&bytes)).unwrap().extract(&old).unwrap();
    std::fs::remove_file(&kept).unwrap();
    assert!(archive(&runs, &archived) == bytes && !old.exists());
    expect(&error(program("evaluate").arg("--run").arg(&old), 1), &["did you mean", "seed_7.zip?"]);
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

    // The discount is 0 after a divergence, and after nothing else: there the critic has no future to value.
    assert_eq!(table.values("terminated").unwrap(), diverged);
    let ends = step.iter().zip(&diverged).filter(|(_, diverged)| **diverged == 1.0).map(|(step, _)| *step as usize);
    let stored = stored(&run);
    let futureless = (1..=stored.len()).filter(|action| stored[action - 1].discount == 0.0);
    assert_eq!(futureless.collect::<Vec<_>>(), ends.collect::<Vec<_>>());
}

/// The committed tables and curves in `results` are those that `report` makes from the committed runs.
#[test]
fn committed_tables_and_curves_are_of_the_committed_runs() {
    let results = Path::new(env!("CARGO_MANIFEST_DIR")).join("../results");
    let out = tempfile::tempdir().unwrap();
    // The studies' tables are made first, with their hypotheses.
    for name in ["study", "second-study", "insert"] {
        let mut study = program("report");
        study.arg(results.join(name)).arg("--out").arg(out.path().join(name));
        let files = WalkDir::new(results.join(name)).max_depth(1).sort_by_file_name().into_iter();
        for file in files.map(|file| file.unwrap().into_path()) {
            if file.file_name().is_some_and(|name| name.to_string_lossy().starts_with("hypotheses")) {
                study.arg("--hypotheses").arg(file);
            }
        }
        study.assert().success();
    }
    program("report").arg(&results).arg("--pages").arg("--out").arg(out.path()).assert().success();
    let made = WalkDir::new(out.path()).into_iter().map(|entry| entry.unwrap().into_path());
    let texts: Vec<_> = made.filter(|path| path.is_file()).collect();
    for filled in ["findings.md", "study/README.md", "noise/README.md"] {
        assert!(texts.contains(&out.path().join(filled)), "{filled}");
    }
    for text in texts {
        let text = text.strip_prefix(out.path()).unwrap();
        let [made, committed] = [out.path(), &results].map(|root| std::fs::read_to_string(root.join(text)).unwrap());
        assert!(made == committed, "{}: run make pages", text.display());
    }
}

/// The table's folder is made, and a flag that would have no effect is refused.
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
    for pictures in [&["--out", "one.svg", "--plot", "one"][..], &["--out", "one", "--plot", "one.svg", "--map", "one"]]
    {
        let mut twice = program("baselines");
        twice.current_dir(&folder).args(["random", "--episodes", "1"]).args(pictures);
        expect(&error(&mut twice, 2), &["one.svg", "two of --out, --plot and --map would write it"]);
    }
    std::fs::write(folder.path().join("mine.svg"), "mine").unwrap();
    let mut mine = program("baselines");
    mine.current_dir(&folder).args(["random", "--episodes", "1", "--out", "two.csv", "--plot", "mine"]);
    expect(&error(&mut mine, 1), &["mine.svg", "nothing was overwritten"]);
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

/// A kept policy plays in those set-ups of a sweep that have its task and space, and a map shows the result.
#[test]
fn a_trained_policy_is_a_baseline_of_its_own_set_ups() {
    let folder = tempfile::tempdir().unwrap();
    let kept = concat!(env!("CARGO_MANIFEST_DIR"), "/../results/study/table-1/lift/aforce/seed_12.zip");
    let sweep = folder.path().join("psi.toml");
    let adaptive = "env.space.stiffness.adaptive";
    let groups = format!(
        "[run]\nenv.horizon = 2\nsetup = 'paper-steps'\n[[group]]\ntasks = ['lift', 'door']\nspaces = ['aforce', 'osc']\nseeds = [7, 8]\n\
         [[group]]\nname = 'soft'\ntasks = ['lift']\nspaces = ['aforce']\nseeds = [7]\nrun.{adaptive}.k_min = [100.0, 5.0]\nrun.{adaptive}.delta_sign = 'off'"
    );
    std::fs::write(&sweep, groups).unwrap();
    let table = folder.path().join("played.csv");
    let mut command = program("baselines");
    command.args([kept, "--episodes", "1", "--sweep"]).arg(&sweep).arg("--out").arg(&table);
    command.arg("--map").arg(folder.path().join("map.svg")).assert().success();
    let table = CsvTable::read_finished(&table).unwrap();
    let [task, space, variant, policy, k_min, tolerance, sign] =
        ["task", "space", "variant", "policy", "k_min_n_per_m", "tolerance_m", "delta_sign"]
            .map(|name| table.column(name).unwrap());
    assert_eq!((task, space, variant), (vec!["lift"; 2], vec!["aforce"; 2], vec!["", "soft"]));
    assert_eq!((policy, k_min, sign), (vec!["mean"; 2], vec!["300.0", "100.0"], vec!["damping", "off"]));
    assert!(tolerance.iter().all(|cell| cell.starts_with("0.037")), "{tolerance:?}");
    let map = std::fs::read_to_string(folder.path().join("map.svg")).unwrap();
    assert!(
        map.contains("Lift, delta with the damping sign")
            && map.contains("Lift, without delta")
            && !map.contains("Door")
    );
    assert!(map.contains("100 to 150 N/m") && map.contains(">100<"), "{map}");
    let mut random = program("baselines");
    random.current_dir(&folder).args(["random", "--spaces", "osc", "--out", "a.csv", "--map", "b"]);
    expect(&error(&mut random, 2), &["--map", "in none of these action spaces"]);
    let mut elsewhere = program("baselines");
    let shipped = concat!(env!("CARGO_MANIFEST_DIR"), "/configs/second-study/door.toml");
    elsewhere.current_dir(&folder).args([kept, "--sweep", shipped, "--out", "a.csv"]);
    expect(&error(&mut elsewhere, 2), &["no set-up is lift with aforce"]);
    let mut nowhere = program("baselines");
    nowhere.current_dir(&folder).args([kept, "--tasks", "lift", "--out", "a.csv"]);
    expect(&error(&mut nowhere, 2), &["name it with --sweep"]);
    let mut last = program("baselines");
    last.current_dir(&folder).args([kept, "--checkpoint", "last", "--out", "a.csv", "--sweep"]).arg(&sweep);
    expect(&error(&mut last, 1), &["--checkpoint last", "it keeps the other one"]);
    let mut last = program("baselines");
    last.current_dir(&folder).args(["random", "--checkpoint", "last", "--out", "a.csv"]);
    expect(&error(&mut last, 2), &["--checkpoint", "have none"]);
    let mut nobody = program("baselines");
    expect(
        &error(nobody.current_dir(&folder).args(["exprt", "--out", "a.csv"]), 2),
        &["neither expert, random nor a run"],
    );
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 3);
}

/// A policy is played undisturbed and under every case, from the same starts. A case that disturbs what its task does not
/// have is refused before.
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
        // The disturbance that the critic observes is missing in the undisturbed episodes, which is allowed.
        command.args(["--set", "env.observation.critic=['disturbance']", "--set", "env.disturbance.payload_kg=0.1"]);
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

    // The start of a row is played again.
    let (again, film) = (folder.path().join("again.csv"), folder.path().join("again.html"));
    let common =
        ["--expert", "--task", "lift", "--space", "osc", "--set", "env.horizon=30", "--episode-seed", starts[1]];
    program("evaluate").args(common).arg("--csv").arg(&again).assert().success();
    let row = CsvTable::read(&again).unwrap();
    assert_eq!(
        (row.column("episode_seed").unwrap(), row.column("energy_j").unwrap()),
        (vec![starts[1]], vec![energy[1]])
    );
    let told = program("replay").args(common).arg("--html").arg(&film).assert().success().get_output().stdout.clone();
    let per_action = format!("{:.2} J per action", energy[1].parse::<f64>().unwrap() / 30.0);
    expect(&String::from_utf8(told).unwrap(), &[&per_action]);
    expect(
        &error(program("replay").args(common).args(["--episode", "1", "--html", "unmade.html"]), 2),
        &["--episode-seed"],
    );

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
        expect(&error(&mut evaluate(&text), 2), &["grid.toml", message]);
        assert!(!table.exists());
    }
}
