//! Time per segment and outer iteration of the direct path, all in, against rivals: `cargo bench -p cosserat-dynamics`.
//!
//! Every figure is the median of some repeats; the variants of a table's row take turns within each repeat.

mod rival;

use std::sync::Arc;
use std::time::Instant;

use component::{Component, split};
use dynamics::formulation::Formulation;
use dynamics::simulation::{Settings, Simulation};
use jointed::linear::LinearSolver;
use jointed::linear::cg::CgParams;
use jointed::linear::direct::Direct;
use jointed::linear::looped::Looped;
use jointed::linear::precondition::PreconditionerKind;
use jointed::linear::solvers::SolverKind;
use kernels::dispatch::vectorized;
use nalgebra::Vector3;
use rival::Rival;
use rod::{Assembly, Material, Model, RodSpec, State, shape};

const DT: f64 = 0.02;
/// Segments times iterations that a variant runs in one repeat, at least.
const WORK: usize = 20_000;
/// Longest chain for the sparse Cholesky.
const LONGEST_SPARSE: usize = 100_000;

/// Horizontal rods with 0.1 m long segments, held by their first segment.
fn rods(count: usize, segments: usize) -> (Model, State) {
    let material = Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    for k in 0..count {
        let start = Vector3::new(0.0, k as f64, 0.0);
        let line = shape::straight(start, Vector3::x(), 0.1 * segments as f64, segments);
        let rod = assembly.rod(&RodSpec::new(line, 0.05, material));
        assembly.fix(rod.start);
    }
    assembly.finish()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Seconds of evaluation, linear solve (any solver's) and update, one outer iteration each time.
fn iterate(component: &mut Component<f64>, solver: &mut dyn LinearSolver, iterations: usize) -> [f64; 3] {
    let formulation = Formulation::default();
    let mut sums = [0.0; 3];
    for _ in 0..iterations {
        component.predict(0.0, DT, formulation);
        let mut marks = [Instant::now(); 4];
        vectorized(
            #[inline(always)]
            || component.evaluate(formulation),
        );
        marks[1] = Instant::now();
        solver.solve(&component.system, false, &mut component.dlambda);
        marks[2] = Instant::now();
        vectorized(
            #[inline(always)]
            || component.update(formulation, 1.0),
        );
        marks[3] = Instant::now();
        component.roll_back();
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum += (marks[k + 1] - marks[k]).as_secs_f64();
        }
    }
    sums
}

/// One chain: [evaluate, solve, update, all, nalgebra, faer, one iteration of conjugate gradients] in microseconds per
/// segment and iteration.
fn one_rod(n: usize, repeats: usize) -> [f64; 7] {
    let (model, state) = rods(1, n);
    let (members, topology) = split(&model).remove(0);
    let topology = Arc::new(topology);
    let mut component = Component::new(&model, &state, topology.clone(), &[&members]);
    let mut direct = Direct::new(&topology).expect("a chain has no loop");
    let mut sparse = (n <= LONGEST_SPARSE).then(|| Looped::new(&topology).expect("the pattern fits"));
    let cg = |max_iterations| {
        let preconditioner = PreconditionerKind::BlockJacobi;
        let params = CgParams { preconditioner, tolerance: 0.0, max_iterations: Some(max_iterations) };
        SolverKind::Cg(params).build(&model, &members, &topology).expect("it works on any graph")
    };
    let mut gradients = [1, 11].map(cg);
    component.predict(0.0, DT, Formulation::Xpbd);
    let mut predicted = state.clone();
    component.store_state(&mut predicted, &members, 0);
    let mut rival = Rival::new(&model, &predicted, DT);
    rival.iterate();
    component.evaluate(Formulation::Xpbd);
    direct.solve(&component.system, false, &mut component.dlambda);
    let (own, other): (f64, f64) = (component.dlambda[0].linear.0[2], rival.lambda[0][2]);
    assert!((own - other).abs() <= 1e-6 * own.abs(), "nalgebra solves another problem: {own} and {other}");
    component.roll_back();

    let iterations = WORK.div_ceil(n);
    let scale = 1e6 / (iterations * n) as f64;
    let mut times: [Vec<f64>; 7] = Default::default();
    for _ in 0..repeats {
        let parts = iterate(&mut component, &mut direct, iterations);
        for (times, part) in times.iter_mut().zip(parts.into_iter().chain([parts.iter().sum()])) {
            times.push(part * scale);
        }
        let mut seconds = 0.0;
        for _ in 0..iterations {
            rival.state.clone_from(&predicted);
            rival.lambda.fill(nalgebra::Vector6::zeros());
            let start = Instant::now();
            rival.iterate();
            seconds += start.elapsed().as_secs_f64();
        }
        times[4].push(seconds * scale);
        if let Some(sparse) = &mut sparse {
            times[5].push(iterate(&mut component, sparse, iterations).iter().sum::<f64>() * scale);
        } else {
            times[5].push(f64::NAN);
        }
        // Ten iterations more, without what comes before the first.
        let [one, eleven] = gradients.each_mut().map(|cg| iterate(&mut component, cg.as_mut(), iterations)[1]);
        times[6].push((eleven - one) / 10.0 * scale);
    }
    times.map(median)
}

/// Many rods: wall time of whole steps, in microseconds per segment and iteration, for each number of threads.
fn many_rods(count: usize, segments: usize, threads: &[usize], repeats: usize) -> Vec<f64> {
    let (model, state) = rods(count, segments);
    let pool = |&threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start");
    let pools: Vec<_> = threads.iter().map(pool).collect();
    let new = |_| Simulation::new(&model, &state, &Settings::default(), None).expect("the model is valid");
    let mut simulations: Vec<Simulation> = threads.iter().map(new).collect();
    let mut times = vec![Vec::new(); threads.len()];
    for _ in 0..repeats {
        for (k, (pool, simulation)) in pools.iter().zip(&mut simulations).enumerate() {
            let before = simulation.counters().segment_iterations;
            let start = Instant::now();
            pool.install(|| simulation.step(DT)).expect("dt is positive");
            let wall = start.elapsed().as_secs_f64();
            times[k].push(wall * 1e6 / (simulation.counters().segment_iterations - before) as f64);
        }
    }
    times.into_iter().map(median).collect()
}

fn processor() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    name.map_or("unknown processor".into(), |(_, name)| name.to_string())
}

fn main() {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    println!("microseconds per segment and outer iteration, formulation {}", Formulation::default());
    let instructions = format!("{:?}", pulp::Arch::new());
    let instructions = instructions.split('(').next().unwrap_or_default();
    println!("{}, {threads} hardware threads, x86-64 instructions {instructions}", processor());
    println!("\none chain, one thread, one iteration from the predicted state; median of the repeats");
    println!(
        "      N repeats | evaluate  solve  update |    all | nalgebra | faer sparse LL^T | one CG iteration (block-Jacobi)"
    );
    for (n, repeats) in [(10, 41), (100, 41), (1_000, 41), (10_000, 31), (100_000, 11), (1_000_000, 5)] {
        let [evaluate, solve, update, all, nalgebra, faer, cg] = one_rod(n, repeats);
        let faer = if faer.is_nan() { "       -".into() } else { format!("{faer:8.3}") };
        print!("{n:7} {repeats:7} | {evaluate:8.3} {solve:6.3} {update:7.3} |");
        println!(" {all:6.3} | {nalgebra:8.3} | {faer}         | {cg:8.3}");
    }
    println!("\nmany rods, whole steps with prediction, wall time; median of 15 steps");
    for (count, segments) in [(1_000, 30), (1_000, 100), (100, 1_000)] {
        let counts: Vec<usize> = if threads > 1 { vec![1, 2] } else { vec![1] };
        for (threads, time) in counts.iter().zip(many_rods(count, segments, &counts, 15)) {
            println!("{count:5} rods of {segments:4} segments, {threads} thread(s): {time:.4}");
        }
    }
}
