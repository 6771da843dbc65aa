//! Motions that are made, not simulated: segments on a skeleton that sways.
#![allow(dead_code)]

use std::sync::Arc;

use nalgebra::{Unit, UnitQuaternion, Vector3};
use rod::{
    Body, Carried, InnerDamping, Joint, JointForce, Mesh, Model, Obstacle, ObstacleShape, Pose, Segment, State, Surface,
};
use view::{Frame, Recorder, Run};

/// A segment and how it hangs on its parent's end.
struct Bone {
    parent: Option<usize>,
    /// Orientation in the parent's frame.
    turn: UnitQuaternion<f64>,
    /// Amplitude [rad], angular frequency [rad/s] and phase of its swaying about d1, half of it about d2.
    sway: [f64; 3],
}

/// A set of rods that sways.
pub(crate) struct Motion {
    pub(crate) model: Model,
    bones: Vec<Bone>,
    root: Vector3<f64>,
}

impl Motion {
    fn new(root: Vector3<f64>) -> Self {
        Self { model: Model { gravity: Vector3::z() * -9.81, ..Model::default() }, bones: Vec::new(), root }
    }

    fn bone(&mut self, rod: usize, length: f64, radius: f64, bone: Bone) -> usize {
        let i = self.bones.len();
        self.model.segments.push(Segment {
            length,
            radius,
            density: 1000.0,
            line_inertia: None,
            added_mass: 0.0,
            fixed: i == 0,
            rod,
            body: None,
        });
        if let Some(parent) = bone.parent {
            let offset_a = 0.5 * self.model.segments[parent].length;
            self.model.joints.push(Joint {
                a: Body::Segment(parent),
                b: Body::Segment(i),
                offset_a,
                offset_b: -0.5 * length,
                length: offset_a + 0.5 * length,
                rest_darboux: Vector3::zeros(),
                rest_frames: [UnitQuaternion::identity(); 2],
                stretch_compliance: 1e-9,
                shear_compliance: 1e-9,
                shear_extra: 0.0,
                bend_compliance: 1e-3,
                bend_extra: 0.0,
                twist_compliance: 1e-3,
                inner_damping: InnerDamping::NONE,
                youngs_modulus: 1e6,
                torsion_modulus: 1e6,
                mount: None,
                freedom: rod::Freedom::None,
            });
        }
        self.bones.push(bone);
        i
    }

    fn poses(&self, time: f64) -> State {
        let mut state = State::default();
        for (bone, segment) in self.bones.iter().zip(&self.model.segments) {
            let [amplitude, frequency, phase] = bone.sway;
            let angle = amplitude * ((frequency * time + phase).sin() - phase.sin());
            let sway = UnitQuaternion::from_euler_angles(angle, 0.5 * angle, 0.0);
            let (start, before) = match bone.parent {
                Some(p) => {
                    (state.positions[p] + state.axis(p) * (0.5 * self.model.segments[p].length), state.orientations[p])
                }
                None => (self.root, UnitQuaternion::identity()),
            };
            let orientation = before * bone.turn * sway;
            state.positions.push(start + orientation * Vector3::z() * (0.5 * segment.length));
            state.orientations.push(orientation);
        }
        state
    }

    /// State at a time [s].
    pub(crate) fn state(&self, time: f64) -> State {
        let h = 1e-5;
        let (before, after) = (self.poses(time - h), self.poses(time + h));
        let mut state = self.poses(time);
        state.velocities = after.positions.iter().zip(&before.positions).map(|(a, b)| (a - b) / (2.0 * h)).collect();
        state.angular_velocities = vec![Vector3::zeros(); state.len()];
        state
    }

    /// What the joints would transmit if each carried a newton a joint that comes after it.
    pub(crate) fn forces(&self, state: &State, time: f64) -> Vec<JointForce> {
        let count = self.model.joints.len() as f64;
        let force = |k: usize| Vector3::z() * -((count - k as f64) * (1.0 + 0.3 * (3.0 * time).sin()));
        let joints = self.model.joints.iter().enumerate();
        joints
            .map(|(k, joint)| {
                let gap = rod::measure::stretch_gap(&self.model, state, joint);
                let lambda_b = -rod::measure::bend_strain(&self.model, state, joint) / joint.bend_compliance;
                let [a, b] = [joint.a, joint.b].map(|body| self.model.pose(body, state).orientation);
                let lambda_s = force(k) - gap / joint.stretch_compliance;
                JointForce::of_multipliers(self.model.strain_measure, lambda_s, lambda_b, [&a, &b], joint.length)
            })
            .collect()
    }

    /// Kinetic energy without turns, and that of the weight [J].
    fn energy(&self, state: &State) -> f64 {
        let parts = self.model.segments.iter().zip(&state.positions).zip(&state.velocities);
        parts.map(|((s, x), v)| s.mass() * (0.5 * v.norm_squared() - self.model.gravity.dot(x))).sum()
    }

    /// The motion recorded: so many frames a second [1/s] from time 0 on.
    pub(crate) fn record(&self, name: &str, frames: usize, rate: f64) -> Run {
        self.record_at(name, frames, rate, |time| time)
    }

    /// The same, the rods as they are at other times.
    pub(crate) fn record_at(&self, name: &str, frames: usize, rate: f64, of_rods: impl Fn(f64) -> f64) -> Run {
        self.recorder(name, frames, rate, of_rods).finish()
    }

    /// The same, to which more can be added.
    pub(crate) fn recorder(&self, name: &str, frames: usize, rate: f64, of_rods: impl Fn(f64) -> f64) -> Recorder {
        let mut recorder = Recorder::new(name, 1.0 / rate, &self.model);
        for frame in 0..frames {
            let time = frame as f64 / rate;
            let state = self.state(of_rods(time));
            let forces = if frame == 0 { Vec::new() } else { self.forces(&state, time) };
            let energy = self.energy(&state);
            let length_ratio = 1.0 + 2e-4 * (5.0 * time).sin();
            let iterations = if frame == 0 { f64::NAN } else { 2.0 + f64::from(u8::from(frame % 17 == 0)) };
            recorder.push(&Frame { time, state: &state, forces: &forces, energy, length_ratio, iterations });
        }
        recorder
    }
}

/// A coil that hangs and swings, above a ground with a ball and a bar. `loose` above 1 swings wider.
pub(crate) fn helix(loose: f64) -> Motion {
    let mut motion = Motion::new(Vector3::new(0.0, 0.0, 1.0));
    let mut parent = None;
    for i in 0..80 {
        let coil = UnitQuaternion::from_euler_angles(0.24, 0.0, 0.07);
        let turn = if i == 0 { UnitQuaternion::from_euler_angles(1.75, 0.0, 0.0) } else { coil };
        let share = i as f64 / 80.0;
        let sway = [loose * if i == 0 { 0.1 } else { 0.012 }, 3.0 / loose.sqrt(), 2.0 * share];
        parent = Some(motion.bone(0, 0.045, 0.008, Bone { parent, turn, sway }));
    }
    let surface = Surface::default();
    let shapes = [
        ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: Unit::new_unchecked(Vector3::z()) },
        ObstacleShape::Sphere { centre: Vector3::new(0.45, 0.25, 0.12), radius: 0.12 },
        ObstacleShape::Capsule {
            start: Vector3::new(-0.5, 0.1, 0.06),
            end: Vector3::new(-0.2, 0.5, 0.06),
            radius: 0.06,
        },
    ];
    motion.model.contacts.obstacles = shapes.map(|shape| Obstacle::new(shape, surface)).into();
    motion
}

/// [`helix`], with its ground, its ball and its bar on the move, about turning axes.
pub(crate) fn driven() -> Motion {
    let mut motion = helix(1.0);
    for (k, obstacle) in motion.model.contacts.obstacles.iter_mut().enumerate() {
        let (pose, k) = (obstacle.at(0.0).pose, k as f64);
        let (v, w) = (Vector3::new(0.1, 0.2 * k, 0.05 * k), Vector3::new(0.3 * k, -0.2 * k, 0.5));
        let way = rod::Motion::at_velocities(&pose, &[(0.0, v, w)]).expect("finite velocities");
        obstacle.motion = Some(Carried::new(Arc::new(way)));
    }
    motion
}

/// A straight rod along z in a vessel, a tube of triangles that is open at both ends, a tenth of it on either side outside.
pub(crate) fn catheter() -> Motion {
    const SIDES: u32 = 24;
    let mut motion = Motion::new(Vector3::zeros());
    let mut parent = None;
    for _ in 0..40 {
        let still = [0.0002, 1.0, 0.0];
        parent = Some(motion.bone(0, 0.01, 0.004, Bone { parent, turn: UnitQuaternion::identity(), sway: still }));
    }
    let places = (0..2 * SIDES).map(|i| {
        let angle = std::f64::consts::TAU * f64::from(i / 2) / f64::from(SIDES);
        Vector3::new(0.03 * angle.cos(), 0.03 * angle.sin(), if i % 2 == 0 { 0.04 } else { 0.36 })
    });
    let sides = (0..SIDES).flat_map(|i| {
        let [a, b, c, d] = [2 * i, 2 * i + 1, 2 * ((i + 1) % SIDES), 2 * ((i + 1) % SIDES) + 1];
        [[a, c, b], [b, c, d]]
    });
    let mesh = Arc::new(Mesh::new(places.collect(), sides.collect()).expect("a surface"));
    let pose = Pose { position: Vector3::zeros(), orientation: UnitQuaternion::identity() };
    motion.model.contacts.obstacles = vec![Obstacle::new(ObstacleShape::Mesh { pose, mesh }, Surface::default())];
    motion
}

/// An obstacle that goes on at a velocity [m/s].
pub(crate) fn moving(obstacle: Obstacle, velocity: Vector3<f64>) -> Obstacle {
    let way = rod::Motion::at_velocities(&obstacle.at(0.0).pose, &[(0.0, velocity, Vector3::zeros())]);
    Obstacle { motion: Some(Carried::new(Arc::new(way.expect("finite velocities")))), ..obstacle }
}

/// A tree of a trunk and branches on branches, thinner and thinner, of 1,061 segments.
pub(crate) fn tree() -> Motion {
    let mut motion = Motion::new(Vector3::zeros());
    let mut trunk = None;
    let mut nodes = Vec::new();
    for i in 0..11 {
        let sway = [0.004, 1.5, 0.0];
        let bone = Bone { parent: trunk, turn: UnitQuaternion::identity(), sway };
        let i_trunk = motion.bone(0, 0.25, 0.09 - 0.005 * i as f64, bone);
        trunk = Some(i_trunk);
        if i > 3 {
            nodes.push(i_trunk);
        }
    }
    // Levels of branches: rods at a parent, segments of each, length and radius of a segment, angle to the parent.
    let levels = [(5, 6, 0.2, 0.03, 1.0), (2, 4, 0.14, 0.014, 0.8), (1, 4, 0.1, 0.006, 0.7)];
    let mut rod = 0;
    for (level, (rods, segments, length, radius, angle)) in levels.into_iter().enumerate() {
        for parent in std::mem::take(&mut nodes) {
            for branch in 0..rods {
                rod += 1;
                let around = 2.4 * f64::from(rod as u16) + f64::from(branch);
                let mut last = parent;
                for k in 0..segments {
                    let out = UnitQuaternion::from_euler_angles(0.0, 0.0, around)
                        * UnitQuaternion::from_euler_angles(angle, 0.0, 0.0);
                    let turn = if k == 0 { out } else { UnitQuaternion::from_euler_angles(-0.06, 0.0, 0.0) };
                    let sway = [0.012 * (level + 1) as f64, 2.0 + level as f64 + 0.02 * (rod % 29) as f64, around];
                    let thickness = radius * (1.0 - 0.6 * k as f64 / segments as f64);
                    if motion.bones.len() == 1061 {
                        return motion;
                    }
                    last = motion.bone(rod, length, thickness, Bone { parent: Some(last), turn, sway });
                    if k >= segments / 2 {
                        nodes.push(last);
                    }
                }
            }
        }
    }
    motion
}
