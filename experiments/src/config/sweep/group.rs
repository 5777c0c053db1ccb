//! A group of a sweep's file: tasks, action spaces and seeds, and the settings that it varies.

use aforce::name;
use aforce::record::overlay;
use anyhow::Result;
use output::program::bad;
use serde::Deserialize;
use settings::{Source, nested};
use tasks::TaskName;
use toml::{Table, Value};

use crate::config::RunConfig;
use crate::config::draws::Draws;

/// Every task with every action space, every choice of the varied settings and every seed.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Group {
    /// First part of the variant of its runs.
    pub(super) name: Option<String>,
    pub(super) tasks: Vec<TaskName>,
    /// Names, files (counted from this file's folder) or tables.
    pub(super) spaces: Vec<Value>,
    pub(super) seeds: Vec<u32>,
    /// Settings on top of the shared ones.
    #[serde(default)]
    pub(super) run: Table,
    /// Dotted keys, each with the values that it takes in turn; on top of `run`.
    #[serde(default)]
    pub(super) vary: Table,
    /// Settings drawn at random, on top of `run` and `vary`: the candidates of a search.
    pub(super) draws: Option<Draws>,
}

/// One value of everything that a group varies.
#[derive(Clone, Default)]
struct Choice {
    variant: String,
    settings: Table,
}

impl Choice {
    /// This choice with a further part of its name, and the settings that it stands for.
    fn with(&self, name: &str, more: &Table) -> Choice {
        let names = [self.variant.as_str(), name].into_iter().filter(|name| !name.is_empty());
        let mut settings = self.settings.clone();
        overlay(&mut settings, more.clone());
        Choice { variant: names.collect::<Vec<_>>().join(","), settings }
    }
}

impl Group {
    /// The runs of every choice, and of every candidate drawn for it, on top of the `shared` settings. `variant` is the
    /// first part of their variant's name, `source` names the file in messages.
    pub(super) fn runs(&self, variant: &str, shared: &[&Table], source: &str) -> Result<Vec<RunConfig>> {
        let wrong = |problem| bad(format!("{source}: {problem}"));
        self.draws_nothing_varied().map_err(wrong)?;
        let of = |choice: &Choice| self.runs_of(choice, shared, source);
        let mut runs = vec![];
        for choice in self.choices(variant).map_err(wrong)? {
            let Some(draws) = &self.draws else {
                runs.extend(of(&choice)?);
                continue;
            };
            let accepts = |settings: &Table| {
                of(&choice.with("draw", settings)).map(|_| ()).map_err(|problem| format!("{problem:#}"))
            };
            for (name, settings) in draws.candidates(accepts).map_err(wrong)? {
                runs.extend(of(&choice.with(&name, &settings))?);
            }
        }
        Ok(runs)
    }

    /// The runs with one choice, on top of the `shared` settings.
    fn runs_of(&self, choice: &Choice, shared: &[&Table], source: &str) -> Result<Vec<RunConfig>> {
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

    /// Every combination of the varied values, in which the last key changes fastest. Their names begin with `variant`.
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
            if self.vary.keys().any(|other| is_below(other, key)) {
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

    /// Refuses a range over a varied key, of which the runs would have another value than their names say.
    fn draws_nothing_varied(&self) -> Result<(), String> {
        for drawn in self.draws.iter().flat_map(Draws::keys) {
            let same = |varied: &&String| *varied == drawn || is_below(varied, drawn) || is_below(drawn, varied);
            if let Some(varied) = self.vary.keys().find(same) {
                return Err(format!("draws.ranges.{drawn:?}: vary.{varied:?} sets it: draw it or vary it"));
            }
        }
        Ok(())
    }

    /// The shortest ending of a varied key, in whole parts, that no other varied key has.
    fn shortest<'a>(&self, key: &'a str) -> &'a str {
        let ends_alike = |tail: &str| self.vary.keys().filter(|other| format!(".{other}").ends_with(tail)).count() > 1;
        let dots = key.rmatch_indices('.').map(|(at, _)| &key[at + 1..]);
        dots.chain([key]).find(|tail| !ends_alike(&format!(".{tail}"))).unwrap_or(key)
    }
}

/// Whether a dotted key lies below another one.
fn is_below(key: &str, other: &str) -> bool {
    key.strip_prefix(other).is_some_and(|rest| rest.starts_with('.'))
}

/// Refuses settings that say which run it is: seed, variant, task or space. `section` is where the settings stand.
pub(super) fn no_identity(section: &str, settings: &Table) -> Result<(), String> {
    let env = |key| settings.get("env").and_then(|env| env.get(key));
    let found = [
        ("seed", settings.get("seed")),
        ("variant", settings.get("variant")),
        ("env.task", env("task")),
        // Keys that change a space are allowed, naming another space is not.
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

/// Refuses a name that cannot be a part of a folder's name.
pub(super) fn is_name(name: &str) -> Result<(), String> {
    name::check_part(name).map_err(|reason| format!("name: {reason}"))
}

/// A value as a part of a folder's name.
fn spelt(value: &Value) -> String {
    let text = value.as_str().map_or_else(|| value.to_string(), String::from);
    text.chars().map(|c| if name::may_have(c) { c } else { '_' }).collect()
}
