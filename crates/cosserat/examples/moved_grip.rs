//! A rope whose grip is moved: to and fro, then held still.
//!
//! A fixed segment keeps its velocity whatever pulls at it, so that its velocity is its motion: before each step it is set to
//! lead from where the segment is to where it shall be at the end of the step. The free segments keep their own.

use std::error::Error;
use std::f64::consts::TAU;

use cosserat::prelude::*;

const DT: f64 = 0.01;
const STEPS: usize = 300;

/// Where the grip is at `time` [s]: it swings by 0.3 m for 2.25 s, then stays where it is [m].
fn grip(time: f64) -> Vector3<f64> {
    Vector3::x() * (0.3 * (TAU * time.min(2.25)).sin())
}

/// Positions of the grip and of the rope's free end after each step [m].
fn swing() -> Result<Vec<[Vector3<f64>; 2]>, Box<dyn Error>> {
    let rubber = Material { youngs_modulus: 2e6, torsion_modulus: 7e5, density: 1100.0 };
    let nodes = shape::straight(Vector3::zeros(), -Vector3::z(), 1.5, 30);
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let rope = assembly.rod(&RodSpec::new(nodes, 0.01, rubber));
    assembly.fix(rope.start);
    let (model, mut state) = assembly.finish();
    let origin = state.positions[rope.start];

    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None)?;
    let mut places = Vec::with_capacity(STEPS);
    for step in 1..=STEPS {
        let target = origin + grip(step as f64 * DT);
        state.velocities[rope.start] = (target - state.positions[rope.start]) / DT;
        simulation.set_velocities(&state);
        simulation.step(DT)?;
        simulation.store(&mut state);
        places.push([state.positions[rope.start], state.positions[rope.end - 1]]);
    }
    Ok(places)
}

fn main() -> Result<(), Box<dyn Error>> {
    for (step, [grip, end]) in swing()?.iter().enumerate().skip(14).step_by(30) {
        let time = DT * (step + 1) as f64;
        println!("{time:.2} s: grip at x = {:6.3} m, end at x = {:6.3} m, z = {:6.3} m", grip.x, end.x, end.z);
    }
    Ok(())
}

#[test]
fn the_grip_is_where_it_shall_be_and_takes_the_rope_along() -> Result<(), Box<dyn Error>> {
    let places = swing()?;
    let origin = Vector3::new(0.0, 0.0, -0.025);
    for (step, [at, _]) in places.iter().enumerate() {
        let error = (at - origin - grip((step + 1) as f64 * DT)).norm();
        assert!(error < 1e-12, "step {step}: {error} m off");
    }
    let farthest = places.iter().map(|[_, end]| end.x.abs()).fold(0.0, f64::max);
    assert!(farthest > 0.1, "the end moves by {farthest} m");
    Ok(())
}
