//! Layer normalisation (Ba et al., 2016, arXiv 1607.06450) without a gain and shift of its own, as the linear layers before and after have
//! both.
//!
//! Layer normalisation bounds a critic's values of actions that no transition holds, so that more updates do less harm (Ball et al., 2023,
//! arXiv 2302.02948, section 4.2).

use crate::simd::wide;

/// Added to the variance, as in PyTorch.
pub(crate) const EPSILON: f32 = 1e-5;

/// `y = (x - mean) / std` over each run of `size` numbers, and what the backward pass needs.
#[derive(Debug)]
pub(crate) struct LayerNorm {
    size: usize,
    /// y of the last forward pass.
    normal: Vec<f32>,
    /// 1 / std of each run.
    scale: Vec<f32>,
}

impl LayerNorm {
    /// Memory for `runs` runs of `size` numbers.
    pub fn new(runs: usize, size: usize) -> Self {
        Self { size, normal: vec![0.0; runs * size], scale: vec![0.0; runs] }
    }

    /// Replaces x by y.
    pub fn forward(&mut self, x: &mut [f32]) {
        forward(self.size, x, &mut self.normal, &mut self.scale);
    }

    /// Replaces the derivative by y with the derivative by x.
    pub fn backward(&self, delta: &mut [f32]) {
        backward(self.size, delta, &self.normal, &self.scale);
    }
}

wide! {
    fn forward(size: usize, x: &mut [f32], normal: &mut [f32], scale: &mut [f32]) {
        let n = size as f32;
        let runs = x.chunks_exact_mut(size).zip(normal.chunks_exact_mut(size));
        for ((x, normal), scale) in runs.zip(scale) {
            let mean = sum(x, |x| x) / n;
            let variance = sum(x, |x| (x - mean) * (x - mean)) / n;
            *scale = (variance + EPSILON).sqrt().recip();
            for x in x.iter_mut() {
                *x = (*x - mean) * *scale;
            }
            normal.copy_from_slice(x);
        }
    }

    fn backward(size: usize, delta: &mut [f32], normal: &[f32], scale: &[f32]) {
        let n = size as f32;
        let runs = delta.chunks_exact_mut(size).zip(normal.chunks_exact(size));
        for ((delta, normal), scale) in runs.zip(scale) {
            let mean = sum(delta, |d| d) / n;
            let slope = sum_products(delta, normal) / n;
            for (d, y) in delta.iter_mut().zip(normal) {
                *d = scale * (*d - mean - slope * y);
            }
        }
    }
}

/// Number of partial sums that are added up side by side. In a single sum each addition would wait for the one before.
const LANES: usize = 16;

#[inline(always)]
fn sum(x: &[f32], of: impl Fn(f32) -> f32) -> f32 {
    let mut sums = [0.0; LANES];
    let (chunks, rest) = x.as_chunks::<LANES>();
    for chunk in chunks {
        for (sum, &x) in sums.iter_mut().zip(chunk) {
            *sum += of(x);
        }
    }
    sums.iter().sum::<f32>() + rest.iter().map(|&x| of(x)).sum::<f32>()
}

#[inline(always)]
fn sum_products(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0; LANES];
    let ((chunks_a, rest_a), (chunks_b, rest_b)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    for (a, b) in chunks_a.iter().zip(chunks_b) {
        for i in 0..LANES {
            sums[i] += a[i] * b[i];
        }
    }
    sums.iter().sum::<f32>() + rest_a.iter().zip(rest_b).map(|(a, b)| a * b).sum::<f32>()
}
