//! What steps that build on those before owe to lanes, to the outside, and to what joints transmit.

use std::sync::Arc;

use component::{Component, Members};
use dynamics::formulation::Formulation;
use dynamics::projection::Projection;
use dynamics::simulation::{Settings, Simulation, SimulationError};
use dynamics::step::{Status, StepParams};
use jointed::linear::solvers::SolverKind;
use jointed::topology::Topology;
use kernels::Spatial;
use nalgebra::Vector3;
use rod::Integrator;
use rod::{
    Air, Assembly, Body, Driven, Interpolation, JointForce, Keyframe, Model, Motion, Reaction, RodSpec, State, Wind,
    shape,
};

use crate::common::{GRAVITY, integrated, material, settings};

const DT: f64 = 0.01;
const SEGMENTS: usize = 12;

/// Alike rods, each clamped or held by its first segment, which fall and are thrown aside.
fn rods(count: usize, is_clamped: bool) -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    for k in 0..count {
        let start = Vector3::new(0.0, 3.0 * k as f64, 0.0);
        let nodes = shape::helix(start, 0.3, 0.5, 1.5, SEGMENTS);
        let rod = assembly.rod(&RodSpec::new(nodes, 0.02, material(1e6, 1000.0)));
        if is_clamped {
            assembly.clamp_start(&rod);
        } else {
            assembly.fix(rod.start);
        }
        for i in rod.start + 1..rod.end {
            assembly.state_mut().velocities[i] = Vector3::new(0.0, 0.5, 0.1) * (i - rod.start) as f64;
        }
    }
    assembly.finish()
}

fn bdf2(formulation: Formulation) -> Settings {
    let mut settings = settings(formulation, SolverKind::Direct);
    settings.step.integrator = Integrator::Bdf2;
    settings
}

fn stored(simulation: &Simulation, like: &State) -> State {
    let mut state = like.clone();
    simulation.store(&mut state);
    state
}

#[test]
fn the_same_bits_whatever_the_lanes_and_substeps() {
    let (one, state) = rods(1, false);
    let (three, states) = rods(3, false);
    for formulation in Formulation::ALL {
        for max_iterations in [30, 1] {
            let mut settings = bdf2(formulation);
            (settings.step.max_iterations, settings.step.max_halvings) = (max_iterations, 3);
            (settings.step.relative_tolerance, settings.step.absolute_tolerance, settings.step.motion_tolerance) =
                (1e-12, 1e-12, 1e-12);
            let mut alone = Simulation::new(&one, &state, &settings, None).unwrap();
            let mut together = Simulation::new(&three, &states, &settings, None).unwrap();
            assert_eq!((alone.in_lanes(), together.in_lanes()), (0, 3));
            for dt in [1.0, 1.0, 0.5, 0.7, 1.5, 4.0, 1.0].into_iter().cycle().take(60) {
                alone.step(dt * DT).unwrap();
                together.step(dt * DT).unwrap();
            }
            assert!(max_iterations > 1 || alone.counters().retries > 0, "{formulation}");
            let (now, all) = (stored(&alone, &state), stored(&together, &states));
            assert_eq!(now.positions, all.positions[..SEGMENTS], "{formulation}");
            assert_eq!(now.velocities, all.velocities[..SEGMENTS], "{formulation}");
            assert_eq!(now.angular_velocities, all.angular_velocities[..SEGMENTS], "{formulation}");
        }
    }
}

#[test]
fn velocities_that_are_given_back_change_nothing() {
    for count in [1, 3] {
        let (model, state) = rods(count, true);
        let settings = bdf2(Formulation::Newton);
        let mut left = Simulation::new(&model, &state, &settings, None).unwrap();
        let mut asked = Simulation::new(&model, &state, &settings, None).unwrap();
        for _ in 0..30 {
            left.step(DT).unwrap();
            asked.step(DT).unwrap();
            asked.set_velocities(&stored(&asked, &state));
        }
        assert_eq!(stored(&left, &state), stored(&asked, &state));
    }
}

#[test]
fn a_velocity_that_is_given_is_that_of_the_step_that_follows() {
    // Free flight, so that a step is all velocity.
    let mut assembly = Assembly::new(Vector3::zeros());
    assembly.rod(&RodSpec::new(shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 5), 0.02, material(1e6, 1000.0)));
    assembly.state_mut().velocities.fill(Vector3::new(1.0, 2.0, 3.0));
    let (model, state) = assembly.finish();
    for formulation in Formulation::ALL {
        let mut simulation = Simulation::new(&model, &state, &bdf2(formulation), None).unwrap();
        for _ in 0..5 {
            simulation.step(DT).unwrap();
        }
        let mut now = stored(&simulation, &state);
        let given = Vector3::new(-4.0, 0.0, 1.0);
        now.velocities.fill(given);
        simulation.set_velocities(&now);
        assert_eq!(stored(&simulation, &state).velocities, now.velocities);
        for step in 1..=5 {
            simulation.step(DT).unwrap();
            let next = stored(&simulation, &state);
            let apart = next.positions[2] - now.positions[2] - given * (DT * f64::from(step));
            assert!(apart.norm() < 1e-12, "{formulation}, step {step}: {apart}");
        }
    }
}

#[test]
fn reactions_balance_weight_and_inertia() {
    let (mut model, state) = rods(1, false);
    let pose = model.pose(Body::Segment(0), &state);
    let frame = |time, shift: [f64; 3], turn: [f64; 3]| Keyframe {
        time,
        position: pose.position + Vector3::from(shift),
        turn: turn.into(),
    };
    let frames = [frame(0.0, [0.0; 3], [0.0; 3]), frame(1.5, [0.2, 0.1, 0.3], [0.0, 1.0, 0.5])];
    let motion = Motion::new(pose.orientation, &frames, Interpolation::Smooth).unwrap();
    model.motions.push(Driven::new(Body::Segment(0), Arc::new(motion)));
    let mut settings = bdf2(Formulation::Newton);
    (settings.step.relative_tolerance, settings.step.absolute_tolerance, settings.step.motion_tolerance) =
        (1e-10, 1e-10, 1e-10);
    settings.step.max_iterations = 60;
    let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
    let weight: f64 = model.segments.iter().map(|segment| 9.81 * segment.mass()).sum();
    let mut forces = vec![JointForce::default(); model.joints.len()];
    let mut states = vec![stored(&simulation, &state)];
    // Later a joint comes near half a turn.
    for step in 1..=110 {
        let status = simulation.step(DT).unwrap().status;
        assert!(matches!(status, Status::Converged | Status::PastHalfTurn), "step {step}: {status:?}");
        states.push(stored(&simulation, &state));
        simulation.store_joint_forces(&mut forces);
        model.set_time(simulation.time());
        let now = states.len() - 1;
        let given = Reaction::all(&model, [&states[now - 1], &states[now]], [0.0, DT], &forces, &[])[0].force;
        let velocity = |k: usize, i: usize| states[k].velocities[i];
        let inertia = |i: usize| {
            let change = if i == 0 || now == 1 {
                velocity(now, i) - velocity(now - 1, i)
            } else {
                (velocity(now, i) * 3.0 - velocity(now - 1, i) * 4.0 + velocity(now - 2, i)) * 0.5
            };
            (change / DT - GRAVITY) * model.segments[i].mass()
        };
        let needed: Vector3<f64> = (0..model.segments.len()).map(inertia).sum();
        assert!((given - needed).norm() < 1e-5 * weight, "step {step}: {given}, not {needed}");
    }
}

#[test]
fn predictions_in_the_place_of_solves_know_nothing_of_it() {
    struct Nothing;
    impl Projection for Nothing {
        fn project(&mut self, _: &Component<f64>, _: usize, _: &mut [Spatial<f64>], _: &mut [Spatial<f64>]) {}
    }
    let (model, state) = rods(1, false);
    let params = StepParams { integrator: Integrator::Bdf2, ..StepParams::DEFAULT };
    let factory = |_: &Model, _: &Members, _: &Topology| -> Box<dyn Projection> { Box::new(Nothing) };
    let refused = Simulation::end_to_end(&model, &state, &params, &factory).err().unwrap();
    assert!(matches!(refused, SimulationError::Projection(Integrator::Bdf2)));
    assert_eq!(refused.to_string(), "predictions in the place of solves need integrator euler, not bdf2");
}

#[test]
fn damping_leaves_a_free_flight_its_exact_share() {
    let mut assembly = Assembly::new(Vector3::zeros());
    assembly.rod(&RodSpec::new(shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 5), 0.02, material(1e6, 1000.0)));
    assembly.damping(rod::Damping { linear: 3.0, angular: 0.0 });
    assembly.state_mut().velocities.fill(Vector3::new(1.0, -2.0, 0.5));
    let (model, state) = assembly.finish();
    for (formulation, integrator) in integrated() {
        let mut settings = settings(formulation, SolverKind::Direct);
        settings.step.integrator = integrator;
        let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
        for dt in [1.0, 0.5, 0.6, 1.2, 1.7].into_iter().cycle().take(50) {
            simulation.step(dt * DT).unwrap();
        }
        for v in &stored(&simulation, &state).velocities {
            let expected = Vector3::new(1.0, -2.0, 0.5) * (-3.0 * 50.0 * DT).exp();
            assert!((v - expected).norm() < 1e-11, "{formulation}, {integrator}: {v}");
        }
    }
}

#[test]
fn a_segment_that_was_held_in_a_wind_moves_on_as_if_it_had_not_been() {
    let mut assembly = Assembly::new(GRAVITY);
    assembly.rod(&RodSpec::new(shape::straight(Vector3::zeros(), Vector3::x(), 0.5, 1), 0.01, material(1e6, 200.0)));
    let wind = Wind::new(Vector3::new(2.0, 3.0, 15.0), None, None);
    assembly.air(Air { density: 1.2, normal_drag: 1.1, tangential_drag: 0.05, wind });
    let (model, state) = assembly.finish();
    let settings = bdf2(Formulation::Newton);
    let mut held = Simulation::new(&model, &state, &settings, None).unwrap();
    for _ in 0..3 {
        held.step(DT).unwrap();
    }
    held.attach(Body::Segment(0), None).unwrap();
    held.step(DT).unwrap();
    held.release(Body::Segment(0)).unwrap();
    let mut now = stored(&held, &state);
    now.velocities[0] = Vector3::new(0.5, 0.0, -1.0);
    now.angular_velocities[0] = Vector3::new(1.0, 8.0, 2.0);
    held.set_velocities(&now);
    let mut fresh = Simulation::new(&model, &now, &settings, None).unwrap();
    for step in 1..=10 {
        held.step(DT).unwrap();
        fresh.step(DT).unwrap();
        let [held, fresh] = [&held, &fresh].map(|simulation| stored(simulation, &state));
        let apart = (held.positions[0] - fresh.positions[0]).norm();
        let turned = (held.orientations[0].coords - fresh.orientations[0].coords).norm();
        assert!(apart < 1e-12 && turned < 1e-12, "step {step}: {apart} m, {turned}");
    }
}

#[test]
fn a_driven_segment_that_is_let_go_keeps_the_velocity_of_its_motion() {
    let mut assembly = Assembly::new(Vector3::zeros());
    let rod = assembly.rod(&RodSpec::new(
        shape::straight(Vector3::zeros(), Vector3::x(), 0.5, 1),
        0.01,
        material(1e6, 1000.0),
    ));
    assembly.fix(rod.start);
    let (mut model, state) = assembly.finish();
    let pose = model.pose(Body::Segment(0), &state);
    let frame = |time, x: f64| Keyframe { time, position: pose.position + Vector3::x() * x, turn: Vector3::zeros() };
    let motion = Motion::new(pose.orientation, &[frame(0.0, 0.0), frame(1.0, 3.0)], Interpolation::Smooth).unwrap();
    model.motions.push(Driven::new(Body::Segment(0), Arc::new(motion)));
    for formulation in Formulation::ALL {
        let mut simulation = Simulation::new(&model, &state, &bdf2(formulation), None).unwrap();
        for _ in 0..20 {
            simulation.step(DT).unwrap();
        }
        let held = stored(&simulation, &state);
        simulation.release(Body::Segment(0)).unwrap();
        for step in 1..=5 {
            simulation.step(DT).unwrap();
            let shift = stored(&simulation, &state).positions[0] - held.positions[0];
            let apart = (shift - held.velocities[0] * (DT * f64::from(step))).norm();
            assert!(apart < 1e-12, "{formulation}, step {step}: {apart} m");
        }
    }
}
