//! Bad input is answered in one line that names what is wrong, and nothing is overwritten.

mod common;

use std::io::{Cursor, Write};
use std::path::Path;

use assert_cmd::Command;
use common::{error, expect, few, program, run_folder, train, train_for, unsummed};
use zip::ZipWriter;
use zip::write::FileOptions;

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
    expect(&error(train(out).args(["--config", "/dev/zero"]), 1), &["/dev/zero: longer than 4 MiB"]);
    expect(&error(program("sweep").args(["/dev/zero", "--list"]), 1), &["/dev/zero: longer than 4 MiB"]);
    expect(&error(program("sweep").args(["nowhere.toml", "--list"]), 2), &["nowhere.toml: there is no such file"]);
    expect(&error(program("report").args(["nowhere", "--out"]).arg(out), 2), &["nowhere: there is no such folder"]);
    expect(&error(train(out).args(["--set", "gamma="]), 2), &["gamma", "learner.gamma"]);
    let long = "n".repeat(300);
    for (name, reason) in [("=1+1", "letter or digit first"), ("-x", "letter or digit first"), (&long, "is too long")] {
        for key in ["env.space.name", "variant"] {
            expect(&error(train(out).args(["--describe", "--set", &format!("{key}={name}")]), 2), &["name", reason]);
        }
        let sweep = out.join("named.toml");
        std::fs::write(&sweep, few(600).replace("[[group]]", &format!("[[group]]\nname = \"{name}\""))).unwrap();
        expect(&error(program("sweep").arg(&sweep).arg("--list"), 2), &["named.toml", reason]);
    }
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
    // Options of pictures, of which the page is none.
    for (without_effect, wanted) in [
        (["--view", "top"], &["--png", "--sheet", "--gif"][..]),
        (["--width", "64"], &["--png", "--sheet", "--gif"]),
        (["--every", "4"], &["--gif"]),
    ] {
        expect(&error(replay().args(without_effect), 2), wanted);
    }
    expect(&error(program("replay").args(["--expert", "--png", "x.png", "--every", "4"]), 2), &["--gif"]);
    let doubled = ["--png", "x.png", "--plot", "x.svg"];
    expect(&error(replay().current_dir(out).args(doubled), 2), &["x.png", "two of the options"]);
    let spelt_otherwise = ["--png", "x.png", "--sheet", "./x.png"];
    expect(&error(replay().current_dir(out).args(spelt_otherwise), 2), &["x.png", "two of the options"]);
    expect(&error(program("replay").args(["--expert", "--csv", "/dev/null"]), 2), &["/dev/null", "must end with .csv"]);
    std::fs::create_dir(out.join("folder.csv")).unwrap();
    expect(&error(program("replay").current_dir(out).args(["--expert", "--csv", "folder.csv"]), 1), &["folder.csv"]);
    let disturbed = out.join("disturbed.toml");
    std::fs::write(&disturbed, "[[case]]\nname = \"high\"\ndisturbance.table_height_m = 0.2\n").unwrap();
    let mut evaluate = program("evaluate");
    evaluate.args(["--expert", "--task", "wipe", "--disturb"]).arg(&disturbed);
    expect(&error(&mut evaluate, 1), &["disturbed.toml", "\"high\"", "table_height_m"]);
    std::fs::write(&disturbed, "[[case]]\nname = \"slick\"\ndisturbance.friction = \"low\"\n").unwrap();
    expect(&error(&mut evaluate, 2), &["disturbed.toml", "a number, or [low, high]"]);
    assert!(!out.join("page.html").exists());
    assert!(!out.join("lift").exists(), "a refused run leaves nothing behind");
}

#[test]
fn a_wrong_value_or_file_of_settings_is_named() {
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
}

/// `report` of the runs below `runs`, into a folder beside them.
fn report(runs: &Path) -> Command {
    let mut command = program("report");
    command.arg(runs).arg("--out").arg(runs.with_file_name("report"));
    command
}

#[test]
fn a_report_takes_every_run_once_and_replaces_only_its_own_tables() {
    let folder = tempfile::tempdir().unwrap();
    let (runs, tables) = (folder.path().join("runs"), folder.path().join("report"));
    train_for(600, &runs).assert().success();
    // A link by which the folder contains itself.
    std::os::unix::fs::symlink(&runs, runs.join("again")).unwrap();
    report(&runs).assert().success();
    assert_eq!(std::fs::read_to_string(tables.join("runs.csv")).unwrap().lines().count(), 2);
    std::fs::write(tables.join("summary.csv"), "date,price\n").unwrap();
    expect(&error(&mut report(&runs), 1), &["summary.csv", "not a table of ours", "nothing was overwritten"]);
}

#[test]
fn an_edited_row_of_a_table_is_named_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let runs = folder.path().join("runs");
    train_for(600, &runs).assert().success();
    let table = run_folder(&runs).join("episodes.csv");
    let whole = std::fs::read_to_string(&table).unwrap();
    let row = whole.lines().nth(1).unwrap();
    let mut cells: Vec<&str> = row.split(',').collect();
    cells[7] = "maybe";
    for (edited, words) in [
        (cells.join(","), ["episodes.csv, line 2", "\"maybe\""]),
        (format!("99,{}", row.split_once(',').expect("cells").1), ["episodes.csv, line 2", "schema \"99\""]),
    ] {
        std::fs::write(&table, whole.replacen(row, &edited, 1)).unwrap();
        let output = report(&runs).output().unwrap();
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && words.iter().all(|word| told.contains(word)), "{told}");
    }
    // A row is missing in the middle.
    std::fs::write(&table, whole.replacen(&format!("{row}\n"), "", 1)).unwrap();
    expect(&error(train_for(2000, &runs).arg("--resume"), 1), &["episodes.csv", "rows were taken out or added"]);
}

/// A run is not resumed with tables, a checkpoint or settings of another run.
#[test]
fn a_file_of_another_run_is_not_gone_on_from() {
    let folder = tempfile::tempdir().unwrap();
    let runs = folder.path().join("runs");
    train_for(1500, &runs).args(["--set", "checkpoint_every=1000"]).assert().success();
    let run = run_folder(&runs);
    let mut resumed = train_for(2000, &runs);
    resumed.arg("--resume");
    let mut as_configured = program("train");
    as_configured.arg("--config").arg(run.join("config.toml"));
    as_configured.args(["--resume", "--quiet", "--steps", "2000", "--out"]).arg(&runs);
    let exchange = |command: &mut Command, file: &str, from: &str, to: &str, words: &[&str]| {
        let ours = std::fs::read_to_string(run.join(file)).unwrap();
        assert!(ours.contains(from), "{from:?} is not in {file}");
        std::fs::write(run.join(file), unsummed(&ours.replace(from, to))).unwrap();
        expect(&error(command, 1), words);
        std::fs::write(run.join(file), ours).unwrap();
    };
    for (file, from, to, words) in [
        ("episodes.csv", "aforce,7,", "aforce,8,", ["episodes.csv", "another run, with seed 8, not 7"]),
        ("eval.csv", "lift,", "door,", ["eval.csv", "another run, with task door, not lift"]),
        (
            "checkpoints/last/state.json",
            "\"seed\": 7",
            "\"seed\": 8",
            ["checkpoints/last", "of a run with seed 8, not 7"],
        ),
    ] {
        exchange(&mut resumed, file, from, to, &words);
    }
    let words = ["config.toml", "is not what the run was begun with"];
    exchange(&mut as_configured, "config.toml", "motion_price = 0.0", "motion_price = 5.0", &words);
}

/// Damaged weights, and other weights of the same sizes, are refused.
#[test]
fn weights_that_are_not_the_runs_are_not_played() {
    let folder = tempfile::tempdir().unwrap();
    let runs = folder.path().join("runs");
    train_for(600, &runs).assert().success();
    let run = run_folder(&runs);
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
    expect(&error(&mut evaluate(), 1), &["actor.safetensors", "not the file that state.json beside it names"]);
    std::fs::write(&best, &weights).unwrap();
    evaluate().assert().success();
}

/// A .zip that is not a kept policy is refused in one line.
#[test]
fn an_archive_of_something_else_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("seed_1.zip");
    let evaluate = || {
        let mut command = program("evaluate");
        command.arg("--run").arg(&path);
        command
    };
    let told = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        error(&mut evaluate(), 1)
    };
    let archive_of = |names: &[&str]| {
        let mut archive = ZipWriter::new(Cursor::new(vec![]));
        for name in names {
            archive.start_file(*name, FileOptions::default()).unwrap();
            archive.write_all(b"seed = 1").unwrap();
        }
        archive.finish().unwrap().into_inner()
    };
    let wanted = ["config.toml", "manifest.json", "checkpoints/best/state.json", "checkpoints/best/actor.safetensors"];
    for more in ["notes.txt", "../config.toml", "/config.toml", "checkpoints/last/state.json", "config.toml"] {
        let bytes = archive_of(&[&wanted[..], &[more]].concat());
        expect(&told(&bytes), &["seed_1.zip: not a policy that `archive` kept", &format!("{more:?}"), "each once"]);
    }
    expect(&told(&archive_of(&wanted[..3])), &["seed_1.zip: ", "has no checkpoints/best/actor.safetensors"]);
    let whole = archive_of(&wanted);
    let mut damaged = whole.clone();
    damaged[30 + wanted[0].len()] ^= 0xff;
    for bytes in [&[][..], b"no archive", &whole[..whole.len() - 20], &damaged] {
        expect(&told(bytes), &["seed_1.zip: not a policy that `archive` kept: "]);
    }
    // Messages name the files of a zip file as its own, not as those of the folder to which it is unpacked.
    expect(&told(&whole), &["seed_1.zip/checkpoints/best/state.json: "]);
    expect(&error(evaluate().arg("--csv").arg(path.join("table.csv")), 1), &["seed_1.zip"]);
    expect(&error(program("train").arg("--config").arg(&path).args(["--set", "env.x=1"]), 2), &["env.x"]);
    std::fs::write(&path, archive_of(&wanted[1..])).unwrap();
    expect(&error(program("train").arg("--config").arg(&path), 1), &["seed_1.zip: config.toml in it: "]);
    std::fs::remove_file(&path).unwrap();
    expect(&error(&mut evaluate(), 1), &["seed_1.zip"]);
}

/// A folder whose name is not Unicode works like any other.
#[cfg(unix)]
#[test]
fn a_name_that_is_no_unicode_is_taken() {
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join(std::ffi::OsStr::from_bytes(b"runs\xff"));
    train_for(600, &out).assert().success();
    assert!(run_folder(&out).join("DONE").exists());
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
