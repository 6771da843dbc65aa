//! Sections with sides, rest rotations, inner damping and springs of grips in every solver: against dense algebra, and from
//! lane to lane.

use dynamics::formulation::Formulation;
use dynamics::simulation::{Settings, Simulation};
use jointed::linear::cg::CgParams;
use jointed::linear::precondition::PreconditionerKind;
use jointed::linear::solvers::SolverKind;
use kernels::Spatial;
use nalgebra::{DVector, Vector3};
use rod::{Assembly, InnerDamping, Model, RestShape, RodSpec, Section, Springs, State, Stretch, shape};

use crate::common::*;

const DAMPING: InnerDamping = InnerDamping { bending: 0.01, twist: 0.03, stretch: 0.02 };

/// A grip that yields differently along d1, d2 and d3.
const SOFT: Springs = Springs { force: [3000.0, 1000.0, 2000.0], ..Springs::RIGID };

/// A strip that is curved and twisted at rest.
fn strip(segments: usize, k: f64) -> RodSpec {
    let nodes = shape::helix(Vector3::new(0.0, k, 0.0), 0.2 + 0.02 * k, 0.3, 0.5, segments);
    RodSpec {
        sections: vec![Section::Rectangle { width: 0.05, height: 0.01 }],
        stretch: Stretch::Physical,
        inner_damping: DAMPING,
        d1: Some(Vector3::new(0.3, 1.0, 0.5)),
        twist: 1.0,
        rest: RestShape::Uniform(Vector3::new(0.5, 1.0, -2.0)),
        ..RodSpec::new(nodes, 0.005, material(1e6 * (1.0 + k), 700.0))
    }
}

/// A chain long enough to be folded, a tree and a ring, each with all of it.
fn models() -> Vec<(&'static str, Model, State)> {
    let held = |ends: bool, twigs: usize| {
        let mut assembly = Assembly::new(GRAVITY);
        let rod = assembly.rod(&strip(20, 0.0));
        assembly.clamp_start(&rod);
        if ends {
            assembly.clamp_end(&rod);
        }
        for k in 0..twigs {
            let on = rod.start + 5 + 4 * k;
            let from = assembly.state_mut().positions[on];
            let nodes = shape::straight(from, Vector3::new(0.3, 1.0, k as f64), 0.3, 4);
            let twig = assembly.rod(&RodSpec { d1: None, rest: RestShape::Straight, nodes, ..strip(4, 0.5) });
            assembly.branch(on, 0.5, &twig);
        }
        let (mut model, state) = assembly.finish();
        model.measure_from_rest();
        model.soften(19, &SOFT);
        (model, state)
    };
    let (mut ring_model, ring_state) = ring();
    for (k, joint) in ring_model.joints.iter_mut().enumerate() {
        joint.bend_extra = (k % 3) as f64 * joint.bend_compliance;
        joint.shear_extra = (k % 2) as f64 * joint.shear_compliance;
        joint.inner_damping = DAMPING;
        if k % 2 == 0 {
            joint.measure_from_rest(0.5);
        }
    }
    let ((chain, chain_state), (both, both_state), (tree, tree_state)) =
        (held(false, 0), held(true, 0), held(false, 3));
    vec![
        ("chain", chain, chain_state),
        ("held at both ends", both, both_state),
        ("tree", tree, tree_state),
        ("ring", ring_model, ring_state),
    ]
}

fn kinds() -> Vec<SolverKind> {
    let cg =
        |preconditioner| SolverKind::Cg(CgParams { preconditioner, tolerance: 1e-13, max_iterations: Some(200_000) });
    let mut kinds = vec![SolverKind::Direct, SolverKind::Sparse];
    kinds.extend([PreconditionerKind::Jacobi, PreconditionerKind::BlockJacobi, PreconditionerKind::Frozen].map(cg));
    kinds
}

#[test]
fn every_solver_solves_the_same_system() {
    for formulation in Formulation::ALL {
        for (name, model, state) in models() {
            let (component, members) = component_after(&model, &state, 5, formulation);
            let system = &component.system;
            assert!(!system.frames.is_empty() && !system.bend_extra.is_empty() && !system.shear_extra.is_empty());
            let dense = dense_matrix(system);
            let exact = dense_solution(system);
            let size = |x: &DVector<f64>| x.dot(&(&dense * x)).sqrt();
            for kind in kinds() {
                let mut x = vec![Spatial::zero(); model.joints.len()];
                let mut solver = kind.build(&model, &members, &system.topology).unwrap();
                solver.solve(system, false, &mut x);
                let error = size(&(flat(&x) - &exact)) / size(&exact);
                assert!(error < 1e-6, "{name} {formulation} {kind}: {error:e}");
            }
        }
    }
}

/// With the residual's derivative by differences: the Jacobian that the system is made of is that of the constraints.
#[test]
fn newton_ends_in_few_iterations() {
    for (name, model, state) in models() {
        let mut settings = settings(Formulation::Newton, SolverKind::Direct);
        (settings.step.relative_tolerance, settings.step.motion_tolerance) = (1e-9, 1e-9);
        let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
        for step in 0..20 {
            let report = simulation.step(0.005).unwrap();
            assert_eq!(report.status, dynamics::step::Status::Converged, "{name}, step {step}");
        }
    }
}

#[test]
fn lanes_have_the_bits_of_rods_alone() {
    let run = |model: &Model, mut state: State| {
        let mut simulation = Simulation::new(model, &state, &Settings::default(), None).unwrap();
        for _ in 0..20 {
            simulation.step(0.01).unwrap();
        }
        simulation.store(&mut state);
        state
    };
    // Every third is a rod of the paper.
    let add = |assembly: &mut Assembly, k: usize| {
        let own = strip(15, k as f64);
        let rod = match k % 3 {
            0 => assembly.rod(&RodSpec::new(own.nodes, 0.01, own.material)),
            _ => assembly.rod(&own),
        };
        assembly.clamp_start(&rod);
        let model = assembly.model_mut();
        if k % 2 == 1 {
            model.soften(model.joints.len() - 1, &SOFT);
        }
    };
    let finish = |assembly: Assembly, from_rest: &dyn Fn(usize) -> bool| {
        let (mut model, state) = assembly.finish();
        for joint in &mut model.joints {
            let rod::Body::Segment(a) = joint.a else { continue };
            if from_rest(model.segments[a].rod) {
                joint.measure_from_rest(0.5);
            }
        }
        (model, state)
    };
    let mut together = Assembly::new(GRAVITY);
    (0..8).for_each(|k| add(&mut together, k));
    let (model, state) = finish(together, &|rod| rod % 3 == 2);
    let together = run(&model, state);
    for k in 0..8 {
        let mut alone = Assembly::new(GRAVITY);
        add(&mut alone, k);
        let (model, state) = finish(alone, &|_| k % 3 == 2);
        let alone = run(&model, state);
        let own = 15 * k..15 * (k + 1);
        assert_eq!(together.positions[own.clone()], alone.positions, "rod {k}");
        assert_eq!(together.orientations[own.clone()], alone.orientations, "rod {k}");
        assert_eq!(together.angular_velocities[own], alone.angular_velocities, "rod {k}");
    }
}

/// The moments of joints, in the axes of body a, balance at rest: the clamp holds what a torque at the end asks for.
#[test]
fn moments_of_joints_are_those_of_the_load() {
    let (_, mut model, mut state) = models().swap_remove(0);
    model.gravity = Vector3::zeros();
    // Stiff enough to come to rest in time.
    for joint in &mut model.joints {
        for compliance in [&mut joint.bend_compliance, &mut joint.bend_extra, &mut joint.twist_compliance] {
            *compliance *= 0.01;
        }
    }
    let torque = Vector3::new(0.02, -0.03, 0.01);
    model.loads.push(rod::Load { segment: 19, offset: 0.0, force: Vector3::zeros(), torque, follows: false });
    model.damping = rod::Damping { linear: 5.0, angular: 5.0 };
    let mut simulation =
        Simulation::new(&model, &state, &settings(Formulation::Newton, SolverKind::Direct), None).unwrap();
    for _ in 0..1500 {
        simulation.step(0.01).unwrap();
    }
    simulation.store(&mut state);
    let mut forces = vec![rod::JointForce::default(); model.joints.len()];
    simulation.store_joint_forces(&mut forces);
    for (joint, force) in model.joints.iter().zip(&forces) {
        let moment = model.pose(joint.a, &state).orientation * force.moment;
        assert!((moment.norm() / torque.norm() - 1.0).abs() < 1e-4, "{joint:?}: {moment}");
        assert!(moment.cross(&torque).norm() < 1e-4 * torque.norm_squared(), "{joint:?}: {moment}");
        assert!(force.residual(&model, &state, joint) < 1e-4);
    }
}
