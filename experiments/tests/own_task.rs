//! A user's package with a task: made from the template, built outside of the workspace, and used.
//!
//! It shares the workspace's target folder, so that no dependency is compiled again. This workspace's own crates are
//! compiled again, because cargo treats them as other crates in another workspace. With less optimisation this takes 43 s
//! of CPU time in a fresh clone instead of 106 s, and no time afterwards.

mod common;

use std::path::{Path, PathBuf};
use std::process::Command;

use assert_cmd::Command as Program;
use common::expect;
use toml::Table;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// The workspace's target folder.
fn target() -> &'static Path {
    Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("target/tmp")
}

fn succeeds(command: &mut Command) {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
}

/// Makes the package in `at` and builds it; returns the program's path.
fn build(at: &Path) -> PathBuf {
    succeeds(
        Command::new("make").args(["--no-print-directory", "-C", ROOT, "own-task"]).arg(format!("AT={}", at.display())),
    );
    let (profile, folder) = if cfg!(debug_assertions) { ("dev", "debug") } else { ("release", "release") };
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["build", "--offline", "--profile", profile, "--target-dir"]).arg(target()).current_dir(at);
    let level = |package: &str, level: u8| format!("profile.{profile}.package.{package}.opt-level={level}");
    let simulated = ["aforce", "physics", "tasks"].map(|package| level(package, 1));
    let others = ["experiments", "show", "sac", "settings", "output", "own-task"].map(|package| level(package, 0));
    simulated.iter().chain(&others).for_each(|setting| _ = cargo.args(["--config", setting]));
    succeeds(&mut cargo);
    target().join(folder).join("own-task")
}

#[test]
fn a_task_of_ones_own_is_drawn_trained_and_evaluated() {
    let folder = tempfile::tempdir().unwrap();
    let program = build(&folder.path().join("package"));
    let out = folder.path();
    let run = |arguments: &[&str]| {
        let mut command = Program::new(&program);
        command.current_dir(out).env_remove("RUST_BACKTRACE").args(arguments);
        command
    };
    let done = |arguments: &[&str]| {
        let output = run(arguments).assert().success().get_output().stdout.clone();
        String::from_utf8(output).unwrap()
    };
    let drawn = done(&["replay", "--expert", "--task", "drawer", "--html", "page.html"]);
    assert!(drawn.contains("drawer aforce, scripted expert"), "{drawn}");
    assert!(drawn.contains("Opens the drawer at") && std::fs::metadata(out.join("page.html")).unwrap().len() > 100_000);

    let small = ["--set", "learner.hidden=[8]", "--set", "learner.batch_size=8", "--set", "learner.random_steps=100"];
    let few = ["--steps", "600", "--set", "evaluate_every=300", "--set", "evaluation_episodes=1"];
    let trained = done(&[&["train", "--task", "drawer", "--out", "runs"], &few[..], &small[..]].concat());
    assert!(trained.contains("next:    cargo run --release -- evaluate --run runs/drawer/aforce/seed_1"), "{trained}");
    let disturbed = "case = [{ name = 'sticky', task = 'drawer', disturbance.own.slide_friction = 3.0 }]";
    std::fs::write(out.join("cases.toml"), disturbed).unwrap();
    let played =
        done(&["evaluate", "--run", "runs/drawer/aforce/seed_1", "--episodes", "1", "--disturb", "cases.toml"]);
    assert!(played.contains("of 300 actions") && played.contains("sticky"), "{played}");

    // A sweep starts its runs as the same subcommand of the same program.
    let sweep = "[run]\nsteps = 200\nevaluate_every = 100\nevaluation_episodes = 1\nenv.horizon = 50\nlearner = { hidden = [8], batch_size = 8, \
                 random_steps = 50 }\n[[group]]\ntasks = ['drawer', 'lift']\nspaces = ['osc']\nseeds = [1]\n";
    std::fs::write(out.join("both.toml"), sweep).unwrap();
    done(&["sweep", "both.toml"]);
    assert!(done(&["report", "runs/both"]).contains("2 runs in 2 tables of a task"));

    let error =
        |arguments: &[&str]| String::from_utf8(run(arguments).assert().failure().get_output().stderr.clone()).unwrap();
    expect(
        &error(&["train", "--set", "env.task=drawr"]),
        &["env.task: no task is called \"drawr\"; did you mean \"drawer\"?"],
    );
    expect(
        &error(&["train", "--task", "drawer", "--set", "env.options.wide=1"]),
        &["drawer has no options of its own"],
    );
}

/// With different profiles the shared target folder would hold every dependency twice.
#[test]
fn the_template_is_compiled_as_the_workspace_is() {
    let profiles = |path: &str| {
        let text = std::fs::read_to_string(Path::new(ROOT).join(path)).unwrap();
        text.parse::<Table>().unwrap()["profile"].clone()
    };
    assert_eq!(profiles("templates/own-task/Cargo.toml"), profiles("Cargo.toml"));
}
