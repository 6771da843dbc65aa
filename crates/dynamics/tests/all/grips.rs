//! What is attached and released between two steps, by a program or by the model's grips with times.

use std::sync::Arc;

use component::Members;
use dynamics::formulation::{Formulation, Tangent};
use dynamics::guess::GuessKind;
use dynamics::simulation::{Settings, Simulation, SimulationError};
use dynamics::snapshot::Snapshot;
use dynamics::step::{Status, StepParams};
use jointed::linear::cg::CgParams;
use jointed::linear::solvers::SolverKind;
use jointed::topology::Topology;
use nalgebra::{UnitQuaternion, Vector3};
use rod::Integrator;
use rod::{
    Assembly, Body, Contacts, Driven, Interpolation, JointForce, Keyframe, Model, Motion, Obstacle, ObstacleShape,
    Pose, Reaction, RodSpec, State, Surface, measure, shape,
};

use crate::common::{GRAVITY, material, settings};

const DT: f64 = 0.01;
const SEGMENTS: usize = 12;

/// Rods along x, 3 m apart, each with a free start face under an open grip, and their first segment fixed where asked for.
fn rods(count: usize, fixed: bool) -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    for k in 0..count {
        let nodes = shape::straight(Vector3::y() * (3 * k) as f64, Vector3::x(), 1.0, SEGMENTS);
        let rod = assembly.rod(&RodSpec::new(nodes, 0.02, material(1e6, 1000.0)));
        assembly.clamp_end(&rod);
        if fixed {
            assembly.fix(rod.start);
        }
        let anchor = assembly.model_mut().anchors.len() - 1;
        assembly.model_mut().open.push(anchor);
    }
    assembly.finish()
}

fn steps(simulation: &mut Simulation, state: &mut State, count: usize) {
    for _ in 0..count {
        simulation.step(DT).unwrap();
    }
    simulation.store(state);
}

/// A motion that turns and goes away from `from`, from time `start` [s] on.
fn way(from: &Pose, start: f64) -> Arc<Motion> {
    let frame = |time: f64, shift: [f64; 3], turn: [f64; 3]| Keyframe {
        time: start + time,
        position: from.position + Vector3::from(shift),
        turn: Vector3::from(turn),
    };
    let frames = [
        frame(0.0, [0.0; 3], [0.0; 3]),
        frame(0.3, [0.1, 0.0, 0.1], [0.0, 0.5, 0.4]),
        frame(0.8, [0.0, 0.1, 0.2], [0.3, 0.0, 0.0]),
    ];
    Arc::new(Motion::new(from.orientation, &frames, Interpolation::Smooth).unwrap())
}

fn pose_of(state: &State, i: usize) -> Pose {
    Pose { position: state.positions[i], orientation: state.orientations[i] }
}

#[test]
fn an_open_grip_is_not_there() {
    // The same rods without any anchor: one pushed to and fro by the rounding of rows that do not answer.
    for formulation in Formulation::ALL {
        let (model, state) = rods(1, true);
        let mut bare = model.clone();
        (bare.anchors, bare.open) = (Vec::new(), Vec::new());
        bare.joints.pop();
        let settings = settings(formulation, SolverKind::Direct);
        let (mut with, mut without) = (state.clone(), state.clone());
        let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
        steps(&mut simulation, &mut with, 100);
        steps(&mut Simulation::new(&bare, &state, &settings, None).unwrap(), &mut without, 100);
        let apart = with.positions.iter().zip(&without.positions).map(|(x, y)| (x - y).norm()).fold(0.0, f64::max);
        assert!(apart < 1e-7, "{formulation}: {apart:e} m");
        let mut forces = vec![JointForce::default(); model.joints.len()];
        simulation.store_joint_forces(&mut forces);
        let last = forces[model.joints.len() - 1];
        assert_eq!((last.force.norm(), last.moment.norm()), (0.0, 0.0));
        let mut now = model.clone();
        simulation.store_model(&mut now);
        assert!((measure::energy(&now, &with).total() - measure::energy(&bare, &with).total()).abs() < 1e-12);
    }
}

#[test]
fn what_is_released_falls_with_the_momentum_that_it_has() {
    // Driven to a velocity and a spin, then let go: the momentum changes by the weight alone.
    for solver in [SolverKind::Direct, SolverKind::Sparse, SolverKind::Cg(CgParams::default())] {
        for formulation in Formulation::ALL {
            let (mut model, state) = rods(1, true);
            if matches!(solver, SolverKind::Cg(_)) {
                (model.anchors, model.open) = (Vec::new(), Vec::new());
                model.joints.pop();
            }
            let mass: f64 = model.segments.iter().map(rod::Segment::mass).sum();
            let mut simulation = Simulation::new(&model, &state, &settings(formulation, solver), None).unwrap();
            let motion = way(&pose_of(&state, 0), 0.0);
            simulation.drive(&Driven::new(Body::Segment(0), motion.clone())).unwrap();
            let (mut before, mut after) = (state.clone(), state.clone());
            steps(&mut simulation, &mut before, 20);
            let driven = motion.at(simulation.time());
            assert!((before.velocities[0] - driven.velocity).norm() < 1e-12);
            simulation.release(Body::Segment(0)).unwrap();
            simulation.store(&mut after);
            assert_eq!(before, after, "to be let go moves nothing");
            simulation.store_model(&mut model);
            assert!(!model.segments[0].fixed);
            let what = format!("{formulation}, {solver}");
            for step in 0..50 {
                let p = measure::linear_momentum(&model, &before);
                steps(&mut simulation, &mut after, 1);
                let fall = measure::linear_momentum(&model, &after) - p - GRAVITY * (mass * DT);
                assert!(fall.norm() < 1e-12 * mass, "{what}, step {step}: {:e}", fall.norm());
                std::mem::swap(&mut before, &mut after);
            }
        }
    }
}

#[test]
fn a_segment_alone_falls_as_symplectic_euler_says() {
    let mut assembly = Assembly::new(GRAVITY);
    let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 0.3, 1);
    let rod = assembly.rod(&RodSpec::new(nodes, 0.02, material(1e6, 1000.0)));
    assembly.fix(rod.start);
    let (model, state) = assembly.finish();
    let settings = settings(Formulation::Newton, SolverKind::Direct);
    let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
    let mut now = state.clone();
    steps(&mut simulation, &mut now, 7);
    assert_eq!(now.positions, state.positions);
    simulation.release(Body::Segment(0)).unwrap();
    steps(&mut simulation, &mut now, 30);
    assert!((now.velocities[0] - GRAVITY * (30.0 * DT)).norm() < 1e-13);
    let fallen = GRAVITY * (DT * DT * 30.0 * 31.0 / 2.0);
    assert!((now.positions[0] - state.positions[0] - fallen).norm() < 1e-13);
}

#[test]
fn what_is_attached_in_mid_air_keeps_its_pose_and_goes_with_the_motion() {
    for formulation in Formulation::ALL {
        let (mut model, mut now) = rods(1, false);
        let mut simulation = Simulation::new(&model, &now, &settings(formulation, SolverKind::Direct), None).unwrap();
        steps(&mut simulation, &mut now, 15);
        // Held as it is.
        let here = pose_of(&now, 4);
        simulation.attach(Body::Segment(4), None).unwrap();
        steps(&mut simulation, &mut now, 10);
        assert_eq!(pose_of(&now, 4), here, "{formulation}");
        assert_eq!((now.velocities[4], now.angular_velocities[4]), (Vector3::zeros(), Vector3::zeros()));
        // Let go and taken along by a gripper that is elsewhere.
        simulation.release(Body::Segment(4)).unwrap();
        steps(&mut simulation, &mut now, 5);
        let here = pose_of(&now, 4);
        let gripper = Pose { position: Vector3::new(0.5, 0.2, 0.3), orientation: UnitQuaternion::identity() };
        let motion = way(&gripper, simulation.time());
        let taken = simulation.time();
        simulation.attach(Body::Segment(4), Some(motion.clone())).unwrap();
        let relative = |pose: &Pose, time: f64| {
            let Pose { position, orientation } = motion.at(time).pose;
            (orientation.inverse() * (pose.position - position), orientation.inverse() * pose.orientation)
        };
        let (arm, turn) = relative(&here, taken);
        for _ in 0..60 {
            steps(&mut simulation, &mut now, 1);
            let (at, turned) = relative(&pose_of(&now, 4), simulation.time());
            assert!((at - arm).norm() < 1e-12 && (turned.coords - turn.coords).norm() < 1e-12, "{formulation}");
        }
        // The open grip closes on the face without a jolt, and holds its place.
        simulation.release(Body::Segment(4)).unwrap();
        steps(&mut simulation, &mut now, 1);
        simulation.attach(Body::Anchor(0), None).unwrap();
        simulation.store_model(&mut model);
        assert!(model.open.is_empty() && !model.segments[4].fixed);
        let face = |state: &State| state.positions[SEGMENTS - 1] + state.axis(SEGMENTS - 1) * (0.5 / SEGMENTS as f64);
        let there = model.anchors[0].position;
        assert!((face(&now) - there).norm() < 1e-12);
        let joint = model.joints[SEGMENTS - 1];
        assert!(measure::bend_strain(&model, &now, &joint).norm() < 1e-12);
        steps(&mut simulation, &mut now, 30);
        assert!((face(&now) - there).norm() < 1e-5, "{formulation}");
        simulation.release(Body::Anchor(0)).unwrap();
        steps(&mut simulation, &mut now, 20);
        assert!((face(&now) - there).norm() > 1e-2, "{formulation}");
    }
}

#[test]
fn other_rods_keep_their_bits() {
    // Alone, in lanes, and in step because they may touch; what becomes of the second is none of the others' business.
    for (count, fixed, touching) in [(2, true, false), (4, true, false), (4, false, false), (3, true, true)] {
        let (mut model, state) = rods(count, fixed);
        if touching {
            let shape = ObstacleShape::HalfSpace { point: Vector3::z() * -9.0, normal: Vector3::z_axis() };
            let obstacles = vec![Obstacle::new(shape, Surface::default())];
            model.contacts = Contacts { obstacles, ..Contacts::default() };
        }
        let settings = settings(Formulation::Newton, SolverKind::Direct);
        let (mut changed, mut unchanged) = (state.clone(), state.clone());
        let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
        let mut other = Simulation::new(&model, &state, &settings, None).unwrap();
        assert_eq!(simulation.in_lanes() > 0, count > 2 && !touching);
        for round in 0..3 {
            steps(&mut simulation, &mut changed, 8);
            steps(&mut other, &mut unchanged, 8);
            let body = Body::Segment(SEGMENTS);
            match (round, fixed) {
                (0, true) | (1, false) => simulation.release(body).unwrap(),
                (0, false) | (1, true) => simulation.attach(body, None).unwrap(),
                _ => simulation.attach(Body::Anchor(1), None).unwrap(),
            }
        }
        steps(&mut simulation, &mut changed, 20);
        steps(&mut other, &mut unchanged, 20);
        for i in (0..count * SEGMENTS).filter(|i| i / SEGMENTS != 1) {
            let apart = (changed.positions[i] - unchanged.positions[i]).norm();
            // Those that may touch take as many iterations as the others.
            assert!(apart <= if touching { 1e-7 } else { 0.0 }, "{count} rods, segment {i}: {apart:e} m");
            assert!(touching || pose_of(&changed, i) == pose_of(&unchanged, i));
            assert!(touching || changed.velocities[i] == unchanged.velocities[i]);
        }
        assert_ne!(changed.positions[SEGMENTS + 3], unchanged.positions[SEGMENTS + 3]);
        assert_eq!(simulation.components(), count);
    }
}

#[test]
fn grips_with_times_take_hold_and_let_go_by_themselves() {
    // One rod alone, and three in lanes; the first is held by a segment from the start, the face is taken later.
    for count in [1, 3] {
        let (mut model, state) = rods(count, true);
        let segment = Body::Segment(SEGMENTS * (count - 1));
        let anchor = Body::Anchor(count - 1);
        let first = way(&model.pose(segment, &state), 0.0);
        model.motions.push(Driven::new(segment, first.clone()).between(0.0, 0.1));
        let later = way(&model.pose(anchor, &state), 0.2);
        model.motions.push(Driven { moves_along: true, ..Driven::new(anchor, later.clone()).between(0.2, 0.5) });
        model.motions.push(Driven::new(segment, first.clone()).between(0.305, 0.4));
        // The others let go, too, much later, so that all are alike.
        for body in (0..count - 1).map(|k| Body::Segment(SEGMENTS * k)) {
            let resting = Arc::new(Motion::resting(&model.pose(body, &state)));
            model.motions.push(Driven::new(body, resting).between(0.0, 99.0));
        }
        // With the exact tangent rods of which one alone is held part.
        let mut settings = settings(Formulation::Newton, SolverKind::Direct);
        settings.step.tangent = Tangent::Positive;
        let build = || Simulation::new(&model, &state, &settings, None).unwrap();
        let mut simulation = build();
        let mut snapshots = Vec::new();
        assert_eq!(simulation.in_lanes(), if count > 2 { count } else { 0 });
        let (mut now, mut told) = (state.clone(), model.clone());
        let Body::Segment(i) = segment else { unreachable!() };
        let mut grip = None;
        for step in 1..=60 {
            steps(&mut simulation, &mut now, 1);
            let time = simulation.time();
            if [5, 15, 25, 33, 38, 45, 55].contains(&step) {
                snapshots.push((step, simulation.snapshot().words().to_vec()));
            }
            // The step from 0.09 s to 0.1 s is the last that is held, that from 0.2 s to 0.21 s the first of the grip.
            assert_eq!(simulation.is_held(segment), Some(step <= 10 || (32..=40).contains(&step)), "step {step}");
            assert_eq!(simulation.is_held(anchor), Some((21..=50).contains(&step)), "step {step}");
            simulation.store_model(&mut told);
            assert_eq!(told.segments[i].fixed, step <= 10 || (32..=40).contains(&step));
            if step <= 10 {
                assert!((now.positions[i] - first.at(time).pose.position).norm() < 1e-12);
            }
            if (21..=50).contains(&step) {
                // The face goes the motion's way from where it was taken.
                let way = later.at(time).pose.position - later.at(0.2).pose.position;
                let origin = *grip.get_or_insert(told.anchors[count - 1].position - way);
                assert!((told.anchors[count - 1].position - way - origin).norm() < 1e-12, "step {step}");
                // What is known of it places it at any time.
                let mut then = told.clone();
                then.set_time(time);
                let [at, there] = [&then, &told].map(|model| model.anchors[count - 1]);
                assert!((at.position - there.position).norm() < 1e-14);
                assert!((at.orientation.coords - there.orientation.coords).norm() < 1e-14);
            }
        }
        assert!(grip.is_some() && simulation.in_lanes() == if count > 2 { count } else { 0 });
        // As from a file, in whatever state the grips are.
        for (step, words) in snapshots {
            let mut other = build();
            other.restore(&Snapshot::from_words(words)).unwrap();
            let (mut then, mut told_then) = (state.clone(), model.clone());
            steps(&mut other, &mut then, 60 - step);
            other.store_model(&mut told_then);
            assert_eq!(then, now, "from step {step}");
            // An open anchor stands where it let go, which the one who goes on after that has not seen.
            told_then.anchors.clone_from(&told.anchors);
            assert_eq!(told_then, told, "from step {step}");
            // What it says of the grips places them, too.
            let grips = other.timed_grips();
            assert!(grips.iter().all(|grip| grip.of(&model.motions[grip.motion]) == told.motions[grip.motion]));
        }
    }
}

#[test]
fn the_same_bits_on_any_number_of_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let (mut model, state) = rods(90, true);
            for k in 0..90 {
                let body = Body::Segment(k * SEGMENTS);
                let motion = Arc::new(Motion::resting(&model.pose(body, &state)));
                model.motions.push(Driven::new(body, motion).between(0.0, 0.05));
            }
            let mut now = state.clone();
            let settings = settings(Formulation::Newton, SolverKind::Direct);
            let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
            steps(&mut simulation, &mut now, 12);
            simulation.attach(Body::Anchor(7), None).unwrap();
            steps(&mut simulation, &mut now, 5);
            now
        })
    };
    assert_eq!(run(1), run(2));
}

#[test]
fn reactions_balance_while_grips_change() {
    let (mut model, state) = rods(1, true);
    let body = Body::Segment(0);
    let motion = way(&model.pose(body, &state), 0.0);
    model.motions.push(Driven::new(body, motion.clone()).between(0.0, 0.2));
    model.motions.push(Driven { moves_along: true, ..Driven::new(Body::Anchor(0), motion).between(0.1, 0.4) });
    let weight: f64 = model.segments.iter().map(|segment| 9.81 * segment.mass()).sum();
    let step = StepParams {
        relative_tolerance: 1e-10,
        motion_tolerance: 1e-10,
        absolute_tolerance: 1e-10,
        max_iterations: 60,
        formulation: Formulation::Newton,
        integrator: Integrator::Euler,
        ..StepParams::DEFAULT
    };
    let settings = Settings { step, solver: SolverKind::Direct };
    let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
    let mut forces = vec![JointForce::default(); model.joints.len()];
    let (mut before, mut after) = (state.clone(), state.clone());
    let mut whole_steps = 0;
    for step in 0..60 {
        std::mem::swap(&mut before, &mut after);
        // In substeps the forces are those of the last one alone.
        let is_whole = simulation.step(DT).unwrap().status == Status::Converged;
        whole_steps += usize::from(is_whole);
        simulation.store(&mut after);
        simulation.store_joint_forces(&mut forces);
        simulation.store_model(&mut model);
        let given: Vector3<f64> = Reaction::all(&model, [&before, &after], [0.0, DT], &forces, &[])
            .iter()
            .map(|reaction| reaction.force)
            .sum();
        let change = |i: usize| (after.velocities[i] - before.velocities[i]) / DT - GRAVITY;
        let needed: Vector3<f64> =
            model.segments.iter().enumerate().map(|(i, segment)| change(i) * segment.mass()).sum();
        let apart = (given - needed).norm() / weight.max(needed.norm());
        assert!(apart < 1e-7 || !is_whole, "step {step}: {apart:e} of the weight");
    }
    assert!(whole_steps > 50, "{whole_steps}");
}

#[test]
fn a_released_rod_lands_on_the_ground() {
    // The contacts see that the segment is free; before, it hung in the air.
    let (mut model, state) = rods(1, true);
    let shape = ObstacleShape::HalfSpace { point: Vector3::z() * -0.5, normal: Vector3::z_axis() };
    model.contacts = Contacts { obstacles: vec![Obstacle::new(shape, Surface::default())], ..Contacts::default() };
    model.damping = rod::Damping { linear: 1.0, angular: 1.0 };
    let settings = settings(Formulation::Newton, SolverKind::Direct);
    let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
    let mut now = state.clone();
    steps(&mut simulation, &mut now, 50);
    assert_eq!(now.positions[0], state.positions[0]);
    simulation.release(Body::Segment(0)).unwrap();
    steps(&mut simulation, &mut now, 250);
    for (i, x) in now.positions.iter().enumerate() {
        assert!((x.z + 0.48).abs() < 2e-3, "segment {i} at z = {} m", x.z);
    }
}

#[test]
fn what_cannot_be_attached_or_released_is_refused() {
    let (mut model, state) = rods(1, true);
    let settings = settings(Formulation::Newton, SolverKind::Direct);
    let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
    for body in [Body::Segment(0), Body::Segment(SEGMENTS), Body::Anchor(1)] {
        let refused = simulation.attach(body, None);
        assert!(matches!(refused, Err(SimulationError::NothingToAttach(named)) if named == body));
    }
    for body in [Body::Segment(1), Body::Segment(SEGMENTS), Body::Anchor(0)] {
        let refused = simulation.release(body);
        assert!(matches!(refused, Err(SimulationError::NothingToRelease(named)) if named == body));
    }
    let resting = Arc::new(Motion::resting(&model.pose(Body::Anchor(0), &state)));
    let open = simulation.drive(&Driven::new(Body::Anchor(0), resting.clone()));
    assert!(matches!(open, Err(SimulationError::NotHeld(_))));
    let cg = Settings { solver: SolverKind::Cg(CgParams::default()), ..settings };
    let error = Simulation::new(&model, &state, &cg, None).err().unwrap().to_string();
    assert!(error.contains("solver cg-block-jacobi knows no ball joints"), "{error}");

    let mut refused = |driven: Vec<Driven>| {
        model.motions = driven;
        Simulation::new(&model, &state, &settings, None).err().unwrap().to_string()
    };
    let grip = |body: Body, from: f64, until: f64| Driven::new(body, resting.clone()).between(from, until);
    let anchor = Body::Anchor(0);
    assert_eq!(
        refused(vec![grip(anchor, 0.0, 1.0)]),
        "motion 0: anchor 0 is open, but only what is held can be driven"
    );
    let error = refused(vec![grip(anchor, 1.0, 2.0), grip(anchor, 1.5, 3.0)]);
    assert_eq!(error, "motion 1: motion 0 drives the same body");
    let error = refused(vec![grip(anchor, 2.0, 1.0)]);
    assert_eq!(error, "motion 0: it holds its body from 2 s until 1 s, but the second time must be later");
    let error = refused(vec![grip(Body::Segment(0), 1.0, 2.0)]);
    assert_eq!(error, "motion 0: it takes hold of segment 0 on the way, which is held from the start");
}

#[test]
fn a_start_that_goes_on_from_the_last_steps_does_no_harm() {
    for kind in [GuessKind::StepAdaptive, GuessKind::StepQuadratic] {
        let (model, state) = rods(1, true);
        let build = |model: &Model, members: &Members, topology: &Topology| kind.build(model, members, topology);
        let settings = settings(Formulation::Newton, SolverKind::Direct);
        let mut simulation = Simulation::new(&model, &state, &settings, Some(&build)).unwrap();
        let mut plain = Simulation::new(&model, &state, &settings, None).unwrap();
        let (mut now, mut other) = (state.clone(), state.clone());
        let mut forces = vec![JointForce::default(); model.joints.len()];
        for round in 0..4 {
            for simulation in [&mut simulation, &mut plain] {
                match round {
                    0 => {}
                    1 => simulation.attach(Body::Anchor(0), None).unwrap(),
                    2 => simulation.release(Body::Anchor(0)).unwrap(),
                    _ => simulation.release(Body::Segment(0)).unwrap(),
                }
            }
            steps(&mut simulation, &mut now, 12);
            steps(&mut plain, &mut other, 12);
            simulation.store_joint_forces(&mut forces);
            assert_eq!(forces[SEGMENTS - 1].force.norm() > 0.0, round == 1, "{kind}, round {round}");
            let apart = now.positions.iter().zip(&other.positions).map(|(x, y)| (x - y).norm()).fold(0.0, f64::max);
            assert!(apart < 1e-3, "{kind}, round {round}: {apart:e} m");
        }
    }
}

#[test]
fn a_grip_that_lets_go_within_a_step_holds_to_its_end() {
    let (mut model, state) = rods(1, false);
    model.open.clear();
    let anchor = model.anchors.len() - 1;
    let motion = way(&model.anchors[anchor], 0.0);
    model.motions.push(Driven::new(Body::Anchor(anchor), motion.clone()).between(0.0, 4.5 * DT));
    let mut simulation =
        Simulation::new(&model, &state, &settings(Formulation::Newton, SolverKind::Direct), None).unwrap();
    let (mut now, mut told) = (state.clone(), model.clone());
    for step in 1..=6 {
        steps(&mut simulation, &mut now, 1);
        simulation.store_model(&mut told);
        let is_held = step <= 5;
        assert_eq!(told.open.is_empty(), is_held, "step {step}");
        if is_held {
            assert_eq!(told.anchors[anchor], motion.at(simulation.time()).pose, "step {step}");
        }
        assert!(measure::worst_gap(&told, &now) < 1e-5, "step {step}: {}", measure::worst_gap(&told, &now));
    }
}

/// Four alike rods that float and are pushed, of which the first one is held from the third step on: the others go on as each of them does
/// alone, with what gravity and the load of the third one come to be.
#[test]
fn rods_that_have_left_their_lanes_bear_their_own_loads() {
    let with_loads = |count: usize| {
        let (mut model, state) = rods(count, false);
        for (segment, own) in model.segments.iter().enumerate() {
            model.lifts.push(rod::Lift { load: segment, mass: 0.4 * own.mass() });
            let force = GRAVITY * (-0.4 * own.mass());
            model.loads.push(rod::Load { segment, offset: 0.0, force, torque: Vector3::zeros(), follows: false });
        }
        for k in 0..count {
            let segment = k * SEGMENTS + 5;
            model.loads.push(rod::Load {
                segment,
                offset: 0.0,
                force: Vector3::y(),
                torque: Vector3::zeros(),
                follows: false,
            });
        }
        (model, state)
    };
    let settings = Settings { step: StepParams::DEFAULT, solver: SolverKind::Direct };
    let run = |count: usize, pushed: Option<usize>, held: bool| {
        let (model, mut state) = with_loads(count);
        let before = state.positions.clone();
        let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
        assert_eq!(simulation.in_lanes() > 0, count > 1);
        steps(&mut simulation, &mut state, 3);
        if held {
            simulation.attach(Body::Segment(0), None).unwrap();
        }
        simulation.set_gravity(Vector3::new(1.0, 0.5, -3.0)).unwrap();
        if let Some(rod) = pushed {
            simulation.set_load(count * SEGMENTS + rod, Vector3::z() * 2.0, Vector3::zeros()).unwrap();
        }
        steps(&mut simulation, &mut state, 12);
        state.positions.iter().zip(before).map(|(now, then)| now - then).collect::<Vec<_>>()
    };
    let (together, [pushed, other]) = (run(4, Some(2), true), [Some(0), None].map(|pushed| run(1, pushed, false)));
    for (rod, alone) in [(1, &other), (2, &pushed), (3, &other)] {
        for (i, alone) in alone.iter().enumerate() {
            let apart = (together[rod * SEGMENTS + i] - alone).norm();
            assert!(apart < 1e-6, "rod {rod}, segment {i}: {apart:e} m");
        }
    }
}

/// A snapshot of rods that have left their lanes goes on in a new simulation, in which they are side by side.
#[test]
fn rods_that_have_left_their_lanes_go_on_from_a_snapshot() {
    let (model, state) = rods(4, false);
    let settings = Settings { step: StepParams::DEFAULT, solver: SolverKind::Direct };
    let new = || Simulation::new(&model, &state, &settings, None).unwrap();
    let (mut simulation, mut ends) = (new(), [state.clone(), state.clone()]);
    steps(&mut simulation, &mut ends[0], 3);
    let before = simulation.snapshot();
    simulation.attach(Body::Segment(SEGMENTS), None).unwrap();
    steps(&mut simulation, &mut ends[0], 3);
    let after = Snapshot::from_words(simulation.snapshot().words().to_vec());
    let mut other = new();
    other.restore(&after).unwrap();
    steps(&mut simulation, &mut ends[0], 9);
    steps(&mut other, &mut ends[1], 9);
    assert_eq!(ends[0], ends[1]);
    assert!(simulation.restore(&before).is_err(), "they do not come together again");
    new().restore(&before).unwrap();
}
