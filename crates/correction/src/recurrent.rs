//! A recurrent network: gated recurrent units (Cho et al. 2014) between a layer that reads and two that say.

use burn::module::{Module, Param};
use burn::nn::Linear;
use burn::tensor::{Device, Tensor, TensorData, activation};
use copingnet::parameters::set;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Sizes of a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sizes {
    /// Numbers of a frame.
    pub(crate) inputs: usize,
    /// Numbers that are remembered, and width of all layers.
    pub(crate) width: usize,
    /// Numbers that are said of a frame.
    pub(crate) outputs: usize,
}

impl Sizes {
    /// Inputs and outputs of the layers, in the order of [`Recurrent`].
    fn layers(&self) -> [[usize; 2]; 5] {
        let Self { inputs, width, outputs } = *self;
        [[inputs, width], [width, 3 * width], [width, 3 * width], [width, width], [width, outputs]]
    }

    /// Number of parameters.
    pub(crate) fn parameters(&self) -> usize {
        self.layers().iter().map(|[inputs, outputs]| (inputs + 1) * outputs).sum()
    }

    /// Random parameters, the same for a seed on every machine: uniform in +/- 1 / sqrt(inputs).
    pub(crate) fn random(&self, seed: u64) -> Vec<f32> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut all = Vec::with_capacity(self.parameters());
        for [inputs, outputs] in self.layers() {
            let bound = 1.0 / (inputs as f32).sqrt();
            all.extend((0..(inputs + 1) * outputs).map(|_| random.random_range(-bound..=bound)));
        }
        all
    }

    /// The network with these parameters.
    pub(crate) fn network(&self, parameters: &[f32], device: &Device) -> Recurrent {
        let [read, input, memory, hidden, say] = self.layers().map(|[inputs, outputs]| Linear {
            weight: Param::from_tensor(Tensor::zeros([inputs, outputs], device)),
            bias: Some(Param::from_tensor(Tensor::zeros([outputs], device))),
        });
        set(Recurrent { read, input, memory, hidden, say }, parameters)
    }
}

/// The network: of a frame x and what is remembered, h, it makes
///
/// ```text
/// u = relu(read x)
/// [r, z, n] = sigmoid, sigmoid, tanh of input u + memory h, the last with r (memory h)
/// h <- (1 - z) n + z h                                             zeros at first
/// y = tanh(say relu(hidden h))
/// ```
#[derive(Module, Debug)]
pub(crate) struct Recurrent {
    read: Linear,
    input: Linear,
    memory: Linear,
    hidden: Linear,
    say: Linear,
}

impl Recurrent {
    /// What is said of rows of frames: `frames` has, for each frame of all rows, its numbers `[rows, inputs]`. Returned are
    /// `[rows frames, outputs]`, row by row.
    pub(crate) fn forward(&self, frames: impl Iterator<Item = Vec<f32>>, rows: usize, to: &Device) -> Tensor<2> {
        let [_, triple] = self.input.weight.dims();
        let width = triple / 3;
        let mut h = Tensor::zeros([rows, width], to);
        let mut all = Vec::new();
        for frame in frames {
            let columns = frame.len() / rows;
            let x = Tensor::<2>::from_data(TensorData::new(frame, [rows, columns]), to);
            let seen = self.input.forward(activation::relu(self.read.forward(x)));
            let known = self.memory.forward(h.clone());
            let part = |of: &Tensor<2>, k: usize| of.clone().slice([0..rows, k * width..(k + 1) * width]);
            let r = activation::sigmoid(part(&seen, 0) + part(&known, 0));
            let z = activation::sigmoid(part(&seen, 1) + part(&known, 1));
            let n = (part(&seen, 2) + r * part(&known, 2)).tanh();
            h = n.clone() + z * (h - n);
            all.push(h.clone());
        }
        let count = all.len();
        let h = Tensor::stack::<3>(all, 1).reshape([rows * count, width]);
        self.say.forward(activation::relu(self.hidden.forward(h))).tanh()
    }
}
