//! Formulation `newton` ends a step where no surface would move by more than the tolerance: what a step comes to is compared with the same
//! step solved a hundred times finer.

use component::Members;
use dynamics::formulation::{Formulation, Tangent};
use dynamics::guess::GuessKind;
use dynamics::simulation::{Settings, Simulation};
use dynamics::step::Status;
use jointed::linear::solvers::SolverKind;
use jointed::topology::Topology;
use nalgebra::Vector3;
use rod::Integrator;
use rod::{Assembly, Contacts, Friction, Model, Obstacle, ObstacleShape, RodSpec, State, Surface, shape};

use crate::common::*;

/// A first correction that is as large as the tolerance says little of those to come: a little more than it may be left.
const MOST: f64 = 2.0;

/// The largest way between the surfaces of two states, relative to the tolerance: a share of what bodies measure, and no more than what
/// gravity moves in a step.
fn largest_way(model: &Model, [one, other]: [&State; 2], tolerance: f64) -> f64 {
    let ways = model.segments.iter().enumerate().map(|(i, segment)| {
        let turn = (one.orientations[i] * other.orientations[i].inverse()).scaled_axis();
        let spin = one.axis(i).dot(&turn);
        let tilt = (turn - one.axis(i) * spin).norm();
        let shift = (one.positions[i] - other.positions[i]).norm();
        let size = if model.contacts.is_empty() { segment.length } else { segment.radius };
        let way = shift.hypot(0.5 * tilt * segment.length).hypot(spin * segment.radius);
        way / (tolerance * size).min(model.gravity.norm() * DT * DT)
    });
    ways.fold(0.0, f64::max)
}

/// Steps of a scene, each beside the same step solved `finer`; returns the largest way between the two, relative to the tolerance.
fn off((model, state): &(Model, State), settings: &Settings, finer: f64, steps: usize, what: &str) -> f64 {
    let build = |m: &Model, s: &Members, t: &Topology| GuessKind::StepAdaptive.build(m, s, t);
    let mut fine = *settings;
    fine.step.motion_tolerance /= finer;
    // Gaps a tenth of that: friction is solved as exactly as sweeps can.
    fine.step.contact_tolerance /= 0.1 * finer;
    fine.step.contact.motion_tolerance *= 0.1;
    fine.step.max_iterations *= 4;
    let [mut one, mut other] =
        [settings, &fine].map(|settings| Simulation::new(model, state, settings, Some(&build)).unwrap());
    let [mut a, mut b] = [state.clone(), state.clone()];
    let tolerance = settings.step.allowed_motion(!model.contacts.is_empty());
    let (mut most, mut compared) = (0.0_f64, 0);
    for step in 0..steps {
        other.restore(&one.snapshot()).unwrap();
        let statuses = [&mut one, &mut other].map(|simulation| simulation.step(DT).unwrap().status);
        assert!(statuses.iter().all(|status| *status <= Status::PastHalfTurn), "{what}, step {step}: {statuses:?}");
        if statuses != [Status::Converged; 2] {
            continue;
        }
        compared += 1;
        one.store(&mut a);
        other.store(&mut b);
        most = most.max(largest_way(model, [&a, &b], tolerance));
    }
    assert!(10 * compared >= 9 * steps, "{what}: {compared} steps of {steps} as a whole");
    most
}

/// Stiff rods answer a small way with a large force, soft ones with next to none, and the positive matrix leaves more than a half of each
/// correction in a tree that sags far: the way is told right in all of them.
#[test]
fn a_step_that_has_converged_is_within_the_tolerance_of_its_solution() {
    let scenes = [
        ("soft", rod(3.0, 30, 0.01, material(1e4, 1000.0))),
        ("stiff", rod(1.0, 30, 0.01, material(2e11, 7800.0))),
        ("helix", helix(40)),
        ("tree", tree()),
        ("ring", ring()),
    ];
    for (name, scene) in &scenes {
        for (tangent, integrator) in Tangent::ALL.into_iter().flat_map(|t| Integrator::ALL.map(|i| (t, i))) {
            for tolerance in [1e-3, 1e-6] {
                let mut settings = settings(Formulation::Newton, SolverKind::Direct);
                settings.step.tangent = tangent;
                settings.step.integrator = integrator;
                (settings.step.relative_tolerance, settings.step.motion_tolerance) = (tolerance, tolerance);
                settings.step.absolute_tolerance = 0.0;
                // The positive matrix leaves more than a half in each iteration.
                settings.step.max_iterations = 100;
                let what = format!("{name}, {tangent}, {integrator}, {tolerance:e}");
                let off = off(scene, &settings, 100.0, 30, &what);
                println!("{what}: {off:.1e} of the tolerance");
                assert!(off <= MOST, "{what}: {off}");
            }
        }
    }
}

/// A cantilever that bends down onto the ground and comes to lie on it.
#[test]
fn a_step_with_contacts_is_within_the_tolerance_of_its_solution() {
    let mut assembly = Assembly::new(GRAVITY);
    let nodes = shape::straight(Vector3::z() * 0.2, Vector3::x(), 1.0, 20);
    let rod = assembly.rod(&RodSpec::new(nodes, 0.01, material(1e6, 1000.0)));
    assembly.fix(rod.start);
    let (mut model, state) = assembly.finish();
    let ground = ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: Vector3::z_axis() };
    let surface = Surface { friction: Friction::new(0.3), ..Surface::default() };
    model.contacts = Contacts { obstacles: vec![Obstacle::new(ground, surface)], ..Contacts::default() };
    let settings = settings(Formulation::Newton, SolverKind::Direct);
    let off = off(&(model, state), &settings, 100.0, 100, "ground");
    println!("{off:.1e} of the tolerance");
    assert!(off <= MOST, "{off}");
}
