//! The loss through conjugate gradients: it is what the solver leaves, and its gradient is that of differences.

use std::sync::Arc;

use component::{Component, Members, split};
use copingnet::CgLoss;
use dynamics::formulation::Formulation;
use dynamics::simulation::{Settings, Simulation};
use jointed::linear::LinearSolver;
use jointed::linear::cg::CgParams;
use jointed::linear::direct::Direct;
use jointed::linear::precondition::{Preconditioner, PreconditionerKind};
use jointed::linear::solvers::SolverKind;
use jointed::system::System;
use kernels::Spatial;
use nalgebra::Vector3;
use rod::{Assembly, Material, RodSpec, shape};

/// The first linear system after a few steps.
fn component(assembly: Assembly) -> Component<f64> {
    let (model, mut state) = assembly.finish();
    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None).unwrap();
    for _ in 0..8 {
        simulation.step(0.02).unwrap();
    }
    simulation.store(&mut state);
    let (members, topology) = split(&model).swap_remove(0);
    let mut component = Component::new(&model, &state, Arc::new(topology), &[&members]);
    component.predict(0.0, 0.02, Formulation::Xpbd);
    component.evaluate(Formulation::Xpbd);
    component
}

/// Of a planar rod, of a helix and of a tree.
fn components() -> Vec<Component<f64>> {
    let material = Material { youngs_modulus: 1e5, torsion_modulus: 2e5, density: 100.0 };
    let spec = |nodes| RodSpec::new(nodes, 0.05, material);
    let begin = || Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let mut rod = begin();
    let straight = rod.rod(&spec(shape::straight(Vector3::zeros(), Vector3::new(0.8, 0.0, 0.6), 3.0, 30)));
    rod.fix(straight.start);
    let mut helix = begin();
    let coil = helix.rod(&spec(shape::helix(Vector3::zeros(), 0.5, 0.5, 2.0, 24)));
    helix.fix(coil.start);
    let mut tree = begin();
    let trunk = tree.rod(&spec(shape::straight(Vector3::zeros(), Vector3::z(), 1.2, 8)));
    tree.clamp_start(&trunk);
    let from = Vector3::new(0.0, 0.0, 0.75);
    let branch = tree.rod(&spec(shape::straight(from, Vector3::new(1.0, 0.5, 0.5), 0.6, 4)));
    tree.branch(4, 1.0, &branch);
    [rod, helix, tree].map(component).into()
}

const KINDS: [PreconditionerKind; 3] =
    [PreconditionerKind::Raw, PreconditionerKind::Jacobi, PreconditionerKind::BlockJacobi];

fn loss(system: &System<f64>, kind: PreconditionerKind, steps: usize) -> CgLoss {
    CgLoss::new(&system.topology, Preconditioner::new(kind, &system.topology, None), steps)
}

fn solution(system: &System<f64>) -> Vec<Spatial<f64>> {
    let mut x = zeros(system);
    Direct::new(&system.topology).unwrap().solve(system, false, &mut x);
    x
}

/// The exact solution, off by half in a way without a pattern.
fn start(system: &System<f64>) -> Vec<Spatial<f64>> {
    let wrong = |(i, x): (usize, Spatial<f64>)| {
        let mut k = 7.0 * i as f64;
        Spatial::from_array(x.to_array().map(|x| {
            k += 2.3;
            x * (1.0 + 0.5 * k.sin())
        }))
    };
    solution(system).into_iter().enumerate().map(wrong).collect()
}

fn dot(a: &[Spatial<f64>], b: &[Spatial<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

fn zeros(system: &System<f64>) -> Vec<Spatial<f64>> {
    vec![Spatial::zero(); system.joints.len()]
}

#[test]
fn the_value_is_what_the_solver_leaves() {
    for component in components() {
        let system = &component.system;
        for kind in KINDS {
            for steps in [0, 1, 6] {
                let params = CgParams { preconditioner: kind, tolerance: 1e-9, max_iterations: Some(steps as u64) };
                let (model, _) = Assembly::new(Vector3::zeros()).finish();
                let mut cg = SolverKind::Cg(params).build(&model, &Members::default(), &system.topology).unwrap();
                let (mut x, mut gradient) = (start(system), zeros(system));
                let value = loss(system, kind, steps).value_and_gradient(system, &x, &mut gradient);
                let left = cg.solve(system, true, &mut x).residual;
                assert!((value - 2.0 * left.ln()).abs() < 1e-9, "{kind} {steps}: {value}");
            }
        }
    }
}

#[test]
fn the_gradient_is_that_of_central_differences() {
    for (which, component) in components().into_iter().enumerate() {
        let system = &component.system;
        for (kind, steps) in KINDS.into_iter().flat_map(|kind| [0, 1, 6].map(|steps| (kind, steps))) {
            let mut loss = loss(system, kind, steps);
            let (x, mut gradient, mut other) = (start(system), zeros(system), zeros(system));
            loss.value_and_gradient(system, &x, &mut gradient);
            for k in 0..6 {
                // All joints, then two at a time.
                let joints = if k < 3 { 0..x.len() } else { 4 * k - 12..4 * k - 10 };
                let mut direction = zeros(system);
                joints.for_each(|j| direction[j] = Spatial::zero().plus(x[j], ((3 * k + 5 * j) as f64).sin()));
                let mut value = |h: f64| {
                    let moved: Vec<Spatial<f64>> = x.iter().zip(&direction).map(|(x, d)| x.plus(*d, h)).collect();
                    loss.value_and_gradient(system, &moved, &mut other)
                };
                // Richardson's extrapolation of central differences.
                let mut difference = |h: f64| (value(h) - value(-h)) / (2.0 * h);
                let h = 1e-3;
                let expected = (4.0 * difference(0.5 * h) - difference(h)) / 3.0;
                let found = dot(&gradient, &direction);
                let apart = (found - expected).abs();
                assert!(apart < 1e-5 * expected.abs(), "{which} {kind} {steps} {k}: {found} {expected}");
            }
        }
    }
}

#[test]
fn what_cannot_be_improved_has_no_gradient() {
    let mut component = components().swap_remove(0);
    let nothing = zeros(&component.system);
    let exact = solution(&component.system);
    for kind in KINDS {
        let mut loss = loss(&component.system, kind, 6);
        let mut gradient = exact.clone();
        assert_eq!(loss.value_and_gradient(&component.system, &exact, &mut gradient), f64::ln(1e-24), "{kind}");
        assert_eq!(gradient, nothing);
        let far: Vec<Spatial<f64>> = exact.iter().map(|x| Spatial::zero().plus(*x, 1e200)).collect();
        gradient.clone_from(&exact);
        assert_eq!(loss.value_and_gradient(&component.system, &far, &mut gradient), f64::INFINITY);
        assert_eq!(gradient, nothing);
    }
    component.system.joints.iter_mut().for_each(|joint| joint.rhs = Spatial::zero());
    for kind in KINDS {
        let mut loss = loss(&component.system, kind, 6);
        for start in [&nothing, &exact] {
            let mut gradient = exact.clone();
            assert_eq!(loss.value_and_gradient(&component.system, start, &mut gradient), f64::ln(1e-24));
            assert_eq!(gradient, nothing);
        }
    }
}

#[test]
fn calls_do_not_allocate() {
    let component = components().swap_remove(1);
    let system = &component.system;
    let (mut loss, start, mut gradient) = (loss(system, KINDS[2], 6), start(system), zeros(system));
    let count = allocation_counter::measure(|| {
        loss.value_and_gradient(system, &start, &mut gradient);
    });
    assert_eq!(count.count_total, 0);
}
