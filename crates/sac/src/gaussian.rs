//! The tanh-squashed Gaussian policy (Haarnoja et al., 2018, appendix C): `a = tanh(u)`, `u = mean + std * noise`.

use std::f32::consts::LN_2;

use crate::Config;
use crate::math::{exp, ln_1p, tanh};
use crate::simd::wide;

/// log 2 pi.
const LN_2_PI: f32 = 1.837_877_1;

/// Turns the outputs of the actor network into actions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SquashedGaussian {
    log_std_min: f32,
    /// Half the width of the range of log std.
    half_range: f32,
}

/// Entries that are computed side by side.
const LANES: usize = 8;

/// Entries of sampled actions, row by row, with the values that their derivatives need.
#[derive(Debug, Clone)]
pub(crate) struct Samples {
    blocks: Vec<Block>,
}

/// `LANES` entries of actions.
#[derive(Debug, Clone, Copy, Default)]
struct Block {
    mean: [f32; LANES],
    raw_log_std: [f32; LANES],
    /// Standard normal.
    noise: [f32; LANES],
    /// In [-1, 1].
    action: [f32; LANES],
    /// log of the probability density of the entry.
    log_prob: [f32; LANES],
    /// d u / d log_std.
    std_noise: [f32; LANES],
    /// d log_std / d raw_log_std.
    slope: [f32; LANES],
}

impl SquashedGaussian {
    pub fn new(config: &Config) -> Self {
        let (min, max) = (config.log_std_min as f32, config.log_std_max as f32);
        Self { log_std_min: min, half_range: 0.5 * (max - min) }
    }

    /// Entries of actions for outputs of the network, rows of `[mean of each action | raw log std of each action]`, and standard normal
    /// `noise`, `(row, action)`.
    pub fn sample(&self, outputs: &[f32], noise: &[f32], actions: usize, samples: &mut Samples) {
        let rows = outputs.chunks_exact(2 * actions).zip(noise.chunks_exact(actions));
        for (row, (output, noise)) in rows.enumerate() {
            for i in 0..actions {
                let (block, lane) = samples.place(row * actions + i);
                block.mean[lane] = output[i];
                block.raw_log_std[lane] = output[actions + i];
                block.noise[lane] = noise[i];
            }
        }
        squash(*self, &mut samples.blocks);
    }

    /// The action without noise.
    pub fn mean(&self, mean: f32) -> f32 {
        tanh(mean)
    }
}

wide! {
    /// Computes action, log-probability and derivatives from mean, raw log std and noise.
    fn squash(policy: SquashedGaussian, blocks: &mut [Block]) {
        let SquashedGaussian { log_std_min, half_range } = policy;
        let half_log_2_pi = 0.5 * LN_2_PI;
        for block in blocks {
            for i in 0..LANES {
                let noise = block.noise[i];
                let squashed = tanh(block.raw_log_std[i]);
                let log_std = log_std_min + half_range * (squashed + 1.0);
                let std_noise = exp(log_std) * noise;
                let u = block.mean[i] + std_noise;
                let log_normal = -0.5 * noise * noise - log_std - half_log_2_pi;
                // Change of variables: log(1 - tanh(u)^2), in a form that stays exact where tanh(u) rounds to 1.
                let log_slope = 2.0 * (LN_2 - u.abs() - ln_1p(exp(-2.0 * u.abs())));
                block.action[i] = tanh(u);
                block.log_prob[i] = log_normal - log_slope;
                block.std_noise[i] = std_noise;
                block.slope[i] = half_range * (1.0 - squashed * squashed);
            }
        }
    }
}

impl Samples {
    pub fn zeros(entries: usize) -> Self {
        Self { blocks: vec![Block::default(); entries.div_ceil(LANES)] }
    }

    /// Entry `index` of the action.
    pub fn action(&self, index: usize) -> f32 {
        self.blocks[index / LANES].action[index % LANES]
    }

    /// Log of the probability density of entry `index`.
    pub fn log_prob(&self, index: usize) -> f32 {
        self.blocks[index / LANES].log_prob[index % LANES]
    }

    /// Gradient of a loss with respect to (mean, raw_log_std) of entry `index`, given its gradients with respect to the action and to the
    /// log-probability.
    #[inline]
    pub fn backward(&self, index: usize, grad_action: f32, grad_log_prob: f32) -> (f32, f32) {
        let (block, lane) = (&self.blocks[index / LANES], index % LANES);
        let a = block.action[lane];
        // d a / d u = 1 - a^2; d log_prob / d u = 2 a, with the noise held fixed.
        let grad_u = grad_action * (1.0 - a * a) + grad_log_prob * 2.0 * a;
        // d log_prob / d log_std = -1, besides the path through u.
        (grad_u, (grad_u * block.std_noise[lane] - grad_log_prob) * block.slope[lane])
    }

    fn place(&mut self, index: usize) -> (&mut Block, usize) {
        (&mut self.blocks[index / LANES], index % LANES)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::with_and_without_avx2;

    fn policy() -> SquashedGaussian {
        SquashedGaussian::new(&Config::default())
    }

    /// One entry.
    fn sample(mean: f32, raw_log_std: f32, noise: f32) -> Samples {
        let mut samples = Samples::zeros(1);
        policy().sample(&[mean, raw_log_std], &[noise], 1, &mut samples);
        samples
    }

    /// exp(log_prob) must be the density of the action itself: it integrates to one over (-1, 1), and over part of it to the share of
    /// the Gaussian that lands there.
    #[test]
    fn density_integrates_to_the_share_of_samples() {
        for (mean, raw) in [(0.0, 0.0), (0.7, 0.3), (-1.5, -0.2), (0.2, 0.6)] {
            let log_std = -5.0 + 3.5 * (f32::tanh(raw) + 1.0);
            let density = |a: f64| {
                let noise = (a.atanh() - f64::from(mean)) / f64::from(log_std.exp());
                let sample = sample(mean, raw, noise as f32);
                assert!((f64::from(sample.action(0)) - a).abs() < 1e-5);
                f64::from(sample.log_prob(0)).exp()
            };
            let n = 20_000;
            let integral = |to: f64| {
                (0..n).map(|i| density(-1.0 + (to + 1.0) * (i as f64 + 0.5) / n as f64)).sum::<f64>() * (to + 1.0)
                    / n as f64
            };
            assert!((integral(1.0) - 1.0).abs() < 2e-3, "{mean} {raw}: {}", integral(1.0));
            // Half of all samples lie below tanh(mean).
            assert!((integral(f64::from(mean).tanh()) - 0.5).abs() < 2e-3);
        }
    }

    #[test]
    fn gradients_agree_with_finite_differences() {
        let loss = |mean: f32, raw: f32| {
            let s = sample(mean, raw, 0.6);
            1.7 * s.action(0) + 0.3 * s.log_prob(0)
        };
        for (mean, raw) in [(0.0, 0.0), (0.5, -0.4), (-0.8, 0.3)] {
            let (grad_mean, grad_raw) = sample(mean, raw, 0.6).backward(0, 1.7, 0.3);
            let h = 1e-2;
            approx::assert_relative_eq!(
                grad_mean,
                (loss(mean + h, raw) - loss(mean - h, raw)) / (2.0 * h),
                epsilon = 2e-3
            );
            approx::assert_relative_eq!(
                grad_raw,
                (loss(mean, raw + h) - loss(mean, raw - h)) / (2.0 * h),
                epsilon = 2e-3
            );
        }
    }

    #[test]
    fn far_tails_stay_finite() {
        for mean in [-100.0, -20.0, 20.0, 100.0] {
            let s = sample(mean, 5.0, 3.0);
            assert!(s.log_prob(0).is_finite() && s.action(0).abs() <= 1.0);
        }
    }

    #[test]
    fn an_entry_does_not_depend_on_its_place_or_on_avx2() {
        let number = |i: usize| ((7 * i) as f32).sin() * 3.0;
        let (rows, actions) = (5, 7);
        let outputs: Vec<f32> = (0..2 * rows * actions).map(number).collect();
        let noise: Vec<f32> = (100..100 + rows * actions).map(number).collect();
        let all = with_and_without_avx2(|| {
            let mut samples = Samples::zeros(rows * actions);
            policy().sample(&outputs, &noise, actions, &mut samples);
            samples
        });
        for (row, i) in (0..rows).flat_map(|row| (0..actions).map(move |i| (row, i))) {
            let (at, output) = (row * actions + i, &outputs[2 * row * actions..]);
            let alone = sample(output[i], output[actions + i], noise[at]);
            for all in &all {
                assert_eq!((all.action(at), all.log_prob(at)), (alone.action(0), alone.log_prob(0)));
                assert_eq!(all.backward(at, 1.7, 0.3), alone.backward(0, 1.7, 0.3));
            }
        }
    }
}
