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
/// Mass per length of the rods [kg/m].
const LINE_DENSITY: f64 = DENSITY * PI * RADIUS * RADIUS;
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
    /// Ways of the grips, which hold the faces of the rod at their inner markers.
    motions: Vec<Arc<Motion>>,
    /// Times of the frames [s].
    pub(crate) time: Vec<f64>,
    /// Segments between two markers.
    pub(crate) parts: usize,
}

impl Cable {
    /// The cable of a recording, with so many segments between two markers.
    ///
    /// A grip holds the end face of the rod, which lies at its inner marker, at the angle at which the curve through the first
    /// frame goes through it. From there it turns as the direction from marker to marker does, without a turn about it.
    ///
    /// # Errors
    /// If the markers of a grip make no motion, because a coordinate is not finite.
    pub fn new(recording: &Recording, parts: usize) -> Result<Self, KeyframeError> {
        let last = recording.count() - 1;
        let nodes = [0, 1].map(|frame| {
            let all = spline::through(&recording.markers[frame], parts);
            all[parts * (GRIPPED - 1)..=parts * (last + 1 - GRIPPED)].to_vec()
        });
        let time = recording.time.clone();
        let mut cable = Self { nodes, interval: time[1], motions: Vec::new(), time, parts };
        let (model, _) = cable.assembly(&Parameters::default()).finish();
        for (anchor, [inner, outer]) in model.anchors.iter().zip([[GRIPPED - 1, 0], [last + 1 - GRIPPED, last]]) {
            let motion = grip_motion(recording, inner, outer, anchor.orientation)?;
            cable.motions.push(Arc::new(motion));
        }
        Ok(cable)
    }

    /// The grips' motions, that of the rod's start first.
    pub fn motions(&self) -> &[Arc<Motion>] {
        &self.motions
    }

    /// The model of the cable with these parameters, and its state in the first frame.
    pub fn model(&self, parameters: &Parameters) -> (Model, State) {
        let mut assembly = self.assembly(parameters);
        let springs = springs(parameters);
        let model = assembly.model_mut();
        let grips = model.joints.len() - self.motions.len();
        for (end, motion) in self.motions.iter().enumerate() {
            model.anchors[end] = motion.at(0.0).pose;
            model.motions.push(Driven::new(Body::Anchor(end), motion.clone()));
            model.soften(grips + end, &springs);
        }
        assembly.finish()
    }

    /// The rod, clamped at both faces by grips that stand still.
    fn assembly(&self, parameters: &Parameters) -> Assembly {
        let of = |parameter| parameters[parameter];
        let youngs_modulus = youngs_modulus(parameters);
        let torsion_modulus = 0.5 * of(Parameter::Twist) * youngs_modulus;
        let (x, y) = (of(Parameter::TiltX), of(Parameter::TiltY));
        let mut assembly = Assembly::new(Vector3::new(x.sin(), y.sin(), -1.0).normalize() * GRAVITY);
        assembly.damping(Damping { linear: of(Parameter::OuterDamping), angular: 0.0 });
        let drags = [Parameter::DragAcross, Parameter::DragAlong].map(of);
        if drags != [0.0; 2] {
            let [normal_drag, tangential_drag] = drags.map(|drag| drag * DENSITY * PI * RADIUS / AIR_DENSITY);
            let wind = Wind::steady(Vector3::zeros());
            assembly.air(Air { density: AIR_DENSITY, normal_drag, tangential_drag, wind });
        }
        let axis = (self.nodes[0][1] - self.nodes[0][0]).normalize();
        let tau = of(Parameter::InnerDamping);
        let rod = assembly.rod(&RodSpec {
            inner_damping: InnerDamping { bending: tau, twist: tau, stretch: 0.0 },
            d1: Some(upright(&axis) * Vector3::x()),
            rest: RestShape::Uniform(Vector3::new(of(Parameter::Curvature1), of(Parameter::Curvature2), 0.0)),
            ..RodSpec::new(
                self.nodes[0].clone(),
                RADIUS,
                Material { youngs_modulus, torsion_modulus, density: DENSITY },
            )
        });
        assembly.clamp_start(&rod).clamp_end(&rod);
        self.set_velocities(assembly.state_mut());
        assembly
    }

    /// Nodes of the rod in the first frame [m].
    pub(crate) fn first_nodes(&self) -> &[Vector3<f64>] {
        &self.nodes[0]
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

/// Young's modulus [Pa] of a rod of the nominal radius and density.
pub(crate) fn youngs_modulus(parameters: &Parameters) -> f64 {
    4.0 * parameters[Parameter::Bending] * LINE_DENSITY / (PI * RADIUS.powi(4))
}

/// The springs of the grips.
pub(crate) fn springs(parameters: &Parameters) -> Springs {
    let bend = parameters[Parameter::Bending] * LINE_DENSITY / parameters[Parameter::Grip];
    Springs { force: [f64::INFINITY; 3], moment: [bend, bend, parameters[Parameter::Twist] * bend] }
}

/// The way of a grip: that of its `inner` marker, turned from its `first` orientation as the direction to the `outer` one
/// turns. It goes on a frame at either end, so that it is as fast in the first and the last frame as beside them.
fn grip_motion(
    recording: &Recording,
    inner: usize,
    outer: usize,
    first: UnitQuaternion<f64>,
) -> Result<Motion, KeyframeError> {
    let (mut orientation, mut before) = (first, None);
    let mut poses = Vec::with_capacity(recording.frames() + 2);
    for (time, markers) in recording.time.iter().zip(&recording.markers) {
        let direction = (markers[outer] - markers[inner]).normalize();
        orientation = carry(before.as_ref().unwrap_or(&direction), &direction) * orientation;
        before = Some(direction);
        poses.push((*time, Pose { position: markers[inner], orientation }));
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

/// The frame whose d3 is `axis`: the smallest rotation away from one that points down.
fn upright(axis: &Vector3<f64>) -> UnitQuaternion<f64> {
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI);
    carry(&-Vector3::z(), axis) * down
}
