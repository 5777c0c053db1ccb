//! Nudges: now and then one entry of the action stays at an end of its range for a while, and the policy commands the other entries.
//!
//! A nudge is temporally extended exploration (as in temporally extended epsilon-greedy, Dabney et al., 2021, ICLR) of one entry at a time:
//! what the policy can do already, such as holding a handle, goes on meanwhile.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Length of a nudge in actions: two seconds at 20 Hz. An arm of low stiffness has to pull the door's handle for one and a half seconds.
const LENGTH: u32 = 40;
/// Probability with which an action without a nudge begins one: every 50 actions, on average.
const RATE: f64 = 0.02;

/// The nudges of one episode.
#[derive(Debug, Clone, Default)]
pub(crate) struct Nudges {
    under_way: Option<Nudge>,
}

#[derive(Debug, Clone)]
struct Nudge {
    entry: usize,
    value: f32,
    left: u32,
}

impl Nudges {
    /// Applies to `action` the nudge under way, or one that begins.
    pub fn apply(&mut self, action: &mut [f32], rng: &mut ChaCha8Rng) {
        if self.under_way.is_none() && rng.random_bool(RATE) {
            let value = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
            self.under_way = Some(Nudge { entry: rng.random_range(0..action.len()), value, left: LENGTH });
        }
        if let Some(Nudge { entry, value, left }) = &mut self.under_way {
            action[*entry] = *value;
            *left -= 1;
            if *left == 0 {
                self.under_way = None;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn one_entry_keeps_an_end_for_two_seconds_and_the_others_are_the_policys() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let (mut nudges, mut begun, mut nudged) = (Nudges::default(), vec![], 0);
        for _ in 0..100_000 {
            let fresh = nudges.under_way.is_none();
            let mut action = [0.0; 3];
            nudges.apply(&mut action, &mut rng);
            let changed: Vec<(usize, f32)> =
                (0..3).map(|i| (i, action[i])).filter(|(_, value)| *value != 0.0).collect();
            nudged += changed.len();
            match changed[..] {
                [one] => {
                    if fresh {
                        begun.push(one);
                    }
                    assert_eq!(begun.last(), Some(&one));
                }
                _ => assert!(changed.is_empty() && nudges.under_way.is_none()),
            }
        }
        // On average one nudge begins in 50 - 1 + 40 actions, and lasts for 40.
        assert!((1000..1250).contains(&begun.len()), "{}", begun.len());
        assert!(nudged.abs_diff(begun.len() * LENGTH as usize) < LENGTH as usize);
        for entry in 0..3 {
            for end in [-1.0, 1.0] {
                assert!((130..260).contains(&begun.iter().filter(|nudge| **nudge == (entry, end)).count()));
            }
        }
    }
}
