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

/// Means of N numbers that are added in turn.
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

#[cfg(test)]
mod tests {
    use sac::ActorLosses;

    use super::*;

    /// The actor learns less often than the critics, so each column is a mean over its own updates.
    #[test]
    fn a_row_has_each_mean_in_the_column_of_its_name() {
        let actor = |loss, entropy, q_mean, grad_norm| Some(ActorLosses { loss, entropy, q_mean, grad_norm });
        let losses = |critic_loss, grad_norm_critic, temperature, actor| Losses {
            critic_loss,
            grad_norm_critic,
            temperature,
            actor,
        };
        let mut log = LearnerLog::new(300);
        log.add(&losses(1.0, 20.0, 0.25, actor(-3.0, 5.0, 40.0, 0.5)));
        log.add(&losses(2.0, 30.0, 0.5, actor(-4.0, 8.0, 70.0, 1.5)));
        log.add(&losses(6.0, 70.0, 1.5, None));
        let row = log.row(700, 11, 13, Spent { wall_s: 17.0, cpu_s: 19.0 });
        assert!(row.env_steps_per_s > 0.0);
        let expected = ProgressRow {
            schema: SCHEMA,
            step: 700,
            updates: 11,
            wall_s: 17.0,
            cpu_s: 19.0,
            env_steps_per_s: row.env_steps_per_s,
            critic_loss: Some(3.0),
            actor_loss: Some(-3.5),
            alpha: Some(0.75),
            entropy: Some(6.5),
            q_mean: Some(55.0),
            grad_norm_critic: Some(40.0),
            grad_norm_actor: Some(1.0),
            replay_size: 13,
        };
        assert_eq!(row, expected);

        // The next row begins anew.
        let next = log.row(800, 11, 13, Spent::default());
        assert_eq!((next.critic_loss, next.alpha, next.grad_norm_critic), (None, None, None));
        assert_eq!((next.actor_loss, next.entropy, next.q_mean, next.grad_norm_actor), (None, None, None, None));
    }
}
