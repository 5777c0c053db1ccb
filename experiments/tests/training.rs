//! What training stores and writes, and how runs and sweeps are resumed and extended.

mod common;

use std::path::Path;

use common::{
    assert_same, error, expect, few, note, program, run_folder, start, states, stored, train, train_for, unsummed,
};
use experiments::config::cli::EnvArgs;
use experiments::config::{RunConfig, RunId};
use experiments::report::columns::Columns;
use experiments::report::record::Record;
use experiments::run::csv_writer::CsvWriter;
use experiments::run::folder::RunFolder;
use experiments::run::rollout::evaluate;
use experiments::run::seeds::{sub_seed, training_evaluation_seed};
use experiments::run::source::{Player, SourceArgs};
use experiments::run::which::Which;
use sac::{Act, Actor, Sac, Sizes};
use tasks::{Component, Env, Outcome};

fn scaled(values: &[f32], components: &[Component]) -> Vec<f32> {
    let mut values = values.to_vec();
    tasks::scale(components, &mut values);
    values
}

/// What the policy sees, and what only the critics see.
fn seen(env: &Env) -> [Vec<f32>; 2] {
    let policy = scaled(env.observation(), env.observation_components());
    [policy, scaled(env.privileged(), env.privileged_components())]
}

fn wide(action: &[f32]) -> Vec<f64> {
    action.iter().map(|&a| f64::from(a)).collect()
}

/// The stored actions, played again, give the stored rows: observation, reward, next observation. At a time limit the
/// next observation is the episode's last one, and the critic's value of it counts.
#[test]
fn what_is_stored_is_what_happened() {
    let folder = tempfile::tempdir().unwrap();
    train(folder.path()).args(["--set", "learner.n_step=1"]).assert().success();
    let run = run_folder(folder.path());
    let config = RunConfig::resolve(Some(&run.join("config.toml")), &[]).unwrap();
    assert!(config.learner.scaled_observations);
    let mut env = Env::new(config.env.clone(), sub_seed(config.seed, "train-env", 0)).unwrap();

    let mut totals = vec![];
    for episode in stored(&run).chunks(config.env.horizon as usize) {
        env.reset(None);
        for row in episode {
            assert_eq!(row.observation, seen(&env).concat());
            let step = env.step(&wide(&row.action));
            assert_eq!(row.next, seen(&env).concat());
            assert_eq!((row.reward, row.discount), (step.reward as f32, config.learner.gamma as f32));
        }
        totals.push(episode.iter().map(|row| f64::from(row.reward)).sum::<f64>());
    }

    let table = Columns::read(&run.join("episodes.csv")).unwrap();
    let values = |column| table.values(column).unwrap();
    assert_eq!((values("truncated"), values("terminated")), (vec![1.0; 20], vec![0.0; 20]));
    let returns = values("return");
    assert_eq!(returns.len(), totals.len());
    // The table is rounded to seven digits.
    assert!(returns.iter().zip(&totals).all(|(a, b)| (a - b).abs() < 1e-5 && *a > 0.0), "{returns:?} {totals:?}");
}

/// In a stored observation the critics' part follows the policy's, each with its own scales. The run learns nothing, so a
/// learner with the same seed chooses the stored actions if it is given the policy's part.
#[test]
fn critics_are_told_more_and_the_policy_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let mut train = train_for(1000, folder.path());
    train.args(["--task", "insert", "--set", "env.observation.critic=[\"contact\", \"task\"]"]);
    train.args(["--set", "learner.n_step=1", "--set", "learner.updates_per_step=0.0"]).assert().success();
    let run = folder.path().join("insert/aforce/seed_7");
    let config = RunConfig::resolve(Some(&run.join("config.toml")), &[]).unwrap();
    assert!(config.learner.scaled_observations);
    let mut env = Env::new(config.env.clone(), sub_seed(config.seed, "train-env", 0)).unwrap();
    let [observation, privileged] = seen(&env).map(|part| part.len());
    let sizes = Sizes { observation, privileged, action: env.action_dim() };
    let mut learner = Sac::new(&config.learner, sizes, sub_seed(config.seed, "learner", 0)).unwrap();

    let mut acts = (0..1000).map(|step| if step < config.learner.random_steps { Act::Random } else { Act::Sample });
    let mut action = vec![0.0; sizes.action];
    for episode in stored(&run).chunks(config.env.horizon as usize) {
        env.reset(None);
        learner.begin_episode();
        for row in episode {
            let [policy, critics] = seen(&env);
            assert_ne!(env.privileged(), critics, "with scales that matter");
            learner.act(&policy, &mut action, acts.next().unwrap());
            let apart = action.iter().zip(&row.action).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            // The last bits of a product may differ between processes.
            assert!(apart < 1e-4, "{action:?} {:?}", row.action);
            assert_eq!(row.observation, [policy, critics].concat());
            env.step(&wide(&row.action));
            assert_eq!(row.next, seen(&env).concat());
        }
    }
    assert!(acts.next().is_none(), "all of them are stored");
    let (actor, _) = Actor::load(&run.join("checkpoints/last"), observation, sizes.action, 0).unwrap();
    assert_eq!(actor.observation_dim(), observation);
}

/// All numbers are equal, to the last digit of the table.
#[test]
fn the_best_checkpoint_plays_its_evaluation_again() {
    let folder = tempfile::tempdir().unwrap();
    let often = ["--set", "evaluate_every=400", "--set", "evaluation_episodes=2"];
    train(folder.path()).args(often).assert().success();
    let run = run_folder(folder.path());

    // The best policy is that of an evaluation with mean actions. Sampled actions are played from the same starts.
    let of = |policy| Record::of_folder(&RunFolder::open(&run).unwrap()).unwrap().evaluations(policy).unwrap();
    let [means, sampled] = ["mean", "sampled"].map(|policy| of(policy).mean_by_step("return").unwrap());
    assert_eq!((means.len(), sampled.len()), (5, 5));
    assert!(means.iter().zip(&sampled).all(|(mean, sampled)| mean.1 != sampled.1));
    let starts = |policy| {
        let parts = of(policy).by_text("episode_seed").unwrap();
        parts.into_iter().map(|(seed, _)| seed).collect::<Vec<_>>()
    };
    assert_eq!(starts("mean"), starts("sampled"));
    assert!(starts("mean").iter().all(|seed| seed.len() == 18 && seed.starts_with("0x")), "text in every program");
    // The first of equally good evaluations.
    let (at, best) = means.into_iter().rev().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
    let note = note(&run.join("checkpoints/best")).unwrap();
    assert_eq!(note["step"].as_f64(), Some(at));
    // Tables are rounded to seven digits.
    assert!((note["evaluation_return"].as_f64().unwrap() / best - 1.0).abs() < 1e-6);

    let env = EnvArgs::default();
    let checkpoint = Some(Which::Best);
    let source = SourceArgs { run: Some(run.clone()), checkpoint, sample: false, expert: false, random: false, env };
    let Player { config, mut env, mut policy, step, .. } = source.open().unwrap();
    let again = folder.path().join("again.csv");
    let starts = (0..2).map(|index| training_evaluation_seed(step / 400, index));
    let mut table = CsvWriter::append(&again).unwrap();
    let write = |key, outcome: &Outcome| table.write((key, outcome));
    evaluate(&mut env, &mut policy, starts, step, &RunId::of(&config), write).unwrap();
    let [recorded, again] = [run.join("eval.csv"), again].map(|table| std::fs::read_to_string(table).unwrap());
    let recorded: Vec<&str> = recorded.lines().collect();
    assert_eq!(again.lines().count(), 3);
    assert!(again.lines().all(|row| recorded.contains(&row)), "{recorded:#?} {again}");
}

/// A resumed run keeps its best policy until a better one comes.
#[test]
fn the_best_evaluation_outlives_a_stop() {
    let folder = tempfile::tempdir().unwrap();
    let resume = |steps| {
        let mut command = train_for(steps, folder.path());
        command.args(["--resume", "--set", "evaluate_every=500"]).assert().success();
    };
    let run = run_folder(folder.path());
    let best = || note(&run.join("checkpoints/best")).unwrap()["step"].as_u64();
    // Makes the best return so far better than any to come, or worse.
    let remember = |value: &str| {
        let file = run.join("checkpoints/last/state.json");
        let text = std::fs::read_to_string(&file).unwrap();
        let line = text.lines().find(|line| line.contains("\"best_return\"")).unwrap();
        std::fs::write(&file, unsummed(&text.replace(line, &format!("\"best_return\": {value},")))).unwrap();
    };
    resume(500);
    assert_eq!(best(), Some(500));
    remember("1e9");
    resume(1000);
    assert_eq!(best(), Some(500));
    remember("-1e9");
    resume(1500);
    assert_eq!(best(), Some(1500));
    // If the best policy is missing, the next evaluation's policy is kept, whatever the best return was.
    remember("1e9");
    std::fs::remove_dir_all(run.join("checkpoints/best")).unwrap();
    resume(2000);
    assert_eq!(best(), Some(2000));
}

/// A stopped sweep asks every run to save a checkpoint, from which the same command continues.
#[test]
fn a_stopped_sweep_leaves_runs_to_go_on_with() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("few.toml"), folder.path().join("out"));
    std::fs::write(&file, few(1_000_000)).unwrap();
    let runs = ["aforce", "osc"].map(|space| out.join("lift").join(space).join("seed_1"));

    let mut sweep = start(program("sweep").arg(&file).arg("--out").arg(&out).args(["--jobs", "2"]));
    runs.iter().for_each(|run| sweep.wait_for_a_row(&run.join("episodes.csv")));
    assert_eq!(states(&file, &out), ["running", "running"]);
    assert_eq!(sweep.stop(), Some(75));
    assert_eq!(states(&file, &out), ["begun", "begun"]);
    for run in runs {
        assert!(run.join("checkpoints/last/replay.bin").exists());
        assert_eq!(RunFolder::open(&run).unwrap().manifest().unwrap().status, "stopped");
    }
}

#[test]
fn a_finished_run_is_extended_to_the_bytes_of_a_longer_one() {
    extend(1000);
}

/// The only evaluation of the short run, at its end, is not made in the longer run.
#[test]
fn a_run_too_short_for_an_evaluation_is_extended_likewise() {
    extend(200);
}

fn extend(steps: u64) {
    let folder = tempfile::tempdir().unwrap();
    let [extended, whole] = ["extended", "whole"].map(|name| folder.path().join(name));
    let [short, long] = [steps, 1500].map(|steps| {
        let file = folder.path().join(format!("{steps}.toml"));
        std::fs::write(&file, few(steps)).unwrap();
        file
    });
    let first = |file: &Path, out: &Path| {
        program("sweep").arg(file).args(["--index", "0", "--out"]).arg(out).assert().success();
    };
    first(&short, &extended);
    assert_eq!(states(&short, &extended), ["done", "new"]);
    assert_eq!(states(&long, &extended), ["begun", "new"]);

    let [run, longer] = [&extended, &whole].map(|out| out.join("lift/aforce/seed_1"));
    let mut train = program("train");
    train.arg("--config").arg(run.join("config.toml")).args(["--steps", "1500", "--resume", "--quiet", "--out"]);
    train.arg(&extended).assert().success();
    assert_eq!(states(&long, &extended), ["done", "new"]);
    first(&long, &whole);
    let networks = ["checkpoints/last/actor.safetensors", "checkpoints/best/actor.safetensors"];
    assert_same(&run, &longer, &["config.toml", "episodes.csv", "eval.csv", networks[0], networks[1]]);
}

/// The exit code tells a scheduler that the run is done; the next call draws the missing picture.
#[test]
fn curves_that_cannot_be_drawn_do_not_fail_a_run() {
    let folder = tempfile::tempdir().unwrap();
    let picture = run_folder(folder.path()).join("curves.svg");
    std::fs::create_dir_all(&picture).unwrap();
    train(folder.path()).assert().success();
    std::fs::remove_dir(&picture).unwrap();
    train(folder.path()).arg("--resume").assert().success();
    assert!(picture.is_file());
}

/// Committed results have no replay buffer: such a run can be looked at, but not resumed.
#[test]
fn a_run_without_its_checkpoint_is_not_begun_anew() {
    let folder = tempfile::tempdir().unwrap();
    train(folder.path()).assert().success();
    let run = run_folder(folder.path());
    let tables = ["episodes.csv", "eval.csv", "progress.csv", "manifest.json", "DONE"];
    let kept = folder.path().join("kept");
    std::fs::create_dir(&kept).unwrap();
    for name in tables {
        std::fs::copy(run.join(name), kept.join(name)).unwrap();
    }
    std::fs::remove_dir_all(run.join("checkpoints/last")).unwrap();

    // A finished run needs no checkpoint. Without one it cannot be extended, nor resumed if it is unfinished.
    train(folder.path()).arg("--resume").assert().success();
    assert_same(&run, &kept, &tables);
    expect(&error(train_for(3000, folder.path()).arg("--resume"), 1), &["checkpoints/last", "2000 actions"]);
    assert_same(&run, &kept, &tables);
    std::fs::remove_file(run.join("DONE")).unwrap();
    expect(&error(train(folder.path()).arg("--resume"), 1), &["checkpoints/last", "2000 actions"]);
    assert_same(&run, &kept, &tables[..4]);
}

/// A finished run that cannot be extended stays as it was: what is missing or damaged is named, and nothing is written.
#[test]
fn a_run_that_cannot_go_on_stays_finished() {
    let folder = tempfile::tempdir().unwrap();
    train(folder.path()).assert().success();
    let run = run_folder(folder.path());
    let all = ["config.toml", "episodes.csv", "eval.csv", "progress.csv", "manifest.json", "DONE"];
    let text = |name: &str| std::fs::read(run.join(name)).unwrap();
    let before: Vec<Vec<u8>> = all.iter().map(|name| text(name)).collect();
    type Damage = fn(&Path);
    let damages: [(&str, Damage, &str); 9] = [
        (
            "checkpoints/last/state.json",
            |path| change(path, "\"policy_average\": 0.0003,", ""),
            "policy_average: there 1.0",
        ),
        ("progress.csv", |path| change(path, "alpha", "alfa"), "only there: alfa; only here: alpha"),
        ("checkpoints/last/replay.bin", |path| std::fs::remove_file(path).unwrap(), "no replay memory"),
        ("checkpoints/last/actor.safetensors", |path| std::fs::write(path, "cut").unwrap(), "actor.safetensors"),
        ("checkpoints/best/actor.safetensors", |path| std::fs::write(path, "cut").unwrap(), "remove its folder"),
        ("episodes.csv", |path| std::fs::write(path, first_lines(path, 3)).unwrap(), "rows are missing"),
        ("eval.csv", |path| std::fs::remove_file(path).unwrap(), "rows are missing"),
        ("config.toml", |path| std::fs::remove_file(path).unwrap(), "without its config.toml"),
        ("manifest.json", |path| std::fs::write(path, "{").unwrap(), "manifest.json"),
    ];
    for (name, damage, word) in damages {
        let whole = text(name);
        damage(&run.join(name));
        let damaged: Vec<_> = all.iter().map(|file| std::fs::read(run.join(file)).ok()).collect();
        expect(&error(train_for(3000, folder.path()).arg("--resume"), 1), &["seed_7", word]);
        let left: Vec<_> = all.iter().map(|file| std::fs::read(run.join(file)).ok()).collect();
        assert!(left == damaged, "{name}");
        std::fs::write(run.join(name), whole).unwrap();
        let after: Vec<Vec<u8>> = all.iter().map(|name| text(name)).collect();
        assert!(before == after, "{name}");
    }
    train_for(3000, folder.path()).arg("--resume").assert().success();
}

fn change(path: &Path, part: &str, other: &str) {
    let text = std::fs::read_to_string(path).unwrap();
    assert!(text.contains(part));
    std::fs::write(path, unsummed(&text.replacen(part, other, 1))).unwrap();
}

fn first_lines(path: &Path, n: usize) -> String {
    std::fs::read_to_string(path).unwrap().lines().take(n).map(|line| format!("{line}\n")).collect()
}

/// A run too short for a regular evaluation has one at its end, so that it can be played and reported.
#[test]
fn a_short_run_is_evaluated_once() {
    let folder = tempfile::tempdir().unwrap();
    train_for(300, folder.path()).assert().success();
    let run = run_folder(folder.path());
    let steps = Columns::read(&run.join("eval.csv")).unwrap().values("step").unwrap();
    assert_eq!(steps, [300.0, 300.0], "with a mean and with a sampled action");
    program("report").arg(folder.path()).assert().success();
    let mut evaluate = program("evaluate");
    evaluate.args(["--episodes", "1", "--run"]).arg(&run).assert().success();
    expect(&error(evaluate.args(["--set", "learner.scaled_observations=false"]), 2), &["learner.scaled_observations"]);

    // `report` names a finished run that it cannot read, and exits with 3.
    let other = folder.path().join("lift/aforce/seed_8");
    std::fs::create_dir(&other).unwrap();
    std::fs::write(other.join("DONE"), "").unwrap();
    expect(&error(program("report").arg(folder.path()), 3), &["left out", "seed_8"]);
}

/// A run that was killed before its first checkpoint begins anew, and the row that it was writing is cut off.
#[test]
fn a_run_killed_before_its_first_checkpoint_begins_anew() {
    let folder = tempfile::tempdir().unwrap();
    let [killed, whole] = ["killed", "whole"].map(|name| folder.path().join(name));
    train(&whole).assert().success();
    train(&killed).assert().success();
    let run = run_folder(&killed);
    std::fs::remove_file(run.join("DONE")).unwrap();
    std::fs::remove_dir_all(run.join("checkpoints")).unwrap();
    let episodes = run.join("episodes.csv");
    let text = std::fs::read_to_string(&episodes).unwrap();
    let three: Vec<&str> = text.lines().take(4).collect();
    std::fs::write(&episodes, three.join("\n") + "\n2,lift,af").unwrap();
    train(&killed).arg("--resume").assert().success();
    let last = "checkpoints/last/actor.safetensors";
    assert_same(&run, &run_folder(&whole), &["episodes.csv", "eval.csv", last]);
}

/// A slow run saves itself by the clock: few actions in its tables do not mean that it had no checkpoint.
#[test]
fn a_slow_run_without_its_checkpoint_is_not_begun_anew() {
    let folder = tempfile::tempdir().unwrap();
    train(folder.path()).assert().success();
    let run = run_folder(folder.path());
    std::fs::remove_file(run.join("DONE")).unwrap();
    std::fs::remove_dir_all(run.join("checkpoints")).unwrap();
    let [episodes, progress] = ["episodes.csv", "progress.csv"].map(|name| run.join(name));
    let text = std::fs::read_to_string(&episodes).unwrap();
    std::fs::write(&episodes, text.lines().take(4).collect::<Vec<_>>().join("\n") + "\n").unwrap();
    let header = std::fs::read_to_string(&progress).unwrap().lines().next().unwrap().to_string();
    let cell = |name: &str| match name {
        "step" => "300",
        "wall_s" => "900",
        _ => "",
    };
    std::fs::write(&progress, format!("{header}\n{}\n", header.split(',').map(cell).collect::<Vec<_>>().join(",")))
        .unwrap();
    expect(&error(train(folder.path()).arg("--resume"), 1), &["checkpoints/last", "300 actions"]);
}

/// If the learner diverges, the error says at which action, and the manifest says that the run failed.
#[test]
fn a_failed_run_says_so_in_its_manifest() {
    let folder = tempfile::tempdir().unwrap();
    let error = error(
        train(folder.path()).args([
            "--set",
            "learner.critic_learning_rate=1.0",
            "--set",
            "learner.initial_temperature=1e30",
        ]),
        1,
    );
    expect(&error, &["seed_7", "the learner diverged at action"]);
    assert_eq!(RunFolder::open(&run_folder(folder.path())).unwrap().manifest().unwrap().status, "failed");
}
