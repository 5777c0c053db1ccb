//! Forward and backward pass of [`Networks`], written out: libtorch multiplies matrices, loops here do the rest, in memory made once.
//!
//! Autograd would do the same products, and besides them the gradients that nobody asks for, with a new tensor for every step between.
//! The tests hold this file against it.

use tch::Tensor;

use crate::buffer::Buffer;
use crate::layer_norm::LayerNorm;
use crate::network::Networks;

/// Memory for one batch on its way through the networks and, if it has one, back.
#[derive(Debug)]
pub(crate) struct Pass {
    networks: usize,
    rows: usize,
    /// Numbers per row and layer: output size times number of networks, which lie side by side.
    widths: Vec<usize>,
    /// Output of each layer, after the ReLU, `(rows, width)`.
    output: Vec<Buffer>,
    /// Derivative of the loss by the product and bias of each layer, `(rows, width)`; empty without a way back.
    delta: Vec<Buffer>,
    /// Between bias and ReLU of each hidden layer; empty without.
    norms: Vec<LayerNorm>,
}

impl Pass {
    /// For batches of `rows`; without `back` there is only the way forward.
    pub fn new(networks: &Networks, rows: usize, back: bool) -> Self {
        let widths: Vec<usize> = networks.sizes[1..].iter().map(|size| size * networks.layers.len()).collect();
        let buffers = || widths.iter().map(|width| Buffer::zeros(rows * width)).collect();
        Self {
            networks: networks.layers.len(),
            rows,
            output: buffers(),
            delta: if back { buffers() } else { vec![] },
            norms: vec![],
            widths,
        }
    }

    /// The same with layer normalisation in every hidden layer.
    pub fn normalised(mut self, networks: &Networks) -> Self {
        let hidden = &networks.sizes[1..networks.sizes.len() - 1];
        self.norms = hidden.iter().map(|&size| LayerNorm::new(self.rows * self.networks, size)).collect();
        self
    }

    /// Computes the outputs of every network for `input` `(rows, input)`.
    pub fn forward(&mut self, networks: &Networks, input: &Tensor) {
        for layer in 0..self.widths.len() {
            if layer == 0 {
                // Every network sees the same input: one product for all of them.
                multiply(&self.all(&self.output, 0), input, &networks.first.tr());
            } else {
                for (k, layers) in networks.layers.iter().enumerate() {
                    let x = self.one(&self.output, layer - 1, k);
                    multiply(&self.one(&self.output, layer, k), &x, &layers[layer].weight.tr());
                }
            }
            let bias = &networks.values[networks.biases(layer)];
            if layer + 1 == self.widths.len() {
                add_bias(&mut self.output[layer], bias)
            } else if let Some(norm) = self.norms.get_mut(layer) {
                add_bias(&mut self.output[layer], bias);
                norm.forward(&mut self.output[layer]);
                relu(&mut self.output[layer]);
            } else {
                add_bias_relu(&mut self.output[layer], bias)
            }
        }
    }

    /// Outputs of the last layer, `(rows, networks * output)`.
    pub fn result(&self) -> &[f32] {
        self.output.last().expect("at least one layer")
    }

    /// [`Pass::result`], and where the derivative of the loss by it is to be written before [`Pass::backward`].
    pub fn result_and_gradient(&mut self) -> (&[f32], &mut [f32]) {
        let (result, gradient) = (self.output.last(), self.delta.last_mut());
        (result.expect("at least one layer"), gradient.expect("a way back"))
    }

    /// Carries the derivative of the loss from the result back to the first layer.
    pub fn backward(&mut self, networks: &Networks) {
        for layer in (1..self.widths.len()).rev() {
            for (k, layers) in networks.layers.iter().enumerate() {
                let delta = self.one(&self.delta, layer, k);
                multiply(&self.one(&self.delta, layer - 1, k), &delta, &layers[layer].weight);
            }
            mask_relu(&mut self.delta[layer - 1], &self.output[layer - 1]);
            if let Some(norm) = self.norms.get(layer - 1) {
                norm.backward(&mut self.delta[layer - 1]);
            }
        }
    }

    /// After [`Pass::backward`]: the derivative by every weight and bias, for the `input` of the way forward.
    pub fn parameter_gradient(&self, input: &Tensor, gradient: &mut Networks) {
        multiply(&gradient.first, &self.all(&self.delta, 0).tr(), input);
        for layer in 0..self.widths.len() {
            if layer > 0 {
                for (k, layers) in gradient.layers.iter().enumerate() {
                    let delta = self.one(&self.delta, layer, k);
                    multiply(&layers[layer].weight, &delta.tr(), &self.one(&self.output, layer - 1, k));
                }
            }
            let biases = gradient.biases(layer);
            sum_rows(&self.delta[layer], &mut gradient.values[biases]);
        }
    }

    /// After [`Pass::backward`]: the derivative by the inputs from column `from` on, summed over the networks, `(rows, input - from)`.
    pub fn input_gradient(&self, networks: &Networks, from: usize, gradient: &mut Buffer) {
        let columns = networks.sizes[0] - from;
        let weights = networks.first.narrow(1, from as i64, columns as i64);
        multiply(&gradient.view(0, &[self.rows, columns]), &self.all(&self.delta, 0), &weights);
    }

    /// All networks in `layer`, `(rows, width)`.
    fn all(&self, buffers: &[Buffer], layer: usize) -> Tensor {
        buffers[layer].view(0, &[self.rows, self.widths[layer]])
    }

    /// Network `k` in `layer`, `(rows, size)`.
    fn one(&self, buffers: &[Buffer], layer: usize, k: usize) -> Tensor {
        let size = (self.widths[layer] / self.networks) as i64;
        self.all(buffers, layer).narrow(1, k as i64 * size, size)
    }
}

/// `out = a b`.
fn multiply(out: &Tensor, a: &Tensor, b: &Tensor) {
    let _ = a.mm_out(out, b);
}

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

/// Zero where the ReLU was closed.
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
