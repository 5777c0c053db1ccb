//! Nudges: now and then one entry of the action keeps a random value for a while, and the policy commands the others.
//!
//! Exploration that lasts (as in temporally extended epsilon-greedy, Dabney et al., 2021, ICLR), an entry at a time: what the policy does
//! already, such as holding a handle, goes on while something is tried.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Actions of a nudge: a second at 20 Hz.
const LENGTH: u32 = 20;

/// A nudge under way.
#[derive(Debug, Clone)]
pub(crate) struct Nudge {
    entry: usize,
    value: f32,
    left: u32,
}

impl Nudge {
    /// Applies to `action` the nudge under way, or one that begins with probability `rate`.
    pub fn apply(nudge: &mut Option<Self>, rate: f64, action: &mut [f32], rng: &mut ChaCha8Rng) {
        if nudge.is_none() && rng.random_bool(rate) {
            let (entry, value) = (rng.random_range(0..action.len()), rng.random_range(-1.0..=1.0));
            *nudge = Some(Nudge { entry, value, left: LENGTH });
        }
        if let Some(Nudge { entry, value, left }) = nudge {
            action[*entry] = *value;
            *left -= 1;
            if *left == 0 {
                *nudge = None;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn one_entry_keeps_a_value_for_a_second_and_the_others_are_the_policys() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let (mut nudge, mut nudges, mut nudged) = (None, vec![], 0);
        for _ in 0..100_000 {
            let fresh = nudge.is_none();
            let mut action = [2.0; 3];
            Nudge::apply(&mut nudge, 0.01, &mut action, &mut rng);
            let changed: Vec<(usize, f32)> =
                (0..3).map(|i| (i, action[i])).filter(|(_, value)| *value != 2.0).collect();
            nudged += changed.len();
            if let [one] = changed[..] {
                if fresh {
                    nudges.push(one);
                }
                assert_eq!(nudges.last(), Some(&one));
            } else {
                assert!(changed.is_empty() && nudge.is_none());
            }
        }
        // Of 100 + 20 actions each.
        assert!((750..920).contains(&nudges.len()), "{}", nudges.len());
        assert!(nudged.abs_diff(nudges.len() * LENGTH as usize) < LENGTH as usize);
        for entry in 0..3 {
            let values: Vec<f32> = nudges.iter().filter(|(i, _)| *i == entry).map(|(_, value)| *value).collect();
            assert!(values.len() > 200 && values.iter().sum::<f32>().abs() < 0.15 * values.len() as f32);
        }
    }
}
