//! A run's scalars for TensorBoard: CleanRL's tags, and `energy/`, `contact/`, `eval/`.

pub mod events;

use std::path::Path;

use anyhow::Result;
use events::EventFile;
use output::statistics::mean_of;
use tasks::Outcome;

use crate::run::rows::ProgressRow;

/// Event files of one run.
pub struct TensorBoard(EventFile);

impl TensorBoard {
    /// In `folder`, going on after `step`.
    ///
    /// # Errors
    /// If the file cannot be written; so for every method.
    pub fn create(folder: &Path, step: u64) -> Result<Self> {
        EventFile::create(folder, step).map(TensorBoard)
    }

    /// A training episode that ended at `step`.
    pub fn episode(&mut self, step: u64, outcome: &Outcome) -> Result<()> {
        self.0.write(
            step,
            &[
                ("charts/episodic_return", outcome.total),
                ("charts/episodic_length", outcome.length as f64),
                ("energy/per_action_j", outcome.energy_per_action_j),
                ("energy/copper_loss_j", outcome.copper_loss_j),
                ("contact/max_force_n", outcome.max_contact_force_n),
                ("contact/excess_impulse_ns", outcome.excess_impulse_ns),
                ("contact/penalty", outcome.penalty),
                ("contact/penalised_steps", outcome.penalised_steps as f64),
                ("contact/stiffness_translation_n_per_m", outcome.stiffness_translation_n_per_m),
            ],
        )
    }

    /// The learner's numbers.
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
    pub fn evaluation(&mut self, step: u64, outcomes: &[Outcome]) -> Result<()> {
        self.0.write(
            step,
            &[
                ("eval/episodic_return", mean_of(outcomes, |o| o.total)),
                ("eval/success", mean_of(outcomes, |o| f64::from(u8::from(o.success)))),
                ("eval/energy_per_action_j", mean_of(outcomes, |o| o.energy_per_action_j)),
                ("eval/max_contact_force_n", mean_of(outcomes, |o| o.max_contact_force_n)),
                ("eval/penalty", mean_of(outcomes, |o| o.penalty)),
            ],
        )
    }
}
