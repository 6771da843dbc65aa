//! A planner that tries 64 motions of a grip at once and takes the one after which the rope swings least.
//!
//! The grip carries a hanging rope 0.4 m along in a second. Where it is after a third and after two thirds of the time is
//! open: the planner tries an 8 by 8 grid of both, goes back to a snapshot, and tries a finer grid about the best. The best
//! motion then moves a simulation of its own, with the same bits.

use std::error::Error;
use std::ops::RangeInclusive;
use std::sync::Arc;

use rods::prelude::*;

const DT: f64 = 0.01;
/// How far the grip goes [m], and how long it takes [s].
const WAY: f64 = 0.4;
const TIME: f64 = 1.0;
/// Motions along each side of the grid.
const SIDE: usize = 8;

/// A rope that hangs from a grip, at rest.
fn rope() -> (Model, State) {
    let rubber = Material { youngs_modulus: 2e6, torsion_modulus: 7e5, density: 1100.0 };
    let nodes = shape::straight(Vector3::zeros(), -Vector3::z(), 0.8, 20);
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let rod = assembly.rod(&RodSpec::new(nodes, 0.01, rubber));
    assembly.clamp_start(&rod);
    assembly.finish()
}

/// The grip's motion through two places on its way, from `begin` [s] on: shares of the way after a third and after two
/// thirds of the time.
fn motion(grip: &Pose, begin: f64, places: [f64; 2]) -> Driven {
    let frame = |third: f64, share: f64| Keyframe {
        time: begin + third / 3.0 * TIME,
        position: grip.position + Vector3::x() * (share * WAY),
        turn: Vector3::zeros(),
    };
    let frames = [frame(0.0, 0.0), frame(1.0, places[0]), frame(2.0, places[1]), frame(3.0, 1.0)];
    let motion = Motion::new(grip.orientation, &frames, Interpolation::Smooth).expect("times in order");
    Driven::new(Body::Anchor(0), Arc::new(motion))
}

/// `SIDE` values, evenly over a range.
fn grid(range: &RangeInclusive<f64>) -> [f64; SIDE] {
    let step = (range.end() - range.start()) / (SIDE - 1) as f64;
    std::array::from_fn(|k| range.start() + step * k as f64)
}

/// What was found: places on the way, and the energy of the swing that they leave [J].
#[derive(Clone, Copy, Debug, PartialEq)]
struct Found {
    places: [f64; 2],
    swing: f64,
}

/// The best of all motions through a place in each range.
fn best_of(batch: &mut Batch, model: &Model, ranges: &[RangeInclusive<f64>; 2]) -> Result<Found, Box<dyn Error>> {
    let begin = batch.time();
    let [first, second] = ranges.each_ref().map(grid);
    let places = |copy: usize| [first[copy / SIDE], second[copy % SIDE]];
    for copy in 0..batch.len() {
        batch.drive(copy, &motion(&model.anchors[0], begin, places(copy)))?;
    }
    for _ in 0..(TIME / DT).round() as usize {
        batch.step(DT)?;
    }
    let (mut best, mut state) = (Found { places: [0.0; 2], swing: f64::INFINITY }, State::default());
    for copy in 0..batch.len() {
        batch.store(copy, &mut state);
        let swing = swing(model, &state);
        if swing < best.swing {
            best = Found { places: places(copy), swing };
        }
    }
    Ok(best)
}

/// Energy above that of the rope at rest below its grip [J].
fn swing(model: &Model, state: &State) -> f64 {
    let (_, rest) = rope();
    measure::energy(model, state).total() - measure::energy(model, &rest).total()
}

/// What each round of the plan found, and what the best motion came to alone.
fn plan() -> Result<([Found; 2], f64), Box<dyn Error>> {
    let (model, state) = rope();
    let settings = Settings::default();
    let mut batch = Batch::new(&vec![(&model, &state); SIDE * SIDE], &settings, None)?;
    let now = batch.snapshot();
    let coarse = best_of(&mut batch, &model, &[0.0..=1.0, 0.0..=1.0])?;
    batch.restore(&now)?;
    let about = coarse.places.map(|place| place - 0.1..=place + 0.1);
    let fine = best_of(&mut batch, &model, &about)?;

    let mut simulation = Simulation::new(&model, &state, &settings, None)?;
    let mut end = state.clone();
    simulation.drive(&motion(&model.anchors[0], 0.0, fine.places))?;
    for _ in 0..(TIME / DT).round() as usize {
        simulation.step(DT)?;
    }
    simulation.store(&mut end);
    Ok(([coarse, fine], swing(&model, &end)))
}

fn main() -> Result<(), Box<dyn Error>> {
    let (rounds, alone) = plan()?;
    for Found { places: [first, second], swing } in rounds {
        println!("through {:.3} and {:.3} of the way: {:.2} mJ of swing are left", first, second, 1e3 * swing);
    }
    println!("the best motion alone leaves {:.2} mJ", 1e3 * alone);
    Ok(())
}

#[test]
fn a_finer_grid_finds_a_calmer_motion_and_alone_it_is_the_same() -> Result<(), Box<dyn Error>> {
    let ([coarse, fine], alone) = plan()?;
    assert!(fine.swing > 0.0 && fine.swing <= coarse.swing, "{fine:?} {coarse:?}");
    assert_eq!(fine.swing, alone);
    // Going straight there at an even pace is no match.
    let (model, state) = rope();
    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None)?;
    simulation.drive(&motion(&model.anchors[0], 0.0, [1.0 / 3.0, 2.0 / 3.0]))?;
    for _ in 0..(TIME / DT).round() as usize {
        simulation.step(DT)?;
    }
    let mut end = state.clone();
    simulation.store(&mut end);
    assert!(fine.swing < 0.5 * swing(&model, &end), "{} J, {} J", fine.swing, swing(&model, &end));
    Ok(())
}
