//! The replay memory: past transitions, sampled uniformly.

use std::ops::Range;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::log::Log;
use crate::n_step::{NStep, Transition};
use crate::{Config, Error, Sizes};

/// The last [`Config::replay_capacity`] transitions, in f32.
///
/// The reward of a transition sums up to n rewards, and its discount multiplies the value of the next observation (see [`Config::n_step`]);
/// the discount is 0 after a termination. An observation is kept once: the one after a step is mostly the one before the next step.
#[derive(Debug, Clone, PartialEq)]
pub struct Replay {
    /// Numbers in an observation: all that the critics see.
    pub(crate) whole_observation: usize,
    pub(crate) action_dim: usize,
    pub(crate) capacity: usize,
    /// The observations, in the order in which they came.
    pub(crate) observations: Log,
    /// A row for each transition: `[action | reward | discount | place of its observation (2 numbers) | rows from there
    /// to the next observation]`.
    pub(crate) transitions: Log,
    pub(crate) n_step: NStep,
}

/// Numbers of a row besides the action. The place of an observation takes two of them, as an f32 holds every integer only up to 2^24.
const BESIDES_ACTION: usize = 5;
/// A place is the first of its two numbers times this, plus the second.
const RADIX: usize = 1 << 20;

/// Transitions drawn for one update, in the layout of the networks' inputs.
#[derive(Debug)]
pub(crate) struct Batch {
    /// `(batch, observation + action)`: the observations with the actions that were taken.
    pub input: Vec<f32>,
    /// `(batch, observation + action)`: the next observations; the policy fills the columns of the action.
    pub next_input: Vec<f32>,
    /// `(batch)`.
    pub reward: Vec<f32>,
    /// `(batch)`.
    pub discount: Vec<f32>,
}

impl Batch {
    /// A batch of `size` transitions, all zero.
    pub fn zeros(size: usize, whole_observation: usize, action_dim: usize) -> Self {
        let input = vec![0.0; size * (whole_observation + action_dim)];
        Self { next_input: input.clone(), input, reward: vec![0.0; size], discount: vec![0.0; size] }
    }
}

impl Replay {
    /// An empty memory.
    pub fn new(config: &Config, sizes: impl Into<Sizes>) -> Self {
        let sizes = sizes.into();
        let (whole_observation, action_dim) = (sizes.whole_observation(), sizes.action);
        Self {
            whole_observation,
            action_dim,
            capacity: config.replay_capacity,
            observations: Log::new(whole_observation),
            transitions: Log::new(action_dim + BESIDES_ACTION),
            n_step: NStep::new(config.n_step, config.gamma),
        }
    }

    /// Number of stored transitions. The last n - 1 steps of a running episode still wait for their rewards and do not count.
    pub fn len(&self) -> usize {
        self.transitions.len().min(self.capacity)
    }

    /// Whether nothing is stored yet.
    pub fn is_empty(&self) -> bool {
        self.transitions.len() == 0
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
        assert_eq!(step.observation.len(), self.whole_observation, "length of observation");
        assert_eq!(step.next_observation.len(), self.whole_observation, "length of next_observation");
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
        let observation = self.place_of(step.observation);
        self.observations.push(&[step.next_observation]);
        let next = self.observations.len() - 1;
        let Self { transitions, n_step, .. } = self;
        n_step.push(step, observation, |first, discount| {
            let place = [first.observation / RADIX, first.observation % RADIX, next - first.observation];
            transitions.push(&[&first.action, &[first.reward, discount], &place.map(|n| n as f32)]);
        });
        let oldest = self.transitions.len() - self.len();
        self.transitions.forget_before(oldest);
        if !self.is_empty() {
            self.observations.forget_before(self.places(oldest)[0]);
        }
        Ok(())
    }

    /// Row of an observation in the log. If it is not the last row, the observation is added.
    fn place_of(&mut self, observation: &[f32]) -> usize {
        let last = self.observations.len().checked_sub(1);
        // Compared by their bits, which differ between 0.0 and -0.0.
        let same = |row: &[f32]| row.iter().zip(observation).all(|(a, b)| a.to_bits() == b.to_bits());
        match last.filter(|last| same(self.observations.row(*last))) {
            Some(last) => last,
            None => {
                self.observations.push(&[observation]);
                self.observations.len() - 1
            }
        }
    }

    /// Draws transitions, each uniformly and with replacement, into `places` of the batch.
    pub(crate) fn sample(&self, places: Range<usize>, rng: &mut ChaCha8Rng, batch: &mut Batch) {
        assert!(!self.is_empty(), "an update needs at least one transition in the replay memory");
        let (o, a) = (self.whole_observation, self.action_dim);
        for i in places {
            let transition = self.drawn(rng.random_range(0..self.len() as u32) as usize);
            let (row, [observation, next]) = (self.transitions.row(transition), self.places(transition));
            batch.input[i * (o + a)..][..o].copy_from_slice(self.observations.row(observation));
            batch.input[i * (o + a) + o..][..a].copy_from_slice(&row[..a]);
            batch.next_input[i * (o + a)..][..o].copy_from_slice(self.observations.row(next));
            batch.reward[i] = row[a];
            batch.discount[i] = row[a + 1];
        }
    }

    /// The transition that the number `drawn`, below [`Replay::len`], stands for: the one whose number modulo the
    /// capacity is `drawn`, as in a ring buffer. This memory was a ring buffer once, and a seed still draws the same
    /// transitions.
    fn drawn(&self, drawn: usize) -> usize {
        let oldest = self.transitions.len() - self.len();
        oldest + (drawn + self.capacity - oldest % self.capacity) % self.capacity
    }

    /// Rows of a transition's observation and next observation in the log.
    fn places(&self, transition: usize) -> [usize; 2] {
        let row = self.transitions.row(transition);
        let [high, low, further] = [2, 3, 4].map(|i| row[self.action_dim + i] as usize);
        let observation = high * RADIX + low;
        [observation, observation + further]
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;
    use crate::replay_file;

    fn config(capacity: usize) -> Config {
        Config { replay_capacity: capacity, batch_size: 1, n_step: 1, gamma: 0.5, ..Config::default() }
    }

    fn replay(capacity: usize) -> Replay {
        Replay::new(&config(capacity), (2, 1))
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

    /// Draws `count` transitions, checks that each is one that [`push`] pushed, and returns their numbers.
    fn drawn(replay: &Replay, count: usize) -> Vec<usize> {
        let mut batch = Batch::zeros(count, 2, 1);
        replay.sample(0..count, &mut ChaCha8Rng::seed_from_u64(1), &mut batch);
        let one = |i: usize| {
            let k = batch.input[3 * i];
            assert_eq!(batch.input[3 * i..][..3], [k, -k, 0.1 * k]);
            assert_eq!(batch.next_input[3 * i..][..2], [k + 1.0, -k - 1.0]);
            assert_eq!((batch.reward[i], batch.discount[i]), (10.0 * k, 0.5));
            k as usize
        };
        (0..count).map(one).collect()
    }

    /// A ring buffer of whole rows, as the replay memory once was.
    struct Ring {
        rows: Vec<Vec<f32>>,
        oldest: usize,
        capacity: usize,
        n_step: NStep,
        observations: Vec<Vec<f32>>,
    }

    impl Ring {
        fn push(&mut self, step: &Transition) {
            let Self { rows, oldest, capacity, n_step, observations } = self;
            observations.push(step.observation.to_vec());
            n_step.push(step, observations.len() - 1, |first, discount| {
                let observation = &observations[first.observation];
                let row = [observation, &first.action, step.next_observation, &[first.reward, discount]].concat();
                if rows.len() < *capacity {
                    rows.push(row);
                } else {
                    rows[*oldest] = row;
                    *oldest = (*oldest + 1) % *capacity;
                }
            });
        }
    }

    /// Steps of episodes of all lengths. Each episode begins at [0, -0], and so does now and then a step within an episode.
    fn steps(count: usize, mut take: impl FnMut(&Transition)) {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut observation = [0.0, -0.0];
        for _ in 0..count {
            let next_observation = [rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0)];
            let ends = rng.random_range(0..40);
            take(&Transition {
                observation: &observation,
                action: &[rng.random_range(-1.0..1.0)],
                reward: rng.random_range(-1.0..1.0),
                next_observation: &next_observation,
                terminated: ends == 0,
                truncated: ends == 1,
            });
            observation = if ends < 2 || rng.random_bool(0.01) { [0.0, -0.0] } else { next_observation };
        }
    }

    #[test]
    fn draws_what_a_ring_of_whole_rows_draws() {
        for (capacity, n) in [(50, 1), (20_000, 3), (1_000_000, 3)] {
            let config = Config { replay_capacity: capacity, n_step: n, ..Config::default() };
            let mut replay = Replay::new(&config, (2, 1));
            let n_step = NStep::new(n, config.gamma);
            let mut ring = Ring { rows: vec![], oldest: 0, capacity, n_step, observations: vec![] };
            steps(50_000, |step| {
                replay.push(step).unwrap();
                ring.push(step);
            });
            assert_eq!(replay.len(), ring.rows.len());
            let mut batch = Batch::zeros(2000, 2, 1);
            replay.sample(0..2000, &mut ChaCha8Rng::seed_from_u64(1), &mut batch);
            let mut rng = ChaCha8Rng::seed_from_u64(1);
            for i in 0..2000 {
                let (input, next) = (&batch.input[3 * i..][..3], &batch.next_input[3 * i..][..2]);
                let found = [input, next, &[batch.reward[i], batch.discount[i]]].concat();
                let expected = &ring.rows[rng.random_range(0..ring.rows.len() as u32) as usize];
                let bits = |row: &[f32]| row.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(&found), bits(expected), "capacity {capacity}, draw {i}");
            }
        }
    }

    #[test]
    fn an_observation_is_kept_once_and_forgotten_with_its_transition() {
        let mut replay = replay(20_000);
        (0..100_000).for_each(|k| push(&mut replay, k as f32));
        assert_eq!((replay.len(), replay.observations.len(), replay.transitions.len()), (20_000, 100_001, 100_000));
        // The first 80 000 rows of each log are not needed: four segments and a part of the fifth.
        assert_eq!((replay.observations.forgotten, replay.transitions.forgotten), (4, 4));
        assert_eq!((replay.observations.segments.len(), replay.transitions.segments.len()), (2, 2));
    }

    #[test]
    fn a_batch_holds_whole_rows_and_reaches_all_of_them() {
        let mut replay = replay(10);
        (0..10).for_each(|k| push(&mut replay, k as f32));
        let mut seen = [0; 10];
        drawn(&replay, 500).into_iter().for_each(|k| seen[k] += 1);
        // 50 expected, standard deviation 6.7.
        assert!(seen.iter().all(|&n| (20..=80).contains(&n)), "{seen:?}");
    }

    /// Beyond 2^20 the place of an observation needs the first of its two numbers, even if few rows are kept.
    #[test]
    fn a_long_run_draws_what_was_pushed_after_the_first_million() {
        const PUSHED: usize = 1_100_000;
        let [mut short, mut long] = [20_000, 2_000_000].map(replay);
        for k in 0..PUSHED {
            push(&mut short, k as f32);
            push(&mut long, k as f32);
        }
        // 4.7 % of the million: 234 expected, standard deviation 15.
        let late = drawn(&long, 5000).into_iter().filter(|&k| k > RADIX).count();
        assert!((150..=320).contains(&late), "{late}");

        let folder = tempfile::tempdir().unwrap();
        replay_file::write(folder.path(), &folder.path().join("none"), &short).unwrap();
        let loaded = replay_file::read(folder.path(), &config(20_000), (2, 1)).unwrap();
        for memory in [&short, &loaded] {
            assert!(drawn(memory, 500).into_iter().all(|k| (PUSHED - 20_000..PUSHED).contains(&k)));
        }
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
