//! A rope that a program shakes, watched and dragged in a browser while it runs:
//! `cargo run -p cosserat --features live --example watch_a_rope`.

use cosserat::live::{Live, Options, with_hands};
use cosserat::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let rubber = Material { youngs_modulus: 2e6, torsion_modulus: 7e5, density: 1100.0 };
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let rope = assembly.rod(&RodSpec::new(shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 40), 0.005, rubber));
    assembly.fix(rope.start);
    let (model, state) = assembly.finish();
    // Hands pull at loads of their own.
    let model = with_hands(&model);
    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None)?;
    let mut live = Live::open(&model, &mut simulation, 0.01, None, Options::new("a rope that is shaken"))?;
    println!("{}", live.address());
    // Until a minute after the page was closed, or Ctrl-C.
    while live.turn(&mut simulation)? {
        let wave = 0.5 * (3.0 * simulation.time()).sin();
        simulation.set_gravity(Vector3::new(0.0, 9.81 * wave, -9.81))?;
    }
    println!("{} steps", live.recording().steps);
    Ok(())
}
