//! Systems to test linear solvers on, and a dense oracle that shares nothing with them but the parts of the matrix.
#![allow(dead_code, missing_docs, unreachable_pub)]

use std::sync::Arc;

use component::{Component, Members, split};
use dynamics::formulation::Formulation;
use dynamics::guess::GuessKind;
use dynamics::simulation::{Settings, Simulation};
use dynamics::step::StepParams;
use jointed::linear::cg::CgParams;
use jointed::linear::solvers::SolverKind;
use jointed::system::System;
use kernels::Spatial;
use kernels::math::{Quat, Sym3, Vec3};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rod::Integrator;
use rod::{Assembly, Material, Model, RodSpec, State, shape};

pub const DT: f64 = 0.02;
pub const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

pub fn material(youngs_modulus: f64, density: f64) -> Material {
    Material { youngs_modulus, torsion_modulus: youngs_modulus, density }
}

/// Of Euler's rule, by which most tests know what is right; [`integrated`] has both.
pub fn settings(formulation: Formulation, solver: SolverKind) -> Settings {
    let (integrator, tolerance) = (Integrator::Euler, 1e-6);
    let step = StepParams {
        formulation,
        integrator,
        relative_tolerance: tolerance,
        motion_tolerance: tolerance,
        ..StepParams::DEFAULT
    };
    Settings { step, solver }
}

/// Every formulation with every integrator.
pub fn integrated() -> impl Iterator<Item = (Formulation, Integrator)> {
    Formulation::ALL.into_iter().flat_map(|formulation| Integrator::ALL.map(|integrator| (formulation, integrator)))
}

/// Every formulation with every guess that it may begin with, and a solver that begins there.
pub fn ways() -> impl Iterator<Item = (Formulation, GuessKind, SolverKind)> {
    let of = |formulation: Formulation| GuessKind::ALL.into_iter().map(move |kind| (formulation, kind));
    let may_begin = |(formulation, kind): &(Formulation, GuessKind)| !kind.helps_steps() || formulation.momentum();
    Formulation::ALL.into_iter().flat_map(of).filter(may_begin).map(|(formulation, kind)| {
        let solves = !kind.helps_steps() && kind != GuessKind::Zero;
        let solver = if solves { SolverKind::Cg(CgParams::default()) } else { SolverKind::Direct };
        (formulation, kind, solver)
    })
}

/// A straight rod along x, its first segment fixed.
pub fn rod(length: f64, segments: usize, radius: f64, material: Material) -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    let nodes = shape::straight(Vector3::zeros(), Vector3::x(), length, segments);
    let rod = assembly.rod(&RodSpec::new(nodes, radius, material));
    assembly.fix(rod.start);
    assembly.finish()
}

/// A helix whose two ends are clamped to the ground.
pub fn helix(segments: usize) -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    let nodes = shape::helix(Vector3::zeros(), 0.3, 0.8, 2.5, segments);
    let rod = assembly.rod(&RodSpec::new(nodes, 0.03, material(1e5, 500.0)));
    assembly.clamp_start(&rod).clamp_end(&rod);
    assembly.finish()
}

/// A trunk with a fork and a branch of a branch, clamped at its foot.
pub fn tree() -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    let line = |from: Vector3<f64>, direction, n| {
        RodSpec::new(shape::straight(from, direction, 0.15 * n as f64, n), 0.02, material(1e6, 700.0))
    };
    let trunk = assembly.rod(&line(Vector3::zeros(), Vector3::z(), 6));
    assembly.clamp_start(&trunk);
    for (parent, fraction, direction) in [(2, 1.0, Vector3::new(1.0, 0.2, 0.5)), (2, 0.5, Vector3::new(-1.0, 0.0, 1.0))]
    {
        let from = Vector3::new(0.0, 0.0, 0.15 * (parent as f64 + fraction));
        let branch = assembly.rod(&line(from, direction, 4));
        assembly.branch(parent, fraction, &branch);
        let twig = assembly.rod(&line(from + direction.normalize() * 0.3, Vector3::y(), 3));
        assembly.branch(branch.start + 1, 1.0, &twig);
    }
    assembly.finish()
}

/// A free ring with physical stretch that flies and turns.
pub fn ring() -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    let nodes = shape::ring(Vector3::zeros(), 0.5, 14);
    let spec =
        RodSpec { closed: true, stretch: rod::Stretch::Physical, ..RodSpec::new(nodes, 0.03, material(1e5, 400.0)) };
    assembly.rod(&spec);
    let (model, mut state) = assembly.finish();
    for (i, v) in state.velocities.iter_mut().enumerate() {
        *v = Vector3::new(0.0, 0.3 * (i as f64).sin(), 1.0);
    }
    (model, state)
}

/// The linear system of the first outer iteration of the step after `steps` steps of [`DT`] by sparse Cholesky, for
/// one connected set of segments.
pub fn component_after(
    model: &Model,
    state: &State,
    steps: usize,
    formulation: Formulation,
) -> (Component<f64>, Members) {
    let mut state = state.clone();
    if steps > 0 {
        let step = StepParams { formulation, ..StepParams::default() };
        let mut simulation =
            Simulation::new(model, &state, &Settings { step, solver: SolverKind::Sparse }, None).unwrap();
        for _ in 0..steps {
            simulation.step(DT).unwrap();
        }
        simulation.store(&mut state);
    }
    let (members, topology) = split(model).swap_remove(0);
    let mut component = Component::new(model, &state, Arc::new(topology), &[&members]);
    component.predict(0.0, DT, formulation);
    component.evaluate(formulation);
    (component, members)
}

fn v(x: Vec3<f64>) -> Vector3<f64> {
    Vector3::from(x.0)
}

fn rotation(q: Quat<f64>) -> Matrix3<f64> {
    Matrix3::from_columns(&[Vector3::x(), Vector3::y(), Vector3::z()].map(|e| v(q.rotate(Vec3([e.x, e.y, e.z])))))
}

fn symmetric(m: Sym3<f64>) -> Matrix3<f64> {
    let rows = m.full();
    Matrix3::from_fn(|r, c| rows[r][c])
}

/// A in the original rows, from J, M^-1 and alpha~ written out.
pub fn dense_matrix(system: &System<f64>) -> DMatrix<f64> {
    let (joints, bodies) = (system.joints.len(), system.bodies.len());
    let mut j = DMatrix::zeros(6 * joints, 6 * bodies);
    let mut alpha = DMatrix::zeros(6 * joints, 6 * joints);
    for (k, terms) in system.joints.iter().enumerate() {
        let [a, b] = system.topology.joints[k].map(|body| body as usize);
        let r_a = rotation(system.frame(k));
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Vec3);
        let g =
            r_a.transpose() * Matrix3::from_columns(&axes.map(|e| v(terms.rows.forward(terms.t, e)))) / terms.length;
        for (end, (body, sigma, z)) in [(a, 1.0, terms.offsets[0]), (b, -1.0, terms.offsets[1])].into_iter().enumerate()
        {
            let across = system.across.get(k).map_or(Vector3::zeros(), |ends| v(ends[end]));
            let arm = (v(system.bodies[body].axis) * z + across).cross_matrix() * -sigma;
            j.fixed_view_mut::<3, 3>(6 * k, 6 * body).copy_from(&(Matrix3::identity() * sigma));
            j.fixed_view_mut::<3, 3>(6 * k, 6 * body + 3).copy_from(&arm);
            j.fixed_view_mut::<3, 3>(6 * k + 3, 6 * body + 3).copy_from(&(g * -sigma));
        }
        let d = v(system.bodies[a].axis);
        let d2 = rotation(system.bodies[a].orientation).column(1).into_owned();
        let second = system.shear_extra.get(k).map_or(0.0, |&extra| extra);
        let stretch =
            Matrix3::identity() * terms.shear + d * d.transpose() * terms.stretch_extra + d2 * d2.transpose() * second;
        let bend = Matrix3::from_diagonal(&v(system.bend_twist_compliance(k)));
        alpha.fixed_view_mut::<3, 3>(6 * k, 6 * k).copy_from(&stretch);
        alpha.fixed_view_mut::<3, 3>(6 * k + 3, 6 * k + 3).copy_from(&bend);
    }
    let mut inverse_mass = DMatrix::zeros(6 * bodies, 6 * bodies);
    for (i, body) in system.bodies.iter().enumerate() {
        inverse_mass.fixed_view_mut::<3, 3>(6 * i, 6 * i).copy_from(&(Matrix3::identity() * body.inverse_mass));
        inverse_mass.fixed_view_mut::<3, 3>(6 * i + 3, 6 * i + 3).copy_from(&symmetric(body.inverse_inertia));
    }
    &j * inverse_mass * j.transpose() + alpha
}

pub fn flat(x: &[Spatial<f64>]) -> DVector<f64> {
    DVector::from_iterator(6 * x.len(), x.iter().flat_map(|x| x.to_array()))
}

pub fn spatials(x: &DVector<f64>) -> Vec<Spatial<f64>> {
    x.as_slice().chunks(6).map(|c| Spatial::from_array([c[0], c[1], c[2], c[3], c[4], c[5]])).collect()
}

pub fn rhs(system: &System<f64>) -> Vec<Spatial<f64>> {
    system.joints.iter().map(|joint| joint.rhs).collect()
}

/// The solution by dense Cholesky, of the symmetrically scaled system.
pub fn dense_solution(system: &System<f64>) -> DVector<f64> {
    let a = dense_matrix(system);
    let scale = DVector::from_iterator(a.nrows(), a.diagonal().iter().map(|d| 1.0 / d.sqrt()));
    let scaled = DMatrix::from_fn(a.nrows(), a.ncols(), |r, c| a[(r, c)] * scale[r] * scale[c]);
    let b = flat(&rhs(system)).component_mul(&scale);
    scaled.cholesky().unwrap().solve(&b).component_mul(&scale)
}
