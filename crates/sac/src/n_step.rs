//! Sums of the next n rewards, cut where an episode ends.

use std::collections::VecDeque;

/// One environment step, as the environment reports it.
#[derive(Debug, Clone, Copy)]
pub struct Transition<'a> {
    /// Observation before the action: what the actor sees, then what only the critics see ([`Sizes`](crate::Sizes)).
    pub observation: &'a [f32],
    /// Action, each entry in [-1, 1].
    pub action: &'a [f32],
    /// Reward of the step.
    pub reward: f32,
    /// Observation after the step: the true last one at the end of an episode, not the first of the next.
    pub next_observation: &'a [f32],
    /// The episode ended in a terminal state: no reward follows it.
    pub terminated: bool,
    /// The episode was cut short, by its time limit for instance: rewards would follow, and the critic's estimate of them is used.
    pub truncated: bool,
}

/// A step whose n rewards are not complete yet.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Pending {
    /// Row of the observation before the action in the memory's log.
    pub observation: usize,
    pub action: Vec<f32>,
    /// sum_k gamma^k r_k over the rewards seen so far.
    pub reward: f32,
    /// gamma^k with k the number of rewards seen so far.
    pub discount: f32,
}

/// The steps of the running episode whose n rewards are not complete, oldest first; at most n - 1 between two calls.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NStep {
    n: usize,
    gamma: f32,
    pub pending: VecDeque<Pending>,
}

impl NStep {
    pub fn new(n: usize, gamma: f64) -> Self {
        Self { n, gamma: gamma as f32, pending: VecDeque::with_capacity(n) }
    }

    /// Takes one step, whose observation is kept at `observation`. Every step that is now complete goes to `emit` with the discount of the
    /// value of `step.next_observation`: gamma^k, or 0 after a termination. The critic's target is `reward + discount * V(next_observation)`.
    pub fn push(&mut self, step: &Transition, observation: usize, mut emit: impl FnMut(&Pending, f32)) {
        for pending in &mut self.pending {
            pending.reward += pending.discount * step.reward;
            pending.discount *= self.gamma;
        }
        self.pending.push_back(Pending {
            observation,
            action: step.action.to_vec(),
            reward: step.reward,
            discount: self.gamma,
        });
        let ended = step.terminated || step.truncated;
        while self.pending.len() >= self.n || (ended && !self.pending.is_empty()) {
            let first = self.pending.pop_front().expect("not empty");
            // A time limit is no terminal state: only after a termination is the value of the next observation 0.
            emit(&first, if step.terminated { 0.0 } else { first.discount });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pushes rewards 1, 2, 4, ... of one episode and lists (first observation, reward, discount, next observation) of each complete step.
    fn run(n: usize, steps: usize, terminated: bool, truncated: bool) -> Vec<(f32, f32, f32, f32)> {
        let mut n_step = NStep::new(n, 0.5);
        let mut out = Vec::new();
        for k in 0..steps {
            let last = k + 1 == steps;
            let step = Transition {
                observation: &[k as f32],
                action: &[0.0],
                reward: (1 << k) as f32,
                next_observation: &[k as f32 + 1.0],
                terminated: terminated && last,
                truncated: truncated && last,
            };
            n_step.push(&step, k, |p, discount| {
                out.push((p.observation as f32, p.reward, discount, step.next_observation[0]))
            });
        }
        if terminated || truncated {
            assert!(n_step.pending.is_empty(), "nothing may leak into the next episode");
        }
        out
    }

    #[test]
    fn one_step_is_the_textbook() {
        assert_eq!(run(1, 2, true, false), [(0.0, 1.0, 0.5, 1.0), (1.0, 2.0, 0.0, 2.0)]);
        assert_eq!(run(1, 2, false, true), [(0.0, 1.0, 0.5, 1.0), (1.0, 2.0, 0.5, 2.0)]);
    }

    #[test]
    fn three_steps_wait_for_three_rewards() {
        // 1 + 2/2 + 4/4 = 3, then 2 + 4/2 + 8/4 = 6; gamma^3 = 1/8.
        assert_eq!(run(3, 4, false, false), [(0.0, 3.0, 0.125, 3.0), (1.0, 6.0, 0.125, 4.0)]);
    }

    #[test]
    fn termination_takes_the_future_away_from_every_pending_step() {
        assert_eq!(run(3, 3, true, false), [(0.0, 3.0, 0.0, 3.0), (1.0, 4.0, 0.0, 3.0), (2.0, 4.0, 0.0, 3.0)]);
    }

    #[test]
    fn truncation_keeps_the_future_over_shorter_distances() {
        assert_eq!(run(3, 3, false, true), [(0.0, 3.0, 0.125, 3.0), (1.0, 4.0, 0.25, 3.0), (2.0, 4.0, 0.5, 3.0)]);
    }

    #[test]
    fn termination_wins_when_the_time_limit_falls_on_the_same_step() {
        assert_eq!(run(3, 1, true, true), [(0.0, 1.0, 0.0, 1.0)]);
    }

    #[test]
    fn an_episode_shorter_than_n_is_kept() {
        assert_eq!(run(5, 2, false, true), [(0.0, 2.0, 0.25, 2.0), (1.0, 2.0, 0.5, 2.0)]);
    }
}
