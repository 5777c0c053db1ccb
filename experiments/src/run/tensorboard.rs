//! A run's scalars for TensorBoard: CleanRL's tags, and `energy/`, `contact/`, `eval/`.

pub mod events;

use std::path::Path;

use anyhow::Result;
use events::EventFile;
use tasks::Outcome;
use tasks::columns::COLUMNS;

use crate::run::rollout::mean_of_column;
use crate::run::rows::ProgressRow;

/// Event files of one run.
pub struct TensorBoard(EventFile);

impl TensorBoard {
    /// In `folder`, going on after `step`.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn create(folder: &Path, step: u64) -> Result<Self> {
        EventFile::create(folder, step).map(TensorBoard)
    }

    /// A training episode that ended at `step`.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn episode(&mut self, step: u64, outcome: &Outcome) -> Result<()> {
        let scalars = COLUMNS.iter().filter_map(|column| Some((column.scalar?, outcome.number(column.name)?)));
        self.0.write(step, &scalars.collect::<Vec<_>>())
    }

    /// The learner's numbers.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn progress(&mut self, row: &ProgressRow) -> Result<()> {
        let losses = [
            // CleanRL's is the mean of both critics, ours their sum.
            ("losses/qf_loss", row.critic_loss.map(|sum| sum / 2.0)),
            ("losses/actor_loss", row.actor_loss),
            ("losses/alpha", row.alpha),
            ("losses/entropy", row.entropy),
            ("losses/q_mean", row.q_mean),
        ];
        let losses = losses.into_iter().filter_map(|(tag, value)| Some((tag, value?)));
        let scalars: Vec<_> = std::iter::once(("charts/SPS", row.env_steps_per_s)).chain(losses).collect();
        self.0.write(row.step, &scalars)
    }

    /// The evaluation made at `step`.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn evaluation(&mut self, step: u64, outcomes: &[Outcome]) -> Result<()> {
        let scalars = COLUMNS
            .iter()
            .filter_map(|column| Some((column.evaluation_scalar?, mean_of_column(outcomes, column.name))));
        self.0.write(step, &scalars.collect::<Vec<_>>())
    }
}
