//! The memory of past transitions, drawn from uniformly.

use std::ops::Range;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::n_step::{NStep, Transition};
use crate::{Config, Error};

/// A ring of transitions in f32, one row each: `[observation | action | next observation | reward | discount]`.
///
/// `reward` sums up to n rewards and `discount` multiplies the value of the next observation (see [`Config::n_step`]); 0 after a
/// termination. Memory grows with use up to [`Config::replay_capacity`] rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Replay {
    pub(crate) observation_dim: usize,
    pub(crate) action_dim: usize,
    pub(crate) capacity: usize,
    /// Row that the next transition is written to once the ring is full.
    pub(crate) oldest: usize,
    pub(crate) rows: Vec<f32>,
    pub(crate) n_step: NStep,
}

/// Transitions drawn for one update, laid out for it.
#[derive(Debug)]
pub(crate) struct Batch {
    /// `(batch, observation + action)`: what was seen and done.
    pub input: Vec<f32>,
    /// `(batch, observation + action)`: what was seen next; the action columns are left for the policy to fill.
    pub next_input: Vec<f32>,
    /// `(batch)`.
    pub reward: Vec<f32>,
    /// `(batch)`.
    pub discount: Vec<f32>,
}

impl Batch {
    /// Of `size` transitions, all zero.
    pub fn zeros(size: usize, observation_dim: usize, action_dim: usize) -> Self {
        let input = vec![0.0; size * (observation_dim + action_dim)];
        Self { next_input: input.clone(), input, reward: vec![0.0; size], discount: vec![0.0; size] }
    }
}

impl Replay {
    /// An empty memory.
    pub fn new(config: &Config, observation_dim: usize, action_dim: usize) -> Self {
        let n_step = NStep::new(config.n_step, config.gamma);
        Self { observation_dim, action_dim, capacity: config.replay_capacity, oldest: 0, rows: Vec::new(), n_step }
    }

    /// Number of stored transitions. The last n - 1 steps of a running episode still wait for their rewards and do not count.
    pub fn len(&self) -> usize {
        self.rows.len() / self.width()
    }

    /// Whether nothing is stored yet.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Takes one step of the environment. Steps of an episode must come in order, and its last one must be `terminated` or `truncated`.
    ///
    /// # Errors
    ///
    /// [`Error::NotFinite`] if the step holds a NaN or an infinity; the memory is unchanged.
    ///
    /// # Panics
    ///
    /// If a slice has the wrong length.
    pub fn push(&mut self, step: &Transition) -> Result<(), Error> {
        assert_eq!(step.observation.len(), self.observation_dim, "length of observation");
        assert_eq!(step.next_observation.len(), self.observation_dim, "length of next_observation");
        assert_eq!(step.action.len(), self.action_dim, "length of action");
        let parts = [
            ("observation", step.observation),
            ("action", step.action),
            ("reward", &[step.reward]),
            ("next_observation", step.next_observation),
        ];
        for (what, values) in parts {
            if let Some(index) = values.iter().position(|x| !x.is_finite()) {
                return Err(Error::NotFinite { what, index, value: values[index] });
            }
        }
        let Self { rows, oldest, capacity, n_step, .. } = self;
        n_step.push(step, |first, discount| {
            let scalars = [first.reward, discount];
            let row = [first.observation.as_slice(), &first.action, step.next_observation, &scalars];
            let width = row.iter().map(|part| part.len()).sum::<usize>();
            if rows.len() < *capacity * width {
                // Doubles, but never past the capacity: a full memory holds no spare room.
                if rows.len() == rows.capacity() {
                    rows.reserve_exact(rows.len().max(1024 * width).min(*capacity * width - rows.len()));
                }
                row.iter().for_each(|part| rows.extend_from_slice(part));
            } else {
                let mut at = *oldest * width;
                for part in row {
                    rows[at..at + part.len()].copy_from_slice(part);
                    at += part.len();
                }
                *oldest = (*oldest + 1) % *capacity;
            }
        });
        Ok(())
    }

    /// Draws transitions, each uniformly and with replacement, into `places` of the batch.
    pub(crate) fn sample(&self, places: Range<usize>, rng: &mut ChaCha8Rng, batch: &mut Batch) {
        assert!(!self.is_empty(), "an update needs at least one transition in the replay memory");
        let (o, a) = (self.observation_dim, self.action_dim);
        for i in places {
            let row = self.row(rng.random_range(0..self.len() as u32) as usize);
            batch.input[i * (o + a)..][..o + a].copy_from_slice(&row[..o + a]);
            batch.next_input[i * (o + a)..][..o].copy_from_slice(&row[o + a..o + a + o]);
            batch.reward[i] = row[o + a + o];
            batch.discount[i] = row[o + a + o + 1];
        }
    }

    fn row(&self, index: usize) -> &[f32] {
        &self.rows[index * self.width()..][..self.width()]
    }

    /// Numbers per row.
    pub(crate) fn width(&self) -> usize {
        2 * self.observation_dim + self.action_dim + 2
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    fn replay(capacity: usize) -> Replay {
        let config = Config { replay_capacity: capacity, batch_size: 1, n_step: 1, gamma: 0.5, ..Config::default() };
        Replay::new(&config, 2, 1)
    }

    fn push(replay: &mut Replay, k: f32) {
        let step = Transition {
            observation: &[k, -k],
            action: &[0.1 * k],
            reward: 10.0 * k,
            next_observation: &[k + 1.0, -k - 1.0],
            terminated: false,
            truncated: false,
        };
        replay.push(&step).unwrap();
    }

    #[test]
    fn the_oldest_make_room() {
        let mut replay = replay(3);
        (0..5).for_each(|k| push(&mut replay, k as f32));
        assert_eq!(replay.len(), 3);
        let first: Vec<f32> = (0..3).map(|i| replay.row(i)[0]).collect();
        assert_eq!(first, [3.0, 4.0, 2.0]);
        assert_eq!(replay.row(1), [4.0, -4.0, 0.4, 5.0, -5.0, 40.0, 0.5]);
    }

    #[test]
    fn memory_grows_with_use_and_stops_at_the_capacity() {
        let mut replay = replay(1500);
        push(&mut replay, 0.0);
        assert!(replay.rows.capacity() <= 1024 * 7);
        (1..3000).for_each(|k| push(&mut replay, k as f32));
        assert_eq!(replay.rows.capacity(), 1500 * 7);
    }

    #[test]
    fn a_batch_holds_whole_rows_and_reaches_all_of_them() {
        let mut replay = replay(10);
        (0..10).for_each(|k| push(&mut replay, k as f32));
        let mut batch = Batch::zeros(500, 2, 1);
        replay.sample(0..500, &mut ChaCha8Rng::seed_from_u64(1), &mut batch);
        let mut seen = [0; 10];
        for i in 0..500 {
            let k = batch.input[3 * i];
            assert_eq!(batch.input[3 * i..][..3], [k, -k, 0.1 * k]);
            assert_eq!(batch.next_input[3 * i..][..2], [k + 1.0, -k - 1.0]);
            assert_eq!((batch.reward[i], batch.discount[i]), (10.0 * k, 0.5));
            seen[k as usize] += 1;
        }
        // 50 expected, standard deviation 6.7.
        assert!(seen.iter().all(|&n| (20..=80).contains(&n)), "{seen:?}");
    }

    #[test]
    fn what_is_not_finite_is_refused_by_name() {
        let mut replay = replay(10);
        let step = Transition {
            observation: &[0.0, 0.0],
            action: &[0.0],
            reward: 0.0,
            next_observation: &[0.0, f32::NAN],
            terminated: false,
            truncated: false,
        };
        let error = replay.push(&step).unwrap_err();
        assert_eq!(error.to_string(), "next_observation[1] is NaN: not stored");
        assert!(replay.is_empty() && replay.n_step.pending.is_empty());
    }
}
