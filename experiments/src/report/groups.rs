//! Sorts runs into groups (an experiment's task with an action space), and computes statistics over the seeds of a group.

use serde::Serialize;
use tasks::TaskName;

use crate::report::run_tables::summarised;
use crate::report::summary::RunSummary;
use output::statistics::{FEWEST_FOR_INTERVAL, deviation, iqm, iqm_interval, mean, median, range};

/// Runs that are compared with each other: the runs of one task in one experiment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section<'a> {
    /// Folder of the experiment, relative to the reported folder; empty if it is that folder.
    pub experiment: &'a str,
    /// Task name.
    pub task: &'a str,
}

impl<'a> Section<'a> {
    /// The section to which a run belongs.
    pub fn of(run: &'a RunSummary) -> Self {
        Section { experiment: &run.experiment, task: &run.task }
    }

    /// Whether the task is one of robosuite's, whose returns have one scale.
    pub fn is_robosuites(&self) -> bool {
        TaskName::ROBOSUITE.iter().any(|task| task.as_str() == self.task)
    }

    /// Task and experiment.
    pub fn name(&self) -> String {
        if self.experiment.is_empty() { self.title() } else { format!("{}, {}", self.title(), self.experiment) }
    }

    /// The task's name as a heading.
    pub fn title(&self) -> String {
        self.task[..1].to_uppercase() + &self.task[1..]
    }
}

/// The runs of a section with an action space, a variant and a preset; seeds differ.
pub struct Group<'a> {
    /// Experiment and task.
    pub section: Section<'a>,
    /// Action space name.
    pub space: &'a str,
    /// The variant's name, mostly empty.
    pub variant: &'a str,
    /// The learner's preset.
    pub preset: &'a str,
    /// In the order in which they were found.
    pub runs: Vec<&'a RunSummary>,
}

impl Group<'_> {
    /// Whether a run is one of the group's.
    pub fn has(&self, run: &RunSummary) -> bool {
        let key = (Section::of(run), run.space.as_str(), run.variant.as_str(), run.preset.as_str());
        key == (self.section, self.space, self.variant, self.preset)
    }

    /// Space, variant and preset, by which groups of different tasks belong together.
    pub fn name(&self) -> (&str, &str, &str) {
        (self.space, self.variant, self.preset)
    }

    /// The number `name` of every run.
    pub fn values(&self, name: &str) -> Vec<f64> {
        self.runs.iter().map(|run| run.number(name)).collect()
    }
}

/// Groups in the order of their first run.
pub fn groups(rows: &[RunSummary]) -> Vec<Group<'_>> {
    let mut groups: Vec<Group> = vec![];
    for run in rows {
        match groups.iter_mut().find(|group| group.has(run)) {
            Some(group) => group.runs.push(run),
            None => groups.push(Group {
                section: Section::of(run),
                space: &run.space,
                variant: &run.variant,
                preset: &run.preset,
                runs: vec![run],
            }),
        }
    }
    groups
}

/// Every section once, in the order of its first group.
pub fn sections<'a>(groups: &[Group<'a>]) -> Vec<Section<'a>> {
    let mut sections = vec![];
    for group in groups {
        if !sections.contains(&group.section) {
            sections.push(group.section);
        }
    }
    sections
}

/// A row of `summary.csv`: one number of a group, over its seeds.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "documented once, in docs/columns.md")]
pub struct SummaryRow {
    pub experiment: String,
    pub task: String,
    pub space: String,
    pub variant: String,
    pub preset: String,
    pub metric: &'static str,
    pub n_seeds: usize,
    pub mean: f64,
    pub std: Option<f64>,
    pub lowest: f64,
    pub highest: f64,
    pub iqm: f64,
    pub ci_low: Option<f64>,
    pub ci_high: Option<f64>,
    pub median: f64,
}

/// Every metric of every group, over the runs that have it. A deviation needs two seeds, an interval [`FEWEST_FOR_INTERVAL`].
pub fn summary(groups: &[Group]) -> Vec<SummaryRow> {
    let row = |group: &Group, metric: &'static str| {
        let mut values = group.values(metric);
        values.retain(|value| !value.is_nan());
        if values.is_empty() {
            return None;
        }
        let ci = (values.len() >= FEWEST_FOR_INTERVAL).then(|| iqm_interval(&values));
        let [lowest, highest] = range(&values);
        Some(SummaryRow {
            experiment: group.section.experiment.into(),
            task: group.section.task.into(),
            space: group.space.into(),
            variant: group.variant.into(),
            preset: group.preset.into(),
            metric,
            n_seeds: values.len(),
            mean: mean(&values),
            std: (values.len() > 1).then(|| deviation(&values)),
            lowest,
            highest,
            iqm: iqm(&values),
            ci_low: ci.map(|ci| ci[0]),
            ci_high: ci.map(|ci| ci[1]),
            median: median(&values),
        })
    };
    groups.iter().flat_map(|group| summarised().filter_map(move |metric| row(group, metric))).collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use tasks::columns::Cell;

    use super::*;

    /// Finished runs of `space` with final returns of 60, 61, ...
    pub(crate) fn runs(space: &str, count: u32) -> Vec<RunSummary> {
        let run = |k: u32| RunSummary {
            task: "lift".into(),
            space: space.into(),
            preset: "desktop".into(),
            seed: k.into(),
            done: true,
            numbers: vec![
                ("diverged_episodes", Cell::Count(0)),
                ("final_return", Cell::Real(60.0 + f64::from(k))),
                ("sampled_return", Cell::Real(0.0)),
                ("curve_return", Cell::Real(0.0)),
                ("energy_per_action_j", Cell::Real(0.0)),
                ("mean_penalty_per_episode", Cell::Real(0.0)),
                ("penalised_episode_share", Cell::Real(0.0)),
                ("steps_to_450", Cell::Empty),
            ],
            ..RunSummary::default()
        };
        (0..count).map(run).collect()
    }

    /// Gives a run another number.
    pub(crate) fn set(run: &mut RunSummary, name: &'static str, cell: Cell) {
        run.numbers.retain(|(known, _)| *known != name);
        run.numbers.push((name, cell));
    }

    #[test]
    fn five_seeds_have_an_interval_and_fewer_a_range() {
        let (five, four) = (runs("aforce", 5), runs("aforce", 4));
        let row =
            |runs: &[RunSummary]| summary(&groups(runs)).into_iter().find(|row| row.metric == "final_return").unwrap();
        let (enough, few) = (row(&five), row(&four));
        assert_eq!((enough.n_seeds, enough.mean, enough.iqm, enough.median), (5, 62.0, 62.0, 62.0));
        assert_eq!((enough.lowest, enough.highest), (60.0, 64.0));
        assert!((enough.std.unwrap() - 2.5f64.sqrt()).abs() < 1e-12);
        let [low, high] = [enough.ci_low.unwrap(), enough.ci_high.unwrap()];
        assert!(60.0 < low && low < 62.0 && 62.0 < high && high < 64.0, "{low} to {high}");
        assert_eq!((few.ci_low, few.ci_high), (None, None));

        let mut older = runs("aforce", 5);
        set(&mut older[0], "final_return", Cell::Empty);
        let known = row(&older);
        assert_eq!((known.n_seeds, known.iqm, known.lowest), (4, 62.5, 61.0));
        older.iter_mut().for_each(|run| set(run, "final_return", Cell::Empty));
        assert!(summary(&groups(&older)).iter().all(|row| row.metric != "final_return"));
    }
}
