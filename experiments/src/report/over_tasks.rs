//! What rliable reports (Agarwal et al. 2021): performance profiles, and aggregates over the tasks of a space.
//!
//! A return is at most one per action in robosuite's tasks, so their returns have one scale. Other tasks are not pooled with them.

use output::statistics::{FEWEST_FOR_INTERVAL, interval, iqm, mean, median, stratified_iqm_interval, with_width};
use serde::Serialize;

use crate::report::groups::Group;

/// The returns that are aggregated.
const RETURNS: [&str; 3] = ["final_return", "sampled_return", "curve_return"];
/// The return whose profile is told; the number of thresholds of a profile, from 0 on, and the return between two of
/// them.
const PROFILED: &str = "final_return";
const HEIGHTS: usize = 10;
const APART: f64 = 50.0;

/// A row of `aggregates.csv`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "documented once, in docs/columns.md")]
pub struct AggregateRow {
    pub experiment: String,
    pub tasks: String,
    pub space: String,
    pub variant: String,
    pub preset: String,
    pub metric: &'static str,
    pub n_runs: usize,
    pub iqm: f64,
    pub ci_low: Option<f64>,
    pub ci_high: Option<f64>,
    pub mean: f64,
    pub median: f64,
}

/// A row of `profiles.csv`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "documented once, in docs/columns.md")]
pub struct ProfileRow {
    pub experiment: String,
    pub tasks: String,
    pub space: String,
    pub variant: String,
    pub preset: String,
    pub n_runs: usize,
    pub final_return_above: f64,
    pub share: f64,
    pub ci_low: Option<f64>,
    pub ci_high: Option<f64>,
}

/// Groups that differ in their task alone.
struct OverTasks<'a>(Vec<&'a Group<'a>>);

impl<'a> OverTasks<'a> {
    /// Joins the groups of robosuite's tasks that differ in their task alone, in the order of the first.
    fn all(groups: &'a [Group<'a>]) -> Vec<Self> {
        let mut all: Vec<OverTasks> = vec![];
        for group in groups.iter().filter(|group| group.section.is_robosuites()) {
            match all.iter_mut().find(|OverTasks(known)| {
                (known[0].section.experiment, known[0].name()) == (group.section.experiment, group.name())
            }) {
                Some(OverTasks(known)) => known.push(group),
                None => all.push(OverTasks(vec![group])),
            }
        }
        all
    }

    /// The spaces that have several tasks in an experiment, each with the tasks that all of these spaces have there, so
    /// that the spaces can be compared. None if there are fewer than two such tasks.
    fn comparable(groups: &'a [Group<'a>]) -> Vec<Self> {
        let several: Vec<Self> = Self::all(groups).into_iter().filter(|over| over.0.len() > 1).collect();
        let has = |over: &Self, group: &Group| over.0.iter().any(|own| own.section == group.section);
        let by_all = |group: &Group| {
            let of_experiment = |over: &&Self| over.0[0].section.experiment == group.section.experiment;
            several.iter().filter(of_experiment).all(|over| has(over, group))
        };
        let shared =
            several.iter().map(|over| OverTasks(over.0.iter().copied().filter(|group| by_all(group)).collect()));
        shared.filter(|over| over.0.len() > 1).collect()
    }

    fn tasks(&self) -> String {
        self.0.iter().map(|group| group.section.task).collect::<Vec<_>>().join(" ")
    }

    /// The metric of its runs, a list per task; `None` if a run lacks it.
    fn values(&self, metric: &str) -> Option<Vec<Vec<f64>>> {
        let values: Vec<_> = self.0.iter().map(|group| group.values(metric)).collect();
        values.iter().flatten().all(|value| !value.is_nan()).then_some(values)
    }
}

/// A row per metric and space that has several of robosuite's tasks in its experiment, over those tasks that all such
/// spaces have there: the interquartile mean of all runs, its interval with the runs of each task resampled separately,
/// and mean and median of the tasks' means.
pub fn aggregates(groups: &[Group]) -> Vec<AggregateRow> {
    let row = |over: &OverTasks, metric: &'static str| {
        let values = over.values(metric)?;
        let borrowed: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
        let ci = enough(&values).then(|| stratified_iqm_interval(&borrowed)).and_then(with_width);
        let of_tasks: Vec<f64> = values.iter().map(|values| mean(values)).collect();
        Some(AggregateRow {
            experiment: over.0[0].section.experiment.into(),
            tasks: over.tasks(),
            space: over.0[0].space.into(),
            variant: over.0[0].variant.into(),
            preset: over.0[0].preset.into(),
            metric,
            n_runs: values.iter().map(Vec::len).sum(),
            iqm: iqm(&values.concat()),
            ci_low: ci.map(|ci| ci[0]),
            ci_high: ci.map(|ci| ci[1]),
            mean: mean(&of_tasks),
            median: median(&of_tasks),
        })
    };
    OverTasks::comparable(groups).iter().flat_map(|over| RETURNS.map(|metric| row(over, metric))).flatten().collect()
}

/// The share of runs whose final return lies above 0, 50, ... 450: of every group, and over tasks as in [`aggregates`].
pub fn profiles(groups: &[Group]) -> Vec<ProfileRow> {
    let each = groups.iter().map(|group| OverTasks(vec![group]));
    each.chain(OverTasks::comparable(groups)).flat_map(|over| profile(&over)).collect()
}

fn profile(over: &OverTasks) -> Vec<ProfileRow> {
    let Some(values) = over.values(PROFILED) else { return vec![] };
    let borrowed: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
    let row = |height: usize| {
        let above = APART * height as f64;
        // Every task counts alike, however many runs it has.
        let share = |of_tasks: &[Vec<f64>]| {
            let of_task =
                |values: &Vec<f64>| values.iter().filter(|value| **value > above).count() as f64 / values.len() as f64;
            mean(&of_tasks.iter().map(of_task).collect::<Vec<_>>())
        };
        let ci = enough(&values).then(|| interval(&borrowed, share)).and_then(with_width);
        ProfileRow {
            experiment: over.0[0].section.experiment.into(),
            tasks: over.tasks(),
            space: over.0[0].space.into(),
            variant: over.0[0].variant.into(),
            preset: over.0[0].preset.into(),
            n_runs: values.iter().map(Vec::len).sum(),
            final_return_above: above,
            share: share(&values),
            ci_low: ci.map(|ci| ci[0]),
            ci_high: ci.map(|ci| ci[1]),
        }
    };
    (0..HEIGHTS).map(row).collect()
}

fn enough(of_tasks: &[Vec<f64>]) -> bool {
    of_tasks.iter().all(|values| values.len() >= FEWEST_FOR_INTERVAL)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use tasks::columns::Cell;

    use super::*;
    use crate::report::groups::groups;
    use crate::report::groups::tests::{runs, set};
    use crate::report::summary::RunSummary;

    /// The reference values are rliable's, by `scripts/statistics_reference.py`.
    #[test]
    fn agrees_with_rliable() {
        let mut reader = csv::Reader::from_reader(&include_bytes!("../../reference/over_tasks.csv")[..]);
        let mut cases = 0;
        for record in reader.records() {
            let record = record.unwrap();
            let number = |at: usize| record[at].parse::<f64>().unwrap();
            let mut all: Vec<RunSummary> = vec![];
            for (task, returns) in ["lift", "door", "wipe"].iter().zip(record[0].split(';')) {
                for (at, value) in returns.split(' ').enumerate() {
                    let mut run = runs("osc", 1).remove(0);
                    (run.task, run.seed) = ((*task).into(), at as u64);
                    set(&mut run, "final_return", Cell::Real(value.parse().unwrap()));
                    all.push(run);
                }
            }
            let groups = groups(&all);
            let rows = aggregates(&groups);
            let row = rows.iter().find(|row| row.metric == "final_return").unwrap();
            for (found, expected) in [(row.iqm, number(1)), (row.mean, number(4)), (row.median, number(5))] {
                assert!((found - expected).abs() < 1e-9, "{found}, not {expected}");
            }
            // Both sides resample at random.
            for (found, expected) in [(row.ci_low, number(2)), (row.ci_high, number(3))] {
                assert!((found.unwrap() - expected).abs() < 4.0, "{found:?}, not {expected}");
            }
            let profile: Vec<ProfileRow> =
                profiles(&groups).into_iter().filter(|row| row.tasks == "lift door wipe").collect();
            let shares: Vec<f64> = record[6].split(' ').map(|cell| cell.parse().unwrap()).collect();
            assert_eq!((profile.len(), shares.len()), (HEIGHTS, HEIGHTS));
            for (row, share) in profile.iter().zip(shares) {
                assert!((row.share - share).abs() < 1e-12);
                // There is no interval if, within every task, all runs are above the threshold or none is.
                let is_whole = || (3.0 * share - (3.0 * share).round()).abs() < 1e-9;
                assert!(row.ci_low.zip(row.ci_high).map_or_else(is_whole, |(low, high)| low <= share && share <= high));
            }
            cases += 1;
        }
        assert!(cases >= 3);
    }

    #[test]
    fn spaces_are_aggregated_over_the_tasks_that_they_share() {
        let of = |space: &str, task: &str| {
            runs(space, 5).into_iter().map(|run| RunSummary { task: task.into(), ..run }).collect::<Vec<_>>()
        };
        let [more, fewer] = [&["lift", "door", "wipe"][..], &["lift", "door"]];
        let mut all: Vec<RunSummary> = more.iter().flat_map(|task| of("variable", task)).collect();
        all.extend(fewer.iter().flat_map(|task| of("aforce", task)));
        all.extend(of("floor", "wipe"));
        let groups = groups(&all);
        let over: BTreeSet<_> = aggregates(&groups).into_iter().map(|row| (row.space, row.tasks, row.n_runs)).collect();
        let row = |space: &str| (space.to_string(), "lift door".to_string(), 10);
        assert_eq!(over, [row("aforce"), row("variable")].into());
    }

    #[test]
    fn one_task_has_a_profile_and_no_aggregate_and_few_runs_no_interval() {
        let all = [runs("osc", 4), runs("aforce", 5)].concat();
        let groups = groups(&all);
        assert_eq!(aggregates(&groups), []);
        let rows = profiles(&groups);
        assert_eq!(rows.len(), 2 * HEIGHTS);
        let of = |space: &str| {
            rows.iter().filter(|row| row.space == space).map(|row| (row.share, row.ci_low)).collect::<Vec<_>>()
        };
        assert_eq!(of("osc")[..3], [(1.0, None), (1.0, None), (0.0, None)], "returns of 60 to 63 against 0, 50, 100");
        assert_eq!(of("aforce")[1], (1.0, None), "resamples of runs that agree say nothing");
        // Insert's returns have another scale than Lift's.
        let inserted = runs("osc", 4).into_iter().map(|run| RunSummary { task: "insert".into(), ..run });
        let all: Vec<RunSummary> = runs("osc", 4).into_iter().chain(inserted).collect();
        assert_eq!(aggregates(&super::super::groups::groups(&all)), []);
    }
}
