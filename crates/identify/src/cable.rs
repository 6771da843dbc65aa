//! A cable between two grips, as a recording has it, and the model of it.

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};
use rod::{
    Air, Assembly, Body, Damping, Driven, InnerDamping, Interpolation, KeyframeError, Material, Model, Motion, Pose,
    RestShape, RodSpec, Springs, State, Wind,
};

use crate::parameter::{Parameter, Parameters};
use crate::recording::{GRIPPED, Recording};
use crate::spline;

/// Gravitational acceleration [m/s^2].
pub const GRAVITY: f64 = 9.81;
/// Radius of the rods [m] and density [kg/m^3]. Markers tell no masses, so that these say nothing of the real cable: all that
/// is identified is a ratio to them.
pub const RADIUS: f64 = 0.004;
/// See [`RADIUS`].
pub const DENSITY: f64 = 1000.0;
/// Density of the air [kg/m^3], which counts together with the drag alone.
pub const AIR_DENSITY: f64 = 1.2;

/// How finely cables are simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Resolution {
    /// Segments between two markers.
    pub segments: usize,
    /// Steps from frame to frame.
    pub steps: usize,
}

impl Default for Resolution {
    fn default() -> Self {
        Self { segments: 3, steps: 1 }
    }
}

/// What a prediction may know of a recording: its first two frames, and its grips over all time.
#[derive(Clone, Debug)]
pub struct Cable {
    /// Nodes of the rod [m] in the first two frames, from the inner marker of one grip to that of the other.
    nodes: [Vec<Vector3<f64>>; 2],
    /// Time from the first frame to the second [s].
    interval: f64,
    /// Ways of the inner markers of the grips.
    motions: [Arc<Motion>; 2],
    /// Times of the frames [s].
    pub(crate) time: Vec<f64>,
    /// Segments between two markers.
    pub(crate) parts: usize,
}

impl Cable {
    /// The cable of a recording, with so many segments between two markers.
    ///
    /// # Errors
    /// If the markers of a grip make no motion, because a coordinate is not finite.
    pub fn new(recording: &Recording, parts: usize) -> Result<Self, KeyframeError> {
        let last = recording.count() - 1;
        let nodes = [0, 1].map(|frame| {
            let all = spline::through(&recording.markers[frame], parts);
            all[parts * (GRIPPED - 1)..=parts * (last + 1 - GRIPPED)].to_vec()
        });
        let directions = |[from, to]: [usize; 2]| -> Vec<Vector3<f64>> {
            recording.markers.iter().map(|markers| (markers[to] - markers[from]).normalize()).collect()
        };
        let ends = [directions([0, 1]), directions([last - 1, last])];
        // The frame of the first grip, and from there without twist along the rod to the second.
        let first = upright(&ends[0][0]);
        let mut along = first;
        for pair in nodes[0].windows(2) {
            along = carried(&along, &(pair[1] - pair[0]).normalize());
        }
        let starts = [first, carried(&along, &ends[1][0])];
        let inner = [GRIPPED - 1, last + 1 - GRIPPED];
        let motion = |end: usize| grip_motion(recording, inner[end], &ends[end], starts[end]);
        let motions = [Arc::new(motion(0)?), Arc::new(motion(1)?)];
        Ok(Self { nodes, interval: recording.time[1], motions, time: recording.time.clone(), parts })
    }

    /// The grips' motions, that of the rod's start first.
    pub fn motions(&self) -> &[Arc<Motion>; 2] {
        &self.motions
    }

    /// The model of the cable with these parameters, and its state in the first frame.
    pub fn model(&self, parameters: &Parameters) -> (Model, State) {
        let of = |parameter| parameters[parameter];
        let mass = DENSITY * PI * RADIUS.powi(2);
        let bending = of(Parameter::Bending) * mass;
        let youngs_modulus = 4.0 * bending / (PI * RADIUS.powi(4));
        let torsion_modulus = 0.5 * of(Parameter::Twist) * youngs_modulus;
        let (x, y) = (of(Parameter::TiltX), of(Parameter::TiltY));
        let mut assembly = Assembly::new(Vector3::new(x.sin(), y.sin(), -1.0).normalize() * GRAVITY);
        assembly.damping(Damping { linear: of(Parameter::OuterDamping), angular: 0.0 });
        let to_coefficient = DENSITY * PI * RADIUS / AIR_DENSITY;
        assembly.air(Air {
            density: AIR_DENSITY,
            normal_drag: of(Parameter::DragAcross) * to_coefficient,
            tangential_drag: of(Parameter::DragAlong) * to_coefficient,
            wind: Wind::steady(Vector3::zeros()),
        });
        let starts = [0, 1].map(|end| self.motions[end].at(0.0).pose);
        let axis = (self.nodes[0][1] - self.nodes[0][0]).normalize();
        let tau = of(Parameter::InnerDamping);
        let rod = assembly.rod(&RodSpec {
            inner_damping: InnerDamping { bending: tau, twist: tau, stretch: 0.0 },
            d1: Some(carried(&starts[0].orientation, &axis) * Vector3::x()),
            rest: RestShape::Uniform(Vector3::new(of(Parameter::Curvature1), of(Parameter::Curvature2), 0.0)),
            ..RodSpec::new(self.nodes[0].clone(), RADIUS, Material { youngs_modulus, torsion_modulus, density: DENSITY })
        });
        let between = rod.len() - 1;
        assembly.clamp_start(&rod).clamp_end(&rod);
        self.set_velocities(assembly.state_mut());
        let model = assembly.model_mut();
        let bend = bending / of(Parameter::Grip);
        let springs = Springs { force: [f64::INFINITY; 3], moment: [bend, bend, of(Parameter::Twist) * bend] };
        for end in 0..2 {
            model.anchors[end] = starts[end];
            model.motions.push(Driven::new(Body::Anchor(end), self.motions[end].clone()));
            model.soften(between + end, &springs);
        }
        assembly.finish()
    }

    /// The velocities between the first two frames.
    fn set_velocities(&self, state: &mut State) {
        let [now, next] = &self.nodes;
        for i in 0..state.len() {
            let [before, after] = [now, next].map(|nodes| (nodes[i], nodes[i + 1]));
            state.velocities[i] = ((after.0 + after.1) - (before.0 + before.1)) * (0.5 / self.interval);
            let [from, to] = [before, after].map(|(a, b)| (b - a).normalize());
            state.angular_velocities[i] = carry(&from, &to).scaled_axis() / self.interval;
        }
    }

    /// Nodes at which the free markers lie.
    pub(crate) fn marker_nodes(&self) -> impl Iterator<Item = usize> {
        (1..self.nodes[0].len() / self.parts).map(|marker| marker * self.parts)
    }
}

/// The way of a grip: a marker's, turned as the direction `axes` turns, without a turn about it. It goes on a frame at either
/// end, so that it is as fast in the first and the last frame as beside them.
fn grip_motion(
    recording: &Recording,
    marker: usize,
    axes: &[Vector3<f64>],
    start: UnitQuaternion<f64>,
) -> Result<Motion, KeyframeError> {
    let mut orientation = start;
    let mut poses = Vec::with_capacity(axes.len() + 2);
    for ((time, markers), axis) in recording.time.iter().zip(&recording.markers).zip(axes) {
        orientation = carried(&orientation, axis);
        poses.push((*time, Pose { position: markers[marker], orientation }));
    }
    let beyond = |[here, next]: [&(f64, Pose); 2]| {
        let turn = next.1.orientation.rotation_to(&here.1.orientation);
        let position = here.1.position * 2.0 - next.1.position;
        (2.0 * here.0 - next.0, Pose { position, orientation: turn * here.1.orientation })
    };
    let count = poses.len();
    let [before, after] = [beyond([&poses[0], &poses[1]]), beyond([&poses[count - 1], &poses[count - 2]])];
    poses.insert(0, before);
    poses.push(after);
    Motion::through(&poses, Interpolation::Smooth)
}

/// The smallest rotation that takes one unit vector to another.
fn carry(from: &Vector3<f64>, to: &Vector3<f64>) -> UnitQuaternion<f64> {
    let half_turn = || UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI);
    UnitQuaternion::rotation_between(from, to).unwrap_or_else(half_turn)
}

/// A frame, turned by the smallest rotation that brings its d3 to `axis`.
fn carried(frame: &UnitQuaternion<f64>, axis: &Vector3<f64>) -> UnitQuaternion<f64> {
    carry(&(frame * Vector3::z()), axis) * frame
}

/// The frame of a grip whose d3 is `axis`: the smallest rotation away from one that points down.
fn upright(axis: &Vector3<f64>) -> UnitQuaternion<f64> {
    carried(&UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI), axis)
}
