//! Pink noise: power 1/f, so that an episode explores slow and fast changes alike (Eberhard et al., 2023, ICLR).
//!
//! The noise is a sum of first-order processes, each with twice the time constant of the one before: the usual approximation of 1/f by
//! octaves. Eberhard et al. draw a whole episode at once by a Fourier transform. Every number is standard normal on its own, as in white
//! noise.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::math::exp;

/// Number of octaves: the slowest process has a time constant of 2^8 = 256 actions, half an episode.
const OCTAVES: usize = 9;

/// The noise of one episode.
#[derive(Debug, Clone)]
pub(crate) struct Pink {
    /// Standard normal, one array per action.
    processes: Vec<[f32; OCTAVES]>,
}

impl Pink {
    /// The noise at the start of an episode, drawn from the stationary distribution.
    pub fn new(actions: usize, rng: &mut ChaCha8Rng) -> Self {
        let mut processes = vec![[0.0; OCTAVES]; actions];
        processes.as_flattened_mut().fill_with(|| StandardNormal.sample(rng));
        Self { processes }
    }

    /// The next number for action `index`.
    pub fn next(&mut self, index: usize, rng: &mut ChaCha8Rng) -> f32 {
        for (octave, x) in self.processes[index].iter_mut().enumerate() {
            let keep = exp(-1.0 / (1u32 << octave) as f32);
            let fresh: f32 = StandardNormal.sample(rng);
            *x = keep * *x + (1.0 - keep * keep).sqrt() * fresh;
        }
        self.processes[index].iter().sum::<f32>() / (OCTAVES as f32).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    /// Mean squares of 400 episodes of 512 numbers, smoothed over `window`.
    fn power(window: usize) -> f32 {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut sum = 0.0;
        for _ in 0..400 {
            let mut pink = Pink::new(1, &mut rng);
            let numbers: Vec<f32> = (0..512).map(|_| pink.next(0, &mut rng)).collect();
            let means = numbers.chunks_exact(window).map(|w| w.iter().sum::<f32>() / window as f32);
            sum += means.map(|m| m * m).sum::<f32>() / (512 / window) as f32;
        }
        sum / 400.0
    }

    #[test]
    fn each_number_is_standard_normal_and_slow_changes_are_as_strong_as_fast_ones() {
        let powers = [1, 4, 16, 64].map(power);
        assert!((powers[0] - 1.0).abs() < 0.05, "{powers:?}");
        // White noise would lose three quarters with each factor of four in `window`; 1/f loses the same amount each time: two octaves of
        // nine.
        for (fast, slow) in powers.iter().zip(&powers[1..]) {
            assert!((0.1..0.3).contains(&(fast - slow)), "{powers:?}");
        }
    }
}
