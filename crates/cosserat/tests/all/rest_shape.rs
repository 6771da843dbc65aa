//! The rest shape with which a hanging tree stays as it is drawn.

use cosserat::prelude::*;
use cosserat::statics::{RestShapeError, rest_shape};

/// A builtin scene in still air.
fn still(name: &str) -> (Model, State) {
    let Scene { mut model, state, .. } = scene::builtin(name).unwrap();
    model.air = None;
    (model, state)
}

fn farthest(a: &State, b: &State) -> f64 {
    a.positions.iter().zip(&b.positions).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

fn size(state: &State) -> f64 {
    let first = state.positions[0];
    state.positions.iter().map(|x| (x - first).norm()).fold(0.0, f64::max)
}

#[test]
fn what_is_drawn_is_at_rest() {
    for name in ["heavy-cantilever", "small-cantilever", "tree-10", "tree-20", "branch"] {
        let (mut model, drawn) = still(name);
        let mut sags = drawn.clone();
        statics::equilibrium(&model, &mut sags, &StaticParams::default()).unwrap();
        assert!(farthest(&drawn, &sags) > 1e-3 * size(&drawn), "{name} must sag for the test to say anything");

        let mut design = drawn.clone();
        rest_shape(&mut model, &mut design).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(farthest(&drawn, &design) < 1e-6 * size(&drawn), "{name}: joints yield");
        let mut rest = design.clone();
        let report = statics::equilibrium(&model, &mut rest, &StaticParams::default()).unwrap();
        assert!(report.converged, "{name}");
        let error = farthest(&design, &rest) / size(&drawn);
        assert!(error < 1e-9, "{name}: the equilibrium is {error:e} of its size away");
        assert!(report.steps <= 3, "{name}: {} solves", report.steps);
    }
}

#[test]
fn a_run_stays_in_the_design() {
    let (mut model, mut design) = still("tree-10");
    rest_shape(&mut model, &mut design).unwrap();
    let step = StepParams { formulation: Formulation::Newton, ..StepParams::default() };
    let mut simulation = Simulation::new(&model, &design, &Settings { step, ..Settings::default() }, None).unwrap();
    for _ in 0..50 {
        assert_eq!(simulation.step(0.02).unwrap().status, Status::Converged);
    }
    let mut end = design.clone();
    simulation.store(&mut end);
    let error = farthest(&design, &end) / size(&design);
    assert!(error < 1e-6, "{error:e} of its size away");
}

#[test]
fn loads_count_and_soft_joints_stretch() {
    let (mut model, drawn) = still("branch");
    for (segment, along) in [(15, 0.3), (25, -0.2)] {
        let force = Vector3::new(1.0, -2.0, 3.0) * 0.5 * model.segments[segment].mass() * 9.81;
        let torque = Vector3::new(0.02, 0.01, -0.03);
        model.loads.push(Load {
            segment,
            offset: along * model.segments[segment].length,
            force,
            torque,
            follows: false,
        });
    }
    // Stretch that can be seen.
    for joint in &mut model.joints {
        joint.stretch_compliance = 1e-6;
        joint.shear_compliance = 3e-6;
    }
    let mut design = drawn.clone();
    rest_shape(&mut model, &mut design).unwrap();
    assert!(farthest(&drawn, &design) > 1e-5, "it stretches");
    let mut rest = design.clone();
    assert!(statics::equilibrium(&model, &mut rest, &StaticParams::default()).unwrap().converged);
    let error = farthest(&design, &rest) / size(&drawn);
    assert!(error < 1e-9, "the equilibrium is {error:e} of its size away");
}

#[test]
fn what_is_no_clamped_tree_is_refused() {
    let refused = |name: &str, change: &dyn Fn(&mut Model)| {
        let (mut model, mut state) = still(name);
        change(&mut model);
        let before = (model.clone(), state.clone());
        let error = rest_shape(&mut model, &mut state).unwrap_err();
        assert!(before == (model, state), "{name}: nothing is changed");
        error
    };
    assert!(matches!(refused("hung-cable", &|_| {}), RestShapeError::Loop(_)));
    assert!(matches!(refused("michell-ring", &|_| {}), RestShapeError::Free(_)));
    assert_eq!(refused("branch", &|model| model.pin(3)), RestShapeError::Loose(3));
    assert!(matches!(refused("branch", &|model| model.gravity *= 1e9), RestShapeError::Moment(_)));
    let touches = |model: &mut Model| model.contacts.between_segments = Some(Surface::default());
    assert_eq!(refused("branch", &touches), RestShapeError::Unknown("contacts"));
}
