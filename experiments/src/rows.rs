//! The tables a run leaves behind, one row type per file. What each column means stands in
//! `results/README.md`. No wall-clock time here: the same seed gives the same bytes.

use serde::{Deserialize, Serialize};
use tasks::Step;

use crate::config::RunConfig;

/// Version of the columns below.
pub const SCHEMA: u32 = 2;

/// What identifies a run in every row.
#[derive(Debug, Clone, PartialEq)]
pub struct RunId {
    /// Task name.
    pub task: String,
    /// Action space name.
    pub space: String,
    /// Seed of the run.
    pub seed: u64,
}

impl RunId {
    /// Of the run with this configuration.
    pub fn of(config: &RunConfig) -> Self {
        RunId { task: config.env.task.as_str().into(), space: config.env.space.name().into(), seed: config.seed }
    }
}

/// What every action of an episode led to.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Episode {
    total: f64,
    steps: Vec<Step>,
}

impl Episode {
    /// Takes in the outcome of one action.
    pub fn add(&mut self, step: Step) {
        self.total += step.reward;
        self.steps.push(step);
    }

    /// Whether the task stood fulfilled after the last action.
    pub fn success(&self) -> bool {
        self.steps.last().is_some_and(|s| s.success)
    }

    /// Largest sustained force (N) of an action that a `share` of the actions does not exceed.
    fn force_percentile(&self, share: f64) -> f64 {
        let mut forces: Vec<f64> = self.steps.iter().map(|s| s.interval.max_force).collect();
        forces.sort_by(f64::total_cmp);
        let rank = (share * forces.len() as f64).ceil() as usize;
        forces.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
    }

    /// The columns that training and evaluation share.
    pub fn outcome(&self) -> Outcome {
        let n = self.steps.len().max(1) as f64;
        let sum = |of: fn(&Step) -> f64| self.steps.iter().map(of).sum::<f64>();
        let max = |of: fn(&Step) -> f64| self.steps.iter().map(of).fold(0.0, f64::max);
        let last = self.steps.last();
        Outcome {
            total: self.total,
            length: self.steps.len(),
            success: self.success(),
            success_any: self.steps.iter().any(|s| s.success),
            terminated: last.is_some_and(|s| s.terminated),
            truncated: last.is_some_and(|s| s.truncated),
            diverged: last.is_some_and(|s| s.diverged),
            energy_j: sum(|s| s.interval.energy.absolute),
            energy_per_action_j: sum(|s| s.interval.energy.absolute) / n,
            energy_positive_j: sum(|s| s.interval.energy.positive),
            energy_net_j: sum(|s| s.interval.energy.net),
            squared_torque_nm2s: sum(|s| s.interval.energy.squared_torque),
            copper_loss_j: sum(|s| s.interval.energy.copper_loss),
            penalty: sum(|s| s.penalty),
            penalised_steps: self.steps.iter().filter(|s| s.over_limit).count(),
            excess_impulse_ns: sum(|s| s.interval.excess_impulse),
            max_contact_force_n: max(|s| s.interval.max_force),
            p99_contact_force_n: self.force_percentile(0.99),
            max_raw_contact_force_n: max(|s| s.interval.max_raw_force),
            contact_time_s: sum(|s| s.interval.contact_time),
            mean_stiffness: sum(|s| s.interval.mean_stiffness()) / n,
            saturated_fraction: sum(|s| s.interval.saturated()) / n,
        }
    }
}

/// The columns that training and evaluation share.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "documented once, in results/README.md")]
pub struct Outcome {
    #[serde(rename = "return")]
    pub total: f64,
    pub length: usize,
    pub success: bool,
    pub success_any: bool,
    pub terminated: bool,
    pub truncated: bool,
    pub diverged: bool,
    pub energy_j: f64,
    pub energy_per_action_j: f64,
    pub energy_positive_j: f64,
    pub energy_net_j: f64,
    pub squared_torque_nm2s: f64,
    pub copper_loss_j: f64,
    pub penalty: f64,
    pub penalised_steps: usize,
    pub excess_impulse_ns: f64,
    pub max_contact_force_n: f64,
    pub p99_contact_force_n: f64,
    pub max_raw_contact_force_n: f64,
    pub contact_time_s: f64,
    pub mean_stiffness: f64,
    pub saturated_fraction: f64,
}

/// Columns before the outcome in `episodes.csv`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "documented once, in results/README.md")]
pub struct TrainingKey {
    pub schema: u32,
    pub task: String,
    pub space: String,
    pub seed: u64,
    pub step: u64,
    pub episode: u64,
}

/// Columns before the outcome in `eval.csv`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "documented once, in results/README.md")]
pub struct EvaluationKey {
    pub schema: u32,
    pub task: String,
    pub space: String,
    pub seed: u64,
    pub step: u64,
    pub policy: String,
    pub eval_episode: u32,
    pub episode_seed: u64,
}

/// One row of `progress.csv`: the clock, and the learner, averaged over the updates since the last row; empty cells if
/// there was none.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "documented once, in results/README.md")]
pub struct Progress {
    pub step: u64,
    pub updates: u64,
    pub wall_s: f64,
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

#[cfg(test)]
mod tests {
    use super::*;
    use tasks::Interval;

    #[test]
    fn ninety_nine_of_a_hundred_actions_stay_below_the_percentile() {
        let mut episode = Episode::default();
        for force in (1..=200).rev() {
            let interval = Interval { max_force: f64::from(force), ..Interval::default() };
            episode.add(Step {
                reward: 0.0,
                reward_terms: [0.0; tasks::REWARD_TERMS],
                terminated: false,
                truncated: false,
                success: false,
                diverged: false,
                over_limit: false,
                penalty: 0.0,
                interval,
            });
        }
        let outcome = episode.outcome();
        assert_eq!((outcome.p99_contact_force_n, outcome.max_contact_force_n), (198.0, 200.0));
        assert_eq!(Episode::default().outcome().p99_contact_force_n, 0.0);
    }
}
