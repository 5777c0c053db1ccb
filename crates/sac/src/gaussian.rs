//! The tanh-squashed Gaussian policy (Haarnoja et al., 2018, appendix C): `a = tanh(u)`, `u = mean + std * noise`.

use std::f32::consts::{LN_2, PI};

use crate::Config;

/// Turns the outputs of the actor network into actions, one entry at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SquashedGaussian {
    log_std_min: f32,
    /// Half the width of the range of log std.
    half_range: f32,
}

/// One entry of a sampled action, with what its derivatives need.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Sample {
    /// In [-1, 1].
    pub action: f32,
    /// log of the probability density of the action.
    pub log_prob: f32,
    /// d u / d log_std.
    std_noise: f32,
    /// d log_std / d raw_log_std.
    slope: f32,
}

impl SquashedGaussian {
    pub fn new(config: &Config) -> Self {
        let (min, max) = (config.log_std_min as f32, config.log_std_max as f32);
        Self { log_std_min: min, half_range: 0.5 * (max - min) }
    }

    /// The action for the outputs `mean` and `raw_log_std` of the network and standard normal `noise`.
    #[inline]
    pub fn sample(&self, mean: f32, raw_log_std: f32, noise: f32) -> Sample {
        let squashed = raw_log_std.tanh();
        let log_std = self.log_std_min + self.half_range * (squashed + 1.0);
        let std_noise = log_std.exp() * noise;
        let u = mean + std_noise;
        let log_normal = -0.5 * noise * noise - log_std - 0.5 * (2.0 * PI).ln();
        // Change of variables: log(1 - tanh(u)^2), in a form that stays exact where tanh(u) rounds to 1.
        let log_slope = 2.0 * (LN_2 - u - softplus(-2.0 * u));
        let slope = self.half_range * (1.0 - squashed * squashed);
        Sample { action: u.tanh(), log_prob: log_normal - log_slope, std_noise, slope }
    }

    /// The action without noise.
    pub fn mean(&self, mean: f32) -> f32 {
        mean.tanh()
    }
}

impl Sample {
    /// Gradient of a loss with respect to (mean, raw_log_std), given its gradients with respect to the action and to the log-probability.
    #[inline]
    pub fn backward(&self, grad_action: f32, grad_log_prob: f32) -> (f32, f32) {
        let a = self.action;
        // d a / d u = 1 - a^2; d log_prob / d u = 2 a, with the noise held fixed.
        let grad_u = grad_action * (1.0 - a * a) + grad_log_prob * 2.0 * a;
        // d log_prob / d log_std = -1, besides the way through u.
        (grad_u, (grad_u * self.std_noise - grad_log_prob) * self.slope)
    }
}

/// log(1 + exp(x)), without overflow.
#[inline]
fn softplus(x: f32) -> f32 {
    x.max(0.0) + (-x.abs()).exp().ln_1p()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn policy() -> SquashedGaussian {
        SquashedGaussian::new(&Config::default())
    }

    /// exp(log_prob) must be the density of the action itself: it integrates to one over (-1, 1), and over part of it to the share of
    /// the Gaussian that lands there.
    #[test]
    fn density_integrates_to_the_share_of_samples() {
        for (mean, raw) in [(0.0, 0.0), (0.7, 0.3), (-1.5, -0.2), (0.2, 0.6)] {
            let log_std = -5.0 + 3.5 * (f32::tanh(raw) + 1.0);
            let density = |a: f64| {
                let noise = (a.atanh() - f64::from(mean)) / f64::from(log_std.exp());
                let sample = policy().sample(mean, raw, noise as f32);
                assert!((f64::from(sample.action) - a).abs() < 1e-5);
                f64::from(sample.log_prob).exp()
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
            let s = policy().sample(mean, raw, 0.6);
            1.7 * s.action + 0.3 * s.log_prob
        };
        for (mean, raw) in [(0.0, 0.0), (0.5, -0.4), (-0.8, 0.3)] {
            let (grad_mean, grad_raw) = policy().sample(mean, raw, 0.6).backward(1.7, 0.3);
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
            let s = policy().sample(mean, 5.0, 3.0);
            assert!(s.log_prob.is_finite() && s.action.abs() <= 1.0);
        }
    }
}
