//! A planner that tries 64 motions of a grip at once and takes the one after which the rope swings least.
//!
//! The grip carries a hanging rope 0.4 m along. How long it takes, and where it is after half of that time, is open: the
//! planner tries an 8 by 8 grid of both, goes back to a snapshot, and tries a finer grid about the best. The best motion then
//! moves a simulation of its own, with the same bits.

use std::error::Error;
use std::ops::RangeInclusive;
use std::sync::Arc;

use cosserat::prelude::*;

const DT: f64 = 0.01;
/// Steps after which the swing is measured.
const STEPS: usize = 200;
/// How far the grip goes [m].
const WAY: f64 = 0.4;
/// Motions along each side of the grid.
const SIDE: usize = 8;

/// A motion: how long it takes [s], and the share of the way that is done after half of the time.
type Move = [f64; 2];

/// A rope that hangs from a grip, at rest.
fn rope() -> (Model, State) {
    let rubber = Material { youngs_modulus: 2e6, torsion_modulus: 7e5, density: 1100.0 };
    let nodes = shape::straight(Vector3::zeros(), -Vector3::z(), 0.8, 20);
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let rod = assembly.rod(&RodSpec::new(nodes, 0.01, rubber));
    assembly.clamp_start(&rod);
    assembly.finish()
}

/// The grip's motion from `begin` [s] on.
fn driven(grip: &Pose, begin: f64, [duration, halfway]: Move) -> Driven {
    let frame = |half: f64, share: f64| Keyframe {
        time: begin + 0.5 * half * duration,
        position: grip.position + Vector3::x() * (share * WAY),
        turn: Vector3::zeros(),
    };
    let frames = [frame(0.0, 0.0), frame(1.0, halfway), frame(2.0, 1.0)];
    let motion = Motion::new(grip.orientation, &frames, Interpolation::Smooth).expect("times in order");
    Driven::new(Body::Anchor(0), Arc::new(motion))
}

/// `SIDE` values, evenly over a range.
fn grid(range: &RangeInclusive<f64>) -> [f64; SIDE] {
    let step = (range.end() - range.start()) / (SIDE - 1) as f64;
    std::array::from_fn(|k| range.start() + step * k as f64)
}

/// A motion, and the energy of the swing that it leaves [J].
#[derive(Clone, Copy, Debug, PartialEq)]
struct Found {
    way: Move,
    swing: f64,
}

/// The best of all motions with numbers in these ranges.
fn best_of(batch: &mut Batch, model: &Model, ranges: &[RangeInclusive<f64>; 2]) -> Result<Found, Box<dyn Error>> {
    let begin = batch.time();
    let [durations, halfway] = ranges.each_ref().map(grid);
    let way = |copy: usize| [durations[copy / SIDE], halfway[copy % SIDE]];
    for copy in 0..batch.len() {
        batch.drive(copy, &driven(&model.anchors[0], begin, way(copy)))?;
    }
    for _ in 0..STEPS {
        batch.step(DT)?;
    }
    let (mut best, mut state) = (Found { way: [0.0; 2], swing: f64::INFINITY }, State::default());
    for copy in 0..batch.len() {
        batch.store(copy, &mut state);
        let swing = swing(model, &state);
        if swing < best.swing {
            best = Found { way: way(copy), swing };
        }
    }
    Ok(best)
}

/// Energy above that of the rope at rest, which hangs below its grip at the end of the way [J].
fn swing(model: &Model, state: &State) -> f64 {
    let (_, rest) = rope();
    let mut there = model.clone();
    there.anchors[0].position.x += WAY;
    measure::energy(&there, state).total() - measure::energy(model, &rest).total()
}

/// The swing that a motion leaves in a simulation of its own [J].
fn alone(way: Move) -> Result<f64, Box<dyn Error>> {
    let (model, mut state) = rope();
    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None)?;
    simulation.drive(&driven(&model.anchors[0], 0.0, way))?;
    for _ in 0..STEPS {
        simulation.step(DT)?;
    }
    simulation.store(&mut state);
    Ok(swing(&model, &state))
}

/// What each round of the plan found.
fn plan() -> Result<[Found; 2], Box<dyn Error>> {
    let (model, state) = rope();
    let mut batch = Batch::new(&vec![(&model, &state); SIDE * SIDE], &Settings::default(), None)?;
    let now = batch.snapshot();
    let coarse = best_of(&mut batch, &model, &[0.6..=1.6, 0.2..=0.8])?;
    batch.restore(&now)?;
    let [duration, halfway] = coarse.way;
    let fine = best_of(&mut batch, &model, &[duration - 0.1..=duration + 0.1, halfway - 0.1..=halfway + 0.1])?;
    Ok([coarse, fine])
}

fn main() -> Result<(), Box<dyn Error>> {
    let [coarse, fine] = plan()?;
    for Found { way: [duration, halfway], swing } in [coarse, fine] {
        let share = 100.0 * halfway;
        println!("in {duration:.2} s, {share:.0} % of the way in half of it: {:.3} mJ of swing are left", 1e3 * swing);
    }
    println!("the best motion alone leaves {:.3} mJ,", 1e3 * alone(fine.way)?);
    println!("an even one in a second {:.3} mJ", 1e3 * alone([1.0, 0.5])?);
    Ok(())
}

#[test]
fn a_plan_leaves_little_swing_and_alone_it_leaves_the_same() -> Result<(), Box<dyn Error>> {
    let [coarse, fine] = plan()?;
    assert!(coarse.swing.is_finite() && fine.swing <= 1.01 * coarse.swing, "{coarse:?} {fine:?}");
    for Found { way, swing } in [coarse, fine] {
        assert_eq!(swing, alone(way)?, "{way:?}");
    }
    let even = alone([1.0, 0.5])?;
    assert!(fine.swing < 0.2 * even, "{} J, {even} J", fine.swing);
    Ok(())
}
