//! What long time steps take: `cargo run -p simulate --example time_step -- FILE.svg` draws the chart of `docs/accuracy.md`.

use std::f64::consts::PI;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use chart::{Axis, Charts, Conditions, Figure, LineChart, Reference, Series};
use cosserat::scene;
use cosserat::simulation::{Integrator, Settings, Simulation};
use cosserat::state::{State, measure};
use cosserat::statics::{StaticParams, equilibrium};

/// A rope of 2 m in 20 segments, held by its first one, that is let go horizontally.
const ROPE: &str = "[[rods]]
radius_m = 0.01
youngs_modulus_pa = 1e6
density_kg_m3 = 1000
clamp = [\"start-segment\"]
shape.straight = { length_m = 2, segments = 20 }
";
/// How long it falls [s].
const DURATION: f64 = 1.0;
/// Time step of the runs that are compared, and of the one that stands for the truth [s].
const DT: f64 = 0.01;
const FINE: f64 = DT / 16.0;

/// The energy above that of rest, as a share of the first one, at each hundredth of a second.
fn energies(integrator: Integrator, dt: f64) -> Result<Vec<(f64, f64)>> {
    let scene = scene::parse(ROPE, "rope.toml")?;
    let mut rest = scene.state.clone();
    ensure!(
        equilibrium(&scene.model, &mut rest, &StaticParams::default())?.converged,
        "the rope does not come to rest"
    );
    let above =
        |state: &State| measure::energy(&scene.model, state).total() - measure::energy(&scene.model, &rest).total();
    let mut settings = Settings::default();
    settings.step.integrator = integrator;
    let mut simulation = Simulation::new(&scene.model, &scene.state, &settings, None)?;
    let mut state = scene.state.clone();
    let mut found = vec![(0.0, 1.0)];
    let every = (DT / dt).round() as usize;
    for step in 1..=(DURATION / dt).round() as usize {
        simulation.step(dt)?;
        if step.is_multiple_of(every) {
            simulation.store(&mut state);
            found.push((simulation.time(), above(&state) / above(&scene.state)));
        }
    }
    Ok(found)
}

/// What is lost of an oscillation in a period, by w dt: in theory.
fn lost() -> LineChart {
    let over = |of: fn(f64) -> f64| (0..=40).map(|k| 10_f64.powf(-2.0 + 0.05 * f64::from(k))).map(move |x| (x, of(x)));
    let curve = |name: &str, of| Series { markers: false, ..Series::new(name, over(of)) };
    LineChart {
        title: "An oscillation of angular frequency w".to_owned(),
        x: Axis::log("w dt"),
        y: Axis::log("part of the energy lost in a period"),
        series: vec![curve("euler", |x| -(-2.0 * PI * x).exp_m1()), curve("bdf2", |x| -(-PI * x.powi(3)).exp_m1())],
        references: vec![Reference::Horizontal { y: 0.2, label: "20 %".to_owned() }],
        ..LineChart::default()
    }
}

fn main() -> Result<()> {
    let file = PathBuf::from(std::env::args().nth(1).context("give the name of the SVG file to write")?);
    let mut series = Vec::new();
    for (name, integrator, dt) in
        [("euler", Integrator::Euler, DT), ("bdf2", Integrator::Bdf2, DT), ("bdf2, dt / 16", Integrator::Bdf2, FINE)]
    {
        series.push(Series { markers: false, ..Series::new(name, energies(integrator, dt)?) });
    }
    let fall = LineChart {
        title: "A rope of 2 m that falls".to_owned(),
        x: Axis::linear("time [s]"),
        y: Axis::linear("energy above that of rest, over the first"),
        series,
        ..LineChart::default()
    };
    let figure = Figure {
        id: "time-step".to_owned(),
        title: "What time steps take".to_owned(),
        caption: String::new(),
        charts: Charts::Lines(vec![lost(), fall]),
        conditions: Conditions::new("rope", format!("released horizontally, dt = {DT} s")),
    };
    std::fs::write(&file, figure.svg()).with_context(|| file.display().to_string())
}

/// Nothing takes energy but the integrator: short steps keep it, and the second order keeps it better than the first.
#[test]
fn the_fall_keeps_its_energy_as_far_as_the_steps_are_short() -> Result<()> {
    let [euler, bdf2] = [energies(Integrator::Euler, DT)?, energies(Integrator::Bdf2, DT)?];
    let fine = energies(Integrator::Bdf2, FINE)?;
    println!("time [s]  euler   bdf2    bdf2, dt / 16");
    for k in (0..=100).step_by(10) {
        println!("{:.1}       {:.4}  {:.4}  {:.4}", fine[k].0, euler[k].1, bdf2[k].1, fine[k].1);
    }
    for ((euler, bdf2), fine) in euler.iter().zip(&bdf2).zip(&fine).skip(1) {
        let [euler, bdf2, fine] = [euler, bdf2, fine].map(|(_, kept)| (kept - 1.0).abs());
        assert!(fine <= bdf2 + 1e-3 && bdf2 < euler + 1e-3, "{fine} {bdf2} {euler}");
    }
    assert!(fine[100].1 > 0.98 && euler[100].1 < 0.9, "{:?} {:?}", fine[100], euler[100]);
    Ok(())
}
