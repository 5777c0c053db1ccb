//! Adam (Kingma and Ba, 2015, algorithm 1). Written out because tch hides the optimiser's state, which is needed to continue a run.

use crate::simd::wide;

/// Decay of the mean of gradients.
const BETA_1: f64 = 0.9;
/// Decay of the mean of squared gradients.
const BETA_2: f64 = 0.999;
/// Keeps the division finite.
const EPSILON: f32 = 1e-8;

/// Running moments of a flat vector of gradients.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Adam {
    /// Mean of gradients.
    pub m: Vec<f32>,
    /// Mean of squared gradients.
    pub v: Vec<f32>,
}

impl Adam {
    pub fn new(parameters: usize) -> Self {
        Self { m: vec![0.0; parameters], v: vec![0.0; parameters] }
    }

    /// Step number `t`, counted from 1, against `gradient`.
    pub fn step(&mut self, parameters: &mut [f32], gradient: &[f32], learning_rate: f64, t: u64) {
        // Both moments start at zero; `step_size` and `scale_v` correct the bias of this start. In f64, because 1 - 0.999^t is small at
        // first.
        let t = i32::try_from(t).unwrap_or(i32::MAX);
        let step_size = (learning_rate / (1.0 - BETA_1.powi(t))) as f32;
        let scale_v = (1.0 - BETA_2.powi(t)).sqrt().recip() as f32;
        // In f32, 1 - 0.999 is already off by 1.3e-5 of its value.
        let (gain_m, gain_v) = ((1.0 - BETA_1) as f32, (1.0 - BETA_2) as f32);
        descend(parameters, gradient, &mut self.m, &mut self.v, [gain_m, gain_v, step_size, scale_v]);
    }
}

wide! {
    fn descend(parameters: &mut [f32], gradient: &[f32], m: &mut [f32], v: &mut [f32], factors: [f32; 4]) {
        let [gain_m, gain_v, step_size, scale_v] = factors;
        for (((p, &g), m), v) in parameters.iter_mut().zip(gradient).zip(m).zip(v) {
            *m += gain_m * (g - *m);
            *v += gain_v * (g * g - *v);
            *p -= step_size * *m / (v.sqrt() * scale_v + EPSILON);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_steps_by_hand() {
        let mut adam = Adam::new(2);
        let mut p = [1.0, 2.0];
        // First step: m/(1 - 0.9) = g and v/(1 - 0.999) = g^2, so every parameter moves by the learning rate, against its sign.
        adam.step(&mut p, &[0.5, -4.0], 0.1, 1);
        approx::assert_relative_eq!(p[..], [0.9, 2.1], max_relative = 1e-6);
        // Second step, first entry, g = 1: m = 0.9 * 0.05 + 0.1 = 0.145, m^ = 0.145 / 0.19; v = 0.999 * 2.5e-4 + 1e-3, v^ = v / 0.001999.
        adam.step(&mut p, &[1.0, 0.0], 0.1, 2);
        let expected = 0.9 - 0.1 * (0.145 / 0.19) / (1.249_75e-3_f32 / 1.999e-3).sqrt();
        approx::assert_relative_eq!(p[0], expected, max_relative = 1e-5);
        // Second entry, g = 0: the mean of gradients still moves it: m^ = -0.36 / 0.19, v^ = 0.999 * 0.016 / 0.001999.
        let expected = 2.1 + 0.1 * (0.36 / 0.19) / (0.999 * 0.016_f32 / 1.999e-3).sqrt();
        approx::assert_relative_eq!(p[1], expected, max_relative = 1e-5);
    }

    #[test]
    fn a_parabola_is_descended() {
        let mut adam = Adam::new(1);
        let mut p = [3.0];
        for t in 1..=2000 {
            let gradient = [2.0 * (p[0] - 1.0)];
            adam.step(&mut p, &gradient, 0.01, t);
        }
        assert!((p[0] - 1.0).abs() < 1e-3, "{}", p[0]);
    }
}
