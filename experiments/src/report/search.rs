//! Candidates of a search, ranked by what they have earned so far: successive halving (Karnin et al., 2013).

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::Result;
use output::statistics::mean;
use serde::Serialize;

use crate::config::{RunConfig, RunId};
use crate::report::record::Record;
use crate::run::folder::{RunFolder, State};

/// A candidate after a round: a row of `search.csv`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// Task.
    pub task: String,
    /// Action space.
    pub space: String,
    /// Variant of its runs.
    pub variant: String,
    /// Number of runs, one for each seed.
    pub seeds: usize,
    /// Actions of each run in this round.
    pub actions: u64,
    /// Mean return of the evaluations in the last quarter of these actions, mean and sampled actions alike, over the seeds; none if
    /// a run failed.
    pub score: Option<f64>,
    /// 1 is the best of its task and space in this round.
    pub rank: usize,
    /// The drawn settings: those in which it differs from the first candidate of its task and space, as `key = value, ..`.
    pub settings: String,
    /// Commit of the first seed's run; none if that run never began.
    pub commit: Option<String>,
}

/// The candidates of `runs` below `out` after so many `actions`, the best of each task and space first. `all` are the
/// runs that the search began with.
///
/// # Errors
/// If a table cannot be read.
pub fn rank(runs: &[&RunConfig], all: &[&RunConfig], out: &Path, actions: u64) -> Result<Vec<Candidate>> {
    let mut seeds: BTreeMap<(String, String, String), Vec<&RunConfig>> = BTreeMap::new();
    for run in runs {
        let RunId { task, space, variant, .. } = RunId::of(run);
        seeds.entry((task, space, variant)).or_default().push(run);
    }
    let mut candidates = vec![];
    for ((task, space, variant), runs) in seeds {
        let scores: Vec<Option<f64>> = runs.iter().map(|run| score(run, out, actions)).collect::<Result<_>>()?;
        let run = runs[0];
        let is_rival = |other: &&&RunConfig| (&RunId::of(other).task, &RunId::of(other).space) == (&task, &space);
        let first = all.iter().find(is_rival).expect("it is one of them");
        candidates.push(Candidate {
            seeds: scores.len(),
            actions,
            score: scores.iter().copied().collect::<Option<Vec<f64>>>().map(|scores| mean(&scores)),
            rank: 0,
            settings: settings(first, run),
            commit: RunFolder::below(out, run).manifest().ok().map(|manifest| manifest.commits()),
            task,
            space,
            variant,
        });
    }
    let of = |candidate: &Candidate| (candidate.task.clone(), candidate.space.clone());
    let worth = |candidate: &Candidate| candidate.score.unwrap_or(f64::NEG_INFINITY);
    candidates.sort_by(|a, b| of(a).cmp(&of(b)).then(worth(b).total_cmp(&worth(a))));
    for group in candidates.chunk_by_mut(|a, b| of(a) == of(b)) {
        group.iter_mut().zip(1..).for_each(|(candidate, rank)| candidate.rank = rank);
    }
    Ok(candidates)
}

/// Whether the candidate of this run is in the better half of its task and space, and none of its runs failed.
pub fn goes_on(run: &RunConfig, ranked: &[Candidate]) -> bool {
    let id = RunId::of(run);
    let rivals = ranked.iter().filter(|other| other.task == id.task && other.space == id.space);
    let half = rivals.clone().count().div_ceil(2);
    rivals.take(half).any(|candidate| candidate.variant == id.variant && candidate.score.is_some())
}

/// The settings in which `run` differs from `first`, apart from seed and variant.
fn settings(first: &RunConfig, run: &RunConfig) -> String {
    let run = RunConfig { seed: first.seed, variant: first.variant.clone(), ..run.clone() };
    let own = first.differences(&run).into_iter().filter_map(|(key, _, value)| Some(format!("{key} = {}", value?)));
    own.collect::<Vec<_>>().join(", ")
}

fn score(config: &RunConfig, out: &Path, actions: u64) -> Result<Option<f64>> {
    let (run, round) = (RunFolder::below(out, config), RunConfig { steps: actions, ..config.clone() });
    if run.state(&round) != State::Done && !run.has_come_past(&round) {
        return Ok(None);
    }
    let recorded = Record::of_folder(&run)?;
    let mut returns = vec![];
    for policy in ["mean", "sampled"] {
        let points = recorded.evaluations(policy)?.mean_by_step("return")?;
        let late = |step: f64| 4.0 * step > 3.0 * actions as f64 && step <= actions as f64;
        returns.extend(points.iter().filter(|point| late(point.0)).map(|point| point.1));
    }
    Ok((!returns.is_empty()).then(|| mean(&returns)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(space: &str, variant: &str, score: f64) -> Candidate {
        let [task, space, variant] = ["lift", space, variant].map(String::from);
        let (settings, commit) = (String::new(), None);
        Candidate { task, space, variant, seeds: 1, actions: 10, score: Some(score), rank: 0, settings, commit }
    }

    #[test]
    fn the_better_half_of_each_space_goes_on() {
        let ranked = [
            candidate("aforce", "b", 3.0),
            candidate("aforce", "a", 2.0),
            candidate("aforce", "c", 1.0),
            candidate("osc", "c", 0.5),
        ];
        let goes_on = |space: &str, variant: &str| {
            let mut run = RunConfig::resolve(None, &[]).unwrap();
            run.env.space = space.parse().unwrap();
            run.variant = variant.into();
            goes_on(&run, &ranked)
        };
        assert_eq!(["a", "b", "c"].map(|variant| goes_on("aforce", variant)), [true, true, false]);
        assert!(goes_on("osc", "c") && !goes_on("osc", "a"));
    }
}
