//! What a snapshot costs beside a step: it is taken, and gone back to, in a small part of the time of one.

use std::error::Error;
use std::time::Instant;

use cosserat::prelude::*;

/// Rounds that are timed.
const ROUNDS: u32 = 200;

/// Microseconds of a step, of taking a snapshot in the place of an older one, and of going back to it.
fn times(rods: usize, segments: usize) -> Result<[f64; 3], Box<dyn Error>> {
    let rubber = Material { youngs_modulus: 2e6, torsion_modulus: 7e5, density: 1100.0 };
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    for k in 0..rods {
        let nodes = shape::straight(Vector3::y() * k as f64, Vector3::x(), 2.0, segments);
        let rod = assembly.rod(&RodSpec::new(nodes, 0.01, rubber));
        assembly.clamp_start(&rod);
    }
    let (model, state) = assembly.finish();
    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None)?;
    let mut snapshot = simulation.snapshot();
    let mut times = [0.0; 3];
    for _ in 0..ROUNDS {
        let mut watch = Instant::now();
        let mut mark = |time: &mut f64| {
            *time += 1e6 * watch.elapsed().as_secs_f64() / f64::from(ROUNDS);
            watch = Instant::now();
        };
        simulation.step(0.01)?;
        mark(&mut times[0]);
        simulation.snapshot_into(&mut snapshot);
        mark(&mut times[1]);
        simulation.restore(&snapshot)?;
        mark(&mut times[2]);
    }
    Ok(times)
}

fn main() -> Result<(), Box<dyn Error>> {
    for (rods, segments) in [(1, 100), (1, 1000), (64, 20)] {
        let [step, taken, restored] = times(rods, segments)?;
        println!(
            "{rods} rods of {segments} segments: a step takes {step:.1} us, a snapshot {taken:.1} us, going back {restored:.1} us"
        );
    }
    Ok(())
}

#[test]
fn all_is_timed() -> Result<(), Box<dyn Error>> {
    assert!(times(3, 5)?.iter().all(|time| *time > 0.0));
    Ok(())
}
