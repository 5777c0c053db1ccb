//! Multi-layer perceptrons whose weights lie in one flat vector, so that Adam, the move of the targets and the files each handle a single
//! vector.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tch::Tensor;

use crate::buffer::Buffer;

/// The weights of one layer of one network, `y = x W^T + b`. Both tensors are views into the flat vector.
#[derive(Debug)]
pub(crate) struct Layer {
    /// `(out, in)`, as in PyTorch.
    pub weight: Tensor,
    /// `(in, out)`.
    pub transposed: Tensor,
}

/// One or more equally shaped perceptrons with ReLU between the layers: the actor, or the twin critics.
///
/// Order of the flat vector: layer by layer; in a layer first the weights of every network, then the biases of every network. The first
/// layers of twins are thus one matrix of twice the height: both see the same input.
#[derive(Debug)]
pub(crate) struct Networks {
    names: Vec<&'static str>,
    /// Input, hidden and output sizes.
    pub sizes: Vec<usize>,
    pub values: Buffer,
    /// `layers[network][layer]`.
    pub layers: Vec<Vec<Layer>>,
    /// The first layer's weights of all networks, `(networks * first hidden, input)`.
    pub first: Tensor,
    /// `(input, networks * first hidden)`.
    pub first_transposed: Tensor,
}

/// Where a weight or bias lies in the flat vector.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Entry {
    /// Such as `critic_1.0.weight`. Layers are numbered 0, 2, 4, ... as in a PyTorch `Sequential` with a ReLU between two of them.
    pub name: String,
    pub offset: usize,
    pub shape: Vec<usize>,
}

impl Entry {
    pub fn range(&self) -> std::ops::Range<usize> {
        self.offset..self.offset + self.shape.iter().product::<usize>()
    }
}

impl Networks {
    /// Networks of the given names and sizes, all parameters zero.
    pub fn zeros(names: &[&'static str], sizes: &[usize]) -> Self {
        let len = names.len() * sizes.windows(2).map(|s| (s[0] + 1) * s[1]).sum::<usize>();
        Self::with_values(names, sizes, Buffer::zeros(len))
    }

    /// Networks of the given names and sizes with these parameters, in the order of their [`entries`].
    pub fn with_values(names: &[&'static str], sizes: &[usize], values: Buffer) -> Self {
        let entries = entries(names, sizes);
        let view = |name: String| {
            let entry = entries.iter().find(|e| e.name == name).expect("every layer has a weight");
            values.view(entry.offset, &entry.shape)
        };
        let layer = |name: &str, i: usize| {
            let weight = view(entry_name(name, i, "weight"));
            Layer { transposed: weight.tr(), weight }
        };
        let layers = names.iter().map(|name| (0..sizes.len() - 1).map(|i| layer(name, i)).collect()).collect();
        let first = values.view(0, &[names.len() * sizes[1], sizes[0]]);
        Self { names: names.to_vec(), sizes: sizes.to_vec(), values, layers, first_transposed: first.tr(), first }
    }

    /// Orthogonal weights, biases zero (as in pytorch_sac).
    pub fn initialise(&mut self, rng: &mut ChaCha8Rng) {
        self.values.fill(0.0);
        for entry in self.entries() {
            if let [rows, columns] = entry.shape[..] {
                self.values[entry.range()].copy_from_slice(&orthogonal(rows, columns, rng));
            }
        }
    }

    /// Every weight and bias, in the order of the flat vector.
    pub fn entries(&self) -> Vec<Entry> {
        entries(&self.names, &self.sizes)
    }

    /// Range of the biases of `layer` in the flat vector: those of all networks, one after the other.
    pub fn biases(&self, layer: usize) -> std::ops::Range<usize> {
        let end = self.names.len() * self.sizes[..layer + 2].windows(2).map(|s| (s[0] + 1) * s[1]).sum::<usize>();
        end - self.names.len() * self.sizes[layer + 1]..end
    }
}

fn entry_name(network: &str, layer: usize, kind: &str) -> String {
    format!("{network}.{}.{kind}", 2 * layer)
}

/// Every weight and bias of networks of these names and sizes, in the order of the flat vector.
pub(crate) fn entries(names: &[&str], sizes: &[usize]) -> Vec<Entry> {
    let mut entries = Vec::new();
    let mut offset = 0;
    for (layer, size) in sizes.windows(2).enumerate() {
        for (kind, shape) in [("weight", vec![size[1], size[0]]), ("bias", vec![size[1]])] {
            for network in names {
                let entry = Entry { name: entry_name(network, layer, kind), offset, shape: shape.clone() };
                offset = entry.range().end;
                entries.push(entry);
            }
        }
    }
    entries
}

impl Clone for Networks {
    fn clone(&self) -> Self {
        Self::with_values(&self.names, &self.sizes, self.values.clone())
    }
}

/// A random matrix with orthonormal rows or columns, whichever are fewer; row-major (Saxe et al., 2014).
fn orthogonal(rows: usize, columns: usize, rng: &mut ChaCha8Rng) -> Vec<f32> {
    let (long, short) = (rows.max(columns), rows.min(columns));
    let normal: Vec<f32> = StandardNormal.sample_iter(rng).take(long * short).collect();
    let (q, r) = Tensor::linalg_qr(&Tensor::from_slice(&normal).view([long as i64, short as i64]), "reduced");
    // The signs of R make the distribution uniform.
    let q = q * r.diagonal(0, 0, 1).sign();
    let q = if rows < columns { q.tr() } else { q }.contiguous();
    Vec::try_from(q.view(-1)).expect("f32")
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;
    use crate::pass::Pass;

    #[test]
    fn orthogonal_rows_or_columns() {
        for (rows, columns) in [(3, 7), (7, 3), (4, 4)] {
            let w = Tensor::from_slice(&orthogonal(rows, columns, &mut ChaCha8Rng::seed_from_u64(1)))
                .view([rows as i64, columns as i64]);
            let gram = if rows < columns { w.matmul(&w.tr()) } else { w.tr().matmul(&w) };
            let error = (gram - Tensor::eye(rows.min(columns) as i64, tch::kind::FLOAT_CPU)).abs().max();
            assert!(f64::try_from(error).unwrap() < 1e-6);
        }
    }

    #[test]
    fn twins_lie_layer_by_layer() {
        let twins = Networks::zeros(&["a", "b"], &[3, 2, 1]);
        let names: Vec<String> = twins.entries().iter().map(|e| format!("{} {}", e.name, e.offset)).collect();
        let expected = [
            "a.0.weight 0",
            "b.0.weight 6",
            "a.0.bias 12",
            "b.0.bias 14",
            "a.2.weight 16",
            "b.2.weight 18",
            "a.2.bias 20",
            "b.2.bias 21",
        ];
        assert_eq!(names, expected);
        assert_eq!(twins.values.len(), 22);
        assert_eq!((twins.biases(0), twins.biases(1)), (12..16, 20..22));
    }

    #[test]
    fn forward_by_hand() {
        let mut net = Networks::zeros(&["n"], &[2, 2, 1]);
        // Hidden: relu(x0 - x1 + 1), relu(x1 - 10); output: 3 h0 + 5 h1 - 2.
        net.values.copy_from_slice(&[1.0, -1.0, 0.0, 1.0, 1.0, -10.0, 3.0, 5.0, -2.0]);
        let mut pass = Pass::new(&net, 2, false);
        pass.forward(&net, &Tensor::from_slice(&[2.0f32, 1.0, 0.0, 20.0]).view([2, 2]));
        assert_eq!(pass.result(), [4.0, 48.0]);
    }
}
