//! The answers are equilibria of the solver's own statics.

use std::f64::consts::TAU;

use cosserat::assembly::{
    Assembly, LineInertia, Load, Material, RestShape, RodSpec, Section, Stiffness, Stretch, shape,
};
use cosserat::state::{Model, State, measure};
use cosserat::statics::{StaticParams, equilibrium};
use equilibria::sample::Distribution;
use equilibria::{Cable, CableOfModel, Equilibrium, Grip, Params, Query, solve};
use nalgebra::{UnitQuaternion, Vector3};

const GRAVITY: f64 = 9.81;

/// The query's cable as a model, in the shape of an answer whose segments are turned a little.
fn model(query: &Query, found: &Equilibrium, off: f64) -> (Model, State) {
    let Cable { length, bending, torsion, weight, rest, stretch_compliance, carried } = query.cable;
    let segments = found.positions.len();
    let section = Section::Known {
        stiffness: Stiffness { stretch: 1.0, shear: 1.0, bending, torsion },
        inertia: LineInertia { mass: weight / GRAVITY, polar: 1e-4 * weight },
    };
    let mut assembly = Assembly::new(-Vector3::z() * GRAVITY);
    let rod = assembly.rod(&RodSpec {
        sections: vec![section],
        stretch: Stretch::Compliance(stretch_compliance),
        rest: RestShape::Uniform(rest),
        ..RodSpec::new(
            shape::straight(query.start.position, Vector3::z(), length, segments),
            1e-2,
            Material { youngs_modulus: 1.0, torsion_modulus: 1.0, density: 1.0 },
        )
    });
    if carried.weight > 0.0 {
        let place = carried.place / length * segments as f64;
        let segment = (place as usize).min(segments - 1);
        let offset = (place - segment as f64 - 0.5) * length / segments as f64;
        let force = Vector3::z() * -carried.weight;
        assembly.load(Load { segment, offset, force, torque: Vector3::zeros(), follows: false });
    }
    assembly.clamp_start(&rod);
    if query.end.is_some() {
        assembly.clamp_end(&rod);
    }
    assembly.model_mut().measure_as_in_paper();
    let (mut model, mut state) = assembly.finish();
    for (anchor, grip) in model.anchors.iter_mut().zip([Some(query.start), query.end].into_iter().flatten()) {
        (anchor.position, anchor.orientation) = (grip.position, grip.orientation);
    }
    state.positions.clone_from(&found.positions);
    for (k, (own, q)) in state.orientations.iter_mut().zip(&found.orientations).enumerate() {
        let place = k as f64;
        let turn = Vector3::new(place.sin(), (1.7 * place).cos(), (0.3 * place).sin()) * off;
        *own = UnitQuaternion::from_scaled_axis(turn) * q;
    }
    (model, state)
}

fn queries() -> Vec<Query> {
    let mut queries: Vec<Query> = (0..24).map(|k| Distribution::default().query(7, k)).collect();
    queries.extend((0..8).map(|k| Distribution { curvature: 4.0, ..Distribution::default() }.query(8, k)));
    queries.extend((0..16).map(|k| Distribution { carried: 40.0, ..Distribution::default() }.query(9, k)));
    for (k, query) in queries.iter_mut().enumerate() {
        // Other units, unlike axes, a cable that stretches, an end that is free.
        if k % 2 == 1 {
            let (length, bending) = (2.5, 3e-3);
            query.cable.length *= length;
            query.cable.bending = [bending, 0.4 * bending];
            query.cable.torsion *= bending;
            query.cable.weight *= bending / length.powi(3);
            query.cable.rest /= length;
            query.cable.carried.weight *= bending / length.powi(2);
            query.cable.carried.place *= length;
            let shift = Vector3::new(1.0, -2.0, 3.0);
            query.start.position = shift;
            query.end = query.end.map(|end| Grip { position: end.position * length + shift, ..end });
        }
        if k % 4 == 2 {
            query.cable.stretch_compliance = 1e-4;
        }
        if k % 8 == 3 {
            query.end = None;
        }
    }
    queries
}

#[test]
fn statics_stays_where_the_answers_are() {
    let queries = queries();
    for segments in [12, 50] {
        let params = Params { segments, ..Params::default() };
        for (k, (query, answer)) in queries.iter().zip(solve(&queries, &params).unwrap()).enumerate() {
            let answer = answer.unwrap_or_else(|error| panic!("query {k}: {error}"));
            let found = &answer.equilibria[0];
            let (model, mut state) = model(query, found, 1e-3);
            let report = equilibrium(&model, &mut state, &StaticParams::default()).unwrap();
            assert!(report.converged && report.stable == Some(true), "query {k}: {report:?}");
            let off = state.positions.iter().zip(&found.positions).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(off <= 1e-8 * query.cable.length, "query {k}, {segments} segments: {off} m");
            let turned = state.orientations.iter().zip(&found.orientations).map(|(a, b)| a.angle_to(b));
            let turned = turned.fold(0.0, f64::max);
            assert!(turned <= 1e-7, "query {k}, {segments} segments: {turned} rad");
            let own = measure::energy(&model, &state).total();
            assert!((own - found.energy).abs() <= 1e-8 * own.abs(), "query {k}: {own} J, {} J", found.energy);
        }
    }
}

/// From starts of its own statics comes to other equilibria, too, but to none that is lower than the answer; from those without
/// more twist than it takes, mostly to branches that are answers.
#[test]
fn statics_finds_nothing_lower() {
    let queries: Vec<Query> = (0..100).map(|k| Distribution::default().query(9, k)).collect();
    let params = Params { segments: 30, branches: true, ..Params::default() };
    let (mut known, mut elsewhere) = (0, 0);
    for (k, (query, answer)) in queries.iter().zip(solve(&queries, &params).unwrap()).enumerate() {
        let found = answer.unwrap().equilibria;
        let (model, mut state) = model(query, &found[0], 0.0);
        // Turns go evenly from grip to grip, with whole turns about the axis for some.
        let (start, end) = (query.start.orientation, query.end.unwrap().orientation);
        let twist = TAU * (k % 3) as f64;
        let mut place = query.start.position;
        for i in 0..30 {
            let share = (i as f64 + 0.5) / 30.0;
            let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), twist * share);
            let q = start.slerp(&end, share) * roll;
            let half = q * Vector3::z() / 60.0;
            (state.orientations[i], state.positions[i]) = (q, place + half);
            place += half * 2.0;
        }
        let report = equilibrium(&model, &mut state, &StaticParams::default()).unwrap();
        assert!(report.converged && report.stable == Some(true), "query {k}: {report:?}");
        let own = measure::energy(&model, &state).total();
        let error = 1e-6 * own.abs().max(1.0);
        assert!(own >= found[0].energy - error, "query {k}: {own} J, {} J", found[0].energy);
        known += usize::from(k % 3 == 0 && found.iter().any(|branch| (branch.energy - own).abs() <= error));
        elsewhere += usize::from(own > found[0].energy + error);
    }
    println!(
        "of 100: {elsewhere} at other equilibria than the lowest; of 34 without whole turns {known} at branches that were found"
    );
    assert!(elsewhere > 20 && known > 30, "{elsewhere}, {known}");
}

#[test]
fn models_ask_the_queries_they_are_made_of() {
    let queries: Vec<Query> = queries().into_iter().filter(|query| query.end.is_some()).collect();
    for (k, (query, answer)) in queries.iter().zip(solve(&queries, &Params::default()).unwrap()).enumerate() {
        let found = &answer.unwrap().equilibria[0];
        let (mut model, mut state) = model(query, found, 1e-3);
        let cable = CableOfModel::new(&model, &state).unwrap_or_else(|| panic!("query {k}"));
        let same = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs().max(1.0);
        assert_eq!((cable.query.start, cable.query.end), (query.start, query.end));
        let numbers = |cable: Cable| {
            let Cable { length, bending: [first, second], torsion, weight, rest, stretch_compliance, carried } = cable;
            let place = if carried.weight > 0.0 { carried.place } else { 0.0 };
            let [x, y, z] = rest.into();
            [length, first, second, torsion, weight, x, y, z, stretch_compliance, carried.weight, place]
        };
        let pairs = numbers(cable.query.cable).into_iter().zip(numbers(query.cable));
        assert!(pairs.into_iter().all(|(a, b)| same(a, b)), "query {k}: {:?}, {:?}", cable.query.cable, query.cable);
        assert!(cable.is_near(&state, found));
        let before = state.clone();
        // A turn of twist more is another class, two are too far.
        for turns in [1.0, 2.0] {
            for (i, q) in state.orientations.iter_mut().enumerate() {
                let share = turns * (i as f64 + 0.5) / found.positions.len() as f64;
                *q = before.orientations[i] * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), TAU * share);
            }
            assert!(!cable.is_near(&state, found), "query {k}, {turns} turns");
        }
        cable.store(found, &mut state);
        assert_eq!((&state.positions, &state.orientations), (&found.positions, &found.orientations));
        for segment in [3, 5] {
            model.segments[segment].added_mass = 1e-3;
        }
        assert_eq!(CableOfModel::new(&model, &state), None);
        for segment in [3, 5] {
            model.segments[segment].added_mass = 0.0;
        }
        model.joints[4].twist_compliance *= 2.0;
        assert_eq!(CableOfModel::new(&model, &state), None);
    }
}

/// Fixed segments at the ends are grips, too: the model has the query's shape but for its end joints.
#[test]
fn fixed_segments_are_grips() {
    let mut assembly = Assembly::new(-Vector3::z() * GRAVITY);
    let material = Material { youngs_modulus: 2e7, torsion_modulus: 8e6, density: 1500.0 };
    let hung = shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 20);
    let rod = assembly.rod(&RodSpec::new(hung, 4e-3, material));
    for segment in [rod.start, rod.end - 1] {
        assembly.fix(segment);
    }
    let (model, mut state) = assembly.finish();
    state.positions[19].x -= 0.25;
    let cable = CableOfModel::new(&model, &state).unwrap();
    assert_eq!(cable.segments, (1..19).collect::<Vec<_>>());
    let end = cable.query.end.unwrap();
    assert!((cable.query.start.position - Vector3::x() * 0.05).norm() < 1e-12, "{}", cable.query.start.position);
    assert!((end.position - Vector3::x() * 0.7).norm() < 1e-12, "{}", end.position);
    assert!((cable.query.cable.length - 0.9).abs() < 1e-12);
}
