//! The derivative of an equilibrium against central differences of equilibria.

use cosserat::derivative::{
    DerivativeError, Equilibrium, HeldVariation, Parameter, Rods, StateVariation, Variation, Wanted,
};
use cosserat::prelude::*;

use super::common::{moved, of_fourth_order, reading, vector};

const SCENES: [&str; 5] = ["heavy-cantilever", "hung-cable", "helix", "tree-10", "branch"];

/// Where a scene is at rest, held where its motions begin.
fn at_rest(name: &str) -> (Model, State) {
    let Scene { mut model, mut state, .. } = scene::builtin(name).unwrap();
    model.motions.clear();
    // Under its whole weight it is near buckling, and differences are of little use.
    if name == "branch" {
        model.gravity *= 0.1;
    }
    let report = statics::equilibrium(&model, &mut state, &StaticParams::default()).unwrap();
    assert!(report.converged, "{name}");
    (model, state)
}

/// Directions of all kinds that a model has.
fn directions(model: &Model) -> Vec<(&'static str, Variation)> {
    let of = |parameter: Parameter| parameter.variation(model);
    let mut out = vec![
        ("bending", of(Parameter::Bending(Rods::All))),
        ("bending of a rod", of(Parameter::Bending(Rods::One(0)))),
        ("second bending", of(Parameter::BendingAbout(1, Rods::All))),
        ("torsion", of(Parameter::Torsion(Rods::All))),
        ("stretch", of(Parameter::Stretch(Rods::All))),
        ("density", of(Parameter::Density(Rods::All))),
        ("gravity down", of(Parameter::Gravity(2))),
        ("gravity aside", of(Parameter::Gravity(1))),
    ];
    let mut rest = Variation::zero(model);
    rest.joints.iter_mut().enumerate().for_each(|(j, joint)| joint.rest_darboux = vector(j) * 0.1);
    out.push(("rest shape", rest));
    let held = model.segments.iter().enumerate().filter(|(_, segment)| segment.fixed).map(|(i, _)| Body::Segment(i));
    for (k, body) in held.chain((0..model.anchors.len()).map(Body::Anchor)).enumerate() {
        let mut grip = Variation::zero(model);
        grip.held.push(HeldVariation { body, poses: vec![[vector(40 + k) * 0.05, vector(50 + k) * 0.1]] });
        out.push(("grip", grip));
    }
    if !model.loads.is_empty() {
        let mut loads = Variation::zero(model);
        loads.loads.iter_mut().enumerate().for_each(|(i, load)| *load = [vector(i), vector(i + 9) * 0.1]);
        out.push(("loads", loads));
    }
    if model.air.is_some() {
        let air = [Parameter::AirDensity, Parameter::NormalDrag, Parameter::TangentialDrag, Parameter::Wind(1)];
        out.extend(air.map(|parameter| ("air", of(parameter))));
    }
    out
}

/// Forward and backward against central differences of fourth order, along all directions.
fn check(name: &str, model: &Model, state: &State) {
    let params = StaticParams::default();
    let mut equilibrium = Equilibrium::new(model, state, &params).unwrap_or_else(|error| panic!("{name}: {error}"));
    let count = model.segments.len();
    let mut weights = StateVariation::zero(count);
    for i in 0..count {
        (weights.positions[i], weights.turns[i]) = (vector(i), vector(i + count) * 0.1);
    }
    let gradient = equilibrium.backward(&weights, Wanted::ALL).unwrap();
    let rest = equilibrium.state().clone();
    // Of the sum that differences are taken of.
    let squares = rest.positions.iter().zip(&weights.positions).map(|(x, w)| x.norm_squared() * w.norm_squared());
    let rounding = f64::EPSILON * squares.sum::<f64>().sqrt();
    for (what, variation) in directions(model) {
        let change = equilibrium.forward(&variation).unwrap();
        let along = change.dot(&weights);
        let back = gradient.dot(&variation);
        let size: f64 = change.positions.iter().chain(&change.turns).map(|x| x.norm()).sum();
        assert!((along - back).abs() <= 1e-10 * size, "{name}, {what}: {along:e} forward, {back:e} backward");
        let h = if name == "branch" { 5e-4 } else { 5e-3 };
        let expected = of_fourth_order(h, |share| {
            let (model, state) = moved(model, &rest, &variation, share);
            let found =
                Equilibrium::new(&model, &state, &params).unwrap_or_else(|error| panic!("{name}, {what}: {error}"));
            let [found, about] = [found.state(), &rest].map(|state| [(state.clone(), Vec::new())]);
            reading(&found, &[(0, weights.clone())], &about)
        });
        let error = (along - expected).abs();
        let allowed = 1e-6 * expected.abs().max(1e-3 * size) + rounding / h;
        assert!(error < allowed, "{name}, {what}: {along:e}, differences say {expected:e}");
    }
}

#[test]
fn the_derivative_of_an_equilibrium_is_that_of_differences() {
    for name in SCENES {
        let (model, state) = at_rest(name);
        check(name, &model, &state);
    }
}

#[test]
fn drag_follows_the_shape_and_loads_turn_with_their_segments() {
    let (mut model, state) = at_rest("hung-cable");
    let wind = Wind::steady(Vector3::new(4.0, 3.0, 0.3));
    model.air = Some(Air { density: 1.2, normal_drag: 1.1, tangential_drag: 0.05, wind });
    check("wind", &model, &state);
    let (mut model, state) = at_rest("heavy-cantilever");
    let force = 2.0 * model.segments[3].mass() * model.gravity.norm() * Vector3::new(1.0, 2.0, 0.5);
    model.loads = vec![Load {
        segment: 3,
        offset: 0.3 * model.segments[3].length,
        force,
        torque: Vector3::zeros(),
        follows: false,
    }];
    check("load", &model, &state);
}

fn refused(model: &Model, state: &State, params: &StaticParams) -> DerivativeError {
    Equilibrium::new(model, state, params).err().expect("it is refused")
}

#[test]
fn what_has_no_derivative_is_refused() {
    let params = StaticParams::default();
    let (model, state) = at_rest("helix");
    let few = StaticParams { max_steps: 1, ..params };
    let begin = scene::builtin("helix").unwrap().state;
    assert!(matches!(refused(&model, &begin, &few), DerivativeError::NotAtRest));
    let mut touching = model.clone();
    touching.contacts.between_segments = Some(Surface::default());
    assert!(refused(&touching, &state, &params).to_string().contains("contacts"));

    // A ring that floats may be anywhere.
    let mut assembly = Assembly::new(Vector3::zeros());
    let rubber = Material { youngs_modulus: 2e6, torsion_modulus: 7e5, density: 1100.0 };
    let nodes = shape::ring(Vector3::zeros(), 0.5, 14);
    assembly.rod(&RodSpec { closed: true, ..RodSpec::new(nodes, 0.01, rubber) });
    let (floating, state) = assembly.finish();
    let error = refused(&floating, &state, &params);
    assert!(matches!(error, DerivativeError::Neutral), "{error}");
    let ring = scene::builtin("michell-ring").unwrap();
    let error = refused(&ring.model, &ring.state, &params);
    assert!(matches!(error, DerivativeError::Neutral | DerivativeError::NotAtRest), "{error}");
    // So may a rod about the axis of its hinge.
    let mut assembly = Assembly::new(Vector3::zeros());
    let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 10);
    let rod = assembly.rod(&RodSpec::new(nodes, 0.01, rubber));
    assembly.clamp_start(&rod);
    let (mut hinged, state) = assembly.finish();
    hinged.pin(0);
    let error = refused(&hinged, &state, &params);
    assert!(matches!(error, DerivativeError::Neutral), "{error}");

    let mut equilibrium = Equilibrium::new(&model, &begin, &params).unwrap();
    assert!(equilibrium.forward(&Variation::zero(&floating)).is_err());
    assert!(equilibrium.backward(&StateVariation::zero(3), Wanted::ALL).is_err());
    let mut free = Variation::zero(&model);
    free.held.push(HeldVariation { body: Body::Segment(20), poses: vec![[Vector3::x(), Vector3::zeros()]] });
    assert!(equilibrium.forward(&free).is_err());
}
