//! What must not matter: place, direction, handedness, numbering, company, threads.

use acceptance::{Beam, run};
use cosserat::assembly::{Assembly, Load, Material, RestShape, RodSpec, shape};
use cosserat::simulation::{Formulation, Settings, Simulation};
use cosserat::state::{Body, Model, State};
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

const SOFT: Material = Material { youngs_modulus: 1e6, torsion_modulus: 5e5, density: 500.0 };
const DT: f64 = 0.01;
const STEPS: usize = 10;

/// A rod along a random curve, clamped at its start, loaded, in random gravity and motion.
#[derive(Clone, Debug)]
struct Scene {
    turns: Vec<[f64; 2]>,
    gravity: [f64; 3],
    spin: [f64; 3],
    force: [f64; 3],
    straight: bool,
    formulation: Formulation,
}

fn scene() -> impl Strategy<Value = Scene> {
    let turn = [-0.4..0.4, -0.4..0.4];
    let three = || [-5.0..5.0, -5.0..5.0, -5.0..5.0];
    let formulation = prop_oneof![Just(Formulation::Xpbd), Just(Formulation::Newton)];
    (prop::collection::vec(turn, 4..16), three(), three(), three(), any::<bool>(), formulation).prop_map(
        |(turns, gravity, spin, force, straight, formulation)| Scene {
            turns,
            gravity,
            spin,
            force: force.map(|f: f64| 0.2 * f),
            straight,
            formulation,
        },
    )
}

impl Scene {
    fn nodes(&self) -> Vec<Vector3<f64>> {
        let mut direction = Vector3::x();
        let mut nodes = vec![Vector3::zeros()];
        for &[yaw, pitch] in &self.turns {
            direction = UnitQuaternion::from_euler_angles(0.0, pitch, yaw) * direction;
            nodes.push(nodes[nodes.len() - 1] + direction * 0.1);
        }
        nodes
    }

    fn build(&self) -> (Model, State) {
        let mut assembly = Assembly::new(Vector3::from(self.gravity));
        let rest = if self.straight { RestShape::Straight } else { RestShape::Initial };
        let rod = assembly.rod(&RodSpec { rest, ..RodSpec::new(self.nodes(), 0.02, SOFT) });
        assembly.clamp_start(&rod);
        let force = Vector3::from(self.force);
        assembly.load(Load { segment: rod.end - 1, offset: 0.05, force, torque: 0.01 * force, follows: false });
        let spin = Vector3::from(self.spin);
        let state = assembly.state_mut();
        for i in 0..state.len() {
            state.velocities[i] = spin.cross(&state.positions[i]);
            state.angular_velocities[i] = spin;
        }
        assembly.finish()
    }

    /// Tolerances near rounding, so that where the outer iterations end does not show.
    fn end(&self, model: &Model, state: &State) -> State {
        let mut settings = Settings::default();
        settings.step.formulation = self.formulation;
        (settings.step.relative_tolerance, settings.step.motion_tolerance) = (1e-11, 1e-11);
        settings.step.absolute_tolerance = 1e-13;
        settings.step.max_iterations = 60;
        let mut simulation = Simulation::new(model, state, &settings, None).unwrap();
        for _ in 0..STEPS {
            simulation.step(DT).unwrap();
        }
        let counters = simulation.counters();
        assert_eq!((counters.retries, counters.not_converged), (0, 0), "{self:?}");
        let mut end = state.clone();
        simulation.store(&mut end);
        end
    }
}

/// Largest distance of poses and (times dt) velocities.
fn distance(a: &State, b: &State) -> f64 {
    let mut worst = 0.0_f64;
    for i in 0..a.len() {
        let turn = (a.orientations[i] * b.orientations[i].inverse()).imag().norm();
        let shift = (a.positions[i] - b.positions[i]).norm();
        let change = (a.velocities[i] - b.velocities[i]).norm() * DT;
        let spin = (a.angular_velocities[i] - b.angular_velocities[i]).norm() * DT;
        worst = worst.max(turn).max(shift).max(change).max(spin);
    }
    worst
}

fn moved(state: &State, turn: &UnitQuaternion<f64>, shift: &Vector3<f64>) -> State {
    State {
        positions: state.positions.iter().map(|x| turn * x + shift).collect(),
        orientations: state.orientations.iter().map(|q| turn * q).collect(),
        velocities: state.velocities.iter().map(|v| turn * v).collect(),
        angular_velocities: state.angular_velocities.iter().map(|w| turn * w).collect(),
        internals: state.internals.clone(),
    }
}

fn moved_model(model: &Model, turn: &UnitQuaternion<f64>, shift: &Vector3<f64>) -> Model {
    let mut model = model.clone();
    model.gravity = turn * model.gravity;
    for anchor in &mut model.anchors {
        anchor.position = turn * anchor.position + shift;
        anchor.orientation = turn * anchor.orientation;
    }
    for load in &mut model.loads {
        (load.force, load.torque) = (turn * load.force, turn * load.torque);
    }
    model
}

/// Renumbers segments and joints (entry k of `segments` is the new number of segment k, of `joints` the old number of
/// joint k) and exchanges the two ends of the joints in `swapped`.
fn relabelled(model: &Model, state: &State, segments: &[usize], joints: &[usize], swapped: &[bool]) -> (Model, State) {
    let (mut new, mut new_state) = (model.clone(), state.clone());
    for (old, &number) in segments.iter().enumerate() {
        new.segments[number] = model.segments[old].clone();
        new_state.positions[number] = state.positions[old];
        new_state.orientations[number] = state.orientations[old];
        new_state.velocities[number] = state.velocities[old];
        new_state.angular_velocities[number] = state.angular_velocities[old];
    }
    let body = |body: Body| match body {
        Body::Segment(i) => Body::Segment(segments[i]),
        Body::Anchor(i) => Body::Anchor(i),
    };
    for (number, &old) in joints.iter().enumerate() {
        let mut joint = model.joints[old];
        (joint.a, joint.b) = (body(joint.a), body(joint.b));
        if swapped[old] {
            std::mem::swap(&mut joint.a, &mut joint.b);
            std::mem::swap(&mut joint.offset_a, &mut joint.offset_b);
            // The vector part of a relative rotation has the same components in both frames.
            joint.rest_darboux = -joint.rest_darboux;
        }
        new.joints[number] = joint;
    }
    for load in &mut new.loads {
        load.segment = segments[load.segment];
    }
    (new, new_state)
}

fn shuffled(count: usize) -> impl Strategy<Value = Vec<usize>> {
    Just((0..count).collect::<Vec<_>>()).prop_shuffle()
}

fn relabelled_scene() -> impl Strategy<Value = (Scene, Vec<usize>, Vec<usize>, Vec<bool>)> {
    scene().prop_flat_map(|scene| {
        let count = scene.turns.len();
        (Just(scene), shuffled(count), shuffled(count), prop::collection::vec(any::<bool>(), count))
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn place_and_direction(
        scene in scene(),
        axis in [-3.0..3.0, -3.0..3.0, -3.0..3.0],
        shift in [-3.0..3.0, -3.0..3.0, -3.0..3.0],
    ) {
        let (model, state) = scene.build();
        let (turn, shift) = (UnitQuaternion::from_scaled_axis(Vector3::from(axis)), Vector3::from(shift));
        let expected = moved(&scene.end(&model, &state), &turn, &shift);
        let found = scene.end(&moved_model(&model, &turn, &shift), &moved(&state, &turn, &shift));
        prop_assert!(distance(&expected, &found) < 1e-10, "{}", distance(&expected, &found));
    }

    #[test]
    fn numbering((scene, segments, joints, swapped) in relabelled_scene()) {
        let (model, state) = scene.build();
        let end = scene.end(&model, &state);
        let expected = relabelled(&model, &end, &segments, &joints, &swapped).1;
        let (model, state) = relabelled(&model, &state, &segments, &joints, &swapped);
        let found = scene.end(&model, &state);
        prop_assert!(distance(&expected, &found) < 1e-10, "{}", distance(&expected, &found));
    }

    #[test]
    fn handedness_of_planar_rods(mut scene in scene()) {
        // In the plane of x and z, with its mirror image about x = 0.
        scene.turns.iter_mut().for_each(|turn| turn[0] = 0.0);
        let ends = [1.0, -1.0].map(|side| {
            let mirrored = |v: [f64; 3]| Vector3::new(side * v[0], 0.0, v[2]);
            let mut assembly = Assembly::new(mirrored(scene.gravity));
            let nodes = scene.nodes().iter().map(|x| mirrored((*x).into())).collect();
            let rest = if scene.straight { RestShape::Straight } else { RestShape::Initial };
            let rod = assembly.rod(&RodSpec { rest, ..RodSpec::new(nodes, 0.02, SOFT) });
            assembly.clamp_start(&rod);
            let (force, zero) = (mirrored(scene.force), Vector3::zeros());
            assembly.load(Load { segment: rod.end - 1, offset: 0.05, force, torque: zero, follows: false });
            let (model, state) = assembly.finish();
            scene.end(&model, &state)
        });
        for (x, image) in ends[0].positions.iter().zip(&ends[1].positions) {
            prop_assert!((x - Vector3::new(-image.x, image.y, image.z)).norm() < 1e-10);
            prop_assert!(x.y.abs() < 1e-10);
        }
    }
}

/// A drooping rod with its own place, direction, length and load.
fn add_rod(assembly: &mut Assembly, number: usize, segments: usize) {
    let start = Vector3::new(0.0, number as f64, 0.1 * number as f64);
    let direction = Vector3::new(1.0, 0.01 * number as f64, 0.03 * (number % 7) as f64);
    let beam = Beam { radius: 0.02 + 0.001 * (number % 5) as f64, material: SOFT, length: 1.0, segments };
    let rod = assembly.rod(&beam.spec(start, direction));
    if number.is_multiple_of(2) {
        assembly.fix(rod.start);
    } else {
        assembly.clamp_start(&rod);
    }
    if number.is_multiple_of(3) {
        assembly.load(beam.end_load(&rod, Vector3::y() * 0.1, Vector3::z() * 0.01));
    }
    assembly.state_mut().angular_velocities[rod.end - 1] = Vector3::new(0.3, -0.2, 0.1 * number as f64);
}

fn rods(numbers_and_segments: &[(usize, usize)]) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    for &(number, segments) in numbers_and_segments {
        add_rod(&mut assembly, number, segments);
    }
    assembly.finish()
}

fn joined(states: &[State]) -> State {
    let mut all = State::default();
    for state in states {
        all.positions.extend(&state.positions);
        all.orientations.extend(&state.orientations);
        all.velocities.extend(&state.velocities);
        all.angular_velocities.extend(&state.angular_velocities);
    }
    all
}

/// Runs rods together and each alone, and asserts the same bits.
fn together_as_alone(set: &[(usize, usize)], expected_singles: usize) {
    for formulation in Formulation::ALL {
        let mut settings = Settings::default();
        settings.step.formulation = formulation;
        let alone: Vec<State> = set
            .iter()
            .map(|rod| {
                let (model, state) = rods(&[*rod]);
                run(&model, &state, &settings, 0.02, 30).1
            })
            .collect();
        let (model, state) = rods(set);
        let (simulation, end) = run(&model, &state, &settings, 0.02, 30);
        assert_eq!(simulation.components(), set.len());
        assert_eq!(simulation.singles().count(), expected_singles);
        assert_eq!(end, joined(&alone), "{formulation}");
    }
}

#[test]
fn rods_of_different_lengths_move_as_if_alone() {
    together_as_alone(&[(0, 10), (1, 17), (2, 23), (3, 5)], 4);
}

#[test]
fn eight_alike_rods_in_lanes_move_as_if_alone() {
    together_as_alone(&[0, 2, 4, 6, 8, 10, 12, 14].map(|number| (number, 20)), 0);
    together_as_alone(&[1, 3, 5].map(|number| (number, 12)), 0);
}

/// Lanes that need substeps leave the group for a while; the others do not notice.
#[test]
fn a_lane_in_substeps_moves_as_if_alone() {
    let whip = |assembly: &mut Assembly, number: usize| {
        let start = Vector3::new(0.0, number as f64, 0.0);
        let material = Material { youngs_modulus: 1e4, torsion_modulus: 1e4, density: 1000.0 };
        let rod = assembly.rod(&RodSpec::new(shape::straight(start, Vector3::x(), 3.0, 20), 0.01, material));
        assembly.fix(rod.start);
        assembly.state_mut().velocities[rod.end - 1].z = if number == 2 { 300.0 } else { 0.0 };
    };
    let mut settings = Settings::default();
    settings.step.max_iterations = 3;
    let end = |numbers: &[usize]| {
        let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
        numbers.iter().for_each(|&number| whip(&mut assembly, number));
        let (model, mut state) = assembly.finish();
        let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
        for _ in 0..10 {
            simulation.step(0.02).unwrap();
        }
        simulation.store(&mut state);
        (state, simulation.counters())
    };
    let alone = [0, 1, 2, 3].map(|number| end(&[number]).0);
    let (together, counters) = end(&[0, 1, 2, 3]);
    println!("retries {}, not converged {}", counters.retries, counters.not_converged);
    assert!(counters.retries > 0, "the scene is meant to need substeps");
    assert_eq!(together, joined(&alone));
}

#[test]
fn a_cut_rod_moves_as_its_pieces() {
    let nodes = shape::helix(Vector3::zeros(), 0.3, 0.5, 1.0, 30);
    let (model, state) = {
        let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
        let rod = assembly.rod(&RodSpec::new(nodes, 0.02, SOFT));
        assembly.fix(rod.start).fix(rod.end - 1);
        assembly.finish()
    };
    let mut cut = model.clone();
    cut.joints.remove(11);
    let (simulation, end) = run(&cut, &state, &Settings::default(), 0.02, 20);
    assert_eq!(simulation.components(), 2);
    let piece = |range: std::ops::Range<usize>| {
        let mut piece = model.clone();
        piece.segments = model.segments[range.clone()].to_vec();
        piece.joints = model.joints[range.start..range.end - 1].to_vec();
        for joint in &mut piece.joints {
            for body in [&mut joint.a, &mut joint.b] {
                if let Body::Segment(i) = body {
                    *i -= range.start;
                }
            }
        }
        let state = State {
            positions: state.positions[range.clone()].to_vec(),
            orientations: state.orientations[range.clone()].to_vec(),
            velocities: state.velocities[range.clone()].to_vec(),
            angular_velocities: state.angular_velocities[range].to_vec(),
            internals: Vec::new(),
        };
        run(&piece, &state, &Settings::default(), 0.02, 20).1
    };
    assert_eq!(end, joined(&[piece(0..12), piece(12..30)]));
}

#[test]
fn threads_do_not_change_a_bit() {
    let set: Vec<(usize, usize)> = (0..50).map(|number| (number, 4 + (number * 7) % 30)).collect();
    let (model, state) = rods(&set);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&model, &state, &Settings::default(), 0.02, 50).1)
    };
    let one = on(1);
    assert_eq!(one, on(2));
    assert_eq!(one, on(3));
}
