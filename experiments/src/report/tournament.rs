//! What learners reach in the same CPU time: a row per run.

use anyhow::Result;
use serde::Serialize;

use crate::report::record::Record;
use crate::report::summary::RunSummary;
use crate::report::table::Table;

/// A row of `tournament.csv`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "documented once, in docs/columns.md")]
pub struct TournamentRow {
    pub experiment: String,
    pub variant: String,
    pub preset: String,
    pub task: String,
    pub space: String,
    pub seed: u64,
    pub actions: u64,
    pub cpu_min: f64,
    pub return_3min: Option<f64>,
    pub return_6min: Option<f64>,
    pub return_12min: Option<f64>,
    pub return_24min: Option<f64>,
    pub success_end: f64,
    pub cpu_min_to_450: Option<f64>,
    pub cpu_ms_per_action: f64,
    pub sampled_success_end: f64,
    pub commit: String,
}

impl TournamentRow {
    /// The row of a run, if its tables have CPU time.
    ///
    /// # Errors
    /// If a table cannot be read.
    pub fn of(run: &Record, summary: &RunSummary) -> Result<Option<Self>> {
        let minutes: Vec<(f64, f64)> =
            run.columns(Table::Progress)?.points("cpu_s")?.into_iter().map(|(step, s)| (step, s / 60.0)).collect();
        let Some(cpu_min) = summary.cpu_s.map(|s| s / 60.0).filter(|_| !minutes.is_empty()) else { return Ok(None) };
        let returns = run.evaluations("mean")?.mean_by_step("return")?;
        // Mean return of the last evaluation that began within `limit` minutes; none if the run ended before that.
        let at = |limit: f64| {
            let step = minutes.iter().take_while(|(_, time)| *time <= limit).last()?.0;
            let made = returns.iter().take_while(|(evaluated, _)| *evaluated <= step).last();
            made.filter(|_| cpu_min >= limit).map(|(_, value)| *value)
        };
        Ok(Some(TournamentRow {
            experiment: summary.experiment.clone(),
            variant: summary.variant.clone(),
            preset: summary.preset.clone(),
            task: summary.task.clone(),
            space: summary.space.clone(),
            seed: summary.seed,
            actions: summary.env_steps,
            cpu_min,
            return_3min: at(3.0),
            return_6min: at(6.0),
            return_12min: at(12.0),
            return_24min: at(24.0),
            success_end: summary.number("final_success"),
            cpu_min_to_450: Some(summary.number("cpu_min_to_450")).filter(|minutes| !minutes.is_nan()),
            cpu_ms_per_action: 60e3 * cpu_min / summary.env_steps as f64,
            sampled_success_end: summary.number("sampled_success"),
            commit: summary.commit.clone(),
        }))
    }
}
