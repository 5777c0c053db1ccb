//! Files of sweeps that are accepted, and files that are refused.

use std::path::Path;

use aforce::{Gains, Stiffness};
use anyhow::Result;

use super::{Sweep, read};
use crate::config::{RunConfig, RunId};

fn sweep(text: &str) -> Result<Vec<RunConfig>> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sweep.toml");
    fs_err::write(&path, text).unwrap();
    read(&path).map(|sweep| sweep.runs)
}

fn labels(runs: &[RunConfig]) -> Vec<String> {
    runs.iter().map(|run| RunId::of(run).label()).collect()
}

#[test]
fn groups_become_runs_with_the_nearer_setting() {
    let runs = sweep(
        "run = { steps = 1000, learner = { gamma = 0.9 } }\n\
         [[group]]\ntasks = [\"lift\"]\nspaces = [\"aforce\", \"osc\"]\nseeds = [4, 5]\n\
         [[group]]\ntasks = [\"wipe\"]\nspaces = [\"low-force\"]\nseeds = [1]\nrun = { steps = 2000 }",
    )
    .unwrap();
    let ids: Vec<String> =
        runs.iter().map(RunId::of).map(|id| format!("{} {} {}", id.task, id.space, id.seed)).collect();
    assert_eq!(ids, ["lift aforce 4", "lift osc 4", "lift aforce 5", "lift osc 5", "wipe low-force 1"]);
    assert_eq!(runs.iter().map(|r| r.steps).collect::<Vec<_>>(), [1000, 1000, 1000, 1000, 2000]);
    assert!(runs.iter().all(|r| r.learner.gamma == 0.9));
}

#[test]
fn what_is_wrong_is_named() {
    let group = "[[group]]\ntasks = [\"lift\"]\nspaces = [\"aforce\"]\nseeds = [1]\n";
    for (text, word) in [
        (group.to_string() + group, "twice"),
        (group.replace("seeds = [1]", "seeds = []"), "no run"),
        (group.replace("aforce", "aforze"), "aforze"),
        (group.replace("lift", "left"), "left"),
        (group.to_string() + "run = { learner = { gama = 1 } }", "did you mean \"learner.gamma\""),
        (group.to_string() + "steps = 3", "known are name, tasks"),
        (group.to_string() + "run = { seed = 2 }", "group.run.seed"),
        (group.to_string() + "run = { env = { space = \"osc\" } }", "run.env.space"),
        (group.to_string() + "run = { variant = \"a\" }", "run.variant"),
        (group.to_string() + "vary = { \"learner.nstep\" = [1] }", "did you mean \"learner.n_step\""),
        (group.to_string() + "vary = { \"learner.n_step\" = [] }", "vary.\"learner.n_step\": the list is empty"),
        (group.to_string() + "vary = { \"learner.n_step\" = 1 }", "a list of values"),
        (group.to_string() + "vary = { seed = [1, 2] }", "vary.seed"),
        (group.to_string() + "vary = { \"learner.n_step\" = [3, 3] }", "lift aforce,n_step=3 1 stands there twice"),
        (group.to_string() + "name = \"a/b\"", "a/b"),
        (
            group.to_string()
                + "run.env.disturbance.friction = 0.5\nvary = { \"env.disturbance\" = [{}, { payload_kg = 1.0 }] }",
            "env.disturbance = {} changes nothing",
        ),
    ] {
        let error = sweep(&text).unwrap_err().to_string();
        assert!(error.contains(word) && error.contains("sweep.toml"), "{error}");
    }
}
#[test]
fn a_group_varies_what_it_says_in_the_order_of_its_keys() {
    let runs = sweep(
        "[run]\nlearner = { gamma = 0.9 }\n\
         [[group]]\ntasks = [\"lift\"]\nspaces = [\"aforce\", \"osc\"]\nseeds = [1]\n\
         vary = { \"learner.n_step\" = [1, 5], \"env.controller.position_step\" = [0.02, 0.05] }\n\
         [[group]]\nname = \"soft-45\"\ntasks = [\"lift\"]\nspaces = [\"osc\"]\nseeds = [1]\n\
         run.env.space.stiffness.fixed = 45\n\
         [[group]]\nname = \"wide\"\ntasks = [\"lift\"]\nspaces = [\"osc\"]\nseeds = [1]\n\
         vary = { \"learner.hidden\" = [[8, 8]] }",
    )
    .unwrap();
    let expected = [
        "aforce,n_step=1,position_step=0.02",
        "osc,n_step=1,position_step=0.02",
        "aforce,n_step=1,position_step=0.05",
        "osc,n_step=1,position_step=0.05",
        "aforce,n_step=5,position_step=0.02",
        "osc,n_step=5,position_step=0.02",
        "aforce,n_step=5,position_step=0.05",
        "osc,n_step=5,position_step=0.05",
        "osc,soft-45",
        "osc,wide,hidden=_8__8_",
    ];
    assert_eq!(labels(&runs), expected);
    let of = |run: &RunConfig| (run.learner.n_step, run.env.controller.position_step, run.learner.gamma);
    assert_eq!((of(&runs[2]), of(&runs[4])), ((1, 0.05, 0.9), (5, 0.02, 0.9)));
    assert_eq!(runs[8].env.space.stiffness, Stiffness::Fixed(Gains::all(45.0)));
    assert_eq!(runs[9].learner.hidden, [8, 8]);
}

/// Every candidate has a run for every task, space and seed; the first candidate is the group without drawn settings.
#[test]
fn a_group_draws_candidates_that_can_run() {
    let of = |halving: &str, range: &str| {
        let group = "[[group]]\ntasks = ['lift', 'door']\nspaces = ['aforce']\nseeds = [1]\n";
        format!("{halving}\nrun.steps = 900\n{group}draws = {{ count = 9, seed = 2, ranges = {{ {range} }} }}\n")
    };
    // A `k_max` below the initial stiffness `k_0`, 500 N/m, is refused and drawn again.
    let range = "'env.space.stiffness.adaptive.k_max' = { low = [100, 20], high = [6000, 400], scale = 'log' }";
    let runs = sweep(&of("", range)).unwrap();
    assert_eq!(labels(&runs)[..3], ["aforce,draw-0", "aforce,draw-0", "aforce,draw-1"]);
    let k_max = |run: &RunConfig| run.env.space.psi().unwrap().k_max;
    assert!(runs.len() == 18 && k_max(&runs[0])[0] == 3000.0);
    for pair in runs.as_chunks::<2>().0 {
        assert_eq!(k_max(&pair[0]), k_max(&pair[1]));
        assert!(k_max(&pair[0])[0] >= 500.0, "k_0 lies between the bounds");
    }
    for (text, word) in [
        (of("", &range.replace("k_max", "k_mx")), "did you mean"),
        (of("", &range.replace("6000, 400", "200, 30")), "none of 200 candidates can run"),
        (of("halving = [300, 200]", range), "rising numbers of actions above 0 and below steps, 900"),
        (of("halving = [900]", range), "below steps, 900"),
        (
            of("halving = [450]\nrun.evaluate_every = 300", range),
            "one evaluation in 300 actions, and none in the last quarter of 450",
        ),
        (
            of("halving = [500]\nrun.evaluate_every = 500", range),
            "one evaluation in 500 actions, and none in the last quarter of 900",
        ),
        (
            of("halving = [300]", range) + &of("", range).replace("lift', 'door", "wipe") + "run.steps = 1800",
            "same steps",
        ),
    ] {
        let error = sweep(&text).unwrap_err().to_string();
        assert!(error.contains(word) && error.contains("sweep.toml"), "{error}");
    }
}

/// A run has the value that its name says: what varies is not drawn as well.
#[test]
fn what_varies_is_not_drawn() {
    let of = |varied: &str, drawn: &str| {
        sweep(&format!(
            "[[group]]\ntasks = ['lift']\nspaces = ['osc']\nseeds = [1]\nvary = {{ {varied} }}\n\
             draws = {{ count = 2, seed = 1, ranges = {{ '{drawn}' = {{ low = 0.01, high = 0.02, scale = 'log' }} }} }}\n"
        ))
    };
    let controller = "'env.controller' = [{ position_step = 0.04 }]";
    let step = "'env.controller.position_step' = [0.04]";
    for (varied, drawn) in
        [(step, "env.controller.position_step"), (controller, "env.controller.position_step"), (step, "env.controller")]
    {
        let error = of(varied, drawn).unwrap_err().to_string();
        assert!(error.contains(&format!("sweep.toml: draws.ranges.{drawn:?}: vary.")), "{error}");
    }
    let runs = of(step, "env.controller.rotation_step").unwrap();
    assert_eq!(labels(&runs), ["osc,position_step=0.04,draw-0", "osc,position_step=0.04,draw-1"]);
    assert!(runs.iter().all(|run| run.env.controller.position_step == 0.04));
}

/// Runs are ordered by variant first, so that an interrupted sweep has every group of its first variants.
#[test]
fn every_group_is_there_with_each_variant() {
    let runs = sweep(
        "[run]\nlearner = { gamma = 0.9 }\n\
         [variants]\nbase = {}\nwide = { learner.hidden = [8, 8] }\n\
         [[group]]\ntasks = [\"lift\"]\nspaces = [\"osc\"]\nseeds = [1]\nrun.learner = { gamma = 0.8, hidden = [4] }\n\
         [[group]]\nname = \"own\"\ntasks = [\"door\"]\nspaces = [\"osc\"]\nseeds = [1]\nvary = { \"learner.n_step\" = [1, 5] }",
    )
    .unwrap();
    let expected = [
        "osc,base",
        "osc,base,own,n_step=1",
        "osc,base,own,n_step=5",
        "osc,wide",
        "osc,wide,own,n_step=1",
        "osc,wide,own,n_step=5",
    ];
    assert_eq!(labels(&runs), expected);
    assert_eq!(
        (runs[0].learner.hidden.as_slice(), runs[3].learner.hidden.as_slice()),
        ([4].as_slice(), [8, 8].as_slice())
    );
    assert_eq!((runs[3].learner.gamma, runs[5].learner.gamma), (0.8, 0.9));
    let group = "[[group]]\ntasks = [\"lift\"]\nspaces = [\"osc\"]\nseeds = [1]\n";
    for (variants, word) in
        [("a = 1", "variants.a: a table"), ("'a/b' = {}", "a/b"), ("a = { seed = 2 }", "variants.a.seed")]
    {
        let error = sweep(&format!("[variants]\n{variants}\n{group}")).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
}

/// A label has as many of a key's last parts as are needed to tell it from the other keys.
#[test]
fn varied_keys_that_end_alike_are_told_apart() {
    let runs = sweep(
        "[[group]]\ntasks = [\"lift\"]\nspaces = [\"aforce\"]\nseeds = [1]\n[group.vary]\n\
         \"env.controller.interpolation.linear.ramp_ratio\" = [0.2]\n\
         \"env.space.stiffness.adaptive.delta\" = [0.1]\n\"env.space.stiffness.adaptive.mu\" = [0.5, 1.0]",
    );
    assert_eq!(
        labels(&runs.unwrap()),
        ["aforce,ramp_ratio=0.2,delta=0.1,mu=0.5", "aforce,ramp_ratio=0.2,delta=0.1,mu=1.0"]
    );
}

#[test]
fn spaces_are_names_files_and_tables() {
    let folder = tempfile::tempdir().unwrap();
    fs_err::write(folder.path().join("soft.toml"), "extends = 'low'\nstiffness.fixed = [90, 9]").unwrap();
    let path = folder.path().join("sweep.toml");
    let read = |spaces: &str| {
        let text = format!("[[group]]\ntasks = ['lift']\nspaces = {spaces}\nseeds = [1]\n");
        fs_err::write(&path, text + "vary = { 'env.space.damping_ratio' = [0.5, 1.0] }").unwrap();
        read(&path).map(|sweep| sweep.runs).map_err(|error| format!("{error:#}"))
    };
    let runs =
        read("['osc', 'soft.toml', { name = 'no-ff', extends = 'aforce', stiffness.adaptive.alpha = 0 }]").unwrap();
    let expected = ["osc", "soft", "no-ff"].map(|space| format!("{space},damping_ratio=0.5"));
    assert_eq!(labels(&runs)[..3], expected);
    assert_eq!(runs[1].env.space.stiffness, Stiffness::Fixed(Gains::pair(90.0, 9.0)));
    assert_eq!(runs[2].env.space.psi().unwrap().alpha, Gains::all(0.0));
    assert_eq!((runs[2].env.space.damping_ratio, runs[5].env.space.damping_ratio), (Gains::all(0.5), Gains::all(1.0)));
    for (spaces, word) in [
        ("['soft.toml', { name = 'soft', extends = 'osc' }]", "\"soft\" is used twice"),
        ("[{ extends = 'osc' }]", "needs a name"),
        ("[{ name = 'osc', extends = 'low' }]", "built-in"),
        ("['none.toml']", "none.toml"),
    ] {
        let error = read(spaces).unwrap_err();
        assert!(error.contains(word) && error.contains("sweep.toml"), "{error}");
    }
}

#[test]
fn a_sweep_extends_another() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs_err::create_dir_all(path.parent().unwrap()).unwrap();
        fs_err::write(&path, text).unwrap();
        path
    };
    let group = |space: &str| format!("[[group]]\ntasks = [\"lift\"]\nspaces = [{space:?}]\nseeds = [1]\n");
    write("base.toml", &("run = { steps = 1000, evaluate_every = 500 }\n".to_string() + &group("osc")));
    let plain = write("below/plain.toml", "extends = \"../base.toml\"\n[run]\nsteps = 2000\n");
    let own = "name = \"mine\"\nextends = \"plain.toml\"\n".to_string() + &group("aforce");
    let own = write("below/own.toml", &own);

    let Sweep { name, runs, .. } = read(&plain).unwrap();
    assert_eq!((name.as_str(), labels(&runs)), ("plain", vec!["osc".to_string()]));
    assert_eq!((runs[0].steps, runs[0].evaluate_every), (2000, 500));
    let Sweep { name, runs, .. } = read(&own).unwrap();
    assert_eq!((name.as_str(), labels(&runs), runs[0].steps), ("mine", vec!["aforce".to_string()], 2000));

    let search = "halving = [500]\nvariants = { a = {}, b = {} }\nextends = \"base.toml\"\n";
    let search = write("search.toml", search);
    assert_eq!((read(&search).unwrap().halving, read(&search).unwrap().runs.len()), (vec![500], 2));
    let whole = write("whole.toml", "halving = []\nvariants = {}\nextends = \"search.toml\"\n");
    assert_eq!((read(&whole).unwrap().halving, read(&whole).unwrap().runs.len()), (vec![], 1));

    let error = |path: &Path| format!("{:#}", read(path).unwrap_err());
    write("a.toml", "extends = \"b.toml\"");
    let circle = write("b.toml", "extends = \"a.toml\"");
    assert!(error(&circle).contains("b.toml: extends itself"), "{}", error(&circle));
    let lost = write("lost.toml", "extends = \"nowhere.toml\"");
    assert!(error(&lost).contains("lost.toml: extends") && error(&lost).contains("nowhere.toml"), "{}", error(&lost));
}

/// Settings of a file lie over those of the file that it extends: a set-up over its steps, a robot's key over its robot.
#[test]
fn a_set_up_and_a_robots_key_count_over_the_file_below() {
    let folder = tempfile::tempdir().unwrap();
    let group = "[[group]]\ntasks = ['lift']\nspaces = ['osc']\nseeds = [1]\n";
    let base = "[run]\nsetup = 'small-steps'\nenv.robot = 'fr3'\nenv.disturbance.friction = 0.5\n\
        env.controller = { position_step = 0.006, null_space_stiffness = 5.0 }\n";
    fs_err::write(folder.path().join("base.toml"), base.to_string() + group).unwrap();
    let path = folder.path().join("above.toml");
    let above = |run: &str| {
        fs_err::write(&path, format!("extends = 'base.toml'\nrun = {{ {run} }}\n")).unwrap();
        read(&path).map(|sweep| sweep.runs[0].env.clone()).map_err(|error| format!("{error:#}"))
    };
    for (run, stops, steps) in [
        ("steps = 9", false, (0.006, 0.15)),
        ("setup = 'solve'", true, (0.044, 0.11)),
        ("setup = 'solve', env.controller.rotation_step = 0.2", true, (0.044, 0.2)),
        ("setup = 'solve', env.stops = false", false, (0.044, 0.11)),
    ] {
        let env = above(run).unwrap();
        let controller = env.controller;
        assert_eq!((env.stops, (controller.position_step, controller.rotation_step)), (stops, steps), "{run}");
        assert_eq!((controller.null_space_stiffness, env.robot.name()), (5.0, "fr3"), "{run}");
    }
    let robot = above("env.robot.mount.height = 0.8").unwrap().robot.robot();
    assert_eq!((robot.name.as_str(), robot.mount.height), ("fr3", 0.8));
    let error = above("env.disturbance = {}").unwrap_err();
    assert!(error.contains("above.toml: run.env.disturbance = {} changes nothing"), "{error}");
}
