//! The builtin scene of a wire that yields.

use std::f64::consts::PI;

use cosserat::prelude::*;
use cosserat::scene;
use cosserat::state::measure;

/// Along the post a wire of stiffness EI is bent to the curvature k, by the moment `M = M_y + h / (1 + h) (EI k - M_y)`. Let go, it keeps `k - M / EI`.
#[test]
fn a_wire_springs_back_from_a_post() {
    let (stiffness, yields, hardening) = (2e11 * PI * 1e-12 / 4.0, 4.0 / 3.0 * 8e8 * 1e-9, 0.02);
    let Scene { model, mut state, run, .. } = scene::builtin("bent-wire").unwrap();
    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None).unwrap();
    // The joints that lie on the post all along.
    let curvature = |state: &State| {
        let turns = (12..19).map(|i| state.axis(i).angle(&state.axis(i + 1)) / 0.005);
        turns.sum::<f64>() / 7.0
    };
    let mut bent = 0.0;
    for step in 1..=run.steps {
        let status = simulation.step(run.dt).unwrap().status;
        assert!(status <= Status::ConvergedInSubsteps, "step {step}: {status:?}");
        if step == 220 {
            simulation.store(&mut state);
            bent = curvature(&state);
        }
    }
    simulation.store(&mut state);
    let left = curvature(&state);
    assert!((bent * 0.0409 - 1.0).abs() < 0.02, "bent to the post: {bent} 1/m");
    let moment = yields + hardening / (1.0 + hardening) * (stiffness * bent - yields);
    let expected = bent - moment / stiffness;
    // As the end goes on round the post, what lies on it springs back by a little already.
    assert!((left / expected - 1.0).abs() < 0.02, "{left} of {expected} 1/m");
    let energy = measure::energy(&model, &state);
    assert!(energy.kinetic < 1e-9, "at rest: {energy:?}");
    assert!(measure::dissipated(&model, &state) > 10.0 * energy.bend);
}
