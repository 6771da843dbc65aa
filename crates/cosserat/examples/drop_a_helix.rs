//! A builtin scene, stepped: a helix falls from its clamp and swings; its energies over time.

use std::error::Error;

use cosserat::prelude::*;

/// Time [s] and energies [J], at the start and after every 20 steps.
fn drop() -> Result<Vec<(f64, measure::Energy)>, Box<dyn Error>> {
    let Scene { model, mut state, run, .. } = scene::builtin("helix")?;
    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None)?;
    let mut energies = vec![(0.0, measure::energy(&model, &state))];
    for step in 1..=run.steps {
        let report = simulation.step(run.dt)?;
        if !report.status.is_converged() {
            return Err(format!("step {step}: {}", report.status.name()).into());
        }
        if step % 20 == 0 {
            simulation.store(&mut state);
            energies.push((simulation.time(), measure::energy(&model, &state)));
        }
    }
    Ok(energies)
}

fn main() -> Result<(), Box<dyn Error>> {
    println!("time [s]   kinetic   external   bending and twist   total [J]");
    for (time, energy) in drop()? {
        let measure::Energy { kinetic, external, bend, .. } = energy;
        println!("{time:8.2} {kinetic:9.3} {external:10.3} {bend:19.3} {:11.3}", energy.total());
    }
    Ok(())
}

#[test]
fn the_helix_falls_and_gains_no_energy() -> Result<(), Box<dyn Error>> {
    let energies = drop()?;
    assert_eq!(energies.len(), 6);
    let (_, first) = energies[0];
    for (time, energy) in &energies[1..] {
        assert!(energy.kinetic > 0.0 && energy.external < first.external, "at {time} s");
        assert!(energy.total() <= first.total() + 1e-6 * first.external.abs(), "at {time} s");
    }
    Ok(())
}
