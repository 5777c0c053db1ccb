//! Forward and backward pass of [`Networks`], written out: libtorch multiplies matrices, and loops here do the rest, in memory that is
//! allocated once.
//!
//! Autograd would compute the same products, and besides them gradients that are not needed, with a new tensor for every intermediate step.
//! The tests compare this file with autograd.

use tch::Tensor;

use crate::buffer::Matrix;
use crate::layer_norm::LayerNorm;
use crate::network::Networks;
use crate::simd::wide;

/// Memory for the forward pass of one batch and, if it is needed, for the backward pass.
#[derive(Debug)]
pub(crate) struct Pass {
    networks: usize,
    rows: usize,
    /// Output of each layer, after the ReLU.
    output: Vec<Numbers>,
    /// Derivative of the loss with respect to what each layer computes before its ReLU; empty without a backward pass.
    delta: Vec<Numbers>,
    /// The layer norms between bias and ReLU, one per hidden layer; empty for networks without layer norm.
    norms: Vec<LayerNorm>,
}

/// Numbers of every network in one layer, `(rows, networks * size)`.
#[derive(Debug)]
struct Numbers {
    all: Matrix,
    /// `(networks * size, rows)`.
    all_transposed: Tensor,
    /// Those of each network, `(rows, size)`.
    one: Vec<Tensor>,
    /// `(size, rows)`.
    one_transposed: Vec<Tensor>,
}

impl Numbers {
    fn zeros(rows: usize, networks: usize, size: usize) -> Self {
        let all = Matrix::zeros(rows, networks * size);
        let one: Vec<Tensor> = (0..networks).map(|k| all.columns(k * size..(k + 1) * size)).collect();
        Self { all_transposed: all.view.tr(), one_transposed: one.iter().map(Tensor::tr).collect(), all, one }
    }
}

impl Pass {
    /// Memory for batches of `rows`. Without `back` there is only the forward pass.
    pub fn new(networks: &Networks, rows: usize, back: bool) -> Self {
        let count = networks.layers.len();
        let numbers = || networks.sizes[1..].iter().map(|&size| Numbers::zeros(rows, count, size)).collect();
        Self { networks: count, rows, output: numbers(), delta: if back { numbers() } else { vec![] }, norms: vec![] }
    }

    /// The same with layer normalisation in every hidden layer.
    pub fn normalised(mut self, networks: &Networks) -> Self {
        let hidden = &networks.sizes[1..networks.sizes.len() - 1];
        self.norms = hidden.iter().map(|&size| LayerNorm::new(self.rows * self.networks, size)).collect();
        self
    }

    /// Computes the outputs of every network for `input` `(rows, input)`.
    pub fn forward(&mut self, networks: &Networks, input: &Tensor) {
        let layers = self.output.len();
        for layer in 0..layers {
            if layer == 0 {
                // Every network sees the same input: one product for all of them.
                multiply(&self.output[0].all.view, input, &networks.first_transposed);
            } else {
                let [x, y] = [layer - 1, layer].map(|layer| &self.output[layer].one);
                for (k, weights) in networks.layers.iter().enumerate() {
                    multiply(&y[k], &x[k], &weights[layer].transposed);
                }
            }
            let bias = &networks.values[networks.biases(layer)];
            let output = &mut self.output[layer].all;
            if layer + 1 == layers {
                add_bias(output, bias)
            } else if let Some(norm) = self.norms.get_mut(layer) {
                add_bias(output, bias);
                norm.forward(output);
                relu(output);
            } else {
                add_bias_relu(output, bias)
            }
        }
    }

    /// Outputs of the last layer, `(rows, networks * output)`.
    pub fn result(&self) -> &[f32] {
        &self.output.last().expect("at least one layer").all
    }

    /// [`Pass::result`], and the memory into which the derivative of the loss by it is written before [`Pass::backward`].
    pub fn result_and_gradient(&mut self) -> (&[f32], &mut [f32]) {
        let (result, gradient) = (self.output.last(), self.delta.last_mut());
        (&result.expect("at least one layer").all, &mut gradient.expect("a way back").all)
    }

    /// Carries the derivative of the loss from the result back to the first layer.
    pub fn backward(&mut self, networks: &Networks) {
        for layer in (1..self.output.len()).rev() {
            for (k, weights) in networks.layers.iter().enumerate() {
                multiply(&self.delta[layer - 1].one[k], &self.delta[layer].one[k], &weights[layer].weight);
            }
            let delta = &mut self.delta[layer - 1].all;
            mask_relu(delta, &self.output[layer - 1].all);
            if let Some(norm) = self.norms.get(layer - 1) {
                norm.backward(delta);
            }
        }
    }

    /// After [`Pass::backward`]: the derivative by every weight and bias, for the `input` of the forward pass.
    pub fn parameter_gradient(&self, input: &Tensor, gradient: &mut Networks) {
        multiply(&gradient.first, &self.delta[0].all_transposed, input);
        for (layer, delta) in self.delta.iter().enumerate() {
            if layer > 0 {
                for (k, weights) in gradient.layers.iter().enumerate() {
                    multiply(&weights[layer].weight, &delta.one_transposed[k], &self.output[layer - 1].one[k]);
                }
            }
            let biases = gradient.biases(layer);
            sum_rows(&delta.all, &mut gradient.values[biases]);
        }
    }

    /// After [`Pass::backward`]: the derivative by the inputs from column `from` on, summed over the networks, `(rows, input - from)`.
    pub fn input_gradient(&self, networks: &Networks, from: usize, gradient: &Matrix) {
        let columns = networks.sizes[0] - from;
        multiply(&gradient.view, &self.delta[0].all.view, &networks.first.narrow(1, from as i64, columns as i64));
    }
}

/// `out = a b`.
fn multiply(out: &Tensor, a: &Tensor, b: &Tensor) {
    let _ = a.mm_out(out, b);
}

wide! {
    fn add_bias(x: &mut [f32], bias: &[f32]) {
        for row in x.chunks_exact_mut(bias.len()) {
            for (x, b) in row.iter_mut().zip(bias) {
                *x += b;
            }
        }
    }

    fn add_bias_relu(x: &mut [f32], bias: &[f32]) {
        for row in x.chunks_exact_mut(bias.len()) {
            for (x, b) in row.iter_mut().zip(bias) {
                *x = (*x + b).max(0.0);
            }
        }
    }

    fn relu(x: &mut [f32]) {
        for x in x {
            *x = x.max(0.0);
        }
    }

    /// Sets the derivative to zero where the ReLU's output is zero.
    fn mask_relu(delta: &mut [f32], output: &[f32]) {
        for (d, &y) in delta.iter_mut().zip(output) {
            *d = if y > 0.0 { *d } else { 0.0 };
        }
    }

    fn sum_rows(x: &[f32], sum: &mut [f32]) {
        sum.fill(0.0);
        for row in x.chunks_exact(sum.len()) {
            for (s, x) in sum.iter_mut().zip(row) {
                *s += x;
            }
        }
    }
}
