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
    println!("width blocks scans      graphs   us a graph   us a node   GFLOP/s   of peak");
    for (width, gn_blocks, scans) in [(8, 1, 0), (16, 1, 0), (16, 2, 0), (32, 3, 0), (32, 3, 8), (64, 3, 0)] {
        let config = NetworkConfig { width, gn_blocks, scans, ..NetworkConfig::default() };
        let packed = Arc::new(Packed::new(&weights(config)));
        let measure = |name: &str, graph: &Graph, count: usize| {
            let mut batch = Batch::default();
            for _ in 0..count {
                batch.push(graph);
            }
            let seconds = time(&packed, &batch);
            let rate = 1e-9 * flops(&config, &batch) / seconds;
            let (us, share) = (1e6 * seconds, 100.0 * rate / peak);
            let (a_graph, a_node) = (us / count as f64, us / batch.nodes() as f64);
            println!(
                "{width:5} {gn_blocks:6} {scans:5} {name:>11} {a_graph:12.2} {a_node:11.3} {rate:9.1} {share:7.1} %"
            );
        };
        for n in [10, 30, 100, 300, 1061] {
            measure(&n.to_string(), &chain(n), 1);
        }
        measure("64 x 30", &chain(30), 64);
        measure("tree 1061", &tree(), 1);
    }
}

/// Median time of a pass over a batch [s].
fn time(packed: &Arc<Packed>, graphs: &Batch) -> f64 {
    let config = packed.config();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut random = |count: usize| -> Vec<f32> { (0..count).map(|_| rng.random_range(-1.0..1.0)).collect() };
    let (n, m) = (graphs.nodes(), graphs.edges());
    let constant_nodes = random(n * config.constant_node_inputs);
    let constant_edges = random(m * config.constant_edge_inputs);
    let nodes = random(n * (config.node_inputs - config.constant_node_inputs));
    let edges = random(m * (config.edge_inputs - config.constant_edge_inputs));
    let mut forward = Forward::new(packed.clone(), graphs, &constant_nodes, &constant_edges);
    let repeats = 1 + 3_000 / n;
    let all = median(101, || {
        for _ in 0..repeats {
            forward.run(black_box(&nodes), black_box(&edges));
            black_box((forward.node_outputs(), forward.edge_outputs()));
        }
    });
    all / repeats as f64
}

/// Median time [s].
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

/// Floating-point operations of the matrix products in a pass; what constant inputs contribute is not among them.
fn flops(config: &NetworkConfig, graphs: &Batch) -> f64 {
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
    (graphs.nodes() * of_node + graphs.edges() * of_edge) as f64
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
    let mut assembly = Assembly::new(Vector3::zeros());
    let rod = assembly.rod(&line(n));
    assembly.fix(rod.start);
    graph(assembly)
}

/// A trunk of 61 segments, its first one fixed, with 100 branches of 10 segments.
fn tree() -> Graph {
    let mut assembly = Assembly::new(Vector3::zeros());
    let trunk = assembly.rod(&line(61));
    assembly.fix(trunk.start);
    for k in 0..100 {
        let branch = assembly.rod(&line(10));
        assembly.branch(10 + k / 2, 0.5, &branch);
    }
    graph(assembly)
}

fn line(n: usize) -> RodSpec {
    let material = Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };
    RodSpec::new(shape::straight(Vector3::zeros(), Vector3::x(), 0.1 * n as f64, n), 0.05, material)
}

fn graph(assembly: Assembly) -> Graph {
    let (model, _) = assembly.finish();
    let (members, topology) = component::split(&model).swap_remove(0);
    Graph::new(&model, &members, &topology)
}
