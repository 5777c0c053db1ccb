//! A sweep over settings, from its file to the tables of its report.

mod common;

use common::{error, expect, few, note, program, start, states};
use experiments::config::{RunConfig, sweep};
use experiments::run::csv_table::CsvTable;
use experiments::run::folder::RunFolder;
use rustix::process::{Pid, Signal, kill_process};

#[test]
fn settings_are_swept_like_spaces() {
    let folder = tempfile::tempdir().unwrap();
    let (base, file) = (folder.path().join("few.toml"), folder.path().join("varied.toml"));
    std::fs::write(&base, few(300)).unwrap();
    let group =
        |vary: &str| format!("[[group]]\ntasks = [\"lift\"]\nspaces = [\"aforce\", \"osc\"]\nseeds = [1]\n{vary}\n");
    let text = "name = \"settings\"\nextends = \"few.toml\"\n".to_string()
        + &group("")
        + &group("vary = { \"learner.n_step\" = [1], \"env.horizon\" = [50] }");
    std::fs::write(&file, text).unwrap();

    let out = folder.path().join("runs/settings");
    program("sweep").current_dir(folder.path()).arg("varied.toml").assert().success();
    assert_eq!(states(&file, &out), ["done"; 4]);
    let run = out.join("lift/osc,n_step=1,horizon=50/seed_1");
    assert_eq!(note(&run.join("checkpoints/best")).unwrap()["variant"], "n_step=1,horizon=50");
    // With its config.toml `train` finds the same run.
    let mut again = program("train");
    again.arg("--config").arg(run.join("config.toml")).arg("--resume").arg("--out").arg(&out).arg("--quiet");
    again.assert().success();
    let mut evaluate = program("evaluate");
    evaluate.args(["--episodes", "1", "--run"]).arg(&run).assert().success();

    program("report").arg(&out).assert().success();
    let table = |name: &str| CsvTable::read(&out.join(name)).unwrap();
    let varied = "n_step=1,horizon=50";
    assert_eq!(table("runs.csv").column("variant").unwrap(), ["", varied, "", varied]);
    let compared = table("comparison.csv");
    let [space, variant, reference] = ["space", "variant", "reference"].map(|name| compared.column(name).unwrap());
    let mut pairs: Vec<_> = (0..space.len()).map(|row| (space[row], variant[row], reference[row])).collect();
    pairs.dedup();
    assert_eq!(
        pairs,
        [("aforce", varied, "aforce"), ("osc", "", "aforce"), ("osc", varied, "aforce,n_step=1,horizon=50"),]
    );
    let tables = std::fs::read_to_string(out.join("tables.md")).unwrap();
    let row = |label: &str| tables.lines().filter(|line| line.starts_with(&format!("| `{label}` |"))).count();
    // Return, energy, comparison, safety.
    assert_eq!((row("osc"), row("osc,n_step=1,horizon=50"), row("aforce")), (4, 4, 3), "{tables}");
}

/// A sweep trains the runs that it can, names those that failed, and trains these when it is called again.
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

    // The first folder holds another run.
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

    program("report").arg(&out).assert().success();
    for name in ["runs.csv", "summary.csv", "comparison.csv", "tables.md", "curves_lift.svg"] {
        assert!(out.join(name).is_file(), "{name}");
    }
    // Curves of an earlier report are removed; a file that `report` did not write stays.
    let (stale, own) = (out.join("curves_lift_gone.svg"), out.join("tables.md"));
    let (others, shown) = (out.join("curves_lift_mine.svg"), std::fs::read_to_string(&own).unwrap());
    std::fs::write(&own, shown.clone() + "\n![Learning curves](curves_lift_gone.svg)\n").unwrap();
    for picture in [&stale, &others] {
        std::fs::write(picture, "").unwrap();
    }
    program("report").arg(&out).assert().success();
    assert!(!stale.exists() && others.exists() && out.join("curves_lift.svg").is_file());
    assert_eq!(std::fs::read_to_string(&own).unwrap(), shown);
    std::fs::write(&own, "mine").unwrap();
    expect(&error(program("report").arg(&out), 1), &["tables.md", "not replaced"]);
    assert_eq!(std::fs::read_to_string(&own).unwrap(), "mine");
    std::fs::remove_file(&own).unwrap();
    let (again, config) = (out.join("again"), std::fs::read_to_string(first.join("config.toml")).unwrap());
    std::fs::create_dir(&again).unwrap();
    for table in ["episodes.csv", "eval.csv", "progress.csv", "manifest.json", "DONE"] {
        std::fs::copy(first.join(table), again.join(table)).unwrap();
    }
    std::fs::write(again.join("config.toml"), &config).unwrap();
    expect(&error(program("report").arg(&out), 1), &["again", "lift/aforce/seed_1", "same seed"]);
    let [within, packed] = [&out, folder.path()].map(|folder| folder.join("packed/of/few"));
    expect(&error(program("archive").arg(&out).arg("--out").arg(&within), 2), &["whose runs are read"]);
    expect(&error(program("archive").arg(&out).arg("--out").arg(&packed), 1), &["again", "are the same run"]);
    assert!(!within.exists() && !packed.exists());
    let other = config.replace("seed = 1\n", "seed = 2\n").replace("gamma = 0.97", "gamma = 0.9");
    std::fs::write(again.join("config.toml"), other).unwrap();
    expect(&error(program("report").arg(&out), 1), &["again", "learner.gamma: there 0.9, here 0.97"]);
    let larger = config.replace("seed = 1\n", "seed = 2\n").replace("position_step = 0.05", "position_step = 0.02");
    std::fs::write(again.join("config.toml"), larger).unwrap();
    expect(&error(program("report").arg(&out), 1), &["again", "position_step: there 0.02, here 0.05"]);
}

/// Four candidates, of which two go on after 300 actions and one after 600. The same command again finds all done and
/// writes the same table.
#[test]
fn the_better_half_of_a_search_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("tuned.toml");
    let draws = "draws = { count = 4, seed = 3, ranges.'env.space.stiffness.fixed' = { low = 20, high = 300, scale = 'log' } }\n";
    let text = few(900).replace("\"aforce\", ", "") + draws;
    std::fs::write(&file, "halving = [300, 600]\n".to_string() + &text).unwrap();

    let search = || {
        let output = program("sweep").current_dir(folder.path()).arg("tuned.toml").output().unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let out = folder.path().join("runs/tuned");
    let table = || std::fs::read(out.join("search.csv")).unwrap();
    search();
    let ranked = CsvTable::read(&out.join("search.csv")).unwrap();
    assert_eq!(ranked.column("actions").unwrap(), ["300", "300", "300", "300", "600", "600", "900"]);
    assert_eq!(ranked.column("rank").unwrap(), ["1", "2", "3", "4", "1", "2", "1"]);
    let variants = ranked.column("variant").unwrap();
    assert!(variants[..2].contains(&variants[4]) && variants[4] == variants[6], "{variants:?}");
    let settings = ranked.column("settings").unwrap();
    for (variant, settings) in variants.iter().zip(settings) {
        let drawn = settings.starts_with("env.space.stiffness.fixed = ") && !settings.contains(',');
        assert!(if *variant == "draw-0" { settings.is_empty() } else { drawn }, "{variant}: {settings}");
    }
    assert!(ranked.column("commit").unwrap().iter().all(|commit| !commit.is_empty()));
    let steps = |variant: &str| {
        let config = out.join(format!("lift/osc,{variant}/seed_1/config.toml"));
        RunConfig::resolve(Some(&config), &[]).unwrap().steps
    };
    assert_eq!([variants[6], variants[5], variants[3]].map(steps), [900, 600, 300]);

    let first = table();
    assert_eq!(search().matches("done before").count(), 3);
    assert_eq!(table(), first);
    // What a kill in the middle of the last round leaves.
    std::fs::remove_file(out.join(format!("lift/osc,{}/seed_1/DONE", variants[6]))).unwrap();
    search();
    assert_eq!(table(), first);
    // `report` leaves out the runs of a search: they differ in more than their seeds, and in length.
    let report = program("report").current_dir(folder.path()).arg("runs").output().unwrap();
    let told = String::from_utf8(report.stderr).unwrap();
    assert!(!report.status.success() && told.contains("no run folder below it"), "{told}");

    // Another search in the same folder would overwrite this table.
    for (from, to) in [("lift", "door"), ("count = 4, seed = 3", "count = 4, seed = 4")] {
        let other = std::fs::read_to_string(&file).unwrap().replace(from, to);
        std::fs::write(folder.path().join("other.toml"), other).unwrap();
        let told = error(program("sweep").current_dir(folder.path()).args(["other.toml", "--out", "runs/tuned"]), 1);
        expect(&told, &["runs/tuned/search.csv: ranks lift osc,draw-", "is no candidate of this search"]);
        assert_eq!(table(), first);
    }
}

/// A candidate that was interrupted in a longer round cannot go on in a shorter one, and is not ranked last for it.
#[test]
fn a_round_does_not_become_shorter_than_what_was_begun() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("tuned.toml"), folder.path().join("out"));
    let draws = "draws = { count = 2, seed = 3, ranges.'env.space.stiffness.fixed' = { low = 20, high = 300, scale = 'log' } }\n";
    std::fs::write(&file, "halving = [300]\n".to_string() + &few(900).replace("\"aforce\", ", "") + draws).unwrap();
    let runs = sweep::read(&file).unwrap().runs;
    // What is left of a candidate that was killed in its first episode, when the first round had 600 actions.
    let begun = RunFolder::below(&out, &runs[1]);
    std::fs::create_dir_all(begun.path()).unwrap();
    std::fs::write(begun.config(), RunConfig { steps: 600, ..runs[1].clone() }.to_toml()).unwrap();
    let told = error(program("sweep").arg(&file).arg("--out").arg(&out), 1);
    expect(&told, &["lift osc,draw-1 1 was begun for a round of 600 actions", "the round has 300 now", "--out"]);
    assert!(!RunFolder::below(&out, &runs[0]).path().exists(), "nothing was trained");
}

/// A killed run has not failed: the same command continues it. In a search no candidate is ranked then.
#[test]
fn a_killed_run_has_not_failed() {
    killed_runs_end_a_sweep_with_75("");
    let search = killed_runs_end_a_sweep_with_75("halving = [1_000_000]\n");
    assert!(std::fs::read(search.path().join("out/search.csv")).unwrap().is_empty(), "nobody is ranked");
}

/// Kills both runs of a sweep whose file begins with `head`; its folder.
fn killed_runs_end_a_sweep_with_75(head: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("tuned.toml"), folder.path().join("out"));
    std::fs::write(&file, head.to_string() + &few(2_000_000)).unwrap();
    let mut sweep = start(program("sweep").arg(&file).arg("--out").arg(&out).args(["--jobs", "2"]));
    for space in ["aforce", "osc"] {
        sweep.wait_for_a_row(&out.join(format!("lift/{space}/seed_1/episodes.csv")));
    }
    let children = std::fs::read_to_string(format!("/proc/{0}/task/{0}/children", sweep.id())).unwrap();
    let children: Vec<i32> = children.split_whitespace().map(|child| child.parse().unwrap()).collect();
    assert_eq!(children.len(), 2);
    for child in children {
        kill_process(Pid::from_raw(child).unwrap(), Signal::KILL).unwrap();
    }
    assert_eq!(sweep.ends(), Some(75));
    folder
}

/// If one of two candidates cannot be trained, the other is ranked all the same, and the exit code is 3.
#[test]
fn a_candidate_that_fails_is_the_last() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("tuned.toml");
    let draws = "draws = { count = 2, seed = 3, ranges.'env.space.stiffness.fixed' = { low = 20, high = 300, scale = 'log' } }\n";
    std::fs::write(&file, "halving = [300]\n".to_string() + &few(600).replace("\"aforce\", ", "") + draws).unwrap();
    let out = folder.path().join("out");
    // A folder that looks like a run without its configuration.
    let lost = out.join("lift/osc,draw-1/seed_1");
    std::fs::create_dir_all(&lost).unwrap();
    std::fs::write(lost.join("episodes.csv"), "step\n5\n").unwrap();

    let sweep = || {
        let mut sweep = program("sweep");
        sweep.arg(&file).arg("--out").arg(&out);
        sweep
    };
    let told = sweep().assert().code(3).get_output().stderr.clone();
    assert!(String::from_utf8(told).unwrap().contains("failed: lift osc,draw-1"));
    let ranked = CsvTable::read(&out.join("search.csv")).unwrap();
    assert_eq!(ranked.column("variant").unwrap(), ["draw-0", "draw-1", "draw-0"]);
    assert_eq!(ranked.column("rank").unwrap(), ["1", "2", "1"]);
    assert!(ranked.column("score").unwrap()[1].is_empty());

    // A scheduler may ask again for a run that is done, or that was extended since.
    for steps in ["300", "600"] {
        let again = sweep().args(["--index", "0", "--steps", steps]).assert().success().get_output().stdout.clone();
        assert!(String::from_utf8(again).unwrap().contains("seed_1: done before"));
    }
    // A sweep asks for the run that it read, by its hash, and notices that its file was changed meanwhile.
    for (asked, word) in [
        (
            &["--index", "0", "--steps", "600", "--expect", "0123456789abcdef"][..],
            "was changed while the sweep was at work",
        ),
        (&["--index", "0"], "--index needs --steps"),
    ] {
        let told = sweep().args(asked).assert().code(2).get_output().stderr.clone();
        assert!(String::from_utf8(told).unwrap().contains(word), "{word}");
    }
}
