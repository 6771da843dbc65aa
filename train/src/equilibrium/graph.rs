//! A network on a graph: nodes with the same weights, each of which hears of all others in turns, in every layer.
//!
//! Nodes stand in a ring. What a node says changes with the ring's turn as what it hears does, so that the turns of a star's
//! arms need not be learned. Multiplied out, such a network is a perceptron whose matrices have circulant blocks, and that is what
//! is written down and evaluated.

use burn::tensor::Tensor;

use super::subject::Make;

/// A matrix of numbers in rows.
pub(crate) type Rows = Vec<Vec<f32>>;

/// How a network's inputs become those of the nodes, and the nodes' outputs the network's.
#[derive(Clone, Debug)]
pub(crate) struct Graph {
    /// Of each node [inputs of the network, inputs of a node].
    pub(crate) inputs: Vec<Rows>,
    /// Of each node [outputs of a node, outputs of the network].
    pub(crate) outputs: Vec<Rows>,
}

impl Graph {
    fn nodes(&self) -> usize {
        self.inputs.len()
    }

    /// Sizes of the shared layers for inner layers of this size, all nodes together: what a node hears, and what it says.
    pub(crate) fn layers(&self, inner: &[usize]) -> Vec<[usize; 2]> {
        let nodes = self.nodes();
        let inner = inner.iter().map(|size| (size / nodes).max(1));
        let sizes: Vec<usize> =
            std::iter::once(self.inputs[0][0].len()).chain(inner).chain([self.outputs[0].len()]).collect();
        sizes.windows(2).map(|pair| [nodes * pair[0], pair[1]]).collect()
    }

    /// The nodes' inputs, node after node [nodes x samples, inputs of a node], from the network's [samples, inputs].
    pub(crate) fn spread(&self, x: Tensor<2>, tensor: Make<'_>) -> Tensor<2> {
        Tensor::cat(self.inputs.iter().map(|own| x.clone().matmul(as_tensor(own, tensor))).collect(), 0)
    }

    /// What each node hears: its own, then that of the next ones.
    pub(crate) fn hear(&self, x: Tensor<2>) -> Tensor<2> {
        let [all, columns] = x.dims();
        let samples = all / self.nodes();
        let turned = |by: usize| {
            let [first, last] = [0..by * samples, by * samples..all];
            let parts = [last, first].into_iter().filter(|rows| !rows.is_empty());
            Tensor::cat(parts.map(|rows| x.clone().slice([rows, 0..columns])).collect(), 0)
        };
        Tensor::cat((0..self.nodes()).map(turned).collect(), 1)
    }

    /// The network's outputs [samples, outputs] from the nodes'.
    pub(crate) fn gather(&self, x: Tensor<2>, tensor: Make<'_>) -> Tensor<2> {
        let [all, columns] = x.dims();
        let samples = all / self.nodes();
        let of = |(k, own): (usize, &Rows)| {
            x.clone().slice([k * samples..(k + 1) * samples, 0..columns]).matmul(as_tensor(own, tensor))
        };
        self.outputs.iter().enumerate().map(of).reduce(|sum, own| sum + own).unwrap_or(x.clone())
    }

    /// Sizes and parameters of the perceptron that this network is.
    pub(crate) fn multiplied_out(&self, sizes: &[[usize; 2]], parameters: &[f32]) -> (Vec<[usize; 2]>, Vec<f32>) {
        let nodes = self.nodes();
        let (mut dense, mut all) = (Vec::new(), Vec::new());
        let mut rest = parameters;
        for (layer, &[heard, said]) in sizes.iter().enumerate() {
            let (own, after) = rest.split_at((heard + 1) * said);
            rest = after;
            let inputs = heard / nodes;
            let mut matrix: Rows = vec![vec![0.0; nodes * said]; nodes * inputs + 1];
            for (from, to) in (0..nodes).flat_map(|from| (0..nodes).map(move |to| (from, to))) {
                let by = (from + nodes - to) % nodes;
                for i in 0..inputs {
                    let row = (by * inputs + i) * said;
                    matrix[from * inputs + i][to * said..(to + 1) * said].copy_from_slice(&own[row..row + said]);
                }
            }
            let biases = matrix.len() - 1;
            (0..nodes).for_each(|k| matrix[biases][k * said..(k + 1) * said].copy_from_slice(&own[heard * said..]));
            if layer == 0 {
                let bias = matrix.pop().unwrap_or_default();
                matrix = product(&beside(&self.inputs), &matrix);
                matrix.push(bias);
            }
            if layer + 1 == sizes.len() {
                matrix = product(&matrix, &self.outputs.concat());
            }
            dense.push([matrix.len() - 1, matrix[0].len()]);
            all.extend(matrix.into_iter().flatten());
        }
        (dense, all)
    }
}

fn as_tensor(own: &Rows, tensor: Make<'_>) -> Tensor<2> {
    tensor(own.concat(), own[0].len())
}

/// Matrices of as many rows beside each other.
fn beside(all: &[Rows]) -> Rows {
    (0..all[0].len()).map(|row| all.iter().flat_map(|own| own[row].iter().copied()).collect()).collect()
}

fn product(a: &Rows, b: &Rows) -> Rows {
    let row = |own: &Vec<f32>| {
        let mut sums = vec![0.0; b[0].len()];
        for (x, other) in own.iter().zip(b) {
            sums.iter_mut().zip(other).for_each(|(sum, y)| *sum += x * y);
        }
        sums
    };
    a.iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use burn::tensor::{Device, TensorData};
    use equilibria::network::Perceptron;

    use super::*;

    /// Three nodes with two inputs and one output each, in their order.
    fn ring() -> Graph {
        let unit = |rows: usize, columns: usize, at: [usize; 2], count: usize| {
            let mut matrix = vec![vec![0.0; columns]; rows];
            (0..count).for_each(|k| matrix[at[0] + k][at[1] + k] = 1.0);
            matrix
        };
        Graph {
            inputs: (0..3).map(|k| unit(6, 2, [2 * k, 0], 2)).collect(),
            outputs: (0..3).map(|k| unit(1, 3, [0, k], 1)).collect(),
        }
    }

    /// Multiplied out it says what the nodes say, and nodes that change places in the ring say the same in their new ones.
    #[test]
    fn multiplied_out_it_is_the_same_network() {
        let graph = ring();
        let sizes = graph.layers(&[9]);
        assert_eq!(sizes, [[6, 3], [9, 1]]);
        let count = sizes.iter().map(|[heard, said]| (heard + 1) * said).sum::<usize>();
        let parameters: Vec<f32> = (0..count).map(|k| (1.7 * k as f32).sin()).collect();
        let inputs: Vec<f32> = (0..6).map(|k| (0.6 * k as f32).cos()).collect();
        let device = Device::default();
        let tensor = |values: Vec<f32>, columns: usize| {
            let rows = values.len() / columns;
            Tensor::<2>::from_data(TensorData::new(values, [rows, columns]), &device)
        };
        let mut x = graph.spread(tensor(inputs.clone(), 6), &tensor);
        let mut rest = &parameters[..];
        for (k, &[heard, said]) in sizes.iter().enumerate() {
            if k > 0 {
                x = x.clone() * (x.clone() / (x.clone() * x + 1.0).sqrt() + 1.0) * 0.5;
            }
            let (weights, after) = rest.split_at(heard * said);
            let (biases, after) = after.split_at(said);
            rest = after;
            x = graph.hear(x).matmul(tensor(weights.to_vec(), said)) + tensor(biases.to_vec(), said);
        }
        let expected: Vec<f32> = graph.gather(x, &tensor).into_data().iter::<f32>().collect();
        let (dense, all) = graph.multiplied_out(&sizes, &parameters);
        let perceptron = Perceptron::new(&dense, &all).unwrap();
        let said = |inputs: &[f32]| {
            let mut outputs = [0.0; 3];
            perceptron.evaluate(inputs, &mut outputs);
            outputs
        };
        let own = said(&inputs);
        for (a, b) in own.iter().zip(&expected) {
            assert!((a - b).abs() < 1e-5, "{own:?} {expected:?}");
        }
        let turned = said(&[&inputs[2..], &inputs[..2]].concat());
        for k in 0..3 {
            assert!((turned[k] - own[(k + 1) % 3]).abs() < 1e-5, "{own:?} {turned:?}");
        }
    }
}
