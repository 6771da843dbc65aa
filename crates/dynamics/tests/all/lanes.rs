//! Rods in the lanes of vector registers move like rods alone, to the last bit.

use dynamics::formulation::{Formulation, Tangent};
use dynamics::simulation::{Settings, Simulation};
use nalgebra::Vector3;
use rod::Integrator;
use rod::{Air, Assembly, BodyShape, Gusts, Material, Model, Pose, RigidBody, RodSpec, State, Wind};

const ALIKE: usize = 8;

/// Adds the `k`-th of some rods that differ in all but their connectivity; every rod has a branch where `branched`.
fn add(assembly: &mut Assembly, k: usize, segments: usize, branched: bool) {
    let t = k as f64;
    let material = Material { youngs_modulus: 1e5 * (1.0 + t), torsion_modulus: 1e5, density: 100.0 + 10.0 * t };
    let direction = Vector3::new(1.0, 0.1 * t, 0.05 * t).normalize();
    let nodes = |count: usize, from: Vector3<f64>, along: Vector3<f64>| -> Vec<Vector3<f64>> {
        (0..=count).map(|i| from + along * (0.1 * i as f64)).collect()
    };
    let start = Vector3::new(0.0, t, 0.0);
    let rod = assembly.rod(&RodSpec::new(nodes(segments, start, direction), 0.03 + 0.002 * t, material));
    assembly.fix(rod.start);
    if branched {
        let parent = rod.start + segments / 2;
        let branch = assembly.rod(&RodSpec::new(nodes(3, start + direction, Vector3::y()), 0.02, material));
        assembly.branch(parent, 0.5, &branch);
    }
    assembly.state_mut().velocities[rod.end - 1] = Vector3::new(0.0, t, 1.0);
}

/// Adds a rod with a box at its end, or with another segment there.
fn add_weighted(assembly: &mut Assembly, k: usize) {
    let first = assembly.state_mut().len();
    add(assembly, k, 6, false);
    let end = assembly.state_mut().len() - 1;
    let (position, orientation) = (assembly.state_mut().positions[end], assembly.state_mut().orientations[first]);
    if k.is_multiple_of(3) {
        let material = Material { youngs_modulus: 1e6, torsion_modulus: 1e6, density: 300.0 };
        let last = assembly.rod(&RodSpec::new(vec![position, position + Vector3::y()], 0.01, material));
        assembly.join(end, 1.0, last.start, 0.0);
    } else {
        let body = RigidBody::new(BodyShape::Box { sides: Vector3::new(0.1, 0.2, 0.1 * k as f64) }, 0.5);
        let body = assembly.body(body, Pose { position, orientation });
        assembly.join_body(end, 1.0, body, &Vector3::new(0.05, -0.1, 0.02 * k as f64));
        assembly.state_mut().angular_velocities[body] = Vector3::new(1.0, k as f64, -2.0);
    }
}

/// A storm, or no air at all.
fn airs() -> [Option<Air>; 2] {
    let gusts = Gusts { strength: 0.5, length: 1.0, time: 0.5, seed: 1 };
    let wind = Wind::new(Vector3::new(20.0, 5.0, 0.0), Some(gusts), Some(3.0));
    [None, Some(Air { density: 1.2, normal_drag: 1.1, tangential_drag: 0.05, wind })]
}

type How = (Formulation, Tangent, Integrator);

/// All formulations, with all tangents where they have one.
fn ways() -> impl Iterator<Item = How> {
    let ways = |own| {
        let tangents = if own == Formulation::Newton { &Tangent::ALL[..] } else { &[Tangent::Positive] };
        tangents.iter().flat_map(move |&tangent| Integrator::ALL.map(|by| (own, tangent, by)))
    };
    Formulation::ALL.into_iter().flat_map(ways)
}

fn run(model: &Model, mut state: State, (formulation, tangent, integrator): How) -> State {
    let mut settings = Settings::default();
    (settings.step.formulation, settings.step.tangent, settings.step.integrator) = (formulation, tangent, integrator);
    let mut simulation = Simulation::new(model, &state, &settings, None).unwrap();
    for _ in 0..20 {
        simulation.step(0.02).unwrap();
    }
    simulation.store(&mut state);
    state
}

#[test]
fn rods_in_lanes_have_the_bits_of_rods_alone() {
    for (segments, branched) in [(2, false), (5, false), (6, false), (30, false), (12, true)] {
        are_as_alone(|assembly, k| add(assembly, k, segments, branched));
    }
}

#[test]
fn rigid_bodies_in_lanes_have_the_bits_of_those_alone_beside_rods_without() {
    are_as_alone(add_weighted);
}

fn are_as_alone(add: impl Fn(&mut Assembly, usize)) {
    for air in airs() {
        for how in ways() {
            let mut together = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
            (0..ALIKE).for_each(|k| add(&mut together, k));
            together.model_mut().air.clone_from(&air);
            let (model, state) = together.finish();
            let together = run(&model, state, how);
            let mut offset = 0;
            for k in 0..ALIKE {
                let mut alone = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
                add(&mut alone, k);
                alone.model_mut().air.clone_from(&air);
                let (model, state) = alone.finish();
                let alone = run(&model, state, how);
                let own = offset..offset + alone.len();
                offset = own.end;
                assert_eq!(together.positions[own.clone()], alone.positions, "rod {k} of {} segments", alone.len());
                assert_eq!(together.orientations[own.clone()], alone.orientations);
                assert_eq!(together.velocities[own.clone()], alone.velocities);
                assert_eq!(together.angular_velocities[own], alone.angular_velocities);
            }
        }
    }
}
