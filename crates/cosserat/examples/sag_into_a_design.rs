//! The rest shape with which a hanging sculpture sags into its design: a tree of rods, in one pass.
//!
//! `cargo run -p cosserat --example sag_into_a_design` takes a tree of about 190,000 segments and says how long the pass took. It
//! writes the scene of a small one, made as it is drawn, to `target/sag-into-a-design.toml`: `simulate static` shows its sag.

use std::error::Error;
use std::time::Instant;

use cosserat::prelude::*;
use cosserat::statics::rest_shape;

/// The scene of a tree that grows downwards from a ceiling, of segments of this length [m].
fn sculpture(segment_m: f64) -> String {
    let segments = (4.0 / segment_m).round();
    format!(
        r#"
[[rods]]
name = "trunk"
radius_m = [0.03, 0.012]
youngs_modulus_pa = 4e9
torsion_modulus_pa = 5e8
density_kg_m3 = 700
clamp = ["start-face"]
shape.straight = {{ direction = [0.6, 0, -0.8], length_m = 4, segments = {segments} }}
tree = {{ branches = 9, levels = 3, segment_m = {segment_m}, length_ratio = 0.6, radius_ratio = 0.6, angle_deg = 45, seed = 1 }}
"#
    )
}

/// That tree.
fn grown(segment_m: f64) -> Result<(Model, State), SceneError> {
    let scene = scene::parse(&sculpture(segment_m), "sculpture.toml")?;
    Ok((scene.model, scene.state))
}

/// The largest distance of two states over the design's size.
fn error(design: &State, other: &State) -> f64 {
    let pairs = design.positions.iter().zip(&other.positions);
    let moved = pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    let size = design.positions.iter().map(|x| (x - design.positions[0]).norm()).fold(0.0, f64::max);
    moved / size
}

/// How far the sculpture moves where it is made as it is drawn, and where it is made for the pass: each over its size.
fn sag(segment_m: f64) -> Result<[f64; 2], Box<dyn Error>> {
    let (mut model, drawn) = grown(segment_m)?;
    let params = StaticParams::default();
    let mut sags = drawn.clone();
    statics::equilibrium(&model, &mut sags, &params)?;
    let mut design = drawn.clone();
    rest_shape(&mut model, &mut design)?;
    let mut rest = design;
    let report = statics::equilibrium(&model, &mut rest, &params)?;
    assert!(report.converged && report.stable == Some(true));
    Ok([error(&drawn, &sags), error(&drawn, &rest)])
}

fn main() -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all("target")?;
    std::fs::write("target/sag-into-a-design.toml", sculpture(0.05))?;
    let [sags, stays] = sag(0.05)?;
    println!("Made as it is drawn it sags by {:.1} % of its size, with the rest shape by {stays:.1e}.", 100.0 * sags);
    let (mut model, mut design) = grown(6.65e-5)?;
    let start = Instant::now();
    rest_shape(&mut model, &mut design)?;
    println!("The pass took {:.2} s for {} segments.", start.elapsed().as_secs_f64(), model.segments.len());
    let size = model.segments.len();
    let step = StepParams { formulation: Formulation::Newton, ..StepParams::default() };
    let mut simulation = Simulation::new(&model, &design, &Settings { step, ..Settings::default() }, None)?;
    let report = simulation.step(0.01)?;
    let mut after = design.clone();
    simulation.store(&mut after);
    println!(
        "A step of 0.01 s moves the {size} segments by {:.1e} ({}).",
        error(&design, &after),
        report.status.name()
    );
    Ok(())
}

#[test]
fn the_sculpture_sags_into_its_design() -> Result<(), Box<dyn Error>> {
    let [sags, stays] = sag(0.1)?;
    assert!(sags > 1e-3, "it would sag by {sags:e}");
    assert!(stays < 1e-6, "{stays:e}");
    Ok(())
}
