//! The perceptron in burn, and the gradient of a loss.

use burn::tensor::{Device, Tensor, TensorData};
use rayon::prelude::*;

use super::subject::Subject;

/// Samples whose gradient is computed in one piece; sums run over pieces in their order.
const CHUNK: usize = 256;

/// Mean loss of a batch and its gradient by the parameters.
pub(super) fn gradient<S: Subject>(
    sizes: &[[usize; 2]],
    parameters: &[f32],
    batch: &[&S::Sample],
    device: &Device,
) -> (f64, Vec<f32>) {
    let parts: Vec<(f64, Vec<f32>)> =
        batch.par_chunks(CHUNK).map(|chunk| part::<S>(sizes, parameters, chunk, batch.len(), device)).collect();
    let mut sum = vec![0.0; parameters.len()];
    let mut loss = 0.0;
    for (own, gradient) in parts {
        loss += own;
        sum.iter_mut().zip(gradient).for_each(|(sum, own)| *sum += own);
    }
    (loss, sum)
}

fn part<S: Subject>(
    sizes: &[[usize; 2]],
    parameters: &[f32],
    chunk: &[&S::Sample],
    batch: usize,
    device: &Device,
) -> (f64, Vec<f32>) {
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
    let mut x = tensor(chunk.iter().flat_map(|own| S::inputs(own).iter().copied()).collect(), S::INPUTS);
    for (k, [weight, bias]) in layers.iter().enumerate() {
        if k > 0 {
            x = x.clone() * (x.clone() / (x.clone() * x + 1.0).sqrt() + 1.0) * 0.5;
        }
        x = x.matmul(weight.clone()) + bias.clone();
    }
    let loss = S::loss(x, chunk, &tensor).sum() / batch as f32;
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
