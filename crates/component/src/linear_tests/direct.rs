use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use jointed::linear::LinearSolver;
use jointed::linear::direct::*;
use jointed::system::System;
use kernels::Spatial;
use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rod::{Assembly, BodyShape, Material, Pose, RigidBody, RodSpec};

use crate::formulation::Formulation;
use crate::{Component, split};

fn random(rng: &mut impl Rng, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| size * rng.random_range(-1.0..1.0))
}

/// A rod along a random walk.
fn rod(assembly: &mut Assembly, start: Vector3<f64>, segments: usize, rng: &mut impl Rng) -> std::ops::Range<usize> {
    let mut nodes = vec![start];
    let mut direction = random(rng, 1.0);
    for k in 0..segments {
        direction = (direction + random(rng, 0.5)).normalize();
        nodes.push(nodes[k] + direction * rng.random_range(0.05..0.2));
    }
    let material = Material { youngs_modulus: 1e6, torsion_modulus: 5e5, density: 500.0 };
    assembly.rod(&RodSpec::new(nodes, 0.02, material))
}

/// One of: a chain, a tree with branches of branches, a star; with nothing, a segment or a face held.
fn assembly(seed: u64) -> Assembly {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let length = rng.random_range(2..14);
    let trunk = rod(&mut assembly, Vector3::zeros(), length, rng);
    let mut rods = vec![trunk.clone()];
    let kind = seed % 3;
    let (is_chain, is_tree) = (kind == 0, kind == 1);
    let branches = if is_chain { 0 } else { rng.random_range(1..6) };
    for _ in 0..branches {
        let of = rods[rng.random_range(0..rods.len())].clone();
        let parent = if is_tree { rng.random_range(of) } else { trunk.start };
        let start = assembly.state_mut().positions[parent];
        let length = rng.random_range(1..6);
        let branch = rod(&mut assembly, start, length, rng);
        assembly.branch(parent, rng.random_range(0.0..1.0), &branch);
        rods.push(branch);
    }
    match rng.random_range(0..4) {
        0 => {}
        1 => {
            assembly.fix(rng.random_range(trunk));
        }
        2 => {
            assembly.clamp_start(&trunk);
        }
        _ => {
            assembly.clamp_start(&trunk).clamp_end(&trunk).fix(rods[rods.len() - 1].start);
        }
    }
    let state = assembly.state_mut();
    for k in 0..state.positions.len() {
        state.velocities[k] = random(rng, 1.0);
        state.angular_velocities[k] = random(rng, 5.0);
    }
    assembly
}

/// The same with rigid bodies here and there: at the ends of rods, between two of them, in the middle of one.
fn with_bodies(seed: u64) -> Assembly {
    let rng = &mut ChaCha8Rng::seed_from_u64(1000 + seed);
    let mut assembly = assembly(seed);
    let segments = assembly.state_mut().len();
    for _ in 0..rng.random_range(1..4) {
        let count = assembly.state_mut().len();
        let sides = random(rng, 0.1).abs().add_scalar(0.05);
        let position = random(rng, 0.5);
        let orientation = UnitQuaternion::from_scaled_axis(random(rng, 3.0));
        let body = RigidBody::new(BodyShape::Box { sides }, rng.random_range(0.1..10.0));
        let body = assembly.body(body, Pose { position, orientation });
        let segment = if rng.random() { segments - 1 } else { rng.random_range(0..segments) };
        assembly.join_body(segment, rng.random_range(0.0..1.0), body, &random(rng, 0.1));
        for _ in 0..rng.random_range(0..3) {
            let length = rng.random_range(1..5);
            let rod = rod(&mut assembly, position, length, rng);
            assembly.join_body(rod.start, 0.0, body, &random(rng, 0.1));
        }
        let state = assembly.state_mut();
        for k in count..state.len() {
            (state.velocities[k], state.angular_velocities[k]) = (random(rng, 1.0), random(rng, 5.0));
        }
    }
    assembly
}

/// `A x` in world rows, from the parts of the system.
fn apply(system: &System<f64>, x: &[Spatial<f64>]) -> Vec<Spatial<f64>> {
    let mut impulses = vec![Spatial::zero(); system.bodies.len()];
    for (j, &x) in x.iter().enumerate() {
        system.add_impulse(j, x, &mut impulses);
    }
    let corrections: Vec<_> = impulses.iter().enumerate().map(|(i, &x)| system.correction(i, x)).collect();
    let change = |j: usize| {
        let compliance = Spatial {
            linear: system.stretch_compliance(j).apply(x[j].linear),
            angular: system.bend_compliance(j).apply(x[j].angular),
        };
        system.constraint_change(j, &corrections).plus(compliance, 1.0)
    };
    (0..x.len()).map(change).collect()
}

fn flat(x: &[Spatial<f64>]) -> DVector<f64> {
    DVector::from_iterator(6 * x.len(), x.iter().flat_map(|x| x.to_array()))
}

/// Solves in world rows with the tree and densely; returns the relative difference.
fn difference(system: &System<f64>, dlambda: &mut [Spatial<f64>]) -> f64 {
    let n = system.joints.len();
    let orientation = |j: usize| system.frame(j);
    let mut dense = DMatrix::zeros(6 * n, 6 * n);
    for column in 0..6 * n {
        let mut unit = vec![Spatial::zero(); n];
        let mut entry = [0.0; 6];
        entry[column % 6] = 1.0;
        unit[column / 6] = Spatial::from_array(entry);
        dense.set_column(column, &flat(&apply(system, &unit)));
    }
    let world = |j: usize| system.joints[j].to_world(system.joints[j].rhs, orientation(j));
    let rhs = flat(&(0..n).map(world).collect::<Vec<_>>());
    let expected = dense.lu().solve(&rhs).unwrap();
    Direct::new(&system.topology).unwrap().solve(system, false, dlambda);
    let got: Vec<_> = (0..n).map(|j| system.joints[j].multipliers_to_world(dlambda[j], orientation(j))).collect();
    (flat(&got) - &expected).norm() / expected.norm().max(f64::MIN_POSITIVE)
}

#[test]
fn chains_trees_and_stars_agree_with_a_dense_solve() {
    agree_with_a_dense_solve(assembly, 1e-9);
}

#[test]
fn rods_with_rigid_bodies_agree_with_a_dense_solve() {
    // Bodies are heavier than rods by orders of magnitude, and the matrix so much worse conditioned.
    agree_with_a_dense_solve(with_bodies, 1e-8);
}

fn agree_with_a_dense_solve(assembly: impl Fn(u64) -> Assembly, tolerance: f64) {
    let mut kinds = [0; 4];
    for seed in 0..60 {
        let (model, state) = assembly(seed).finish();
        for formulation in Formulation::ALL {
            for (members, topology) in split(&model) {
                kinds[0] += usize::from(topology.fold > 0);
                kinds[1] += usize::from(topology.branches > 0);
                kinds[2] += usize::from(topology.stack_depth > 1);
                kinds[3] += usize::from(topology.joints.len() == 2 * (topology.joints.len() / 2));
                let mut component = Component::new(&model, &state, Arc::new(topology), &[&members]);
                // With much longer steps the matrix is so ill-conditioned that dense LU and Cholesky disagree by more.
                component.predict(0.0, 1e-3, formulation);
                for iteration in 0..3 {
                    component.evaluate(formulation);
                    let error = difference(&component.system, &mut component.dlambda);
                    assert!(error < tolerance, "seed {seed} {formulation} iteration {iteration}: {error:e}");
                    component.update(formulation, 1.0);
                }
            }
        }
    }
    assert!(kinds.iter().all(|&count| count > 3), "{kinds:?}");
}

#[test]
fn a_star_with_many_arms_and_a_chain_of_half_turns_agree_with_a_dense_solve() {
    let material = Material { youngs_modulus: 1e9, torsion_modulus: 1e9, density: 1000.0 };
    let mut assembly = Assembly::new(Vector3::zeros());
    let nodes = |k: f64| vec![Vector3::new(0.0, 0.0, k), Vector3::new((k * FRAC_PI_2).cos(), k.sin(), k + 0.1)];
    let hub = assembly.rod(&RodSpec::new(nodes(0.0), 0.01, material));
    for k in 0..30 {
        let arm = assembly.rod(&RodSpec::new(nodes(f64::from(k)), 0.01, material));
        assembly.branch(hub.start, 0.03 * f64::from(k), &arm);
    }
    let (model, state) = assembly.finish();
    let (members, topology) = split(&model).remove(0);
    let mut component = Component::new(&model, &state, Arc::new(topology), &[&members]);
    component.predict(0.0, 0.01, Formulation::Newton);
    component.evaluate(Formulation::Newton);
    for (k, terms) in component.system.joints.iter_mut().enumerate() {
        terms.rhs = Spatial::from_array([k as f64, 1.0, -1.0, 0.5, 0.3, 0.1]);
    }
    let error = difference(&component.system, &mut component.dlambda);
    assert!(error < 1e-9, "{error:e}");
}
