//! How much energy a swinging rope loses to the time step alone: the table of `docs/accuracy.md`.
//!
//! No damping, no air: an exact solution would keep its energy. Implicit Euler, which all formulations are close to, takes
//! energy from an oscillation of angular frequency w at a rate of w^2 dt, so that the first to go is what is fast; BDF2 at a
//! rate of w^4 dt^3 / 2.

use std::error::Error;

use cosserat::prelude::*;

/// Length [m], segments, and duration of a swing [s].
const LENGTH: f64 = 2.0;
const SEGMENTS: usize = 40;
const DURATION: f64 = 10.0;

/// Part of the energy above that of rest which is gone after 10 s, of a straight rope that starts at `angle_deg` from
/// hanging.
fn lost(way: (Integrator, Formulation), angle_deg: f64, dt: f64) -> Result<f64, Box<dyn Error>> {
    let material = Material { youngs_modulus: 1e6, torsion_modulus: 4e5, density: 1000.0 };
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    let nodes = shape::straight(Vector3::zeros(), Vector3::new(sin, 0.0, -cos), LENGTH, SEGMENTS);
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let rope = assembly.rod(&RodSpec::new(nodes, 0.01, material));
    assembly.fix(rope.start);
    let (model, mut state) = assembly.finish();
    let energy = |state: &State| measure::energy(&model, state).total();

    let mut rest = state.clone();
    if !statics::equilibrium(&model, &mut rest, &StaticParams::default())?.converged {
        return Err("the rope does not come to rest".into());
    }
    let at_first = energy(&state) - energy(&rest);
    let (integrator, formulation) = way;
    let step = StepParams { formulation, integrator, ..StepParams::default() };
    let mut simulation = Simulation::new(&model, &state, &Settings { step, ..Settings::default() }, None)?;
    for _ in 0..(DURATION / dt).round() as usize {
        simulation.step(dt)?;
    }
    simulation.store(&mut state);
    Ok(1.0 - (energy(&state) - energy(&rest)) / at_first)
}

fn main() -> Result<(), Box<dyn Error>> {
    println!("Energy that a rope of {LENGTH} m loses in {DURATION} s, of that above its rest:");
    for (start, angle_deg) in [("5 degrees from hanging", 5.0), ("horizontal", 90.0)] {
        for integrator in Integrator::ALL {
            for formulation in Formulation::ALL {
                print!("released {start}, {integrator}, {formulation}:");
                for dt in [0.02, 0.01, 0.005, 0.001] {
                    print!("  dt = {dt} s: {:.1} %", 100.0 * lost((integrator, formulation), angle_deg, dt)?);
                }
                println!();
            }
        }
    }
    Ok(())
}

#[test]
fn a_small_swing_loses_energy_at_the_rate_of_implicit_euler() -> Result<(), Box<dyn Error>> {
    // The slowest swing of a hanging chain: half of the first zero of the Bessel function J0.
    let frequency = 1.2024 * (9.81 / LENGTH).sqrt();
    for formulation in Formulation::ALL {
        let rate = |lost: f64| -(1.0 - lost).ln() / DURATION;
        let [coarse, fine] = [0.01, 0.005].map(|dt| lost((Integrator::Euler, formulation), 5.0, dt));
        let [coarse, fine] = [rate(coarse?) / 0.01, rate(fine?) / 0.005];
        for per_dt in [coarse, fine] {
            let expected = frequency.powi(2);
            assert!((per_dt / expected - 1.0).abs() < 0.3, "{formulation}: {per_dt} for {expected} [1/s^2]");
        }
    }
    Ok(())
}

#[test]
fn with_bdf2_a_small_swing_loses_what_its_modes_lose() -> Result<(), Box<dyn Error>> {
    // Zeros j of J0: a hanging chain swings with j sqrt(g / L) / 2, and a straight one, aside, has 32 / j^4 of its energy in
    // that mode. The modes left out have 0.04 % of it.
    let zeros = [2.4048, 5.5201, 8.6537, 11.7915, 14.9309, 18.0711];
    let dt = 0.02_f64;
    let of_mode = |j: f64| {
        let frequency = 0.5 * j * (9.81 / LENGTH).sqrt();
        // The first step is one of Euler's rule.
        let kept = (-0.5 * frequency.powi(4) * dt.powi(3) * DURATION).exp() / (1.0 + (frequency * dt).powi(2));
        32.0 / j.powi(4) * (1.0 - kept)
    };
    let expected: f64 = zeros.into_iter().map(of_mode).sum();
    // Plain `xpbd` breaks the balance of momentum of a taut chain by more than that.
    let formulation = Formulation::Newton;
    let lost = lost((Integrator::Bdf2, formulation), 5.0, dt)?;
    assert!((lost - expected).abs() < 0.3 * expected, "{formulation}: {lost} for {expected}");
    Ok(())
}

#[test]
fn a_fast_fall_loses_more_and_shorter_steps_less() -> Result<(), Box<dyn Error>> {
    let falls = [0.02, 0.005].map(|dt| lost((Integrator::Euler, Formulation::Newton), 90.0, dt));
    let [coarse, fine] = falls;
    let (coarse, fine) = (coarse?, fine?);
    assert!(
        coarse > fine + 0.05 && fine > lost((Integrator::Euler, Formulation::Newton), 5.0, 0.005)?,
        "{coarse}, {fine}"
    );
    Ok(())
}
