//! The builtin scenes of rods that run through eyelets.

use cosserat::prelude::*;
use cosserat::scene;
use cosserat::state::{Sliding, measure};

fn run(name: &str, mut see: impl FnMut(&Model, &State, &[Sliding])) {
    let Scene { model, mut state, run, .. } = scene::builtin(name).unwrap();
    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None).unwrap();
    let mut sliding = vec![Sliding::default(); model.sliding_joints.len()];
    for step in 0..run.steps {
        let status = simulation.step(run.dt).unwrap().status;
        assert!(status <= Status::ConvergedInSubsteps, "{name}, step {step}: {status:?}");
        simulation.store(&mut state);
        simulation.store_sliding(&mut sliding);
        see(&model, &state, &sliding);
    }
}

/// A tendon's tension times its distance bends the backbone by the same moment everywhere: to an arc. The distance is that of the eyelets and,
/// on average, d^2 / 12 times the curvature more, as the tendon is straight between two of them that are d apart.
#[test]
fn a_tendon_bends_its_backbone_to_an_arc() {
    let mut last = None;
    run("tendon-robot", |_, state, sliding| last = Some((state.clone(), sliding.to_vec())));
    let (state, sliding) = last.unwrap();
    let stiffness = 1e9 * std::f64::consts::PI * 0.004_f64.powi(4) / 4.0;
    let expected = 42.0 * 0.015 * 0.5 / (stiffness - 42.0 * 0.05 * 0.05 / 12.0);
    // From the clamp to the middle of the last segment.
    let bent = state.axis(19).angle(&Vector3::z()) / 0.975;
    assert!((bent / expected - 1.0).abs() < 0.021, "{bent} rad, {expected} rad");
    let turns: Vec<f64> = (1..19).map(|i| state.axis(i).angle(&state.axis(i + 1))).collect();
    let mean = turns.iter().sum::<f64>() / turns.len() as f64;
    assert!(turns.iter().all(|turn| (turn / mean - 1.0).abs() < 0.1), "an arc: {turns:?}");
    assert!(
        (sliding[0].force.norm() / 42.0 - 1.0).abs() < 2e-3,
        "without friction the pull arrives: {}",
        sliding[0].force
    );
    assert_eq!(sliding[0].place, 0.0);
}

#[test]
fn a_box_slides_down_a_rope_and_gains_no_energy() {
    let mut highest = None;
    let mut places = Vec::new();
    run("zip-line", |model, state, sliding| {
        let energy = measure::energy(model, state).total();
        let first = *highest.get_or_insert(energy);
        assert!(energy <= first + 1e-6 * first.abs(), "{energy} J, {first} J");
        places.push(sliding[0].place);
    });
    assert!(places.is_sorted() && places.last() > Some(&3.0), "{:?}", places.last());
}

/// The winch bears the load and what hangs out, lowers them as far as its speed says, and hoists them again.
#[test]
fn a_winch_lowers_a_load_and_hoists_it() {
    let (mut lowest, mut last, mut taut) = (f64::INFINITY, Sliding::default(), 0);
    run("winch", |_, state, sliding| {
        last = sliding[0];
        lowest = lowest.min(last.place);
        assert!(last.force.norm() < 500.0, "{last:?}");
        // The rope reaches no farther than what is outside, and mostly as far.
        let reach = state.positions[50].norm() / (2.5 - last.place - 0.025);
        assert!(reach < 1.0 + 1e-6, "{reach}");
        taut += usize::from(reach > 0.995);
    });
    // The integral of the speeds: 0.35 m/s over 1.4 s and half of 0.3 s twice, then back over 2.2 s with half of 0.3 s and of 0.5 s.
    let out = 0.35 * (0.15 + 1.4 + 0.15);
    let back = 0.35 * (0.15 + 2.2 + 0.25);
    assert!((lowest - (1.5 - out)).abs() < 2e-3, "{lowest} m");
    assert!((last.place - (1.5 - out + back)).abs() < 1e-3, "{} m", last.place);
    assert!(taut > 1000, "{taut} of 1250 steps");
}
