//! The learner's numbers between two rows of `progress.csv`.

use std::time::Instant;

use sac::Losses;

use crate::run::clock::Spent;
use crate::run::rows::{ProgressRow, SCHEMA};

/// Means of the learner's numbers since the last row.
pub(crate) struct LearnerLog {
    critics: Means<3>,
    actor: Means<4>,
    since: Instant,
    since_step: u64,
}

impl LearnerLog {
    pub(crate) fn new(step: u64) -> Self {
        LearnerLog { critics: Means::default(), actor: Means::default(), since: Instant::now(), since_step: step }
    }

    pub(crate) fn add(&mut self, l: &Losses) {
        self.critics.add([l.critic_loss, l.temperature, l.grad_norm_critic]);
        if let Some(a) = &l.actor {
            self.actor.add([a.loss, a.entropy, a.q_mean, a.grad_norm]);
        }
    }

    pub(crate) fn row(&mut self, step: u64, updates: u64, replay_size: usize, spent: Spent) -> ProgressRow {
        let [critic_loss, alpha, grad_norm_critic] = self.critics.means();
        let [actor_loss, entropy, q_mean, grad_norm_actor] = self.actor.means();
        let env_steps_per_s = (step - self.since_step) as f64 / self.since.elapsed().as_secs_f64();
        *self = LearnerLog::new(step);
        ProgressRow {
            schema: SCHEMA,
            step,
            updates,
            wall_s: spent.wall_s,
            cpu_s: spent.cpu_s,
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

/// Means of what is added together.
struct Means<const N: usize> {
    sums: [f64; N],
    count: u64,
}

impl<const N: usize> Default for Means<N> {
    fn default() -> Self {
        Means { sums: [0.0; N], count: 0 }
    }
}

impl<const N: usize> Means<N> {
    fn add(&mut self, values: [f32; N]) {
        for (sum, value) in self.sums.iter_mut().zip(values) {
            *sum += f64::from(value);
        }
        self.count += 1;
    }

    /// `None` if nothing was added.
    fn means(&self) -> [Option<f64>; N] {
        self.sums.map(|sum| (self.count > 0).then(|| sum / self.count as f64))
    }
}
