//! A small perceptron: its weights, their file, and its evaluation in vector registers.

use std::collections::HashMap;

use cosserat::internals::kernels::dispatch::vectorized;
use export::Tensor;
use safetensors::{Dtype, SafeTensors};
use thiserror::Error;

/// Outputs of a layer that are summed side by side.
const PANEL: usize = 64;
/// Largest size of a layer.
const LARGEST: usize = 256;

/// Linear layers with the activation `x (1 + x / sqrt(1 + x^2)) / 2` between them, in single precision. The same bits on every
/// width of vector registers.
#[derive(Clone, Debug, PartialEq)]
pub struct Perceptron {
    layers: Vec<Layer>,
}

/// Weights in panels of outputs, an input after the other in each; what is missing from the last panel is zero.
#[derive(Clone, Debug, PartialEq)]
struct Layer {
    inputs: usize,
    outputs: usize,
    weights: Vec<[f32; PANEL]>,
    biases: Vec<[f32; PANEL]>,
}

/// Why a file holds no perceptron of these inputs and outputs.
#[derive(Debug, Error)]
#[error("weights of a perceptron: {0}")]
pub struct WeightsError(String);

impl Perceptron {
    /// Sizes of the layers, `[inputs, outputs]` each, of a perceptron with these inner sizes.
    pub fn layers(inputs: usize, inner: &[usize], outputs: usize) -> Vec<[usize; 2]> {
        let sizes: Vec<usize> = std::iter::once(inputs).chain(inner.iter().copied()).chain([outputs]).collect();
        sizes.windows(2).map(|pair| [pair[0], pair[1]]).collect()
    }

    /// Of parameters in a row: of each layer the weights `[inputs, outputs]`, then the biases.
    ///
    /// # Errors
    /// If there are more or fewer, one is not finite, or a layer is larger than 256.
    pub fn new(sizes: &[[usize; 2]], parameters: &[f32]) -> Result<Self, WeightsError> {
        let count: usize = sizes.iter().map(|[inputs, outputs]| (inputs + 1) * outputs).sum();
        if count != parameters.len() {
            return Err(WeightsError(format!("{} numbers, but there must be {count}", parameters.len())));
        }
        if let Some(value) = parameters.iter().find(|x| !x.is_finite()) {
            return Err(WeightsError(format!("{value}, but all must be finite")));
        }
        if let Some([inputs, outputs]) = sizes.iter().find(|size| size.iter().any(|n| !(1..=LARGEST).contains(n))) {
            return Err(WeightsError(format!("a layer of {inputs} x {outputs}, but sizes go from 1 to {LARGEST}")));
        }
        let mut rest = parameters;
        let layers = sizes.iter().map(|&[inputs, outputs]| {
            let (own, after) = rest.split_at((inputs + 1) * outputs);
            rest = after;
            let panels = outputs.div_ceil(PANEL);
            let at = |row: usize, panel: usize| {
                std::array::from_fn(|k| {
                    let column = panel * PANEL + k;
                    if column < outputs { own[row * outputs + column] } else { 0.0 }
                })
            };
            let weights = (0..panels).flat_map(|panel| (0..inputs).map(move |row| (row, panel)));
            Layer {
                inputs,
                outputs,
                weights: weights.map(|(row, panel)| at(row, panel)).collect(),
                biases: (0..panels).map(|panel| at(inputs, panel)).collect(),
            }
        });
        Ok(Self { layers: layers.collect() })
    }

    /// A safetensors file of a perceptron's parameters: `layer.K.weight` [inputs, outputs] and `layer.K.bias` [outputs], F32, and
    /// in its metadata how they came to be, under `training`.
    pub fn bytes(sizes: &[[usize; 2]], parameters: &[f32], training: &str) -> std::io::Result<Vec<u8>> {
        let mut rest = parameters;
        let mut tensors = Vec::new();
        for (k, &[inputs, outputs]) in sizes.iter().enumerate() {
            for (name, shape) in [("weight", vec![inputs, outputs]), ("bias", vec![outputs])] {
                let (own, after) = rest.split_at(shape.iter().product());
                rest = after;
                let bytes = own.iter().flat_map(|x| x.to_le_bytes()).collect();
                tensors.push((format!("layer.{k}.{name}"), Tensor { dtype: Dtype::F32, shape, bytes }));
            }
        }
        let metadata = HashMap::from([("training".to_owned(), training.to_owned())]);
        safetensors::serialize(tensors.iter().map(|(name, tensor)| (name, tensor)), Some(metadata))
            .map_err(std::io::Error::other)
    }

    /// Reads what [`Self::bytes`] has made.
    ///
    /// # Errors
    /// If it is no such file, or the sizes do not follow each other from `inputs` to `outputs`.
    pub fn from_bytes(bytes: &[u8], inputs: usize, outputs: usize) -> Result<Self, WeightsError> {
        let wrong = |error: safetensors::SafeTensorError| WeightsError(error.to_string());
        let file = SafeTensors::deserialize(bytes).map_err(wrong)?;
        let (mut sizes, mut parameters) = (Vec::new(), Vec::new());
        for k in 0..file.len() / 2 {
            for name in ["weight", "bias"] {
                let name = format!("layer.{k}.{name}");
                let tensor = file.tensor(&name).map_err(wrong)?;
                match (tensor.dtype(), tensor.shape()) {
                    (Dtype::F32, &[rows, columns]) => sizes.push([rows, columns]),
                    (Dtype::F32, &[columns]) if sizes.last().is_some_and(|[_, own]| *own == columns) => {}
                    (dtype, shape) => return Err(WeightsError(format!("{name} is {dtype:?} of {shape:?}"))),
                }
                let numbers = tensor.data().chunks_exact(4).map(|x| f32::from_le_bytes([x[0], x[1], x[2], x[3]]));
                parameters.extend(numbers);
            }
        }
        let follow = sizes.windows(2).all(|pair| pair[0][1] == pair[1][0]);
        let are_ends = sizes.first().is_some_and(|s| s[0] == inputs) && sizes.last().is_some_and(|s| s[1] == outputs);
        if !follow || !are_ends {
            return Err(WeightsError(format!("layers of {sizes:?}, but they must go from {inputs} to {outputs}")));
        }
        Self::new(&sizes, &parameters)
    }

    /// Outputs of rows of inputs: of a row the same alone as among others, which take less time together.
    pub fn evaluate<const I: usize, const O: usize>(&self, inputs: &[[f32; I]]) -> Vec<[f32; O]> {
        let mut outputs = vec![[0.0; O]; inputs.len()];
        let mut at = 0;
        while at < inputs.len() {
            let (inputs, outputs) = (&inputs[at..], &mut outputs[at..]);
            at += match inputs.len() {
                4.. => self.rows::<4, I, O>(inputs, outputs),
                2.. => self.rows::<2, I, O>(inputs, outputs),
                _ => self.rows::<1, I, O>(inputs, outputs),
            };
        }
        outputs
    }

    /// Beside each that is there the outputs of its row of inputs.
    pub(crate) fn evaluate_each<C, const I: usize, const O: usize>(
        &self,
        all: Vec<Option<C>>,
        inputs: impl Fn(&C) -> [f32; I],
    ) -> Vec<Option<(C, [f32; O])>> {
        let rows: Vec<_> = all.iter().flatten().map(inputs).collect();
        let mut outputs = self.evaluate(&rows).into_iter();
        all.into_iter().map(|own| Some((own?, outputs.next()?))).collect()
    }

    /// Those of the first few rows. Returns how many these are.
    fn rows<const ROWS: usize, const I: usize, const O: usize>(
        &self,
        inputs: &[[f32; I]],
        outputs: &mut [[f32; O]],
    ) -> usize {
        let (mut x, mut y) = ([[0.0; LARGEST]; ROWS], [[0.0; LARGEST]; ROWS]);
        for (x, inputs) in x.iter_mut().zip(inputs) {
            x[..I].copy_from_slice(inputs);
        }
        vectorized(
            #[inline(always)]
            || {
                for (k, layer) in self.layers.iter().enumerate() {
                    layer.forward(&x, &mut y, k + 1 < self.layers.len());
                    std::mem::swap(&mut x, &mut y);
                }
            },
        );
        for (x, outputs) in x.iter().zip(outputs) {
            outputs.copy_from_slice(&x[..O]);
        }
        ROWS
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.layers.last().map_or(0, |layer| layer.outputs)
    }
}

impl Layer {
    #[inline(always)]
    fn forward<const ROWS: usize>(&self, x: &[[f32; LARGEST]; ROWS], y: &mut [[f32; LARGEST]; ROWS], is_inner: bool) {
        for (panel, (weights, bias)) in self.weights.chunks_exact(self.inputs).zip(&self.biases).enumerate() {
            let mut sums = [*bias; ROWS];
            for (input, weights) in weights.iter().enumerate() {
                for row in 0..ROWS {
                    let own = x[row][input];
                    for k in 0..PANEL {
                        sums[row][k] += weights[k] * own;
                    }
                }
            }
            for (y, sums) in y.iter_mut().zip(&mut sums) {
                if is_inner {
                    for sum in sums.iter_mut() {
                        *sum *= 0.5 + 0.5 * *sum / (1.0 + *sum * *sum).sqrt();
                    }
                }
                y[panel * PANEL..(panel + 1) * PANEL].copy_from_slice(sums);
            }
        }
    }
}
