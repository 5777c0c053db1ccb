//! How many actions groups need until an evaluation returns 450; runs that never reach 450 are censored.

use output::statistics::{FEWEST_FOR_INTERVAL, interval, with_width};
use output::survival::{Survival, Watched};
use serde::Serialize;

use crate::report::groups::{Group, Section};
use crate::report::run_tables::SOLVED;
use crate::report::summary::RunSummary;

/// A row of `reached.csv`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "documented once, in docs/columns.md")]
pub struct ReachedRow {
    pub experiment: String,
    pub task: String,
    pub space: String,
    pub variant: String,
    pub preset: String,
    pub threshold: f64,
    pub n_runs: usize,
    pub n_reached: usize,
    pub median_actions: Option<f64>,
    pub until_actions: f64,
    pub restricted_mean_actions: f64,
    pub ci_low: Option<f64>,
    pub ci_high: Option<f64>,
}

/// A row per group of every section in which an evaluation of some run returned 450, for robosuite's tasks alone: returns
/// of other tasks have another scale. A run that never reached 450 is censored at its last action. Restricted means end
/// at the length of the section's shortest run, so that groups can be compared.
pub fn reached(groups: &[Group]) -> Vec<ReachedRow> {
    let is_of_use =
        |section: Section| groups.iter().filter(|group| group.section == section).flat_map(watched).any(|run| run.came);
    let watched_to = |section: Section| {
        let of_section = groups.iter().filter(|group| group.section == section).flat_map(|group| &group.runs);
        of_section.map(|run| run.env_steps as f64).fold(f64::INFINITY, f64::min)
    };
    let counts = |group: &&Group| group.section.is_robosuites() && is_of_use(group.section);
    groups.iter().filter(counts).map(|group| row(group, watched_to(group.section))).collect()
}

fn watched(group: &Group) -> Vec<Watched> {
    let of_run = |(run, step): (&&RunSummary, f64)| {
        let came = !step.is_nan();
        Watched { time: if came { step } else { run.env_steps as f64 }, came }
    };
    group.runs.iter().zip(group.values("steps_to_450")).map(of_run).collect()
}

fn row(group: &Group, until: f64) -> ReachedRow {
    let runs = watched(group);
    let survival = Survival::of(&runs);
    // Runs are resampled by their place in the list.
    let places: Vec<f64> = (0..runs.len()).map(|place| place as f64).collect();
    let redrawn = |drawn: &[Vec<f64>]| {
        Survival::of(&drawn[0].iter().map(|&place| runs[place as usize]).collect::<Vec<_>>()).restricted_mean(until)
    };
    let ci = (runs.len() >= FEWEST_FOR_INTERVAL).then(|| interval(&[&places], redrawn)).and_then(with_width);
    ReachedRow {
        experiment: group.section.experiment.into(),
        task: group.section.task.into(),
        space: group.space.into(),
        variant: group.variant.into(),
        preset: group.preset.into(),
        threshold: SOLVED,
        n_runs: runs.len(),
        n_reached: runs.iter().filter(|run| run.came).count(),
        median_actions: survival.median(),
        until_actions: until,
        restricted_mean_actions: survival.restricted_mean(until),
        ci_low: ci.map(|ci| ci[0]),
        ci_high: ci.map(|ci| ci[1]),
    }
}

#[cfg(test)]
mod tests {
    use tasks::columns::Cell;

    use super::*;
    use crate::report::groups::groups;
    use crate::report::groups::tests::{runs, set};

    #[test]
    fn a_run_that_never_came_counts_until_its_end() {
        let mut all = [runs("aforce", 5), runs("osc", 2), runs("low", 1)].concat();
        all[7].task = "wipe".into();
        all.extend(runs("aforce", 1).into_iter().map(|run| RunSummary { task: "insert".into(), ..run }));
        for (run, step) in all.iter_mut().zip([20, 40, 60, 0, 0, 30, 0, 0, 20]) {
            run.env_steps = 100;
            if step > 0 {
                set(run, "steps_to_450", Cell::Count(step));
            }
        }
        // One run has only 50 actions, so restricted means end at 50.
        all[6].env_steps = 50;
        let groups = groups(&all);
        let rows = reached(&groups);
        let [aforce, osc] = rows.as_slice() else {
            panic!("nobody came there in wipe, and insert has another scale: {rows:?}")
        };
        assert_eq!((aforce.n_runs, aforce.n_reached, aforce.median_actions), (5, 3, Some(60.0)));
        assert_eq!((aforce.until_actions, aforce.restricted_mean_actions), (50.0, (20.0 + 40.0 + 3.0 * 50.0) / 5.0));
        assert!(aforce.ci_low.unwrap() < 42.0 && 42.0 < aforce.ci_high.unwrap());
        assert_eq!((osc.median_actions, osc.restricted_mean_actions, osc.ci_low), (Some(30.0), 40.0, None));
    }
}
