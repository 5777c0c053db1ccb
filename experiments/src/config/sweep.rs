//! A sweep: a TOML file that stands for a list of independent runs.

use std::collections::HashSet;
use std::path::Path;

use aforce::ActionSpace;
use anyhow::Result;
use output::program::bad;
use serde::Deserialize;
use tasks::TaskName;
use toml::{Table, Value};

use crate::config::{RunConfig, RunId, parse};

/// The file: groups of runs, and settings that all of them share.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    /// Any part of a run's configuration.
    #[serde(default)]
    run: Table,
    group: Vec<Group>,
}

/// Every task with every action space and every seed.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Group {
    tasks: Vec<TaskName>,
    spaces: Vec<ActionSpace>,
    seeds: Vec<u32>,
    /// On top of the shared settings.
    #[serde(default)]
    run: Table,
}

/// The runs of a sweep in the order of its file. Neighbours differ in their action space, so that a
/// sweep broken off half-way has all spaces.
///
/// # Errors
/// If the file is not a sweep, a setting is not allowed, or two runs would share a folder.
pub fn read(path: &Path) -> Result<Vec<RunConfig>> {
    let text = fs_err::read_to_string(path)?;
    let name = path.display().to_string();
    let file: File = parse(&text).map_err(|problem| bad(format!("{name}: {problem}")))?;
    for table in [&file.run].into_iter().chain(file.group.iter().map(|group| &group.run)) {
        let env = |key| table.get("env").and_then(|env| env.get(key));
        for (key, value) in [("seed", table.get("seed")), ("env.task", env("task")), ("env.space", env("space"))] {
            if value.is_some() {
                return Err(bad(format!("{name}: run.{key}: a group's tasks, spaces and seeds say that")));
            }
        }
    }
    let mut runs = vec![];
    for group in &file.group {
        for &task in &group.tasks {
            for &seed in &group.seeds {
                for space in &group.spaces {
                    let own = Table::from_iter([
                        ("seed".into(), Value::Integer(seed.into())),
                        (
                            "env".into(),
                            Value::Table(Table::from_iter([
                                ("task".into(), Value::String(task.as_str().into())),
                                ("space".into(), Value::String(space.to_string())),
                            ])),
                        ),
                    ]);
                    let layers = [&file.run, &group.run, &own].map(|table| (name.clone(), table.clone()));
                    runs.push(RunConfig::from_layers(layers.into())?);
                }
            }
        }
    }
    let mut seen = HashSet::new();
    for id in runs.iter().map(RunId::of) {
        if !seen.insert(id.clone()) {
            let RunId { task, space, seed } = id;
            return Err(bad(format!("{name}: {task} {space} seed {seed} stands there twice")));
        }
    }
    if runs.is_empty() {
        return Err(bad(format!("{name}: no run: a group needs tasks, spaces and seeds")));
    }
    Ok(runs)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sweep(text: &str) -> Result<Vec<RunConfig>> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sweep.toml");
        fs_err::write(&path, text).unwrap();
        read(&path)
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
            (group.to_string() + "steps = 3", "known are tasks"),
            (group.to_string() + "run = { seed = 2 }", "run.seed"),
            (group.to_string() + "run = { env = { space = \"osc\" } }", "run.env.space"),
        ] {
            let error = sweep(&text).unwrap_err().to_string();
            assert!(error.contains(word) && error.contains("sweep.toml"), "{error}");
        }
    }
}
