//! The tables of a run, one row type per file. What each column means stands in `docs/columns.md`. Clock times are in
//! `progress.csv` alone: in the other tables the same seed gives the same bytes.

use std::sync::LazyLock;

use serde::{Serialize, Serializer};
use tasks::Outcome;

use crate::run::csv_table::header;

/// Version of the columns below.
pub const SCHEMA: u32 = 6;

/// Columns before the outcome in `episodes.csv`.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[allow(missing_docs, reason = "documented once, in docs/columns.md")]
pub struct TrainingKey {
    pub schema: u32,
    pub task: String,
    pub space: String,
    pub seed: u64,
    pub step: u64,
    pub episode: u64,
}

/// The column before those of `eval.csv` in the table of a grid of disturbances.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[allow(missing_docs, reason = "documented once, in docs/columns.md")]
pub struct CaseKey<'a> {
    pub disturbance: &'a str,
}

/// Columns before the outcome in `eval.csv`.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[allow(missing_docs, reason = "documented once, in docs/columns.md")]
pub struct EvaluationKey {
    pub schema: u32,
    pub task: String,
    pub space: String,
    pub seed: u64,
    pub step: u64,
    pub policy: String,
    pub eval_episode: u32,
    #[serde(serialize_with = "as_text")]
    pub episode_seed: u64,
}

/// Written in hexadecimal, because a spreadsheet rounds a number of more than 15 digits.
fn as_text<S: Serializer>(seed: &u64, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&format_args!("{seed:#018x}"))
}

/// One row of `progress.csv`: times, and the learner's numbers averaged over the updates since the last row; empty cells
/// if there was no update.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[allow(missing_docs, reason = "documented once, in docs/columns.md")]
pub struct ProgressRow {
    pub schema: u32,
    pub step: u64,
    pub updates: u64,
    pub wall_s: f64,
    pub cpu_s: f64,
    pub env_steps_per_s: f64,
    pub critic_loss: Option<f64>,
    pub actor_loss: Option<f64>,
    pub alpha: Option<f64>,
    pub entropy: Option<f64>,
    pub q_mean: Option<f64>,
    pub grad_norm_critic: Option<f64>,
    pub grad_norm_actor: Option<f64>,
    pub replay_size: usize,
}

/// The columns of `episodes.csv`, `eval.csv` and `progress.csv`.
pub static COLUMNS: LazyLock<[Vec<String>; 3]> = LazyLock::new(|| {
    [
        header((TrainingKey::default(), Outcome::default())),
        header((EvaluationKey::default(), Outcome::default())),
        header(ProgressRow::default()),
    ]
});
