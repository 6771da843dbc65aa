//! Predictions in the place of the constraint projection.

use component::{Component, Members};
use dynamics::formulation::{ContactProjection, Formulation, Tangent};
use dynamics::projection::Projection;
use dynamics::simulation::{Settings, Simulation};
use dynamics::step::{Status, StepParams};
use jointed::linear::LinearSolver;
use jointed::linear::solvers::SolverKind;
use jointed::topology::Topology;
use kernels::Spatial;
use rod::Integrator;
use rod::{Model, State};

use crate::common::*;

/// Predicts the exact solution, times `scale`, except in the outer iterations where `wrong` says so.
struct Exact {
    solver: Box<dyn LinearSolver>,
    scale: f64,
    wrong: fn(usize) -> bool,
}

impl Projection for Exact {
    fn project(
        &mut self,
        component: &Component<f64>,
        iteration: usize,
        dp: &mut [Spatial<f64>],
        dlambda: &mut [Spatial<f64>],
    ) {
        let system = &component.system;
        self.solver.solve(system, false, dlambda);
        dlambda.iter_mut().for_each(|x| *x = Spatial::zero().plus(*x, self.scale));
        for (j, (&dlambda, &[a, _])) in dlambda.iter().zip(&system.topology.joints).enumerate() {
            let q_a = system.bodies[a as usize].orientation;
            system.add_impulse(j, system.joints[j].multipliers_to_world(dlambda, q_a), dp);
        }
        for (body, dp) in dp.iter_mut().enumerate() {
            *dp = system.correction(body, *dp);
            if system.bodies[body].inverse_mass == 0.0 {
                *dp = Spatial::from_array([1.0; 6]);
            }
        }
        if (self.wrong)(iteration) {
            dp[1].angular.0[2] = f64::NAN;
        }
    }
}

fn end_to_end(model: &Model, state: &State, params: &StepParams, scale: f64, wrong: fn(usize) -> bool) -> Simulation {
    let build = |model: &Model, members: &Members, topology: &Topology| -> Box<dyn Projection> {
        Box::new(Exact { solver: SolverKind::Direct.build(model, members, topology).unwrap(), scale, wrong })
    };
    Simulation::end_to_end(model, state, params, &build).unwrap()
}

fn params(formulation: Formulation, max_iterations: usize) -> StepParams {
    // Predictions stand in for solves with the positive matrix.
    let tangent = Tangent::Positive;
    StepParams {
        formulation,
        tangent,
        integrator: Integrator::Euler,
        max_iterations,
        max_halvings: 0,
        ..StepParams::default()
    }
}

#[test]
fn exact_predictions_move_as_exact_solves_do() {
    let (mut model, state) = rod(3.0, 25, 0.05, material(1e5, 100.0));
    let load = |segment, offset, torque| rod::Load {
        segment,
        offset,
        force: nalgebra::Vector3::new(0.1, 0.3, 0.0),
        torque: nalgebra::Vector3::x() * torque,
        follows: false,
    };
    model.loads = vec![load(24, 0.02, 0.0), load(10, 0.0, 0.05)];
    for (model, state) in [(model, state), tree(), helix(24)] {
        for formulation in Formulation::ALL {
            for iterations in [1, 3] {
                let mut params = params(formulation, iterations);
                if formulation.momentum() {
                    // Predictions are judged by what they leave, solves by how far they move bodies: here none is good enough.
                    (params.relative_tolerance, params.absolute_tolerance, params.motion_tolerance) = (0.0, 0.0, 0.0);
                }
                let settings = Settings { step: params, ..Settings::default() };
                let mut exact = Simulation::new(&model, &state, &settings, None).unwrap();
                let mut predicted = end_to_end(&model, &state, &params, 1.0, |_| false);
                let (mut a, mut b) = (state.clone(), state.clone());
                for _ in 0..40 {
                    let statuses = [exact.step(DT).unwrap().status, predicted.step(DT).unwrap().status];
                    assert_eq!(statuses[0], statuses[1]);
                    exact.store(&mut a);
                    predicted.store(&mut b);
                    for i in 0..a.len() {
                        assert!((a.positions[i] - b.positions[i]).norm() < 1e-8, "{formulation}, {iterations}");
                        assert!(a.orientations[i].angle_to(&b.orientations[i]) < 1e-7);
                        assert!((a.velocities[i] - b.velocities[i]).norm() < 1e-5);
                    }
                }
                let (a, b) = (exact.counters(), predicted.counters());
                assert_eq!((a.steps, a.iterations, a.not_converged), (b.steps, b.iterations, b.not_converged));
                assert_eq!((b.guesses_used, b.guesses_dropped), (b.iterations, 0));
                assert!((a.worst_bend - b.worst_bend).abs() < 1e-6 * a.worst_bend.max(1e-6));
            }
        }
    }
}

#[test]
fn predictions_that_are_not_finite_are_dropped_and_counted() {
    let (model, state) = helix(24);
    let params = params(Formulation::Xpbd, 2);
    let mut none = end_to_end(&model, &state, &params, 0.0, |_| false);
    let mut dropped = end_to_end(&model, &state, &params, 1.0, |_| true);
    let (mut a, mut b) = (state.clone(), state.clone());
    for _ in 0..5 {
        assert_eq!(none.step(DT).unwrap().status, Status::OutOfIterations);
        assert_eq!(dropped.step(DT).unwrap().status, Status::OutOfIterations);
    }
    none.store(&mut a);
    dropped.store(&mut b);
    assert_eq!(a, b, "a prediction that is dropped corrects nothing");
    let counters = dropped.counters();
    assert_eq!((counters.guesses_used, counters.guesses_dropped, counters.iterations), (0, 10, 10));
    assert_eq!((counters.not_converged, counters.retries), (5, 0));
    assert!(counters.worst_stretch > 1e-3, "the residuals show it");
}

#[test]
fn huge_predictions_end_with_the_last_finite_state() {
    /// Multipliers whose residuals overflow, in the third step.
    struct Huge(usize);
    impl Projection for Huge {
        fn project(&mut self, _: &Component<f64>, _: usize, _: &mut [Spatial<f64>], dlambda: &mut [Spatial<f64>]) {
            self.0 += 1;
            dlambda.fill(Spatial::from_array([if self.0 > 2 { 1e153 } else { 0.0 }; 6]));
        }
    }
    let (model, state) = helix(24);
    let build = |_: &Model, _: &Members, _: &Topology| -> Box<dyn Projection> { Box::new(Huge(0)) };
    let mut simulation = Simulation::end_to_end(&model, &state, &params(Formulation::Xpbd, 1), &build).unwrap();
    let (mut before, mut after) = (state.clone(), state);
    let statuses: Vec<Status> = (0..3)
        .map(|_| {
            simulation.store(&mut before);
            simulation.step(DT).unwrap().status
        })
        .collect();
    simulation.store(&mut after);
    assert_eq!(statuses, [Status::OutOfIterations, Status::OutOfIterations, Status::NonFinite]);
    assert_eq!((after, simulation.counters().non_finite), (before, 1));
}

#[test]
fn an_impulse_changes_velocities_alone() {
    let (model, state) = rod(3.0, 25, 0.05, material(1e5, 100.0));
    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None).unwrap();
    simulation.step(DT).unwrap();
    let mut before = state.clone();
    simulation.store(&mut before);
    let mut kicked = before.clone();
    kicked.velocities[24].y += 2.0;
    simulation.set_velocities(&kicked);
    let mut after = state.clone();
    simulation.store(&mut after);
    assert_eq!(after, kicked);
    simulation.step(DT).unwrap();
    simulation.store(&mut after);
    assert!(after.positions[24].y > before.positions[24].y + 1e-3);
}

/// Two free rods, the second on its way onto the first.
fn colliding() -> (Model, State) {
    let mut assembly = rod::Assembly::new(nalgebra::Vector3::zeros());
    let [x, y, z] = [nalgebra::Vector3::x(), nalgebra::Vector3::y(), nalgebra::Vector3::z()];
    let straight =
        |start, along| rod::RodSpec::new(rod::shape::straight(start, along, 1.0, 10), 0.03, material(1e6, 500.0));
    assembly.rod(&straight(x * -0.47, x));
    let second = assembly.rod(&straight(z * 0.1 + y * -0.38, y));
    assembly.model_mut().contacts.between_segments = Some(rod::Surface::default());
    let (model, mut state) = assembly.finish();
    state.velocities[second].fill(z * -2.0 + y * 0.3);
    state.velocities.iter_mut().enumerate().for_each(|(i, v)| v.x += 0.1 * (i as f64).sin());
    (model, state)
}

#[test]
fn contacts_follow_predictions_and_keep_the_momentum() {
    let (model, state) = colliding();
    let momentum = |state: &State| {
        let of = |(segment, v): (&rod::Segment, &nalgebra::Vector3<f64>)| v * segment.mass();
        model.segments.iter().zip(&state.velocities).map(of).sum::<nalgebra::Vector3<f64>>()
    };
    for formulation in Formulation::ALL {
        for predictions in [1, 12] {
            let params =
                StepParams { contact_projection: ContactProjection::Alternating, ..params(formulation, predictions) };
            let mut solved =
                Simulation::new(&model, &state, &Settings { step: params, ..Settings::default() }, None).unwrap();
            let mut predicted = end_to_end(&model, &state, &params, 1.0, |_| false);
            let [mut a, mut b] = [state.clone(), state.clone()];
            for step in 0..15 {
                let statuses = [solved.step(DT).unwrap().status, predicted.step(DT).unwrap().status];
                assert_eq!(statuses[0], statuses[1], "{formulation}, {predictions}, step {step}");
                solved.store(&mut a);
                predicted.store(&mut b);
                let apart = a.positions.iter().zip(&b.positions).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
                assert!(apart < 1e-7, "{formulation}, {predictions}, step {step}: {apart:e}");
                let lost = (momentum(&b) - momentum(&state)).norm() / momentum(&state).norm();
                assert!(lost < 1e-9, "{formulation}, {predictions}, step {step}: {lost:e}");
            }
            assert!(b.velocities[0..10].iter().map(|v| v.z).sum::<f64>() < -1.0, "the first rod is struck");
            let (a, b) = (solved.counters(), predicted.counters());
            assert!(b.contact_solves > 0 && b.retries == 0);
            assert_eq!((a.iterations, a.contact_solves), (b.iterations, b.contact_solves));
        }
    }
}

#[test]
fn bad_predictions_that_touch_say_so_and_stay_finite() {
    /// Turns and shifts of this size, and no multipliers.
    struct Bad(f64);
    impl Projection for Bad {
        fn project(&mut self, _: &Component<f64>, iteration: usize, dp: &mut [Spatial<f64>], _: &mut [Spatial<f64>]) {
            let of = |body: usize| self.0 * (7.0 * body as f64 + iteration as f64).sin();
            dp.iter_mut().enumerate().for_each(|(body, dp)| *dp = Spatial::from_array([of(body); 6]));
        }
    }
    let (model, state) = colliding();
    for size in [1e-3, 0.3, 1e6, 1e100, 1e200] {
        let build = |_: &Model, _: &Members, _: &Topology| -> Box<dyn Projection> { Box::new(Bad(size)) };
        for predictions in [1, 5] {
            let params = params(Formulation::Xpbd, predictions);
            let mut simulation = Simulation::end_to_end(&model, &state, &params, &build).unwrap();
            let mut now = state.clone();
            for _ in 0..5 {
                assert!(simulation.step(DT).unwrap().status >= Status::OutOfIterations, "{size:e}");
            }
            simulation.store(&mut now);
            assert!(now.positions.iter().chain(&now.velocities).all(|x| x.norm().is_finite()), "{size:e}");
            assert_eq!(simulation.counters().retries, 0);
        }
    }
}
