use nalgebra::Vector3;
use rod::{
    Air, Assembly, Body, Contacts, Damping, Friction, Material, Obstacle, ObstacleShape, RodSpec, Surface, Wind, shape,
};

use super::*;
use crate::component::{Change, split_alike};
use crate::contact::PairFilter;
use crate::formulation::Formulation;
use crate::linear::solvers::SolverKind;
use crate::lockstep::Lockstep;
use crate::step::Status;

/// Eleven rods that differ in all but their connectivity fall across each other onto a rough ground, in wind; one more is longer.
fn falling() -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    for k in 0..12_u32 {
        let x = f64::from(k);
        let material = Material { youngs_modulus: 1e6 * (1.0 + x), torsion_modulus: 5e5, density: 500.0 + 10.0 * x };
        let along = Vector3::new((1.1 * x).cos(), (1.1 * x).sin(), 0.1);
        let nodes =
            shape::straight(Vector3::new(0.0, 0.0, 0.03 + 0.03 * x), along, 0.3 + 0.01 * x, 6 + k as usize / 11);
        let rod = assembly.rod(&RodSpec::new(nodes, 0.008, material));
        assembly.state_mut().velocities[rod].fill(Vector3::new(0.1 * x, 0.0, -1.0));
    }
    let wind = Wind::new(Vector3::new(3.0, 1.0, 0.0), None, None);
    assembly.air(Air { density: 1.2, normal_drag: 1.1, tangential_drag: 0.05, wind });
    let (mut model, state) = assembly.finish();
    model.damping = Damping { linear: 0.3, angular: 0.2 };
    let surface = Surface { friction: Friction::new(0.4), ..Surface::default() };
    let ground = ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: Vector3::z_axis() };
    model.contacts = Contacts {
        obstacles: vec![Obstacle::new(ground, surface)],
        between_segments: Some(surface),
        ..Contacts::default()
    };
    (model, state)
}

/// All sets of a model, solved directly.
fn lockstep((model, state): &(Model, State), fills_lanes: bool, params: &StepParams) -> Lockstep {
    let mut sets = Vec::new();
    for Alike { topology, sets: alike } in split_alike(model) {
        for members in alike {
            let component = Component::new(model, state, topology.clone(), &[&members]);
            let solver = SolverKind::Direct.build(model, &members, &topology).unwrap();
            sets.push(ConnectedSet::new(component, members, Projector::Solve { solver, guess: None }));
        }
    }
    Lockstep::new((model, state), sets, fills_lanes, PairFilter::new(model), params).unwrap()
}

#[test]
fn side_by_side_sets_have_the_bits_that_they_have_one_by_one() {
    let scene = falling();
    for formulation in [Formulation::XpbdGeometric, Formulation::Xpbd] {
        let params = StepParams { formulation, ..StepParams::DEFAULT };
        let (mut together, mut apart) = (lockstep(&scene, true, &params), lockstep(&scene, false, &params));
        let mut states = [scene.1.clone(), scene.1.clone()];
        for step in 0..40 {
            let interval = Interval { time: 0.01 * f64::from(step), dt: 0.01 };
            for (lockstep, state) in [&mut together, &mut apart].into_iter().zip(&mut states) {
                let change = match step {
                    // What is held no longer falls, and then goes on from there.
                    10 => Some(Change::Hold),
                    20 => Some(Change::LetGo),
                    _ => None,
                };
                if let Some(change) = change {
                    assert!(lockstep.change(Body::Segment(15), change, SolverKind::Direct).unwrap());
                }
                let status = lockstep.advance(interval, &params);
                assert!(status <= Status::ConvergedInSubsteps, "step {step}: {status:?}");
                lockstep.sets.iter().for_each(|set| set.store(state));
            }
            assert_eq!(states[0], states[1], "{formulation}, step {step}");
        }
        let [(one, other), (solves, others)] =
            [together.counters(), apart.counters()].map(|c| (c.iterations, c.contact_solves));
        assert_eq!((one, other), (solves, others), "iterations and contacts are counted alike");
        assert!(other > 0, "they touch");
        let used = |lockstep: &Lockstep| -> usize {
            lockstep.kinds.kinds.iter().map(|kind| kind.free.lock().unwrap().len()).sum()
        };
        assert_eq!((used(&together), used(&apart)), (1, 0), "side by side in one, one by one in the other");
    }
}

#[test]
fn a_momentum_residual_is_solved_for_one_by_one() {
    let scene = falling();
    let params = StepParams { formulation: Formulation::Newton, ..StepParams::DEFAULT };
    let mut lockstep = lockstep(&scene, true, &params);
    lockstep.advance(Interval { time: 0.0, dt: 0.01 }, &params);
    assert!(lockstep.kinds.kinds[0].free.lock().unwrap().is_empty());
}
