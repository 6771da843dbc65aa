//! Whether heaps gain energy as they fall: `cargo run -p cosserat --example heap_energy -- heap-20 1 2 3` runs 40 steps of each
//! of 49 lengths from 8.55 to 10.95 ms with these seeds.
//!
//! A row a seed: runs that had more energy on the way than at their start, the largest energy relative to that, steps that were
//! halved, steps that did not converge, and outer iterations of a segment a step. `RAYON_NUM_THREADS=1` keeps it to one
//! thread.

use std::error::Error;

use cosserat::prelude::*;

const STEPS: usize = 40;
const LENGTHS: usize = 49;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().ok_or("say which heap, and its seeds")?;
    let text = std::fs::read_to_string(format!("{}/../scene/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR")))?;
    println!("seed   gain   largest   halved   unconverged   outer iterations");
    for seed in arguments {
        let scene = scene::parse(&text.replace("seed = 1", &format!("seed = {seed}")), &name)?;
        let start = measure::energy(&scene.model, &scene.state).total();
        let (mut gains, mut largest) = (0, 0.0_f64);
        let (mut halved, mut unconverged, mut outer) = (0, 0, 0);
        for k in 0..LENGTHS {
            let dt = 0.00855 + 5e-5 * k as f64;
            let mut simulation = Simulation::new(&scene.model, &scene.state, &Settings::default(), None)?;
            let (mut state, mut most) = (scene.state.clone(), 0.0_f64);
            for _ in 0..STEPS {
                simulation.step(dt)?;
                simulation.store(&mut state);
                most = most.max(measure::energy(&scene.model, &state).total() / start);
            }
            let counters = simulation.counters();
            halved += counters.retries;
            unconverged += counters.not_converged;
            outer += counters.segment_iterations;
            gains += u32::from(most > 1.0);
            largest = largest.max(most);
        }
        let outer = outer as f64 / (LENGTHS * STEPS * scene.model.segments.len()) as f64;
        println!("{seed:4}   {gains:4}   {largest:<7.3}   {halved:6}   {unconverged:11}   {outer:.2}");
    }
    Ok(())
}
