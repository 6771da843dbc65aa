//! What a step with contacts takes: `cargo run -p cosserat --example contact_speed -- heap-20 hair` prints a row a scene.
//!
//! Scenes run for a second, and then up to the third. Each half of a row has means over its steps: the time of a step,
//! outer iterations of a rod, sweeps over contacts' problems, and contacts in them, summed over iterations. Then over both: steps
//! that were halved, steps that did not converge, and the deepest penetration.
//! `RAYON_NUM_THREADS=1` keeps it to one thread.

use std::error::Error;
use std::time::Instant;

use cosserat::simulation::{Settings, Simulation};

/// Where the parts of a run end [s]: the impact, and what has settled.
const ENDS: [f64; 2] = [1.0, 3.0];

fn main() -> Result<(), Box<dyn Error>> {
    println!("per step:          first second                        up to the third");
    println!(
        "scene              ms       outer  sweeps  contacts    ms       outer  sweeps  contacts   halved  unconverged  deepest [radii]"
    );
    for name in std::env::args().skip(1) {
        let scene = cosserat::scene::builtin(&name)?;
        let mut simulation = Simulation::new(&scene.model, &scene.state, &Settings::default(), None)?;
        print!("{name:16}");
        let mut done = 0;
        for end in ENDS {
            let steps = (end / scene.run.dt).round() as usize - done;
            let (before, start) = (simulation.counters(), Instant::now());
            for _ in 0..steps {
                simulation.step(scene.run.dt)?;
            }
            let ms = start.elapsed().as_secs_f64() * 1e3;
            let (after, per_step) = (simulation.counters(), 1.0 / steps as f64);
            let [outer, sweeps, contacts] = [
                after.segment_iterations - before.segment_iterations,
                after.contact_sweeps - before.contact_sweeps,
                after.contact_solves - before.contact_solves,
            ]
            .map(|count| count as f64 * per_step);
            let outer = outer / scene.model.segments.len() as f64;
            print!("   {:<8.3} {outer:<6.2} {sweeps:<7.1} {contacts:<8.0}", ms * per_step);
            done += steps;
        }
        let counters = simulation.counters();
        println!("   {:<6}  {:<11}  {:.1e}", counters.retries, counters.not_converged, counters.deepest_penetration);
    }
    Ok(())
}
