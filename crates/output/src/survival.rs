//! How long runs take to reach a target, such as a return, that some of them never reach (Kaplan and Meier, 1958).

use std::cmp::Ordering;

/// A run: how long it was watched, and whether it reached the target at the end of that time. A run that did not is censored:
/// it would have reached the target later, or never.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Watched {
    /// Time for which the run was watched, in any unit.
    pub time: f64,
    /// Whether the run reached the target at `time`.
    pub came: bool,
}

/// The share of runs that have not reached the target yet, as steps: each time at which some runs reached it, and the share
/// from then on.
#[derive(Debug, Clone, PartialEq)]
pub struct Survival(Vec<(f64, f64)>);

impl Survival {
    /// The estimate of Kaplan and Meier. A run that is censored at the time at which another reaches the target is still at risk then.
    pub fn of(runs: &[Watched]) -> Self {
        let mut runs = runs.to_vec();
        runs.sort_by(|a, b| a.time.total_cmp(&b.time));
        let (mut share, mut at_risk, mut steps) = (1.0, runs.len(), vec![]);
        for of_time in runs.chunk_by(|a, b| a.time.total_cmp(&b.time) == Ordering::Equal) {
            let came = of_time.iter().filter(|run| run.came).count();
            if came > 0 {
                share *= 1.0 - came as f64 / at_risk as f64;
                steps.push((of_time[0].time, share));
            }
            at_risk -= of_time.len();
        }
        Survival(steps)
    }

    /// The time by which half of the runs reached the target; `None` if the estimated share of the others stays above one half.
    pub fn median(&self) -> Option<f64> {
        self.0.iter().find(|(_, share)| *share <= 0.5 + 1e-12).map(|(time, _)| *time)
    }

    /// Mean time to reach the target, where a run that has not reached it by `until` counts as `until`: the area under the steps.
    pub fn restricted_mean(&self, until: f64) -> f64 {
        let (mut area, mut from, mut share) = (0.0, 0.0, 1.0);
        for &(time, after) in self.0.iter().filter(|(time, _)| *time < until) {
            area += share * (time - from);
            (from, share) = (time, after);
        }
        area + share * (until - from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `scripts/statistics_reference.py` asks lifelines.
    #[test]
    fn agrees_with_lifelines() {
        let mut reader = csv::Reader::from_reader(&include_bytes!("../reference/survival.csv")[..]);
        let mut rows = 0;
        for record in reader.records() {
            let record = record.unwrap();
            let number = |cell: &str| cell.parse::<f64>().unwrap();
            let runs = record[0]
                .split(' ')
                .map(|run| Watched { time: number(run.trim_end_matches('+')), came: !run.ends_with('+') });
            let survival = Survival::of(&runs.collect::<Vec<_>>());
            assert_eq!(survival.median(), Some(&record[1]).filter(|cell| **cell != *"inf").map(number), "{record:?}");
            let mean = survival.restricted_mean(number(&record[2]));
            assert!((mean - number(&record[3])).abs() < 1e-9 * mean, "{record:?}: {mean}");
            rows += 1;
        }
        assert!(rows >= 5);
    }

    #[test]
    fn without_a_run_that_is_censored_the_mean_is_the_mean() {
        let survival = Survival::of(&[2.0, 4.0, 9.0].map(|time| Watched { time, came: true }));
        assert_eq!((survival.median(), survival.restricted_mean(10.0)), (Some(4.0), 5.0));
        assert_eq!(survival.restricted_mean(4.0), (2.0 + 4.0 + 4.0) / 3.0);
    }
}
