//! What a critic's outputs say of a value: one number, or a histogram (HL-Gauss: Farebrother et al., 2024, arXiv 2403.03950).

use crate::Config;
use crate::math::exp;

/// Standard deviation of a target's distribution, in widths of a bin (their section 3).
const SPREAD: f32 = 0.75;

/// How outputs are read as a value, and taught one.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Value {
    /// One output: the value.
    Number,
    /// Logits of a distribution over these values, evenly spaced.
    Histogram { centres: Vec<f32> },
}

impl Value {
    pub fn new(config: &Config) -> Self {
        let [low, high] = config.value_range.map(|end| end as f32);
        let width = (high - low) / config.value_bins as f32;
        match config.value_bins {
            0 => Value::Number,
            bins => Value::Histogram { centres: (0..bins).map(|i| low + width * (i as f32 + 0.5)).collect() },
        }
    }

    /// Outputs per critic.
    pub fn outputs(&self) -> usize {
        match self {
            Value::Number => 1,
            Value::Histogram { centres } => centres.len(),
        }
    }

    /// The value that `outputs` stand for.
    pub fn read(&self, outputs: &[f32]) -> f32 {
        match self {
            Value::Number => outputs[0],
            Value::Histogram { centres } => {
                let (largest, sum) = scale(outputs);
                outputs.iter().zip(centres).map(|(x, c)| exp(x - largest) / sum * c).sum()
            }
        }
    }

    /// Writes the derivative of [`Value::read`], times `weight`, into `gradient`.
    pub fn differentiate(&self, outputs: &[f32], weight: f32, gradient: &mut [f32]) {
        match self {
            Value::Number => gradient[0] = weight,
            Value::Histogram { centres } => {
                let (value, (largest, sum)) = (self.read(outputs), scale(outputs));
                for ((g, x), c) in gradient.iter_mut().zip(outputs).zip(centres) {
                    *g = weight * exp(x - largest) / sum * (c - value);
                }
            }
        }
    }

    /// Loss of `outputs` where the value should be `y`; its derivative, times `weight`, goes into `gradient`.
    ///
    /// Squared error of a number; of a histogram the cross-entropy with a normal distribution around y, cut off at the ends of the range.
    pub fn teach(&self, outputs: &[f32], y: f32, weight: f32, gradient: &mut [f32]) -> f32 {
        match self {
            Value::Number => {
                let error = outputs[0] - y;
                gradient[0] = 2.0 * weight * error;
                error * error
            }
            Value::Histogram { centres } => {
                let half = 0.5 * (centres[1] - centres[0]);
                let y = y.clamp(centres[0] - half, centres[centres.len() - 1] + half);
                let below = |edge: f32| 0.5 * libm::erff((edge - y) / (2.0 * half * SPREAD * std::f32::consts::SQRT_2));
                let all = below(centres[centres.len() - 1] + half) - below(centres[0] - half);
                let (largest, sum) = scale(outputs);
                let mut loss = 0.0;
                let mut left = below(centres[0] - half);
                for ((g, x), c) in gradient.iter_mut().zip(outputs).zip(centres) {
                    let right = below(c + half);
                    let wanted = (right - left) / all;
                    left = right;
                    loss -= wanted * (x - largest - libm::logf(sum));
                    *g = weight * (exp(x - largest) / sum - wanted);
                }
                loss
            }
        }
    }
}

/// Largest logit, and the sum of exp(x - largest): no exponential overflows.
fn scale(outputs: &[f32]) -> (f32, f32) {
    let largest = outputs.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    (largest, outputs.iter().map(|x| exp(x - largest)).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Taught one value by steps down the gradient, a histogram says that value; at the ends of the range as well.
    #[test]
    fn a_histogram_learns_a_value() {
        let value = Value::new(&Config { value_bins: 41, value_range: [-10.0, 30.0], ..Config::default() });
        for (y, expected) in [(0.0, 0.0), (7.3, 7.3), (29.0, 29.0), (1e9, 29.5), (-1e9, -9.5)] {
            let (mut outputs, mut gradient) = (vec![0.0; value.outputs()], vec![0.0; value.outputs()]);
            for _ in 0..3000 {
                value.teach(&outputs, y, 1.0, &mut gradient);
                outputs.iter_mut().zip(&gradient).for_each(|(x, g)| *x -= 3.0 * g);
            }
            let found = value.read(&outputs);
            assert!((found - expected).abs() < 0.5, "{found}, not {expected}");
        }
    }
}
