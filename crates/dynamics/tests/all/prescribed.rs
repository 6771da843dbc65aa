//! Fixed segments follow their motion exactly, whatever leads the others there.

use std::ops::Range;

use component::{BodyPose, Component, Members};
use dynamics::formulation::{ContactProjection, Formulation};
use dynamics::guess::{GuessKind, InitialGuess};
use dynamics::projection::Projection;
use dynamics::simulation::{Settings, Simulation};
use dynamics::step::{Status, StepParams};
use jointed::linear::LinearSolver;
use jointed::linear::solvers::SolverKind;
use jointed::topology::Topology;
use kernels::Spatial;
use kernels::math::Vec3;
use nalgebra::{Unit, UnitQuaternion, Vector3};
use rod::Integrator;
use rod::{Assembly, Friction, Model, Obstacle, ObstacleShape, RodSpec, State, Surface, shape};

use crate::common::{GRAVITY, material, settings, ways};

const DT: f64 = 0.01;
const SEGMENTS: usize = 20;
const STEPS: usize = 500;
const SPEED: Vector3<f64> = Vector3::new(0.05, -0.02, 0.03);
const SPIN: Vector3<f64> = Vector3::new(0.6, 0.5, 1.0);

/// Rods whose first segments turn and drift, and where each begins.
fn turning(rods: usize) -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    for k in 0..rods {
        let start = Vector3::new(0.0, 3.0 * k as f64, 0.0);
        let nodes = shape::straight(start, Vector3::new(1.0, 0.2, -0.1), 1.0, SEGMENTS);
        let rod = assembly.rod(&RodSpec::new(nodes, 0.02, material(1e6, 1000.0)));
        assembly.fix(rod.start);
        let state = assembly.state_mut();
        (state.velocities[rod.start], state.angular_velocities[rod.start]) = (SPEED, SPIN);
    }
    assembly.finish()
}

/// Steps `simulation` over `steps` and compares each pose of fixed segments, which move from `from` at the first of them.
fn follow(simulation: &mut Simulation, model: &Model, from: &State, steps: Range<usize>, what: &str) {
    let mut now = from.clone();
    for step in steps.clone() {
        simulation.step(DT).unwrap();
        simulation.store(&mut now);
        let elapsed = (step + 1 - steps.start) as f64 * DT;
        for i in (0..model.segments.len()).filter(|&i| model.segments[i].fixed) {
            let (v, w) = (from.velocities[i], from.angular_velocities[i]);
            let gap = (now.positions[i] - (from.positions[i] + v * elapsed)).norm();
            let turned = UnitQuaternion::from_scaled_axis(w * elapsed) * from.orientations[i];
            let apart = now.orientations[i].coords - turned.coords;
            let back = now.orientations[i].coords + turned.coords;
            assert!(gap <= 1e-12, "{what}, step {step}, segment {i}: {gap:e} m");
            assert!(apart.norm().min(back.norm()) <= 1e-12, "{what}, step {step}, segment {i}: {:e}", apart.norm());
            assert_eq!((now.velocities[i], now.angular_velocities[i]), (v, w), "{what}, step {step}");
        }
    }
    assert!(now.positions.iter().all(|x| x.norm().is_finite()), "{what}");
}

fn check(model: &Model, state: &State, settings: &Settings, kind: GuessKind, what: &str) -> Simulation {
    let build = |model: &Model, members: &Members, topology: &Topology| kind.build(model, members, topology);
    let mut simulation = Simulation::new(model, state, settings, Some(&build)).unwrap();
    follow(&mut simulation, model, state, 0..STEPS, what);
    simulation
}

#[test]
fn with_every_formulation_and_guess() {
    let (model, state) = turning(1);
    for (formulation, kind, solver) in ways() {
        let what = format!("{formulation}, {kind}");
        let simulation = check(&model, &state, &settings(formulation, solver), kind, &what);
        assert!(kind == GuessKind::Zero || simulation.counters().guesses_used > 0, "{what}");
    }
}

#[test]
fn in_substeps_alone_and_in_lanes() {
    for rods in [1, 3] {
        let (model, state) = turning(rods);
        for formulation in Formulation::ALL {
            for kind in [GuessKind::Zero, GuessKind::StepQuadratic] {
                if kind.helps_steps() && !formulation.momentum() {
                    continue;
                }
                let mut settings = settings(formulation, SolverKind::Direct);
                (settings.step.max_iterations, settings.step.max_halvings) = (1, 2);
                (settings.step.relative_tolerance, settings.step.absolute_tolerance, settings.step.motion_tolerance) =
                    (1e-13, 1e-13, 1e-13);
                let what = format!("{formulation}, {kind}, {rods} rods");
                let simulation = check(&model, &state, &settings, kind, &what);
                assert!(simulation.counters().retries > 10, "{what}: {} retries", simulation.counters().retries);
            }
        }
    }
}

#[test]
fn among_contacts() {
    let (mut model, state) = turning(2);
    let surface = Surface { friction: rod::Friction::new(0.3), ..Surface::default() };
    let plane = ObstacleShape::HalfSpace { point: Vector3::z() * -0.5, normal: Unit::new_normalize(Vector3::z()) };
    model.contacts.obstacles.push(Obstacle::new(plane, surface));
    for (formulation, kind) in [(Formulation::Xpbd, GuessKind::Zero), (Formulation::Newton, GuessKind::StepQuadratic)] {
        for contact_projection in ContactProjection::ALL {
            let mut settings = settings(formulation, SolverKind::Direct);
            settings.step.contact_projection = contact_projection;
            (settings.step.relative_tolerance, settings.step.motion_tolerance) = (1e-3, 1e-3);
            settings.step.max_halvings = 1;
            let what = format!("{formulation}, {kind}, {contact_projection}");
            let simulation = check(&model, &state, &settings, kind, &what);
            assert!(simulation.counters().contact_solves > 0, "{what}");
        }
    }
}

/// Writes nonsense over the poses of fixed segments, and the prediction over all others.
struct Meddler;

impl InitialGuess for Meddler {
    fn helps_steps(&self) -> bool {
        true
    }

    fn start_step(&mut self, component: &Component<f64>, poses: &mut [BodyPose<f64>], _: &mut [Spatial<f64>]) -> bool {
        for (pose, is_fixed) in poses.iter_mut().zip(&component.system.topology.fixed) {
            if *is_fixed {
                pose.x += Vec3([f64::NAN, 1.0, -1.0]);
            }
        }
        true
    }
}

#[test]
fn whatever_a_guess_says_of_them() {
    let (model, state) = turning(1);
    let meddler = |_: &_, _: &_, _: &_| Some(Box::new(Meddler) as Box<dyn InitialGuess>);
    let settings = settings(Formulation::Newton, SolverKind::Direct);
    let mut simulation = Simulation::new(&model, &state, &settings, Some(&meddler)).unwrap();
    follow(&mut simulation, &model, &state, 0..50, "meddler");
    let counters = simulation.counters();
    assert_eq!((counters.guesses_used, counters.guesses_dropped), (50, 0));
}

/// Half of the exact solution, and corrections of fixed segments that nobody asked for.
struct Half(Box<dyn LinearSolver>);

impl Projection for Half {
    fn project(&mut self, component: &Component<f64>, _: usize, dp: &mut [Spatial<f64>], dlambda: &mut [Spatial<f64>]) {
        let system = &component.system;
        self.0.solve(system, false, dlambda);
        for (j, (dlambda, ends)) in dlambda.iter_mut().zip(&system.topology.joints).enumerate() {
            *dlambda = Spatial::zero().plus(*dlambda, 0.5);
            let q_a = system.bodies[ends[0] as usize].orientation;
            system.add_impulse(j, system.joints[j].multipliers_to_world(*dlambda, q_a), dp);
        }
        for (body, dp) in dp.iter_mut().enumerate() {
            let is_fixed = system.topology.fixed[body];
            *dp = if is_fixed { Spatial::from_array([0.7; 6]) } else { system.correction(body, *dp) };
        }
    }
}

#[test]
fn where_projections_are_predicted() {
    let (model, state) = turning(1);
    let build = |model: &Model, members: &Members, topology: &Topology| -> Box<dyn Projection> {
        Box::new(Half(SolverKind::Direct.build(model, members, topology).unwrap()))
    };
    for formulation in Formulation::ALL {
        let integrator = Integrator::Euler;
        let params = StepParams { formulation, integrator, max_iterations: 4, ..StepParams::DEFAULT };
        let mut simulation = Simulation::end_to_end(&model, &state, &params, &build).unwrap();
        follow(&mut simulation, &model, &state, 0..STEPS, &format!("end to end, {formulation}"));
    }
}

#[test]
fn new_velocities_lead_on_from_where_they_are_given() {
    for rods in [1, 3] {
        let (model, mut state) = turning(rods);
        let settings = settings(Formulation::Newton, SolverKind::Direct);
        let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
        follow(&mut simulation, &model, &state, 0..50, "first");
        for (speed, spin) in [(SPEED * -2.0, Vector3::new(-3.0, 0.0, 1.0)), (Vector3::zeros(), Vector3::zeros())] {
            simulation.store(&mut state);
            (state.velocities[0], state.angular_velocities[0]) = (speed, spin);
            simulation.set_velocities(&state);
            follow(&mut simulation, &model, &state, 0..50, "then");
        }
    }
}

#[test]
fn storing_and_setting_the_same_velocities_changes_nothing() {
    for rods in [1, 3] {
        let (model, state) = turning(rods);
        for formulation in Formulation::ALL {
            let mut ends = [state.clone(), state.clone()];
            for (sets, end) in ends.iter_mut().enumerate() {
                let settings = settings(formulation, SolverKind::Direct);
                let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
                for step in 0..60 {
                    simulation.step(if step % 7 == 0 { 0.5 * DT } else { DT }).unwrap();
                    if sets == 1 {
                        simulation.store(end);
                        simulation.set_velocities(end);
                    }
                }
                simulation.store(end);
            }
            assert_eq!(ends[0], ends[1], "{formulation}");
        }
    }
}

/// A rod whose first segment drags it over rough ground from rest: the energy that this takes is no fault of the step.
#[test]
fn what_a_fixed_segment_does_is_no_gain() {
    let mut assembly = Assembly::new(GRAVITY);
    let nodes = shape::straight(Vector3::new(0.0, 0.0, 0.02), Vector3::x(), 1.0, SEGMENTS);
    let rod = assembly.rod(&RodSpec::new(nodes, 0.02, material(1e6, 1000.0)));
    assembly.fix(rod.start);
    assembly.state_mut().velocities[rod.start] = Vector3::new(0.0, 1.0, 0.0);
    let (mut model, state) = assembly.finish();
    let ground = ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: Vector3::z_axis() };
    let surface = Surface { friction: Friction::new(0.3), ..Surface::default() };
    model.contacts.obstacles = vec![Obstacle::new(ground, surface)];
    for formulation in Formulation::ALL {
        let mut simulation = Simulation::new(&model, &state, &settings(formulation, SolverKind::Direct), None).unwrap();
        let mut now = state.clone();
        let mut kinetic = vec![0.0];
        for step in 0..30 {
            assert_eq!(simulation.step(DT).unwrap().status, Status::Converged, "{formulation}, step {step}");
            simulation.store(&mut now);
            kinetic.push(rod::measure::energy(&model, &now).kinetic);
        }
        assert!(kinetic.windows(2).filter(|pair| pair[1] > 1.1 * pair[0]).count() > 5, "it is sped up: {kinetic:?}");
        assert!(simulation.counters().contact_solves > 0, "{formulation}: it lies on the ground");
    }
}
