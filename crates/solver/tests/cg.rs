//! Conjugate gradients and their preconditioners against dense algebra, and iteration counts as snapshots.

mod common;

use common::*;
use nalgebra::{DMatrix, DVector};
use solver::cg::CgParams;
use solver::component::{Component, Members};
use solver::formulation::Formulation;
use solver::linear::{LinearInfo, LinearSolver, LinearStatus};
use solver::operator::Operator;
use solver::precondition::PreconditionerKind;
use solver::solvers::{SolverError, SolverKind};
use solver::system::Six;

fn scenes() -> Vec<(&'static str, rod::Model, rod::State, usize)> {
    let named = |name, (model, state), steps| (name, model, state, steps);
    vec![
        named("rod", rod(3.0, 20, 0.05, material(1e5, 1000.0)), 20),
        named("helix", helix(24), 15),
        named("tree", tree(), 15),
        named("ring", ring(), 0),
    ]
}

fn solver_for(
    model: &rod::Model,
    members: &Members,
    component: &Component<f64>,
    params: CgParams,
) -> Box<dyn LinearSolver> {
    SolverKind::Cg(params).build(model, members, &component.system.topology).unwrap()
}

fn run(solver: &mut dyn LinearSolver, component: &Component<f64>) -> (LinearInfo, Vec<Six<f64>>) {
    let mut x = vec![Six::zero(); component.system.joints.len()];
    let info = solver.solve(&component.system, false, &mut x);
    (info, x)
}

fn has_loop(component: &Component<f64>) -> bool {
    component.system.topology.elimination.is_none()
}

/// Largest difference, entry by entry, in units of the largest entry of the same kind (force or torque).
fn difference(x: &DVector<f64>, y: &DVector<f64>) -> f64 {
    let size = |part: usize| (0..y.len()).filter(|i| (i / 3) % 2 == part).map(|i| y[i].abs()).fold(1e-300, f64::max);
    let sizes = [size(0), size(1)];
    (0..x.len()).map(|i| (x[i] - y[i]).abs() / sizes[(i / 3) % 2]).fold(0.0, f64::max)
}

#[test]
fn the_product_is_that_of_the_dense_matrix_and_symmetric() {
    for formulation in Formulation::ALL {
        for (name, model, state, steps) in scenes() {
            let (component, _) = component_after(&model, &state, steps, formulation);
            let dense = dense_matrix(&component.system);
            let topology = &component.system.topology;
            let mut operator = Operator::new(topology);
            operator.prepare(&component.system);
            let n = dense.nrows();
            let mut product = DMatrix::zeros(n, n);
            let mut out = vec![Six::zero(); n / 6];
            for column in 0..n {
                let mut unit = DVector::zeros(n);
                unit[column] = 1.0;
                let curvature = operator.apply(topology, &sixes(&unit), &mut out);
                product.set_column(column, &flat(&out));
                assert_eq!(curvature, product[(column, column)], "{name}");
            }
            let scale = |r: usize, c: usize| (dense[(r, r)] * dense[(c, c)]).sqrt();
            for r in 0..n {
                for c in 0..n {
                    assert!((product[(r, c)] - dense[(r, c)]).abs() < 1e-12 * scale(r, c), "{name} {formulation}");
                    assert!((product[(r, c)] - product[(c, r)]).abs() < 1e-12 * scale(r, c), "{name} {formulation}");
                }
                assert!(
                    (flat(&[operator.diagonal(&component.system, r / 6)])[r % 6] / dense[(r, r)] - 1.0).abs() < 1e-10
                );
            }
        }
    }
}

#[test]
fn every_preconditioner_leads_to_the_dense_solution() {
    for formulation in Formulation::ALL {
        for (name, model, state, steps) in scenes() {
            let (component, members) = component_after(&model, &state, steps, formulation);
            let expected = dense_solution(&component.system);
            for preconditioner in PreconditionerKind::ALL {
                if preconditioner == PreconditionerKind::Frozen && has_loop(&component) {
                    continue;
                }
                let params = CgParams { preconditioner, tolerance: 1e-11, ..CgParams::default() };
                let (info, x) = run(solver_for(&model, &members, &component, params).as_mut(), &component);
                assert_eq!(info.status, LinearStatus::Solved, "{name} {formulation} {preconditioner}");
                assert!(info.residual <= 1e-11 && info.iterations > 0);
                let difference = difference(&flat(&x), &expected);
                assert!(difference < 1e-6, "{name} {formulation} {preconditioner}: {difference:e} {info:?}");
            }
        }
    }
}

#[test]
fn counts() {
    let mut table = String::new();
    for (n, y) in [(30, 1e5), (60, 1e5), (100, 1e6)] {
        let (model, state) = rod(3.0, n, 0.05, material(y, 1000.0));
        for steps in [0, 1, 10, 25, 50] {
            let (component, members) = component_after(&model, &state, steps, Formulation::Xpbd);
            for preconditioner in PreconditionerKind::ALL {
                let counts = [1e-2, 1e-4, 1e-6, 1e-8].map(|tolerance| {
                    let params = CgParams { preconditioner, tolerance, ..CgParams::default() };
                    let (info, _) = run(solver_for(&model, &members, &component, params).as_mut(), &component);
                    (info.iterations, (info.stretch_residual * 1e4).round() / 1e4)
                });
                table += &format!("N={n} steps {steps} {preconditioner}: {counts:?}\n");
            }
        }
    }
    println!("{table}");
}

#[test]
fn loops_have_no_frozen_factor() {
    let (model, state) = ring();
    let (component, members) = component_after(&model, &state, 0, Formulation::Xpbd);
    let kind = SolverKind::cg(PreconditionerKind::Frozen);
    let error = kind.build(&model, &members, &component.system.topology).err().unwrap();
    assert!(matches!(error, SolverError::Loop { .. }));
    assert!(error.to_string().contains("frozen"));
}
