//! Time of the forward pass on one core, beside the core's peak.

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use copingnet::inference::{Forward, Packed};
use copingnet::{NetworkConfig, Weights};
use graph::{Batch, Graph};
use nalgebra::Vector3;
use pulp::{Arch, Simd, WithSimd};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rod::{Assembly, Material, RodSpec, shape};

fn main() {
    let peak = peak();
    println!("peak of fused multiply-adds: {peak:.1} GFLOP/s");
    println!("width blocks     N   us/forward   us/node   GFLOP/s   of peak");
    for (width, gn_blocks) in [(8, 1), (16, 1), (16, 2), (16, 3), (32, 3), (64, 3)] {
        let config = NetworkConfig { width, gn_blocks, ..NetworkConfig::default() };
        let packed = Arc::new(Packed::new(&weights(config)));
        for n in [10, 30, 100, 300, 1061] {
            let seconds = time(&packed, n, 1);
            let rate = 1e-9 * flops(&config, n, n - 1) / seconds;
            let (us, share) = (1e6 * seconds, 100.0 * rate / peak);
            let per_node = us / n as f64;
            println!("{width:5} {gn_blocks:6} {n:5} {us:12.2} {per_node:9.3} {rate:9.1} {share:7.1} %");
        }
        let us = 1e6 * time(&packed, 30, 64) / 64.0;
        println!("{width:5} {gn_blocks:6}    30 {us:12.2} in a batch of 64");
    }
}

/// Median time of a pass over chains of `n` nodes [s].
fn time(packed: &Arc<Packed>, n: usize, chains: usize) -> f64 {
    let mut batch = Batch::default();
    let graph = chain(n);
    for _ in 0..chains {
        batch.push(&graph);
    }
    let config = packed.config();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut random = |count: usize| -> Vec<f32> { (0..count).map(|_| rng.random_range(-1.0..1.0)).collect() };
    let (nodes, edges) = (batch.nodes(), batch.edges());
    let constant_nodes = random(nodes * config.constant_node_inputs);
    let constant_edges = random(edges * config.constant_edge_inputs);
    let changing_nodes = random(nodes * (config.node_inputs - config.constant_node_inputs));
    let changing_edges = random(edges * (config.edge_inputs - config.constant_edge_inputs));
    let mut forward = Forward::new(packed.clone(), &batch, &constant_nodes, &constant_edges);
    let repeats = 1 + 10_000 / nodes;
    median(51, || {
        for _ in 0..repeats {
            forward.run(black_box(&changing_nodes), black_box(&changing_edges));
            black_box(forward.edge_outputs());
        }
    }) / repeats as f64
}

fn median(count: usize, mut run: impl FnMut()) -> f64 {
    run();
    let timed = |_| {
        let begin = Instant::now();
        run();
        begin.elapsed().as_secs_f64()
    };
    let mut times: Vec<f64> = (0..count).map(timed).collect();
    times.sort_by(f64::total_cmp);
    times[count / 2]
}

fn weights(config: NetworkConfig) -> Weights {
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let mut weights = Weights::zeros(config);
    for (spec, values) in weights.tensors_mut() {
        let bound = 1.0 / (spec.shape[0] as f32).sqrt();
        values.iter_mut().for_each(|x| *x = rng.random_range(-bound..bound));
    }
    weights
}

/// Floating-point operations of the matrix products that a pass does, without what constant inputs save.
fn flops(config: &NetworkConfig, nodes: usize, edges: usize) -> f64 {
    let perceptron = |inputs, outputs| config.mlp(inputs, outputs).iter().map(|[i, o]| 2 * i * o).sum::<usize>();
    let (l, h) = (config.width, 2 * config.scans);
    let of_node = perceptron(config.node_inputs - config.constant_node_inputs, l)
        + config.gn_blocks * (2 * l * h + perceptron(3 * l + h, l))
        + perceptron(l, config.node_outputs);
    let of_edge = if config.has_constant_edges() {
        config.gn_blocks * perceptron(3 * l, l) - 2 * l * l * config.gn_blocks.min(1)
    } else {
        perceptron(config.edge_inputs - config.constant_edge_inputs, l) + config.gn_blocks * perceptron(3 * l, l)
    } + perceptron(l, config.edge_outputs);
    (nodes * of_node + edges * of_edge) as f64
}

/// Rate of fused multiply-adds in registers on this core [GFLOP/s].
fn peak() -> f64 {
    struct Peak(usize);
    impl WithSimd for Peak {
        type Output = usize;
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> usize {
            let mut sums = [simd.splat_f32s(black_box(1.0)); 12];
            let (x, y) = (simd.splat_f32s(black_box(0.5)), simd.splat_f32s(black_box(0.25)));
            for _ in 0..self.0 {
                for sum in &mut sums {
                    *sum = simd.mul_add_e_f32s(x, *sum, y);
                }
            }
            black_box(sums);
            2 * sums.len() * S::F32_LANES
        }
    }
    const ROUNDS: usize = 200_000;
    let mut operations = 0;
    let seconds = median(51, || operations = Arch::new().dispatch(Peak(ROUNDS)));
    1e-9 * (operations * ROUNDS) as f64 / seconds
}

/// A rod of `n` segments, its first one fixed.
fn chain(n: usize) -> Graph {
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let material = Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };
    let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 3.0, n);
    let rod = assembly.rod(&RodSpec::new(nodes, 0.05, material));
    assembly.fix(rod.start);
    let (model, _) = assembly.finish();
    let (members, topology) = solver::component::split(&model).swap_remove(0);
    Graph::new(&model, &members, &topology)
}
