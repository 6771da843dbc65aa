//! The memory and the time of a gradient with checkpoints: of a long coil, for the height of its last segment at the end, with
//! respect to everything.
//!
//! `cargo run -p cosserat-sensitivity --example gradient_memory -- SEGMENTS STEPS STRETCH` (100,000, 1,000 and 30 unless told). Peak memory is
//! the kernel's `VmHWM`, where there is one.

use std::error::Error;
use std::time::Instant;

use dynamics::formulation::Formulation;
use dynamics::simulation::Settings;
use dynamics::step::StepParams;
use jointed::linear::solvers::SolverKind;
use nalgebra::Vector3;
use rod::{Assembly, Material, RodSpec};
use sensitivity::{Recording, StateVariation, Wanted};

/// Segments of a turn.
const TURN: usize = 48;
/// Radius of the coil, and its rise a turn [m].
const RADIUS: f64 = 0.5;
const RISE: f64 = 0.15;
/// Length of a step [s].
const STEP: f64 = 1e-3;

fn main() -> Result<(), Box<dyn Error>> {
    let given = std::env::args().skip(1).map(|number| number.parse()).collect::<Result<Vec<usize>, _>>()?;
    let number = |k: usize, usual: usize| given.get(k).copied().unwrap_or(usual);
    let (segments, steps, stretch) = (number(0, 100_000), number(1, 1000), number(2, 30));

    let nodes = (0..=segments).map(|k| {
        let turns = k as f64 / TURN as f64;
        let (sine, cosine) = (std::f64::consts::TAU * turns).sin_cos();
        Vector3::new(RADIUS * cosine, RADIUS * sine, -RISE * turns)
    });
    let material = Material { youngs_modulus: 1e7, torsion_modulus: 5e6, density: 1000.0 };
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let coil = assembly.rod(&RodSpec::new(nodes.collect(), 0.01, material));
    assembly.fix(coil.start);
    let (model, state) = assembly.finish();

    let step = StepParams { formulation: Formulation::Newton, ..StepParams::DEFAULT };
    let settings = Settings { step, solver: SolverKind::Direct };
    let mut recording = Recording::with_checkpoints(&model, &state, &settings, stretch)?;
    let begin = Instant::now();
    (0..steps).try_for_each(|_| recording.step(STEP).map(|_| ()))?;
    let run = begin.elapsed().as_secs_f64();
    let iterations = recording.simulation().counters().iterations as f64 / steps.max(1) as f64;
    println!("{segments} segments, {steps} steps of {STEP} s, a checkpoint every {stretch}");
    println!("run: {run:.1} s, {iterations:.2} iterations a step; peak {}", peak());

    let mut height = StateVariation::zero(segments);
    height.positions[coil.end - 1].z = 1.0;
    let begin = Instant::now();
    let gradient = recording.backward(&[(steps, height)], Wanted::ALL)?;
    println!("back: {:.1} s; peak {}", begin.elapsed().as_secs_f64(), peak());
    println!("with respect to gravity: {:?}", gradient.gravity);
    Ok(())
}

/// The most memory that this process has had at a time.
fn peak() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let kib =
        status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix("kB")?.trim().parse().ok());
    kib.map_or("unknown".to_owned(), |kib: f64| format!("{:.3} GiB", kib / 1048576.0))
}
