//! Steps that no motion of the rods solves: what is held is led into an obstacle, or further than the rod reaches.

use std::sync::Arc;

use dynamics::formulation::Formulation;
use dynamics::simulation::Simulation;
use dynamics::step::Status;
use jointed::linear::solvers::SolverKind;
use nalgebra::{Unit, Vector3};
use rod::measure::{energy, widest_gap};
use rod::{
    Assembly, Body, Contacts, Driven, Interpolation, Keyframe, Model, Motion, Obstacle, ObstacleShape, RodSpec, State,
    Stretch, Surface, shape,
};

use crate::common::{integrated, material, settings};

const DT: f64 = 0.01;
const SEGMENTS: usize = 10;
const RADIUS: f64 = 0.01;
/// From when on the first joint gapes by a tenth, where a joint's length is that of half a segment.
const TENTH: f64 = 0.1 * 0.5 / SEGMENTS as f64;

/// Straight rods along x side by side, 1 m long, their ends held by anchors.
fn held(rods: usize, stretch: Stretch, both: bool) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::zeros());
    for k in 0..rods {
        let nodes = shape::straight(Vector3::y() * k as f64, Vector3::x(), 1.0, SEGMENTS);
        let rod = assembly.rod(&RodSpec { stretch, ..RodSpec::new(nodes, RADIUS, material(1e7, 1000.0)) });
        assembly.clamp_end(&rod);
        if both {
            assembly.clamp_start(&rod);
        }
    }
    assembly.finish()
}

/// Lets an anchor go by these shifts [m], one in 0.5 s.
fn drive(model: &mut Model, anchor: usize, shifts: &[Vector3<f64>]) {
    let from = model.anchors[anchor];
    let frame = |(k, shift): (usize, &Vector3<f64>)| Keyframe {
        time: 0.5 * k as f64,
        position: from.position + shift,
        turn: Vector3::zeros(),
    };
    let frames: Vec<Keyframe> = shifts.iter().enumerate().map(frame).collect();
    let motion = Arc::new(Motion::new(from.orientation, &frames, Interpolation::Linear).unwrap());
    model.motions.push(Driven::new(Body::Anchor(anchor), motion));
}

fn touching(model: &mut Model, shape: ObstacleShape) {
    let obstacles = vec![Obstacle::new(shape, Surface::default())];
    model.contacts = Contacts { obstacles, ..Contacts::default() };
}

/// The gap of the joint that gapes most after each step [joint lengths], and the state at the end; each step of `simulation`
/// has to be [`Status::Apart`] where that is more than a tenth.
fn run(mut simulation: Simulation, model: &Model, state: &State, steps: usize) -> (Vec<f64>, State) {
    let (mut now, mut model) = (state.clone(), model.clone());
    let gaps = (0..steps).map(|step| {
        let status = simulation.step(DT).unwrap().status;
        simulation.store(&mut now);
        simulation.store_model(&mut model);
        let (_, gap) = widest_gap(&model, &now).unwrap();
        assert!((gap > 0.1) == (status == Status::Apart) || (gap - 0.1).abs() < 1e-3, "step {step}: {gap} {status:?}");
        assert!(status <= Status::Apart, "step {step}: {status:?}");
        gap
    });
    (gaps.collect(), now)
}

#[test]
fn an_end_that_is_led_into_the_ground_and_out_of_it_says_when() {
    let depth = 0.05;
    for (formulation, integrator) in integrated() {
        let (mut model, state) = held(1, Stretch::ZERO_STRETCH, false);
        drive(&mut model, 0, &[Vector3::zeros(), Vector3::z() * -2.0 * depth, Vector3::zeros()]);
        let ground = ObstacleShape::HalfSpace {
            point: Vector3::z() * -(depth + RADIUS),
            normal: Unit::new_normalize(Vector3::z()),
        };
        touching(&mut model, ground);
        let mut settings = settings(formulation, SolverKind::Direct);
        settings.step.integrator = integrator;
        let simulation = Simulation::new(&model, &state, &settings, None).unwrap();
        let (gaps, end) = run(simulation, &model, &state, 150);
        // It goes 2 mm a step, and is below the ground from step 25 to step 75.
        let beyond: Vec<usize> = (1..=gaps.len()).filter(|&step| gaps[step - 1] > 0.1).collect();
        let first = (0.5 * (depth + TENTH) / depth * 50.0).ceil() as usize;
        assert!(beyond[0].abs_diff(first) <= 1 && beyond[beyond.len() - 1].abs_diff(100 - first) <= 1, "{beyond:?}");
        let deepest = gaps.iter().copied().fold(0.0, f64::max) * 0.5 / SEGMENTS as f64;
        assert!((deepest / depth - 1.0).abs() < 0.05, "{deepest}");
        assert!(energy(&model, &end).stretch < 1e-3 && end.positions.iter().all(|x| x.norm() < 2.0));
    }
}

#[test]
fn an_end_that_is_led_through_a_ball_leaves_the_rod_where_it_is() {
    let (mut model, state) = held(1, Stretch::ZERO_STRETCH, true);
    // Anchor 0 is the end's, 1 the start's.
    drive(&mut model, 0, &[Vector3::zeros(), Vector3::new(-0.2, 0.0, 0.6)]);
    touching(&mut model, ObstacleShape::Sphere { centre: Vector3::new(0.9, 0.0, 0.3), radius: 0.2 });
    let settings = settings(Formulation::default(), SolverKind::Direct);
    let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
    let (mut now, mut apart, mut then) = (state.clone(), 0, model.clone());
    for step in 0..80 {
        let status = simulation.step(DT).unwrap().status;
        assert!(status <= Status::Apart, "step {step}: {status:?}");
        apart += usize::from(status == Status::Apart);
        simulation.store(&mut now);
        // The end is led at 1.3 m/s; nothing is thrown away, and joints open by its way at most.
        assert!(now.velocities.iter().all(|v| v.norm() < 200.0), "step {step}: {:?}", now.velocities);
        simulation.store_model(&mut then);
        let (joint, gap) = widest_gap(&then, &now).unwrap();
        assert!(
            gap * model.joints[joint].length < 1.0 && now.positions.iter().all(|x| x.norm() < 2.0),
            "step {step}: {gap}"
        );
    }
    assert!(apart > 20, "{apart} steps");
    // Errors are those of what was kept, not of the attempts that tore it.
    let counters = simulation.counters();
    assert!(counters.worst_stretch < 0.1 && counters.worst_bend < 0.1, "{counters:?}");
}

#[test]
fn ends_that_are_pulled_apart_say_so_unless_the_rod_is_to_stretch() {
    for (stretch, is_rigid) in [(Stretch::ZERO_STRETCH, true), (Stretch::Physical, false)] {
        for rods in [1, 9] {
            let (mut model, state) = held(rods, stretch, true);
            let pulled = rods / 2;
            drive(&mut model, 2 * pulled, &[Vector3::zeros(), Vector3::x()]);
            let settings = settings(Formulation::default(), SolverKind::Direct);
            let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
            assert_eq!(simulation.in_lanes() > 0, rods > 1);
            let mut statuses = vec![Status::Converged; state.len()];
            for _ in 0..40 {
                simulation.step(DT).unwrap();
            }
            simulation.store_statuses(&mut statuses);
            for (i, status) in statuses.into_iter().enumerate() {
                assert_eq!(status == Status::Apart, is_rigid && i / SEGMENTS == pulled, "{i}: {status:?}");
                assert!(status <= Status::Apart, "{i}: {status:?}");
            }
        }
    }
}
