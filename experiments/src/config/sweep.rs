//! A sweep: a TOML file that stands for a list of independent runs.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use aforce::overlay;
use anyhow::{Context, Result};
use output::program::bad;
use serde::Deserialize;
use settings::{Source, nested, parse, spaces};
use tasks::TaskName;
use toml::{Table, Value};

use crate::config::cli::record;
use crate::config::draws::Draws;
use crate::config::run_id::{NAME_CHARACTERS, is_name_character};
use crate::config::{RunConfig, RunId};

/// Runs that belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// What its folder is called unless somebody names another.
    pub name: String,
    /// In the order of the file. Neighbours differ in their action space, so that a sweep broken off half-way has all spaces.
    pub runs: Vec<RunConfig>,
    /// Actions after which the better half of each task and action space goes on, the others stop; mostly empty.
    pub halving: Vec<u64>,
}

/// The file: groups of runs, and settings that all of them share.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    name: Option<String>,
    /// A sweep, its path counted from this file, whose settings these are on top of, and whose groups these are if there are
    /// none here.
    extends: Option<PathBuf>,
    /// Any part of a run's configuration.
    #[serde(default)]
    run: Table,
    /// By name, settings on top of those of a group: every group is there with each of them.
    #[serde(default)]
    variants: Table,
    #[serde(default)]
    halving: Vec<u64>,
    #[serde(default)]
    group: Vec<Group>,
}

/// Every task with every action space, every choice of the varied settings and every seed.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Group {
    /// First part of the variant of its runs.
    name: Option<String>,
    tasks: Vec<TaskName>,
    /// Names, files (counted from this file's folder) or tables.
    spaces: Vec<Value>,
    seeds: Vec<u32>,
    /// On top of the shared settings.
    #[serde(default)]
    run: Table,
    /// Dotted keys, each with the values that it takes in turn; on top of `run`.
    #[serde(default)]
    vary: Table,
    /// On top of that, settings drawn at random: the candidates of a search.
    draws: Option<Draws>,
}

/// Reads a sweep.
///
/// # Errors
/// If the file is not a sweep, a setting is not allowed, or two runs would share a folder.
pub fn read(path: &Path) -> Result<Sweep> {
    let source = path.display().to_string();
    let wrong = |problem: String| bad(format!("{source}: {problem}"));
    let file = File::read(path, &mut vec![])?;
    file.name.as_deref().map_or(Ok(()), is_name).map_err(&wrong)?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = file.name.clone().unwrap_or_else(|| stem.into());
    no_identity("run", &file.run).map_err(&wrong)?;
    let mut runs = vec![];
    let mut records = HashMap::new();
    let variants = file.variants().map_err(&wrong)?;
    for (variant, group) in variants.iter().flat_map(|variant| file.group.iter().map(move |group| (variant, group))) {
        no_identity("group.run", &group.run).map_err(&wrong)?;
        for space in &group.spaces {
            if records.insert(space["name"].clone().to_string(), space).is_some_and(|other| other != space) {
                return Err(wrong(format!("spaces: the name {} is used twice, for different spaces", space["name"])));
            }
        }
        for choice in group.choices(&variant.name).map_err(&wrong)? {
            let of = |choice: &Choice| group.runs(choice, &[&file.run, &group.run, &variant.settings], &source);
            let accepts = |settings: &Table| {
                of(&choice.with("draw", settings)).map(|_| ()).map_err(|problem| format!("{problem:#}"))
            };
            let candidates = group.draws.as_ref().map(|draws| draws.candidates(accepts)).transpose().map_err(&wrong)?;
            match candidates {
                None => runs.extend(of(&choice)?),
                Some(candidates) => {
                    for (name, settings) in &candidates {
                        runs.extend(of(&choice.with(name, settings))?);
                    }
                }
            }
        }
    }
    let mut seen = HashSet::new();
    for id in runs.iter().map(RunId::of) {
        if !seen.insert(id.clone()) {
            return Err(wrong(format!("{id} stands there twice")));
        }
    }
    if runs.is_empty() {
        return Err(wrong("no run: a group needs tasks, spaces and seeds".into()));
    }
    can_halve(&file.halving, &runs).map_err(wrong)?;
    Ok(Sweep { name, runs, halving: file.halving })
}

impl File {
    /// With what it extends; `readers` are the files that asked for it.
    fn read(path: &Path, readers: &mut Vec<PathBuf>) -> Result<Self> {
        let here = fs_err::canonicalize(path)?;
        if readers.contains(&here) {
            return Err(bad(format!("{}: extends itself", path.display())));
        }
        readers.push(here);
        let wrong = |problem: String| bad(format!("{}: {problem}", path.display()));
        let mut file: File = parse(&fs_err::read_to_string(path)?).map_err(wrong)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        for space in file.group.iter_mut().flat_map(|group| &mut group.spaces) {
            let named = spaces::of_value(space.clone(), folder);
            *space = record(&named.map_err(|problem| wrong(format!("spaces: {problem:#}")))?);
        }
        let Some(base) = &file.extends else { return Ok(file) };
        let base = File::read(&folder.join(base), readers).with_context(|| format!("{}: extends", path.display()))?;
        let mut run = base.run;
        overlay(&mut run, file.run);
        let group = if file.group.is_empty() { base.group } else { file.group };
        let variants = if file.variants.is_empty() { base.variants } else { file.variants };
        let halving = if file.halving.is_empty() { base.halving } else { file.halving };
        Ok(File { run, group, variants, halving, ..file })
    }

    /// Those of the file in its order; one without a name if there are none.
    fn variants(&self) -> Result<Vec<Variant>, String> {
        if self.variants.is_empty() {
            return Ok(vec![Variant::default()]);
        }
        let variant = |(name, settings): (&String, &Value)| {
            is_name(name)?;
            let settings =
                settings.as_table().ok_or_else(|| format!("variants.{name}: a table of settings is needed"))?;
            no_identity(&format!("variants.{name}"), settings)?;
            Ok(Variant { name: name.clone(), settings: settings.clone() })
        };
        self.variants.iter().map(variant).collect()
    }
}

/// A name and the settings that it stands for.
#[derive(Clone, Default)]
struct Variant {
    name: String,
    settings: Table,
}

/// One value of everything that a group varies.
#[derive(Clone, Default)]
struct Choice {
    variant: String,
    settings: Table,
}

impl Choice {
    /// With a further name and what it stands for.
    fn with(&self, name: &str, more: &Table) -> Choice {
        let names = [self.variant.as_str(), name].into_iter().filter(|name| !name.is_empty());
        let mut settings = self.settings.clone();
        overlay(&mut settings, more.clone());
        Choice { variant: names.collect::<Vec<_>>().join(","), settings }
    }
}

impl Group {
    /// Its runs with one choice, on top of the `shared` settings.
    fn runs(&self, choice: &Choice, shared: &[&Table], source: &str) -> Result<Vec<RunConfig>> {
        let mut runs = vec![];
        for &task in &self.tasks {
            for &seed in &self.seeds {
                for space in &self.spaces {
                    let mut own = Table::new();
                    for (key, value) in [
                        ("env.space", space.clone()),
                        ("env.task", Value::String(task.as_str().into())),
                        ("seed", Value::Integer(seed.into())),
                        ("variant", Value::String(choice.variant.clone())),
                    ] {
                        overlay(&mut own, nested(key, value));
                    }
                    // The space comes first: settings may change it.
                    let layers = [&own].into_iter().chain(shared.iter().copied()).chain([&choice.settings]);
                    runs.push(RunConfig::from_layers(
                        layers.map(|layer| (Source::named(source), layer.clone())).collect(),
                    )?);
                }
            }
        }
        Ok(runs)
    }

    /// Every combination of varied values, the last key changing first, as a part of `variant`.
    fn choices(&self, variant: &str) -> Result<Vec<Choice>, String> {
        self.name.as_deref().map_or(Ok(()), is_name)?;
        let names = [Some(variant), self.name.as_deref()].into_iter().flatten().filter(|name| !name.is_empty());
        let variant = names.collect::<Vec<_>>().join(",");
        let mut choices = vec![Choice { variant, settings: Table::new() }];
        for (key, values) in &self.vary {
            let of_key = || format!("vary.{key:?}");
            let values = values.as_array().ok_or_else(|| format!("{}: a list of values is needed", of_key()))?;
            if values.is_empty() {
                return Err(format!("{}: the list is empty", of_key()));
            }
            if self.vary.keys().any(|other| other.starts_with(&format!("{key}."))) {
                return Err(format!("{}: a part of it varies too", of_key()));
            }
            let label = self.shortest(key);
            let with = |choice: &Choice, value: &Value| {
                choice.with(&format!("{label}={}", spelt(value)), &nested(key, value.clone()))
            };
            let pairs = choices.iter().flat_map(|choice| values.iter().map(move |value| (choice, value)));
            choices = pairs.map(|(choice, value)| with(choice, value)).collect();
        }
        choices.iter().try_for_each(|choice| no_identity("vary", &choice.settings))?;
        Ok(choices)
    }

    /// The last parts of a varied key, as many as tell it from the others.
    fn shortest<'a>(&self, key: &'a str) -> &'a str {
        let ends_alike = |tail: &str| self.vary.keys().filter(|other| format!(".{other}").ends_with(tail)).count() > 1;
        let dots = key.rmatch_indices('.').map(|(at, _)| &key[at + 1..]);
        dots.chain([key]).find(|tail| !ends_alike(&format!(".{tail}"))).unwrap_or(key)
    }
}

/// Whether candidates can be ranked after these numbers of actions: by their evaluations in the last quarter.
fn can_halve(halving: &[u64], runs: &[RunConfig]) -> Result<(), String> {
    if halving.is_empty() {
        return Ok(());
    }
    let steps = runs[0].steps;
    if runs.iter().any(|run| run.steps != steps) {
        return Err("halving: every run needs the same steps".into());
    }
    if !halving.is_sorted_by(|a, b| a < b) || halving.iter().any(|&round| round >= steps) {
        return Err(format!("halving = {halving:?}: rising numbers of actions below steps, {steps}"));
    }
    for (round, every) in halving.iter().flat_map(|round| runs.iter().map(move |run| (round, run.evaluate_every))) {
        if 4 * (round / every * every) <= 3 * round {
            return Err(format!("halving: one evaluation in {every} actions, and none in the last quarter of {round}"));
        }
    }
    Ok(())
}

/// Who a run is is no setting; `section` is where the settings stand.
fn no_identity(section: &str, settings: &Table) -> Result<(), String> {
    let env = |key| settings.get("env").and_then(|env| env.get(key));
    let found = [
        ("seed", settings.get("seed")),
        ("variant", settings.get("variant")),
        ("env.task", env("task")),
        // Changes of a space are settings; a space is not.
        (
            "env.space",
            env("space").filter(|space| space.get("name").or(space.get("extends")).is_some() || !space.is_table()),
        ),
    ];
    match found.iter().find(|(_, value)| value.is_some()) {
        Some((key, _)) => Err(format!("{section}.{key}: a group's name, tasks, spaces and seeds say that")),
        None => Ok(()),
    }
}

/// What is to be a part of a folder's name.
fn is_name(name: &str) -> Result<(), String> {
    let fits = !name.is_empty() && name.chars().all(is_name_character);
    if fits { Ok(()) } else { Err(format!("name = {name:?}: {NAME_CHARACTERS}")) }
}

/// A value as a part of a folder's name.
fn spelt(value: &Value) -> String {
    let text = value.as_str().map_or_else(|| value.to_string(), String::from);
    text.chars().map(|c| if is_name_character(c) { c } else { '_' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use aforce::{Gains, Stiffness};

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

    /// Every candidate is there with every task, space and seed; the first is the group itself.
    #[test]
    fn a_group_draws_candidates_that_can_run() {
        let of = |halving: &str, range: &str| {
            let group = "[[group]]\ntasks = ['lift', 'door']\nspaces = ['aforce']\nseeds = [1]\n";
            format!("{halving}\nrun.steps = 900\n{group}draws = {{ count = 9, seed = 2, ranges = {{ {range} }} }}\n")
        };
        // Below its lower bound of 300 N/m a ceiling is refused.
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
            (of("halving = [300, 200]", range), "rising numbers of actions below steps, 900"),
            (of("halving = [900]", range), "below steps, 900"),
            (
                of("halving = [450]\nrun.evaluate_every = 300", range),
                "one evaluation in 300 actions, and none in the last quarter of 450",
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

    /// A sweep that is broken off has every group of its first variants.
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

    /// As many parts of a key as tell it from the others.
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
        assert_eq!(
            (runs[2].env.space.damping_ratio, runs[5].env.space.damping_ratio),
            (Gains::all(0.5), Gains::all(1.0))
        );
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

        let error = |path: &Path| format!("{:#}", read(path).unwrap_err());
        write("a.toml", "extends = \"b.toml\"");
        let circle = write("b.toml", "extends = \"a.toml\"");
        assert!(error(&circle).contains("b.toml: extends itself"), "{}", error(&circle));
        let lost = write("lost.toml", "extends = \"nowhere.toml\"");
        assert!(
            error(&lost).contains("lost.toml: extends") && error(&lost).contains("nowhere.toml"),
            "{}",
            error(&lost)
        );
    }
}
