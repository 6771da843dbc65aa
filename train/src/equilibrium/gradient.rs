//! The perceptron in burn, its loss, and the gradient.

use burn::tensor::{Device, Tensor, TensorData, activation};
use equilibria::canonical::INPUTS;
use equilibria::learned::{MODES, OUTPUTS};
use rayon::prelude::*;

use super::data::Sample;

/// Samples whose gradient is computed in one piece; sums run over pieces in their order.
const CHUNK: usize = 256;
/// Weights of the force's error and of the likelihood's cross entropy against the error of the turns.
const OF_FORCE: f32 = 0.1;
const OF_CLASS: f32 = 0.1;
/// Error below which the root is a square [rad].
const SMALL: f32 = 0.02;
/// By how much faster modes weigh more: their share of the slope.
const SLOPE: f32 = 0.02;

/// Loss of a batch and its gradient by the parameters.
///
/// A sample's loss is the root of its mean squared error of turns [rad], that of the force, and the cross entropy of the class.
pub(super) fn gradient(
    sizes: &[[usize; 2]],
    parameters: &[f32],
    batch: &[&Sample],
    device: &Device,
) -> (f64, Vec<f32>) {
    let parts: Vec<(f64, Vec<f32>)> =
        batch.par_chunks(CHUNK).map(|chunk| part(sizes, parameters, chunk, batch.len(), device)).collect();
    let mut sum = vec![0.0; parameters.len()];
    let mut loss = 0.0;
    for (own, gradient) in parts {
        loss += own;
        sum.iter_mut().zip(gradient).for_each(|(sum, own)| *sum += own);
    }
    (loss, sum)
}

fn part(sizes: &[[usize; 2]], parameters: &[f32], chunk: &[&Sample], batch: usize, device: &Device) -> (f64, Vec<f32>) {
    let tensor = |values: Vec<f32>, columns: usize| {
        let rows = values.len() / columns;
        Tensor::<2>::from_data(TensorData::new(values, [rows, columns]), device)
    };
    let mut rest = parameters;
    let mut take = |rows: usize, columns: usize| {
        let (own, after) = rest.split_at(rows * columns);
        rest = after;
        tensor(own.to_vec(), columns).require_grad()
    };
    let layers: Vec<[Tensor<2>; 2]> = sizes.iter().map(|&[i, o]| [take(i, o), take(1, o)]).collect();
    let mut x = tensor(chunk.iter().flat_map(|own| own.inputs).collect(), INPUTS);
    for (k, [weight, bias]) in layers.iter().enumerate() {
        if k > 0 {
            x = x.clone() * (x.clone() / (x.clone() * x + 1.0).sqrt() + 1.0) * 0.5;
        }
        x = x.matmul(weight.clone()) + bias.clone();
    }
    let rows = chunk.len();
    let targets = chunk.iter().flat_map(|own| own.targets.unwrap_or([0.0; OUTPUTS - 1])).collect();
    let targets = tensor(targets, OUTPUTS - 1);
    let known = tensor(chunk.iter().map(|own| f32::from(u8::from(own.targets.is_some()))).collect(), 1);
    let sign = tensor(chunk.iter().map(|own| if own.is_lowest { -1.0 } else { 1.0 }).collect(), 1);
    // Quaternions turn by twice the angle; a sine's mean square is a half.
    let weight = |k: usize| 2.0 * (1.0 + SLOPE * ((k / 4 + 1) as f32).powi(2));
    let weights = tensor((0..4 * MODES).map(weight).collect(), 4 * MODES);
    let off = x.clone().slice([0..rows, 0..OUTPUTS - 1]) - targets;
    let turns = off.clone().slice([0..rows, 0..4 * MODES]);
    let turns = ((turns.clone() * turns * weights).sum_dim(1) + SMALL * SMALL).sqrt();
    let force = off.slice([0..rows, 4 * MODES..OUTPUTS - 1]);
    let force = ((force.clone() * force).sum_dim(1) + SMALL * SMALL).sqrt();
    let class = activation::softplus(x.slice([0..rows, OUTPUTS - 1..OUTPUTS]) * sign, 1.0);
    let loss = ((turns + force * OF_FORCE) * known + class * OF_CLASS).sum() / batch as f32;
    let value = loss.clone().into_data().iter::<f32>().map(f64::from).sum();
    let gradients = loss.backward();
    let mut all = Vec::with_capacity(parameters.len());
    for parameter in layers.iter().flatten() {
        match parameter.grad(&gradients) {
            Some(own) => all.extend(own.into_data().iter::<f32>()),
            None => all.resize(all.len() + parameter.dims().iter().product::<usize>(), 0.0),
        }
    }
    (value, all)
}
