//! The learner's numbers between two rows of `progress.csv`.

use std::time::Instant;

use sac::Losses;

use crate::run::rows::{ProgressRow, SCHEMA};

/// Means of the learner's numbers since the last row.
pub(crate) struct LearnerLog {
    sums: [f64; 7],
    count: u64,
    since: Instant,
    since_step: u64,
}

impl LearnerLog {
    pub(crate) fn new(step: u64) -> Self {
        LearnerLog { sums: [0.0; 7], count: 0, since: Instant::now(), since_step: step }
    }

    pub(crate) fn add(&mut self, l: &Losses) {
        let values =
            [l.critic_loss, l.actor_loss, l.temperature, l.entropy, l.q_mean, l.grad_norm_critic, l.grad_norm_actor];
        for (sum, value) in self.sums.iter_mut().zip(values) {
            *sum += f64::from(value);
        }
        self.count += 1;
    }

    pub(crate) fn row(&mut self, step: u64, updates: u64, replay_size: usize, wall_s: f64) -> ProgressRow {
        let mean = |sum| (self.count > 0).then(|| sum / self.count as f64);
        let [critic_loss, actor_loss, alpha, entropy, q_mean, grad_norm_critic, grad_norm_actor] = self.sums.map(mean);
        let env_steps_per_s = (step - self.since_step) as f64 / self.since.elapsed().as_secs_f64();
        *self = LearnerLog::new(step);
        ProgressRow {
            schema: SCHEMA,
            step,
            updates,
            wall_s,
            env_steps_per_s,
            critic_loss,
            actor_loss,
            alpha,
            entropy,
            q_mean,
            grad_norm_critic,
            grad_norm_actor,
            replay_size,
        }
    }
}
