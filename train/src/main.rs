//! `train`: trains COPINGNet. See `train --help`.

mod adam;
mod objective;
mod samples;

use copingnet::*;
use dataset::*;
use rayon::prelude::*;
use std::time::Instant;

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let backend: Backend = args[1].parse().unwrap();
    let chunk_size: usize = args[2].parse().unwrap();
    let threads: usize = args[3].parse().unwrap();
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().unwrap();
    let dataset = Dataset::open("/tmp/ds-rod").unwrap();
    let mut encoding = Encoding {
        features: Features::Paper,
        head: Head::Full,
        norms: dataset.norms(),
        whitening: Features::Paper.unwhitened(),
    };
    let t = Instant::now();
    encoding.whitening = samples::whitening(&dataset, &encoding, 10);
    println!("whitening {:?}", t.elapsed());
    let t = Instant::now();
    let samples = samples::Samples::new(&dataset, Split::Train, &encoding, 64);
    println!("samples {:?} {}", t.elapsed(), samples.len());
    let config = Features::Paper.configure(Head::Full, NetworkConfig::default());
    let mut weights = Weights::random(config, 0);
    let mut adam = adam::Adam::new(weights.values().len());
    let params = adam::AdamParams { beta_1: 0.9, beta_2: 0.999, clip: f64::INFINITY };
    let device = backend.device().autodiff();
    let order = shuffled(samples.len(), 0, 0);
    let (mut nodes, mut t) = (0, Instant::now());
    for (k, batch) in order.chunks_exact(128).take(25).enumerate() {
        if k == 5 {
            nodes = 0;
            t = Instant::now();
        }
        let chunks: Vec<_> = batch.chunks(chunk_size).map(|c| samples.chunk(c)).collect();
        let n: usize = chunks.iter().map(|c| c.graphs.nodes()).sum();
        let m: usize = chunks.iter().map(|c| c.graphs.edges()).sum();
        nodes += n;
        let results: Vec<(f64, Vec<f32>)> = chunks
            .par_iter()
            .map(|chunk| {
                let network = Network::new(&weights, &device);
                let graph = GraphTensors::new(&chunk.graphs, &chunk.nodes, &chunk.edges, false, &device);
                let (v, e) = network.forward(&graph);
                let (vn, en) = (
                    v.clone().into_data().try_to_vec::<f32>().unwrap(),
                    e.clone().into_data().try_to_vec::<f32>().unwrap(),
                );
                let ev = objective::mean_square(chunk, [&vn, &en], [6 * n, 6 * m]);
                let c = |x: Vec<f32>, rows: usize| {
                    burn::tensor::Tensor::<2>::from_data(burn::tensor::TensorData::new(x, [rows, 6]), &device)
                };
                let l = (v * c(ev.nodes, chunk.graphs.nodes())).sum() + (e * c(ev.edges, chunk.graphs.edges())).sum();
                let g = l.backward();
                (ev.loss, network.gradients(&g))
            })
            .collect();
        let loss: f64 = results.iter().map(|r| r.0).sum();
        let mut grad = results[0].1.clone();
        for r in &results[1..] {
            grad.iter_mut().zip(&r.1).for_each(|(a, b)| *a += b);
        }
        adam.step(&params, 1e-3, &grad, weights.values_mut());
        if k % 8 == 0 {
            println!("{k} {loss}");
        }
    }
    println!("{:.0} nodes/s", nodes as f64 / t.elapsed().as_secs_f64());
}
