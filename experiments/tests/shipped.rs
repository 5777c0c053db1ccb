//! The shipped configurations: they have the paper's settings, committed runs come from them, and each can be read.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use aforce::{DeltaSign, Gains, Psi, Stiffness};
use experiments::config::sweep::{self, Sweep};
use experiments::config::{RunConfig, RunId};
use experiments::report::summary::find_runs;
use experiments::report::text;
use experiments::run::csv_table::CsvTable;
use experiments::run::disturbances;
use experiments::run::folder::RunFolder;
use physics::robots::RobotName;
use tasks::{CountedForce, Disturbance, EnvConfig, ForcePenalty, TaskName};
use walkdir::WalkDir;

fn shipped(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("configs").join(name)
}

fn shipped_sweep(name: &str) -> Sweep {
    sweep::read(&shipped(name)).unwrap()
}

#[test]
fn the_shipped_table_has_the_papers_steps_and_units() {
    let Sweep { name, runs, .. } = shipped_sweep("study/table-1.toml");
    let wipe = |run: &&RunConfig| run.env.task == TaskName::WIPE;
    assert_eq!((name.as_str(), runs.len(), runs.iter().filter(wipe).count()), ("table-1", 100, 40));
    for RunConfig { env, .. } in &runs {
        assert_eq!((env.controller.position_step, env.controller.rotation_step), (0.05, 0.5));
        assert_eq!(env.space, env.space.name.parse().unwrap(), "built in");
    }
}

/// Every committed run is a run of a shipped sweep. Its space and variant may have another name, and its checkpoints another interval.
#[test]
fn committed_runs_are_those_of_the_shipped_sweeps() {
    let study = ["table-1", "parts", "hidden", "prior", "prior-parts", "tuned", "same-steps", "nudges"];
    let others = [
        "second-study/learners.toml",
        "second-study/stops.toml",
        "second-study/entries.toml",
        "second-study/door.toml",
        "second-study/condensed.toml",
        "second-study/hidden.toml",
        "second-study/psi-learned.toml",
        "second-study/arm.toml",
        "insert/again.toml",
    ];
    let others = others.map(String::from);
    let nameless = |mut run: RunConfig| {
        (run.env.space.name, run.variant, run.checkpoint_every) = ("any".into(), String::new(), 1);
        run
    };
    let shipped: Vec<RunConfig> = study
        .map(|name| format!("study/{name}.toml"))
        .into_iter()
        .chain(others)
        .flat_map(|name| shipped_sweep(&name).runs)
        .map(nameless)
        .collect();
    let results = Path::new(env!("CARGO_MANIFEST_DIR")).join("../results");
    let runs = find_runs(&results).unwrap();
    assert!(runs.len() >= 100, "{}", runs.len());
    for run in runs {
        let run = run.unwrap();
        assert!(run.done && shipped.contains(&nameless(run.config)), "{}", run.path.display());
    }
}

/// The candidate that a committed search ranked first for the task and space of a run, after so many actions.
fn winner<'a>(candidates: &'a [RunConfig], search: &str, run: &RunId, after: &str) -> &'a RunConfig {
    let table = Path::new(env!("CARGO_MANIFEST_DIR")).join("../results").join(search);
    let table = CsvTable::read(&table).unwrap();
    let [tasks, spaces, variants, actions, ranks] =
        ["task", "space", "variant", "actions", "rank"].map(|column| table.column(column).unwrap());
    let won = |at: &usize| (tasks[*at], spaces[*at], actions[*at], ranks[*at]) == (&run.task, &run.space, after, "1");
    let variant = variants[(0..tasks.len()).find(won).unwrap()];
    let is_it = |other: &&RunConfig| {
        let other = RunId::of(other);
        (&other.task, &other.space, other.variant.as_str()) == (&run.task, &run.space, variant)
    };
    candidates.iter().find(is_it).unwrap()
}

/// Runs of the stage `tuned` have the settings that the committed search ranked first; their length and evaluations are
/// those of the untuned stage.
#[test]
fn tuned_spaces_are_the_winners_of_the_search() {
    let candidates = shipped_sweep("study/search.toml").runs;
    let untuned = [shipped_sweep("study/prior.toml").runs, shipped_sweep("study/table-1.toml").runs].concat();
    let tuned = shipped_sweep("study/tuned.toml").runs;
    assert_eq!(tuned.len(), 45);
    for run in &tuned {
        let id = RunId::of(run);
        let candidate = winner(&candidates, "study/search/search.csv", &id, "150000");
        assert_eq!((&run.env, &run.learner), (&candidate.env, &candidate.learner), "{id}");
        assert_eq!(id.variant, candidate.variant);
        let like = untuned.iter().find(|like| like.env.task == run.env.task).unwrap();
        assert_eq!((run.steps, run.evaluate_every), (like.steps, like.evaluate_every), "{id}");
    }
    // `same-steps` has `variable` with AFORCE's action steps: a candidate of the search, or the search's winner with no other change.
    for run in shipped_sweep("study/same-steps.toml").runs {
        let candidate = |other: &RunConfig| other.variant == run.variant && other.env == run.env;
        let won = |other: &RunConfig| run.variant == "only-steps" && other.env.space == run.env.space;
        assert!(candidates.iter().any(candidate) || tuned.iter().any(won));
        let aforce = tuned.iter().find(|other| (other.env.task, other.seed) == (run.env.task, run.seed)).unwrap();
        let (env, variant) = (EnvConfig { space: run.env.space.clone(), ..aforce.env.clone() }, run.variant.clone());
        assert_eq!(run, RunConfig { env, variant, ..aforce.clone() });
    }
    // The search's winners, trained under hidden disturbances.
    let hidden = shipped_sweep("second-study/hidden.toml").runs;
    let winners: Vec<_> = hidden.iter().filter(|run| run.variant.contains("tuned")).collect();
    assert_eq!(winners.len(), 30);
    for RunConfig { env, .. } in winners {
        let like = tuned.iter().find(|run| run.env.space.name == env.space.name).unwrap();
        assert_eq!((&env.controller, &env.space), (&like.env.controller, &like.env.space));
    }
}

#[test]
fn the_sets_of_block_g_come_in_pairs_of_both_signs() {
    let runs = shipped_sweep("second-study/psi.toml").runs;
    for (task, case) in [("lift", "still"), ("door", "hidden"), ("wipe", "push")] {
        let of_case: Vec<_> =
            runs.iter().filter(|run| run.env.task.as_str() == task && run.variant.starts_with(case)).collect();
        assert_eq!(of_case.len(), 200);
        let (printed, damping): (Vec<_>, Vec<_>) = of_case.into_iter().partition(|run| run.variant.contains("printed"));
        for (one, other) in printed.into_iter().zip(damping) {
            assert_eq!(one.variant, other.variant.replace(case, &format!("{case},printed")));
            let (one, other) = (one.env.space.psi().unwrap(), other.env.space.psi().unwrap());
            assert_eq!((one.delta_sign, other.delta_sign), (DeltaSign::Literal, DeltaSign::Damping));
            assert_eq!(Psi { delta_sign: DeltaSign::Damping, ..*one }, *other);
        }
    }
}

/// The second round of block G plays the sets that did best in its first round, by the committed tables, in the order of their rank.
#[test]
fn block_g_plays_its_best_sets_again() {
    let mut sets: BTreeMap<String, (f64, f64)> = BTreeMap::new();
    for player in ["expert", "policy"] {
        let table = format!("../results/second-study/psi/{player}.csv.zst");
        let table = CsvTable::read_finished(&Path::new(env!("CARGO_MANIFEST_DIR")).join(table)).unwrap();
        let [tasks, variants, successes, energies] =
            ["task", "variant", "success_before_stop", "energy_per_action_j"].map(|name| table.column(name).unwrap());
        for at in (0..tasks.len()).filter(|at| tasks[*at] == "lift") {
            let (_, set) = variants[at].split_once(',').unwrap();
            let sum = sets.entry(set.into()).or_default();
            *sum = (sum.0 + successes[at].parse::<f64>().unwrap(), sum.1 + energies[at].parse::<f64>().unwrap());
        }
    }
    let mut ranked: Vec<_> = sets.into_iter().collect();
    ranked.sort_by(|(_, one), (_, other)| other.0.total_cmp(&one.0).then(one.1.total_cmp(&other.1)));
    let of = |name: &str, case: &str| {
        let runs = shipped_sweep(name).runs.into_iter();
        runs.filter(|run| run.env.task == TaskName::LIFT && run.variant.starts_with(case)).collect::<Vec<_>>()
    };
    let (drawn, again) = (of("second-study/psi.toml", "push"), of("second-study/psi-best.toml", "push"));
    assert_eq!((ranked.len(), again.len()), (200, 20));
    for ((set, _), run) in ranked.iter().zip(&again) {
        assert_eq!(run.variant, format!("push,{}", set.replace(',', "-")));
        let first = drawn.iter().find(|other| other.variant == format!("push,{set}")).unwrap();
        assert_eq!(run.env, first.env);
    }
}

/// Every shipped file is a sweep that can be read, except for the files that other tests read.
#[test]
fn every_shipped_file_is_read() {
    let others = ["demo.toml", "disturbances.toml", "insert/disturbances.toml"].map(shipped);
    let files = WalkDir::new(shipped("")).into_iter().map(|entry| entry.unwrap().into_path());
    let sweeps: Vec<PathBuf> = files.filter(|path| path.is_file() && !others.contains(path)).collect();
    assert!(sweeps.len() > 20, "{sweeps:?}");
    for file in sweeps {
        let sweep = sweep::read(&file).unwrap_or_else(|error| panic!("{error:#}"));
        assert!(!sweep.runs.is_empty(), "{}", file.display());
    }
    assert_eq!(shipped_sweep("observation.toml").runs.len(), 8);
    assert_eq!(shipped_sweep("noise.toml").runs.len(), 54);
}

#[test]
fn the_demo_is_a_short_run_that_stops_when_its_task_is_solved() {
    let demo = RunConfig::resolve(Some(&shipped("demo.toml")), &[]).unwrap();
    assert_eq!(
        (demo.steps, RunFolder::below(Path::new("."), &demo).path()),
        (60_000, Path::new("./lift/aforce/seed_1"))
    );
    assert!(demo.env.stops, "of the set-up to solve a task");
}

#[test]
fn disturbances_of_every_task_begin_with_none() {
    for task in TaskName::BUILT_IN {
        let cases = disturbances::read(&shipped("disturbances.toml"), task).unwrap();
        assert!(cases.len() > 11 && cases[0].disturbance == Disturbance::default());
    }
    assert_eq!(disturbances::read(&shipped("insert/disturbances.toml"), TaskName::INSERT).unwrap().len(), 7);
}

/// Five spaces with the same four draws of both action steps, of which the first draw is that of the other blocks.
/// Otherwise they differ from block 1 in space, seed, length and evaluations alone. The tolerance of an adaptive space is
/// in proportion to the steps, as in block 1.
#[test]
fn every_space_of_insert_gets_the_same_search() {
    let first = shipped_sweep("insert/again.toml").runs.swap_remove(0);
    let candidates = shipped_sweep("insert/steps.toml").runs;
    assert_eq!(candidates.len(), 20);
    let steps = |run: &RunConfig| (run.env.controller.position_step, run.env.controller.rotation_step);
    for (at, draw) in candidates.chunks(5).enumerate() {
        assert_eq!(steps(&draw[0]) == steps(&first), at == 0, "draw {at}");
        for candidate in draw {
            assert_eq!((steps(candidate), candidate.seed, candidate.steps), (steps(&draw[0]), 452, 60_000));
            assert!(tolerance_in_steps(candidate).is_none_or(|share| share == ROBOSUITES));
            let mut same = RunConfig { seed: first.seed, steps: first.steps, ..candidate.clone() };
            same.variant = first.variant.clone();
            (same.evaluate_every, same.evaluation_episodes) = (first.evaluate_every, first.evaluation_episodes);
            (same.env.space, same.env.controller) = (first.env.space.clone(), first.env.controller);
            assert_eq!(same, first, "{}", RunId::of(candidate));
        }
    }
}

/// Makes the change to `run` by which a group of the insertion runs differs from the first group.
fn change_of_insert(group: &str, run: &mut RunConfig) {
    match group {
        "1-mm" => {}
        "blows-priced" => {
            run.env.options.insert("penalty".into(), true.into());
            run.env.force_penalty = ForcePenalty { of: CountedForce::Hand, limit: 10.0, weight: 0.2 };
        }
        "unfelt" => run.env.observation.force = false,
        "half-mm" => {
            run.env.options.insert("clearance_mm".into(), 0.5.into());
        }
        "114-um" => {
            run.env.options.insert("clearance_mm".into(), 0.114.into());
        }
        "114-um-2-cm" => {
            change_of_insert("114-um", run);
            change_of_insert("2-cm", run);
        }
        "measured-arm" | "measured-arm-half-mm" | "blows-dear" => {
            if group != "blows-dear" {
                run.env.robot = RobotName::Identified.into();
            }
            let (clearance, steps) = if group.ends_with("half-mm") { (0.5, 400_000) } else { (1.0, run.steps) };
            run.steps = steps;
            run.env.options.insert("clearance_mm".into(), clearance.into());
            run.env.options.insert("penalty".into(), true.into());
            run.env.force_penalty = ForcePenalty { of: CountedForce::Hand, limit: 8.0, weight: 1.0 };
        }
        "1-mm-drawn" | "2-cm-drawn" => {
            change_of_insert(group.trim_end_matches("-drawn"), run);
            let forges = "torque_gain = [0.71, 1.41]\nforce_noise_n = 1.0\n\
                          own = { hole_friction = [0.33, 1.67], peg_mass = [0.74, 1.26] }";
            run.env.disturbance = settings::parse(forges).unwrap();
        }
        "16-mm" => {
            run.env.controller.position_step = 0.0164;
            run.env.controller.rotation_step = 0.0241;
        }
        "2-cm" => {
            run.env.controller.position_step = 0.02;
            run.env.controller.rotation_step = 0.097;
        }
        other => panic!("{other}"),
    }
}

/// The law's tolerance, translation and rotation, as thousandths of the action step: with `aforce` and robosuite's steps.
const ROBOSUITES: [f64; 2] = [750.0, 550.0];

/// The same of a run; `None` if its stiffness does not adapt.
fn tolerance_in_steps(run: &RunConfig) -> Option<[f64; 2]> {
    let (tolerance, steps) = (run.env.space.psi()?.tolerance(), &run.env.controller);
    Some([tolerance[0] / steps.position_step, tolerance[3] / steps.rotation_step].map(|share| (1000.0 * share).round()))
}

/// The groups of insertion differ in the change that they are made for, and in nothing else. The law's tolerance, as a
/// share of the action step, is that of `aforce` with robosuite's steps.
#[test]
fn groups_of_insertion_differ_in_what_they_are_about() {
    let runs = shipped_sweep("insert/again.toml").runs;
    let first = runs[0].clone();
    let mut groups = BTreeMap::new();
    for run in runs {
        let id = RunId::of(&run);
        let share = tolerance_in_steps(&run);
        assert!(share.is_none_or(|share| share == ROBOSUITES), "{id}: {share:?}");
        match run.env.space.name.as_str() {
            "aforce-scaled-force" | "aforce-scaled" => assert_eq!(share, Some(ROBOSUITES)),
            "fixed-565" => assert_eq!(run.env.space.stiffness, Stiffness::Fixed(Gains::pair(565.0, 28.0))),
            "fixed-100" => assert_eq!(run.env.space.stiffness, Stiffness::Fixed(Gains::pair(100.0, 30.0))),
            name => assert_eq!(run.env.space, name.parse().unwrap(), "built in"),
        }
        let mut like = RunConfig { seed: run.seed, variant: run.variant.clone(), ..first.clone() };
        like.env.space = run.env.space.clone();
        change_of_insert(&run.variant, &mut like);
        assert_eq!(run, like, "{id}");
        groups.entry(format!("{},{}", id.space, run.variant)).or_insert_with(Vec::new).push(run.seed);
    }
    assert_eq!(groups.len(), 28);
    for (group, seeds) in groups {
        assert!(seeds.into_iter().eq(21..=if group.ends_with(",half-mm") { 30 } else { 25 }), "{group}");
    }
}

/// Runs have the settings of `table-1`, and for Door in later stages those of `prior`, except for seed and space.
/// `hidden` adds a disturbance; `search` draws settings of the controller, and has other lengths of runs and intervals between evaluations.
#[test]
fn stages_of_the_study_differ_in_what_they_are_about() {
    let table = shipped_sweep("study/table-1.toml").runs;
    let prior = shipped_sweep("study/prior.toml").runs;
    for (stage, count, seeds) in
        [("table-1", 100, 11..=20), ("search", 72, 211..=211), ("parts", 50, 11..=15), ("hidden", 60, 11..=15)]
    {
        let runs = shipped_sweep(&format!("study/{stage}.toml")).runs;
        assert_eq!(runs.len(), count, "{stage}");
        for run in runs {
            let id = RunId::of(&run);
            assert!(seeds.contains(&run.seed) && run.preset == sac::Preset::SWIFT, "{stage}: {id}");
            let base = if stage == "table-1" { &[][..] } else { &prior };
            let like = base.iter().chain(&table).find(|like| like.env.task == run.env.task).unwrap();
            let mut same = RunConfig { seed: like.seed, preset: like.preset, ..run };
            same.env.space = like.env.space.clone();
            if stage == "hidden" {
                assert!(same.env.disturbance != Disturbance::default(), "{id}");
                same.env.disturbance = Disturbance::default();
            }
            if stage == "search" {
                let RunConfig { variant, steps, evaluate_every, .. } = like.clone();
                same = RunConfig { variant, steps, evaluate_every, ..same };
                same.env.controller = like.env.controller;
            }
            assert_eq!(same, *like, "{stage}: {id}");
        }
    }
}

/// Stages with a script's episodes have the learner of the tournament's variant `prior`.
#[test]
fn stages_with_a_script_have_the_learner_of_the_tournament() {
    let tuned = shipped_sweep("tournament.toml").runs.into_iter().find(|run| run.variant == "prior").unwrap();
    let prior = shipped_sweep("study/prior.toml").runs;
    let parts = shipped_sweep("study/prior-parts.toml").runs;
    assert_eq!((prior.len(), parts.len()), (30, 25));
    for run in parts {
        let mut same = RunConfig { seed: prior[0].seed, ..run };
        same.env.space = prior[0].env.space.clone();
        assert_eq!(same, prior[0]);
    }
    assert!(prior.iter().all(|run| run.learner == tuned.learner && run.env.task == TaskName::DOOR));
}

#[test]
fn nudged_runs_are_those_of_the_table_but_for_the_nudges() {
    let table = shipped_sweep("study/table-1.toml").runs;
    let nudged = shipped_sweep("study/nudges.toml").runs;
    assert_eq!(nudged.len(), 30);
    for mut run in nudged {
        assert_eq!(std::mem::take(&mut run.learner.nudges), 0.5);
        assert!(table.contains(&run), "{}", RunId::of(&run));
    }
}

/// A run of the second round differs from one of the first in space, seed, noise and the critics' layer norm alone.
#[test]
fn the_second_round_of_the_tournament_confirms_the_first() {
    let first_round = shipped_sweep("tournament.toml").runs;
    let second_round = shipped_sweep("tournament-confirm.toml").runs;
    assert_eq!((first_round.len(), second_round.len()), (33, 20));
    for run in second_round {
        let base = first_round.iter().find(|base| base.variant == "base" && base.env.task == run.env.task).unwrap();
        let mut same = RunConfig { seed: 201, variant: "base".into(), ..run.clone() };
        same.env.space = base.env.space.clone();
        assert_eq!((run.learner.pink_noise, run.learner.layer_norm), (0.5, run.variant == "half-pink-norm"));
        (same.learner.pink_noise, same.learner.layer_norm) = (1.0, false);
        assert_eq!(same, *base);
    }
}

/// The learner is the preset `desktop`, `swift`, or `swift` with one change.
#[test]
fn the_third_round_of_the_tournament_changes_one_thing_at_a_time() {
    let third_round = shipped_sweep("tournament-five.toml").runs;
    assert_eq!(third_round.len(), 60);
    for run in third_round {
        let (is, swift) = (&run.learner, sac::Preset::SWIFT.settings());
        let changed = [
            is.layer_norm != swift.layer_norm,
            is.hidden != swift.hidden,
            is.actor_period != swift.actor_period,
            is.pink_noise != swift.pink_noise,
        ];
        let changes = changed.iter().filter(|changed| **changed).count();
        match run.variant.as_str() {
            "desktop" => assert_eq!(*is, sac::Preset::DESKTOP.settings()),
            variant => assert_eq!(changes, usize::from(variant != "swift"), "{}", RunId::of(&run)),
        }
    }
}

/// `arms.toml` has runs of every robot, `arms-learned.toml` of every robot but the two models of the Panda.
#[test]
fn every_arm_has_its_runs() {
    let robots = |sweep: &str| -> BTreeSet<String> {
        shipped_sweep(sweep).runs.iter().map(|run| run.env.robot.name().to_string()).collect()
    };
    assert_eq!(robots("arms.toml"), RobotName::ALL.map(|name| name.as_str().to_string()).into());
    assert_eq!(robots("arms-learned.toml"), ["fr3", "iiwa14", "ur5e"].map(String::from).into());
}

/// Templates place cells of tables: a number that a template computes would have no test, and a long macro is hard to read.
#[test]
fn texts_hold_no_long_macros() {
    let results = Path::new(env!("CARGO_MANIFEST_DIR")).join("../results");
    let templates = text::find_templates(&results).unwrap();
    assert!(templates.len() >= 7, "{templates:?}");
    for template in templates {
        let text = std::fs::read_to_string(&template).unwrap();
        let tags = text.lines().enumerate().filter(|(_, line)| line.trim_start().starts_with("{%"));
        for (line, tag) in tags {
            assert!(tag.chars().count() <= 120, "{}, line {}: {tag}", template.display(), line + 1);
        }
    }
}
