//! A sweep: a TOML file that stands for a list of independent runs.

mod file;
mod group;
#[cfg(test)]
mod tests;

use std::collections::{HashMap, HashSet};
use std::path::Path;

use anyhow::Result;
use output::program::bad;

use crate::config::sweep::file::File;
use crate::config::sweep::group::{is_name, no_identity};
use crate::config::{RunConfig, RunId};

/// Runs that belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// Default name of the sweep's folder.
    pub name: String,
    /// In the order of the file. Consecutive runs differ in their action space, so that an interrupted sweep has runs of every space.
    pub runs: Vec<RunConfig>,
    /// Numbers of actions after which only the better half of the candidates of each task and action space goes on; empty
    /// unless the sweep is a search.
    pub halving: Vec<u64>,
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
        runs.extend(group.runs(&variant.name, &[&file.run, &group.run, &variant.settings], &source)?);
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
    let halving = file.halving.unwrap_or_default();
    can_halve(&halving, &runs).map_err(wrong)?;
    Ok(Sweep { name, runs, halving })
}

/// Checks that candidates can be ranked after these numbers of actions: every run needs an evaluation in the last quarter of them.
fn can_halve(halving: &[u64], runs: &[RunConfig]) -> Result<(), String> {
    if halving.is_empty() {
        return Ok(());
    }
    let steps = runs[0].steps;
    if runs.iter().any(|run| run.steps != steps) {
        return Err("halving: every run needs the same steps".into());
    }
    if !halving.is_sorted_by(|a, b| a < b) || halving.iter().any(|&round| round == 0 || round >= steps) {
        return Err(format!("halving = {halving:?}: rising numbers of actions above 0 and below steps, {steps}"));
    }
    let rounds = halving.iter().chain([&steps]);
    for (round, every) in rounds.flat_map(|round| runs.iter().map(move |run| (round, run.evaluate_every))) {
        if round / every * every <= round - round.div_ceil(4) {
            return Err(format!("halving: one evaluation in {every} actions, and none in the last quarter of {round}"));
        }
    }
    Ok(())
}
