//! Cables with three arms: answers are equilibria of the solver's own statics, balanced at the junction, and mirrored and turned as
//! their queries are.

use equilibria::branched::sample::BranchedDistribution;
use equilibria::branched::{
    ARMS, BranchedAnswer, BranchedEquilibrium, BranchedError, BranchedQuery, Junction, default_params, solve,
};
use equilibria::{Cable, Params};
use nalgebra::{UnitQuaternion, Vector3};
use rod::{
    Assembly, LineInertia, Material, Model, Pose, RestShape, RigidBody, RodSpec, Section, State, Stiffness, Stretch,
    shape,
};
use solver::statics::{StaticParams, equilibrium};

const GRAVITY: f64 = 9.81;
/// Of a junction that weighs next to nothing [kg].
const MASS: f64 = 1e-11;

fn queries(seed: u64, count: u64) -> Vec<BranchedQuery> {
    (0..count).map(|k| BranchedDistribution::default().query(seed, k)).collect()
}

/// The query's cable as a tree, in the shape of an answer whose segments are turned a little. The junction is a body that weighs
/// next to nothing.
fn model(query: &BranchedQuery, found: &BranchedEquilibrium, off: f64) -> (Model, State) {
    let mut assembly = Assembly::new(-Vector3::z() * GRAVITY);
    let segments = found.arms[0].positions.len();
    let rods: Vec<_> = (0..ARMS)
        .map(|k| {
            let Cable { length, bending, torsion, weight, rest, stretch_compliance, .. } = query.arms[k];
            let section = Section::Known {
                stiffness: Stiffness { stretch: 1.0, shear: 1.0, bending, torsion },
                inertia: LineInertia { mass: weight / GRAVITY, polar: 1e-4 * weight },
            };
            let start = query.grips[k].position;
            assembly.rod(&RodSpec {
                sections: vec![section],
                stretch: Stretch::Compliance(stretch_compliance),
                rest: RestShape::Uniform(rest),
                ..RodSpec::new(
                    shape::straight(start, Vector3::z(), length, segments),
                    1e-2,
                    Material { youngs_modulus: 1.0, torsion_modulus: 1.0, density: 1.0 },
                )
            })
        })
        .collect();
    let Junction { position, orientation } = found.junction;
    let junction = assembly.body(RigidBody::hidden(MASS, Vector3::repeat(1e-15)), Pose { position, orientation });
    for rod in &rods {
        assembly.clamp_start(rod);
        assembly.join_body(rod.end - 1, 1.0, junction, &Vector3::zeros());
    }
    let (mut model, mut state) = assembly.finish();
    for (anchor, grip) in model.anchors.iter_mut().zip(&query.grips) {
        (anchor.position, anchor.orientation) = (grip.position, grip.orientation);
    }
    let directions = equilibria::branched::query::directions();
    let mut arm = 0;
    for joint in &mut model.joints {
        if joint.mount.is_some() {
            joint.rest_frames = [UnitQuaternion::identity(), directions[arm]];
            joint.rest_darboux = query.arms[arm].rest;
            arm += 1;
        }
    }
    for (rod, arm) in rods.iter().zip(&found.arms) {
        for (k, i) in rod.clone().enumerate() {
            let place = i as f64;
            let turn = Vector3::new(place.sin(), (1.7 * place).cos(), (0.3 * place).sin()) * off;
            state.positions[i] = arm.positions[k];
            state.orientations[i] = UnitQuaternion::from_scaled_axis(turn) * arm.orientations[k];
        }
    }
    (model, state)
}

#[test]
fn statics_stays_where_the_answers_are() {
    let mut queries = queries(7, 24);
    for (k, query) in queries.iter_mut().enumerate() {
        // Other units, unlike axes, arms that are bent at rest, and ones that stretch.
        if k % 2 == 1 {
            let (length, bending) = (2.5, 3e-3);
            let shift = Vector3::new(1.0, -2.0, 3.0);
            for (arm, grip) in query.arms.iter_mut().zip(&mut query.grips) {
                arm.length *= length;
                arm.bending = [arm.bending[0] * bending, 0.4 * arm.bending[0] * bending];
                arm.torsion *= bending;
                arm.weight *= bending / length.powi(3);
                arm.rest = Vector3::new(0.3, -0.8, 0.5);
                grip.position = grip.position * length + shift;
            }
        }
        if k % 4 == 2 {
            query.arms.iter_mut().for_each(|arm| arm.stretch_compliance = 1e-4);
        }
    }
    for segments in [10, 20] {
        let params = Params { segments, ..default_params() };
        for (k, (query, answer)) in queries.iter().zip(solve(&queries, &params).unwrap()).enumerate() {
            let answer = answer.unwrap_or_else(|error| panic!("query {k}: {error}"));
            let found = &answer.equilibria[0];
            let (model, mut state) = model(query, found, 1e-3);
            let report = equilibrium(&model, &mut state, &StaticParams::default()).unwrap();
            assert!(report.converged && report.stable == Some(true), "query {k}: {report:?}");
            let length = query.arms[0].length;
            let own = found.arms.iter().flat_map(|arm| &arm.positions).chain([&found.junction.position]);
            let off = state.positions.iter().zip(own).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(off <= 1e-8 * length, "query {k}, {segments} segments: {off} m");
            let own = found.arms.iter().flat_map(|arm| &arm.orientations).chain([&found.junction.orientation]);
            let turned = state.orientations.iter().zip(own).map(|(a, b)| a.angle_to(b)).fold(0.0, f64::max);
            assert!(turned <= 1e-7, "query {k}, {segments} segments: {turned} rad");
            let body = MASS * GRAVITY * found.junction.position.z;
            let own = rod::measure::energy(&model, &state).total() - body;
            assert!((own - found.energy).abs() <= 1e-8 * own.abs().max(1e-3), "query {k}: {own} J, {} J", found.energy);
        }
    }
}

fn lowest(answers: &[Result<BranchedAnswer, BranchedError>], k: usize) -> &BranchedEquilibrium {
    &answers[k].as_ref().unwrap_or_else(|error| panic!("query {k}: {error}")).equilibria[0]
}

#[test]
fn forces_and_moments_balance_at_the_junction() {
    let queries = queries(8, 200);
    let answers = solve(&queries, &default_params()).unwrap();
    for (k, query) in queries.iter().enumerate() {
        let found = lowest(&answers, k);
        let forces = found.arms.iter().map(|arm| arm.grips[1].force).sum::<Vector3<f64>>();
        let moments = found.arms.iter().map(|arm| arm.grips[1].moment).sum::<Vector3<f64>>();
        let size = 1.0 + found.arms.iter().map(|arm| arm.grips[1].force.norm()).fold(0.0, f64::max);
        assert!(forces.norm() <= 1e-6 * size && moments.norm() <= 1e-6 * size, "query {k}: {forces} {moments}");
        let weight: f64 = query.arms.iter().map(|arm| arm.weight * arm.length).sum();
        let held = found.arms.iter().map(|arm| arm.grips[0].force).sum::<Vector3<f64>>();
        assert!((held - Vector3::z() * weight).norm() <= 1e-6 * size, "query {k}: {held}");
        for (arm, cable) in found.arms.iter().zip(&query.arms) {
            let (last, q) = (arm.positions[19], arm.orientations[19]);
            let end = last + q * Vector3::z() * (cable.length / 40.0);
            assert!((end - found.junction.position).norm() <= 1e-7, "query {k}");
        }
    }
}

