//! An episode from its first action to its last, and what it came to.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use crate::env::{Env, Step};
use crate::interval::AxisGroup;

/// Plays one episode from `seed`, `act` choosing the actions in [-1, 1]^n, to its end or until `on_step` breaks off, which
/// sees every step after it happened.
pub fn play(
    env: &mut Env,
    mut act: impl FnMut(&Env) -> Vec<f64>,
    seed: u64,
    mut on_step: impl FnMut(&Env, &Step) -> ControlFlow<()>,
) -> Episode {
    env.reset(Some(seed));
    let mut episode = Episode::default();
    loop {
        let action = act(env);
        let step = env.step(&action);
        let flow = on_step(env, &step);
        episode.add(step);
        if step.terminated || step.truncated || flow.is_break() {
            return episode;
        }
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
        let samples = self.steps.iter().map(|s| f64::from(s.interval.samples)).sum::<f64>().max(1.0);
        let [translation, rotation] = self.impedance();
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
            mean_stiffness: sum(|s| s.interval.mean_own_stiffness()) / n,
            saturated_fraction: sum(|s| s.interval.saturated()) / n,
            stiffness_translation_n_per_m: translation.sum_stiffness / samples,
            stiffness_rotation_nm_per_rad: rotation.sum_stiffness / samples,
            feedforward_spring_translation_n_per_m: translation.sum_feedforward_spring / samples,
            feedforward_spring_rotation_nm_per_rad: rotation.sum_feedforward_spring / samples,
            at_k_min_translation: translation.sum_at_min / samples,
            at_k_max_translation: translation.sum_at_max / samples,
            at_k_min_rotation: rotation.sum_at_min / samples,
            at_k_max_rotation: rotation.sum_at_max / samples,
            feedforward_share_translation: translation.feedforward_share(),
            feedforward_share_rotation: rotation.feedforward_share(),
            tool_work_translation_j: translation.work,
            tool_work_rotation_j: rotation.work,
        }
    }

    /// What the impedance of the translational and of the rotational axes did.
    fn impedance(&self) -> [AxisGroup; 2] {
        let mut sums = [AxisGroup::default(); 2];
        for step in &self.steps {
            for (sum, group) in sums.iter_mut().zip(step.interval.impedance) {
                *sum += group;
            }
        }
        sums
    }
}

/// What an episode ended with and what it cost; the columns that training and evaluation share.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
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
    pub stiffness_translation_n_per_m: f64,
    pub stiffness_rotation_nm_per_rad: f64,
    pub feedforward_spring_translation_n_per_m: f64,
    pub feedforward_spring_rotation_nm_per_rad: f64,
    pub at_k_min_translation: f64,
    pub at_k_max_translation: f64,
    pub at_k_min_rotation: f64,
    pub at_k_max_rotation: f64,
    pub feedforward_share_translation: f64,
    pub feedforward_share_rotation: f64,
    pub tool_work_translation_j: f64,
    pub tool_work_rotation_j: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Interval, REWARD_TERMS};

    #[test]
    fn ninety_nine_of_a_hundred_actions_stay_below_the_percentile() {
        let mut episode = Episode::default();
        for force in (1..=200).rev() {
            let interval = Interval { max_force: f64::from(force), ..Interval::default() };
            episode.add(Step {
                reward: 0.0,
                reward_terms: [0.0; REWARD_TERMS],
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
