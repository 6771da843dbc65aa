//! Models of every kind with motions made up, and what their centrelines must be.

use std::path::{Path, PathBuf};

use export::{Format, Names, TrajectoryInfo, TrajectoryReader, TrajectoryWriter, write_format};
use nalgebra::{UnitQuaternion, Vector3};
use rod::{Assembly, BodyShape, JointForce, Material, Model, Pose, RigidBody, RodSpec, State, shape};

/// Time step of all runs [s].
const DT: f64 = 0.02;

/// A model and a motion, made up.
pub(crate) struct Run {
    pub(crate) name: &'static str,
    /// What its parts are called: nothing of their own, unless a test names them.
    pub(crate) called: Names,
    pub(crate) model: Model,
    pub(crate) times: Vec<f64>,
    pub(crate) states: Vec<State>,
    /// Empty where no forces are kept.
    pub(crate) forces: Vec<Vec<JointForce>>,
    /// The nodes of each rod's polyline, numbered from 0.
    pub(crate) lines: Vec<Vec<usize>>,
    /// The joint at each node.
    pub(crate) joints: Vec<Option<usize>>,
}

impl Run {
    /// What is made up of `model`, whose first state is kept.
    fn new(name: &'static str, assembly: Assembly, frames: usize, with_forces: bool) -> Self {
        let (model, first) = assembly.finish();
        model.validate(&first).unwrap();
        let states = (0..frames).map(|frame| moved(&first, frame)).collect();
        let force = |frame: usize, joint: usize| {
            let value = |k: usize| ((7 * frame + 13 * joint + k + 1) as f64).sqrt() - 4.0;
            JointForce {
                force: Vector3::from_fn(|c, _| value(c)),
                moment: Vector3::from_fn(|c, _| value(c + 3) * 1e-3),
            }
        };
        let joints = model.joints.len();
        let of_frame = |frame| (0..joints).map(|joint| force(frame, joint)).collect();
        let forces = if with_forces { (0..frames).map(of_frame).collect() } else { Vec::new() };
        let times = (0..frames).map(|frame| frame as f64 * 0.1).collect();
        let called = Names::new(&model, &[], &[]);
        Self { name, called, model, times, states, forces, lines: Vec::new(), joints: Vec::new() }
    }

    /// Writes the trajectory into `directory` and returns its file.
    pub(crate) fn record(&self, directory: &Path) -> PathBuf {
        let info = TrajectoryInfo { scene: "a \"rod\" & <knot> \u{2603}".to_owned(), dt: DT, segments_hash: None };
        let joints = self.forces.first().map_or(0, Vec::len);
        let mut writer = TrajectoryWriter::create(directory, self.model.segments.len(), joints, info).unwrap();
        for (frame, state) in self.states.iter().enumerate() {
            let forces = self.forces.get(frame).map_or(&[][..], Vec::as_slice);
            writer.push(state, forces, self.times[frame]).unwrap();
        }
        writer.finish().unwrap()
    }

    /// Records the run and exports it, in `directory`.
    pub(crate) fn export(&self, format: Format, directory: &Path) -> Vec<PathBuf> {
        let mut reader = TrajectoryReader::open(&self.record(directory)).unwrap();
        write_format(format, directory, &mut reader, &self.model, &self.called).unwrap()
    }

    /// Place of the node between two segments, or at an end, by the segments that meet there.
    pub(crate) fn node(&self, state: &State, node: usize) -> (Vector3<f64>, f64) {
        let mut places = Vec::new();
        let mut radii = Vec::new();
        let mut segment = 0;
        for line in &self.lines {
            for pair in line.windows(2) {
                for (end, side) in pair.iter().zip([-0.5, 0.5]).filter(|(end, _)| **end == node) {
                    assert_eq!(*end, node);
                    let half = side * self.model.segments[segment].length;
                    places.push(state.positions[segment] + state.orientations[segment] * Vector3::z() * half);
                    radii.push(self.model.segments[segment].radius);
                }
                segment += 1;
            }
        }
        assert_eq!(segment, self.model.segments.len());
        let count = places.len() as f64;
        (places.iter().sum::<Vector3<f64>>() / count, radii.iter().sum::<f64>() / count)
    }
}

/// The state of a frame: segments are strewn more in each, with large turns and with signs of quaternions that jump.
fn moved(first: &State, frame: usize) -> State {
    let mut state = first.clone();
    if frame == 0 {
        return state;
    }
    for i in 0..state.positions.len() {
        let value = |k: usize| ((frame * 31 + i * 7 + k) as f64 * 0.7).sin();
        let vector = |k: usize| Vector3::from_fn(|c, _| value(k + c));
        state.positions[i] += vector(0) * (0.1 * frame as f64);
        let turned = UnitQuaternion::from_scaled_axis(vector(3) * 0.8) * state.orientations[i];
        let sign = if (frame + i).is_multiple_of(2) { 1.0 } else { -1.0 };
        state.orientations[i] = UnitQuaternion::new_unchecked(turned.into_inner() * sign);
        state.velocities[i] = vector(6);
        state.angular_velocities[i] = vector(9) * 5.0;
    }
    state
}

const MATERIAL: Material = Material { youngs_modulus: 1e6, torsion_modulus: 5e5, density: 1e3 };

fn assembly() -> Assembly {
    Assembly::new(-9.81 * Vector3::z())
}

fn line(start: Vector3<f64>, direction: Vector3<f64>, length: f64, segments: usize, radius: f64) -> RodSpec {
    RodSpec::new(shape::straight(start, direction, length, segments), radius, MATERIAL)
}

/// Runs of every kind.
pub(crate) fn runs() -> Vec<Run> {
    vec![
        straight(2),
        clamped(),
        ring(true),
        ring(false),
        tree(),
        crossing(),
        single(1, true),
        single(3, false),
        hairpin(),
    ]
}

/// A ball, a box and a hidden body, and a rod of 2 segments between the first two.
pub(crate) fn weighted(frames: usize) -> Run {
    let mut assembly = assembly();
    let at = |x: f64| Pose { position: Vector3::new(x, 0.5, 0.0), orientation: UnitQuaternion::identity() };
    let ball = assembly.body(RigidBody::new(BodyShape::Sphere { radius: 0.25 }, 2.0), at(-0.25));
    let sides = Vector3::new(0.2, 0.4, 0.6);
    let block = assembly.body(RigidBody::new(BodyShape::Box { sides }, 3.0), at(1.1));
    assembly.body(RigidBody::hidden(1.0, Vector3::repeat(0.1)), at(5.0));
    let rod = assembly.rod(&line(Vector3::new(0.0, 0.5, 0.0), Vector3::x(), 1.0, 2, 0.05));
    assembly.join_body(rod.start, 0.0, ball, &Vector3::new(0.25, 0.0, 0.0));
    assembly.join_body(rod.end - 1, 1.0, block, &Vector3::new(-0.1, 0.0, 0.0));
    Run::new("weighted", assembly, frames, true)
}

/// A straight rod of one radius along y, 5 segments, without forces.
pub(crate) fn straight(frames: usize) -> Run {
    straight_of(5, frames)
}

/// A straight rod of so many segments, 2 m long.
pub(crate) fn straight_of(segments: usize, frames: usize) -> Run {
    let mut assembly = assembly();
    assembly.rod(&line(Vector3::new(1.0, 2.0, 3.0), Vector3::y(), 2.0, segments, 0.1));
    let joints = (0..=segments).map(|node| (1..segments).contains(&node).then(|| node - 1)).collect();
    Run { lines: vec![(0..=segments).collect()], joints, ..Run::new("straight", assembly, frames, false) }
}

/// A helix with anchors at both ends, whose radii differ.
fn clamped() -> Run {
    let mut assembly = assembly();
    let nodes = shape::helix(Vector3::new(0.3, -0.2, 1.0), 0.3, 0.5, 1.2, 6);
    let radii = vec![0.01, 0.02, 0.03, 0.015, 0.05, 0.01];
    let rod = assembly.rod(&RodSpec { radii, twist: 2.0, ..RodSpec::new(nodes, 0.0, MATERIAL) });
    assembly.clamp_start(&rod).clamp_end(&rod);
    let joints = [5, 0, 1, 2, 3, 4, 6].map(Some).to_vec();
    Run { lines: vec![(0..=6).collect()], joints, ..Run::new("clamped", assembly, 5, true) }
}

/// A twisted ring.
fn ring(with_forces: bool) -> Run {
    let mut assembly = assembly();
    let nodes = shape::ring(Vector3::new(5.0, 0.0, 0.0), 0.5, 7);
    assembly.rod(&RodSpec { closed: true, twist: 2.5, ..RodSpec::new(nodes, 0.04, MATERIAL) });
    let joints = [6, 0, 1, 2, 3, 4, 5].map(Some).to_vec();
    Run { lines: vec![vec![0, 1, 2, 3, 4, 5, 6, 0]], joints, ..Run::new("ring", assembly, 4, with_forces) }
}

/// A clamped trunk with a branch at its end and one in the middle of a segment, and a ring beside it.
fn tree() -> Run {
    let mut assembly = assembly();
    let trunk = assembly.rod(&line(Vector3::zeros(), Vector3::z(), 1.0, 3, 0.05));
    let branch = assembly.rod(&line(Vector3::z(), Vector3::new(1.0, 0.0, 1.0), 0.5, 2, 0.03));
    let nodes = shape::ring(Vector3::new(2.0, 2.0, 0.0), 0.2, 3);
    assembly.rod(&RodSpec { closed: true, ..RodSpec::new(nodes, 0.02, MATERIAL) });
    let twig = assembly.rod(&line(Vector3::z() * 0.5, Vector3::new(0.0, 1.0, 0.3), 0.2, 1, 0.01));
    // Joints: trunk 0 and 1, branch 2, ring 3 to 5.
    assembly.branch(2, 1.0, &branch).branch(1, 0.5, &twig).clamp_start(&trunk);
    let joints = [
        [Some(8), Some(0), Some(1), None].as_slice(),
        &[Some(6), Some(2), None],
        &[Some(5), Some(3), Some(4)],
        &[Some(7), None],
    ];
    let lines = vec![vec![0, 1, 2, 3], vec![4, 5, 6], vec![7, 8, 9, 7], vec![10, 11]];
    Run { lines, joints: joints.concat(), ..Run::new("tree", assembly, 3, true) }
}

/// Two rods joined in the middles of segments, where no node is, and at a node that has a joint of its own; a third is
/// joined with its end to the middle of a segment.
fn crossing() -> Run {
    let mut assembly = assembly();
    assembly.rod(&line(Vector3::zeros(), Vector3::x(), 1.0, 2, 0.02));
    assembly.rod(&line(Vector3::new(0.25, -0.25, 0.0), Vector3::y(), 1.0, 2, 0.03));
    assembly.rod(&line(Vector3::new(0.5, 0.25, 0.0), Vector3::z(), -1.0, 1, 0.04));
    // Joints: rod 0 has 0, rod 1 has 1.
    assembly.join(0, 0.5, 2, 0.5).join(1, 0.5, 3, 0.0).join(4, 1.0, 3, 0.5);
    let joints = vec![None, Some(0), None, None, Some(1), None, None, Some(4)];
    let lines = vec![vec![0, 1, 2], vec![3, 4, 5], vec![6, 7]];
    Run { lines, joints, ..Run::new("crossing", assembly, 3, true) }
}

/// One segment, with an anchor at its start or without any joint.
fn single(frames: usize, anchored: bool) -> Run {
    let mut assembly = assembly();
    let rod = assembly.rod(&line(Vector3::x(), Vector3::new(1.0, 1.0, 1.0), 0.3, 1, 0.1));
    if anchored {
        assembly.clamp_start(&rod);
    }
    let joints = vec![anchored.then_some(0), None];
    Run { lines: vec![vec![0, 1]], joints, ..Run::new("single", assembly, frames, anchored) }
}

/// A rod that goes back where it came from.
fn hairpin() -> Run {
    let mut assembly = assembly();
    let nodes = vec![Vector3::zeros(), Vector3::x(), Vector3::zeros()];
    assembly.rod(&RodSpec::new(nodes, 0.05, MATERIAL));
    Run { lines: vec![vec![0, 1, 2]], joints: vec![None, Some(0), None], ..Run::new("hairpin", assembly, 2, false) }
}
