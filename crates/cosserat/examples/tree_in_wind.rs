//! A scene file's text in the code: a tree in gusts, and how far its top is pushed.

use std::error::Error;

use cosserat::prelude::*;

const TREE: &str = r#"
[run]
dt_s = 0.02
steps = 150

[air.wind]
velocity_m_s = [12, 0, 0]
gusts = { strength = 0.2, seed = 7 }

[[rods]]
name = "trunk"
radius_m = [0.03, 0.012]
youngs_modulus_pa = 4e9
torsion_modulus_pa = 5e8
density_kg_m3 = 700
clamp = ["start-face"]
shape.straight = { direction = [0, 0, 1], length_m = 4, segments = 40 }
tree = { branches = 9, levels = 2, segment_m = 0.1, seed = 1 }
"#;

/// How far the wind has pushed the end of the trunk after each step [m].
fn sway() -> Result<Vec<f64>, Box<dyn Error>> {
    let scene = scene::parse(TREE, "tree.toml")?;
    let (model, mut state) = (scene.model, scene.state);
    let top = scene.rods[0].segments.end - 1;
    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None)?;
    let first = state.positions[top];
    let mut pushed = Vec::with_capacity(scene.run.steps);
    for _ in 0..scene.run.steps {
        simulation.step(scene.run.dt)?;
        simulation.store(&mut state);
        pushed.push(state.positions[top].x - first.x);
    }
    Ok(pushed)
}

fn main() -> Result<(), Box<dyn Error>> {
    for (step, pushed) in sway()?.iter().enumerate().skip(24).step_by(25) {
        println!("{:.1} s: the top is pushed by {pushed:.3} m", 0.02 * (step + 1) as f64);
    }
    Ok(())
}

#[test]
fn the_wind_pushes_the_top_along_with_it() -> Result<(), Box<dyn Error>> {
    let pushed = sway()?;
    // It sways about where the mean wind holds it.
    let mean = pushed.iter().sum::<f64>() / pushed.len() as f64;
    let most = pushed.iter().copied().fold(0.0, f64::max);
    assert!(mean > 0.05 && most > mean && most < 1.0, "{mean} m in the mean, {most} m at most");
    Ok(())
}
