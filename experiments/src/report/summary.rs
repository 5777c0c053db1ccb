//! One row per run: its results, and the time that it took.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use anyhow::{Error, Result};
use output::program::bad;
use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};
use tasks::ForcePenalty;
use tasks::columns::Cell;
use toml::Table;

use crate::config;
use crate::report::archive;
use crate::report::outside;
use crate::report::record::Record;
use crate::report::run_tables::RunTables;
use crate::run::clock::Spent;
use crate::run::folder::RunFolder;
use crate::run::rows::SCHEMA;

/// A row of `runs.csv`: which run, its numbers, and the time that it took.
#[derive(Debug, Clone, Default, PartialEq)]
#[allow(missing_docs, reason = "documented once, in docs/columns.md")]
pub struct RunSummary {
    pub experiment: String,
    pub task: String,
    pub space: String,
    pub variant: String,
    pub seed: u64,
    pub preset: String,
    pub position_step_m: Option<f64>,
    pub rotation_step_rad: Option<f64>,
    /// Which forces its penalty counts, where its configuration is known; not a column.
    pub force_penalty: Option<ForcePenalty>,
    /// The options of its task; not a column.
    pub options: Table,
    /// The actions that it was to train for, or of its last evaluation where its configuration is not known; not a column.
    pub steps: Option<u64>,
    pub env_steps: u64,
    pub done: bool,
    /// By name, in the order of the table.
    pub numbers: Vec<(&'static str, Cell)>,
    pub wall_s: f64,
    pub cpu_s: Option<f64>,
    pub commit: String,
}

impl Serialize for RunSummary {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut row = serializer.serialize_struct("RunSummary", 14 + self.numbers.len())?;
        row.serialize_field("schema", &SCHEMA)?;
        row.serialize_field("experiment", &self.experiment)?;
        row.serialize_field("task", &self.task)?;
        row.serialize_field("space", &self.space)?;
        row.serialize_field("variant", &self.variant)?;
        row.serialize_field("seed", &self.seed)?;
        row.serialize_field("preset", &self.preset)?;
        row.serialize_field("position_step_m", &self.position_step_m)?;
        row.serialize_field("rotation_step_rad", &self.rotation_step_rad)?;
        row.serialize_field("env_steps", &self.env_steps)?;
        row.serialize_field("done", &self.done)?;
        self.numbers.iter().try_for_each(|(name, cell)| row.serialize_field(name, cell))?;
        row.serialize_field("wall_s", &self.wall_s)?;
        row.serialize_field("cpu_s", &self.cpu_s)?;
        row.serialize_field("commit", &self.commit)?;
        row.end()
    }
}

/// All runs below `root`, in folders and in archives, sorted by path and seed, each once however many links lead to it.
/// Curves of other learners ([`outside`]) are among them. The candidates of a search are not: its search.csv ranks
/// them. A run that cannot be read comes as its folder and the reason.
///
/// # Errors
/// If a folder or an archive cannot be read.
pub fn find_runs(root: &Path) -> Result<Vec<Result<Record, (RunFolder, Error)>>> {
    if !root.exists() {
        return Err(bad(format!("{}: there is no such folder", root.display())));
    }
    find_new_runs(root, &mut HashSet::new())
}

/// The runs below `root`, except in folders that were searched already.
fn find_new_runs(root: &Path, seen: &mut HashSet<PathBuf>) -> Result<Vec<Result<Record, (RunFolder, Error)>>> {
    if !seen.insert(fs_err::canonicalize(root)?) {
        return Ok(vec![]);
    }
    let mut paths: Vec<PathBuf> = fs_err::read_dir(root)?.map(|entry| Ok(entry?.path())).collect::<Result<_>>()?;
    paths.sort_by_cached_key(|path| (seed(path), path.clone()));
    let folder = RunFolder::at(root);
    if folder.episodes().is_file() || folder.done().is_file() {
        return Ok(vec![Record::of_folder(&folder).map_err(|reason| (folder, reason))]);
    }
    if outside::is_outside(root) {
        return Ok(vec![Record::of_outside(root).map_err(|reason| (folder, reason))]);
    }
    if root.join("search.csv").is_file() {
        return Ok(vec![]);
    }
    let mut runs = if archive::is_archive(root) { archive::read(root)?.into_iter().map(Ok).collect() } else { vec![] };
    for path in paths.into_iter().filter(|path| path.is_dir()) {
        runs.extend(find_new_runs(&path, seen)?);
    }
    Ok(runs)
}

/// The N of a folder seed_N. Folders are sorted by it, so that seed 10 comes after seed 2.
fn seed(path: &Path) -> Option<u64> {
    path.file_name()?.to_str()?.strip_prefix("seed_")?.parse().ok()
}

/// A group's name within its section: the action space, the variant, and the preset unless it is `desktop`, `swift` or `plain`.
pub fn label(space: &str, variant: &str, preset: &str) -> String {
    let label = config::label(space, variant);
    let usual = preset.is_empty()
        || [sac::Preset::DESKTOP, sac::Preset::SWIFT, sac::Preset::PLAIN].iter().any(|usual| usual.name == preset);
    if usual { label } else { format!("{label}, {preset} preset") }
}

impl RunSummary {
    /// The name of its group in tables and legends.
    pub fn label(&self) -> String {
        label(&self.space, &self.variant, &self.preset)
    }

    /// The number `name`; NaN if the run's tables do not have it.
    pub fn number(&self, name: &str) -> f64 {
        let cell = self.numbers.iter().find(|(known, _)| *known == name).map(|(_, cell)| *cell);
        cell.and_then(Cell::number).unwrap_or(f64::NAN)
    }

    /// The summary of a run found below `root`.
    ///
    /// # Errors
    /// If a table is missing or damaged, or the run was never evaluated.
    pub fn of(run: &Record, root: &Path) -> Result<Self> {
        let tables = RunTables::of(run)?;
        let Record { config, manifest, done, .. } = run;
        // The manifest has the time once the run has ended. Until then it is taken from the last row of progress.csv.
        let so_far = |clock: &str| Ok::<_, Error>(tables.progress.points(clock)?.last().map_or(0.0, |point| point.1));
        let spent = if *done { manifest.spent } else { Spent { wall_s: so_far("wall_s")?, cpu_s: so_far("cpu_s")? } };
        let step = |axis| Some(config.env.space.step(&config.env.controller, axis)).filter(|_| !run.outside);
        let spent = if run.outside { Spent { wall_s: so_far("wall_s")?, cpu_s: 0.0 } } else { spent };
        Ok(RunSummary {
            experiment: run.experiment(root),
            task: config.env.task.as_str().into(),
            space: config.env.space.name.clone(),
            variant: config.variant.clone(),
            seed: config.seed,
            preset: if run.outside { String::new() } else { config.preset.name.into() },
            position_step_m: step(0),
            rotation_step_rad: step(3),
            force_penalty: (!run.outside).then_some(config.env.force_penalty),
            options: config.env.options.clone(),
            steps: if run.outside { tables.last_evaluation() } else { Some(config.steps) },
            env_steps: tables.last_step()?,
            done: *done,
            numbers: tables.numbers()?,
            wall_s: spent.wall_s,
            cpu_s: (spent.cpu_s > 0.0).then_some(spent.cpu_s),
            commit: manifest.commits(),
        })
    }
}

#[cfg(test)]
pub(crate) mod tests;
