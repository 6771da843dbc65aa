//! A cable between two grips, as a recording has it, and the model of it.

use std::f64::consts::PI;
use std::sync::Arc;

use cosserat::assembly::{
    Air, Assembly, Damping, InnerDamping, JointLaw, Material, MaxwellBranch, RestShape, RodSpec, StrandFriction, Wind,
};
use cosserat::motion::{Carried, Driven, Interpolation, KeyframeError, Motion};
use cosserat::state::{Body, Model, Pose, Springs, State};
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::parameter::{PLACES, Parameter, Parameters};
use crate::recording::{GRIPPED, Grips, Recording};
use crate::specimen::Specimen;
use crate::specimen::SpecimenError;
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Resolution {
    /// Segments between two markers.
    pub segments: usize,
    /// Steps from frame to frame.
    pub steps: usize,
}

impl Resolution {
    /// That in which cables are searched for.
    pub const SEARCH: Self = Self { segments: 3, steps: 1 };
    /// That in which a search for a cable ends, and in which cables are predicted.
    pub const PREDICTION: Self = Self { segments: 5, steps: 2 };

    /// The coarser of two, in each of both.
    #[must_use]
    pub fn min(self, other: Self) -> Self {
        Self { segments: self.segments.min(other.segments), steps: self.steps.min(other.steps) }
    }
}

/// What a prediction may know of a recording: its first two frames, and its grips over all time.
#[derive(Clone, Debug)]
pub struct Cable {
    begin: Begin,
    /// Ways of the grips, which hold the faces of the rod at their inner markers; that of the rod's start first.
    motions: [Arc<Motion>; 2],
    /// By what the faces are turned in the grips, where they are not drawn through the markers.
    turned: Option<[UnitQuaternion<f64>; 2]>,
    /// Times of the frames [s].
    pub(crate) time: Vec<f64>,
    /// Where its free markers lie.
    pub(crate) places: Vec<Place>,
}

/// A place on a rod: a segment, and the share of its length at which it lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    pub(crate) segment: usize,
    pub(crate) share: f64,
}

impl Place {
    /// The node where a segment ends.
    pub(crate) fn end_of(segment: usize) -> Self {
        Self { segment, share: 1.0 }
    }

    /// Where it is in a state [m].
    pub(crate) fn at(self, model: &Model, state: &State) -> Vector3<f64> {
        let Self { segment, share } = self;
        state.positions[segment] + state.axis(segment) * ((share - 0.5) * model.segments[segment].length)
    }
}

impl Cable {
    /// The cable of a recording, with so many segments between two markers.
    ///
    /// A grip holds the end face of the rod, which lies at its inner marker, at the angle at which the curve through the markers of the
    /// first frame goes through it. It turns as the direction from its inner to its outer marker does. Of a turn about that direction the
    /// markers tell nothing: the grip keeps its heading, and is where the smallest rotation from the vertical takes it.
    ///
    /// # Errors
    /// If the markers of a grip make no motion, because a coordinate is not finite.
    pub fn new(recording: &Recording, parts: usize) -> Result<Self, KeyframeError> {
        Self::with_junctions(recording, parts, &[], Grips::Ends)
    }

    /// The same, held by other grips, and with a short segment about each of these markers in place of a node, so that something can
    /// be joined to it there which turns as the cable does at the marker, and not as it does half a segment beside it. A grip of one
    /// marker keeps its direction. Nothing is made of what lies before the first grip.
    pub(crate) fn with_junctions(
        recording: &Recording,
        parts: usize,
        junctions: &[usize],
        grips: Grips,
    ) -> Result<Self, KeyframeError> {
        let last = recording.count() - 1;
        let held = [grips.first(), last + 1 - GRIPPED];
        let nodes = [0, 1].map(|frame| nodes(&recording.markers[frame], parts, junctions, held));
        let places = (held[0] + 1..held[1]).map(|marker| place(marker, parts, junctions, held[0])).collect();
        let time = recording.time.clone();
        let begin = Begin { nodes, interval: time[1] };
        let [start, end] = angles(&begin, &recording.markers[0], held);
        let outer = (grips == Grips::Ends).then_some(0);
        let motions = [
            Arc::new(grip_motion(recording, held[0], outer, start)?),
            Arc::new(grip_motion(recording, held[1], Some(last), end)?),
        ];
        Ok(Self { begin, motions, turned: None, time, places })
    }

    /// By what the grips hold the faces turned in the first frame, from where they are drawn: rotation vectors [rad] in the axes of
    /// the faces. The polyline is drawn at other angles than the curve, and the last one is turned about its axis: twist.
    pub(crate) fn held(&self, parameters: &Parameters) -> [Vector3<f64>; 2] {
        let (faces, grips) = (self.begin.faces(), self.grips(parameters));
        let angle = sides(parameters).angle;
        [0, 1].map(|end| {
            let drawn = faces[end] * about_axis(angle);
            (drawn.inverse() * grips[end].at(0.0).pose.orientation).scaled_axis()
        })
    }

    /// The twist between the grips in the first frame [rad], but for whole turns.
    pub(crate) fn twist(&self, parameters: &Parameters) -> f64 {
        let [_, end] = self.begin.faces();
        let held = end.inverse() * self.grips(parameters)[1].at(0.0).pose.orientation;
        2.0 * held.k.atan2(held.w)
    }

    /// By how much each segment is turned about its axis in the first frame [rad]: the twist between the grips, evenly along the rod
    /// and what yields in its grips.
    pub(crate) fn turns(&self, parameters: &Parameters) -> Vec<f64> {
        let grip = parameters[Parameter::Grip];
        let lengths: Vec<f64> = self.first_nodes().windows(2).map(|pair| (pair[1] - pair[0]).norm()).collect();
        let [_, end] = self.held(parameters);
        let rate = end.z / (lengths.iter().sum::<f64>() + 2.0 * grip);
        let middles = lengths.iter().scan(grip, |way, length| {
            *way += length;
            Some(*way - 0.5 * length)
        });
        middles.map(|way| rate * way).collect()
    }

    /// What the grips hold, that of the rod's start first.
    pub fn grips(&self, parameters: &Parameters) -> [Carried; 2] {
        let Sides { angle, .. } = sides(parameters);
        let held = |end: usize, angle: f64| {
            let whole = Carried::new(self.motions[end].clone());
            let turn = about_axis(angle);
            let orientation = self.turned.map_or(turn, |turned| turned[end] * turn);
            Carried { grip: Pose { orientation, ..whole.grip }, ..whole }
        };
        [held(0, angle), held(1, angle + parameters[Parameter::Roll])]
    }

    /// The cable in its grips, not twisted yet: its segments are the first, and so are the joints between them.
    pub(crate) fn assembly(&self, parameters: &Parameters) -> Assembly {
        let mut assembly = self.begin.assembly(parameters);
        let springs = springs(parameters);
        let model = assembly.model_mut();
        let grips = self.grips(parameters);
        let joints = model.joints.len() - grips.len();
        let [first, second] = sides(parameters).factors;
        for joint in &mut model.joints {
            let alike = joint.bend_compliance;
            joint.bend_compliance = alike / first;
            joint.bend_extra = alike / second - joint.bend_compliance;
        }
        for (end, carried) in grips.into_iter().enumerate() {
            model.anchors[end] = carried.at(0.0).pose;
            model.motions.push(Driven { carried, ..Driven::new(Body::Anchor(end), self.motions[end].clone()) });
            model.soften(joints + end, &springs);
        }
        assembly
    }

    /// The same cable in the same grips, as [`Cable::with_junctions`] makes it, where its markers in the first two frames are these, at
    /// which the grips now hold it.
    pub(crate) fn through(
        &self,
        frames: [&[Vector3<f64>]; 2],
        parts: usize,
        junctions: &[usize],
        grips: Grips,
    ) -> Self {
        let held = [grips.first(), frames[0].len() - GRIPPED];
        let begin = Begin {
            nodes: frames.map(|markers| nodes(markers, parts, junctions, held)),
            interval: self.begin.interval,
        };
        let angles = angles(&begin, frames[0], held);
        let turned = [0, 1].map(|end| self.motions[end].at(0.0).pose.orientation.inverse() * angles[end]);
        Self { begin, turned: Some(turned), ..self.clone() }
    }

    /// Time from the first frame to the second [s].
    pub(crate) fn interval(&self) -> f64 {
        self.begin.interval
    }

    /// The way of the first grip.
    pub(crate) fn first_motion(&self) -> &Arc<Motion> {
        &self.motions[0]
    }

    /// Nodes of the rod in the first frame [m].
    pub(crate) fn first_nodes(&self) -> &[Vector3<f64>] {
        &self.begin.nodes[0]
    }
}

impl Specimen for Cable {
    type Numbers = Parameters;

    fn time(&self) -> &[f64] {
        &self.time
    }

    fn free(&self) -> Vec<usize> {
        (GRIPPED..GRIPPED + self.places.len()).collect()
    }

    fn model(&self, parameters: &Parameters) -> Result<(Model, State), SpecimenError> {
        let mut assembly = self.assembly(parameters);
        turn(assembly.state_mut(), &self.turns(parameters));
        assembly.model_mut().measure_bent_from_rest(&[]);
        Ok(assembly.finish())
    }

    fn markers(&self, _: &Parameters, model: &Model, state: &State) -> Vec<Vector3<f64>> {
        self.places.iter().map(|place| place.at(model, state)).collect()
    }
}

/// How a rod begins.
#[derive(Clone, Debug)]
struct Begin {
    /// Its nodes [m] in the first two frames, from the inner marker of one grip to that of the other.
    nodes: [Vec<Vector3<f64>>; 2],
    /// Time from the first frame to the second [s].
    interval: f64,
}

impl Begin {
    /// Orientations of the rod's faces in the first frame, where it is not twisted.
    fn faces(&self) -> [UnitQuaternion<f64>; 2] {
        let (model, _) = self.assembly(&Parameters::default()).finish();
        [0, 1].map(|end| model.anchors[end].orientation)
    }

    /// Curvatures and twist at rest [1/m] of the joints between segments, by their places in the first frame: of second order along the rod.
    fn rest(&self, parameters: &Parameters) -> Vec<Vector3<f64>> {
        let of = |one, other| Vector3::new(parameters[one], parameters[other], 0.0);
        let mean = of(Parameter::Curvature1, Parameter::Curvature2) + Vector3::z() * parameters[Parameter::RestTwist];
        let slope = of(Parameter::Slope1, Parameter::Slope2);
        let bow = of(Parameter::Bow1, Parameter::Bow2);
        let ways: Vec<f64> = self.nodes[0]
            .windows(2)
            .scan(0.0, |way, pair| {
                *way += (pair[1] - pair[0]).norm();
                Some(*way)
            })
            .collect();
        let length = ways[ways.len() - 1];
        let local: [Vector3<f64>; PLACES] = std::array::from_fn(|k| {
            let [one, other] = [0, 1].map(|axis| Parameter::Local { axis, tenth: k as u8 });
            of(one, other)
        });
        // The curvatures are about d1 and d2 of a rod that bends alike about both.
        let turned = about_axis(-sides(parameters).angle);
        let at = |way: &f64| {
            let share = way / length;
            let place = 2.0 * share - 1.0;
            let tenths = share * (PLACES - 1) as f64;
            let before = (tenths as usize).min(PLACES - 2);
            let own = local[before].lerp(&local[before + 1], tenths - before as f64);
            turned * (mean + slope * place + bow * (3.0 * place * place - 1.0) + own)
        };
        ways[..ways.len() - 1].iter().map(at).collect()
    }

    /// The rod, clamped at both faces by grips that stand still.
    fn assembly(&self, parameters: &Parameters) -> Assembly {
        let of = |parameter| parameters[parameter];
        let youngs_modulus = youngs_modulus(parameters);
        let laws: Vec<JointLaw> = law(parameters).into_iter().collect();
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
            d1: Some(start_frame(&axis) * about_axis(sides(parameters).angle) * Vector3::x()),
            rest: RestShape::PerJoint(self.rest(parameters)),
            laws,
            ..RodSpec::new(
                self.nodes[0].clone(),
                RADIUS,
                Material { youngs_modulus, torsion_modulus, density: DENSITY },
            )
        });
        assembly.clamp_start(&rod).clamp_end(&rod);
        set_velocities(assembly.state_mut(), 0, &self.nodes, self.interval);
        assembly
    }
}

/// At which angles grips hold a rod that begins so: those of the curve through its markers in the first frame, at the markers where it is
/// held.
fn angles(begin: &Begin, markers: &[Vector3<f64>], held: [usize; 2]) -> [UnitQuaternion<f64>; 2] {
    let [start, end] = held.map(|at| spline::direction(markers, at));
    let [drawn, _] = begin.faces();
    [carry(&(drawn * Vector3::z()), &start) * drawn, end_frame(&end)]
}

/// Half of the length of a segment about a junction, as a share of the others': one over this.
const HALF_SHARE: usize = 4;

/// Nodes of the curve through the markers of a frame, from one of them to another, with so many parts between two markers. About each
/// junction, which is neither of these two, is a short segment, whose middle is the marker.
pub(crate) fn nodes(
    markers: &[Vector3<f64>],
    parts: usize,
    junctions: &[usize],
    [first, last]: [usize; 2],
) -> Vec<Vector3<f64>> {
    let fine = spline::through(markers, HALF_SHARE * parts);
    let mut nodes = Vec::new();
    for k in parts * first..=parts * last {
        let (at, marker) = (HALF_SHARE * k, k / parts);
        if k % parts == 0 && junctions.contains(&marker) {
            let [before, after] = [fine[at - 1], fine[at + 1]];
            let half = (after - before) * 0.5;
            nodes.extend([markers[marker] - half, markers[marker] + half]);
        } else {
            nodes.push(fine[at]);
        }
    }
    nodes
}

/// Where a marker lies on the rod of such nodes that begins at the marker `first`.
pub(crate) fn place(marker: usize, parts: usize, junctions: &[usize], first: usize) -> Place {
    let before = junctions.iter().filter(|junction| **junction < marker).count();
    let segment = (marker - first) * parts + before;
    if junctions.contains(&marker) { Place { segment, share: 0.5 } } else { Place::end_of(segment - 1) }
}

/// Gives the segments of a rod, from `first` on, the velocities from its nodes in one frame to those in the next.
pub(crate) fn set_velocities(state: &mut State, first: usize, nodes: &[Vec<Vector3<f64>>; 2], interval: f64) {
    for i in 0..nodes[0].len() - 1 {
        let [now, next] = nodes.each_ref().map(|nodes| (nodes[i], nodes[i + 1]));
        state.velocities[first + i] = ((next.0 + next.1) - (now.0 + now.1)) * (0.5 / interval);
        let [from, to] = [now, next].map(|(a, b)| (b - a).normalize());
        state.angular_velocities[first + i] = carry(&from, &to).scaled_axis() / interval;
    }
}

/// Turns the first segments about their axes by these angles [rad].
pub(crate) fn turn(state: &mut State, turns: &[f64]) {
    state.orientations.iter_mut().zip(turns).for_each(|(orientation, &angle)| *orientation *= about_axis(angle));
}

/// How a section bends unlike about its axes.
#[derive(Clone, Copy)]
pub(crate) struct Sides {
    /// By how much the rod's frames are turned about its axis, so that d1 and d2 are those of its section [rad].
    angle: f64,
    /// EI about its d1 and d2, to that of a section that bends alike.
    pub(crate) factors: [f64; 2],
}

/// The sides of the section.
pub(crate) fn sides(parameters: &Parameters) -> Sides {
    let (x, y) = (parameters[Parameter::Sides1], parameters[Parameter::Sides2]);
    let h = x.hypot(y);
    Sides { angle: 0.5 * y.atan2(x), factors: [h.exp(), (-h).exp()] }
}

/// Young's modulus [Pa] of a rod of the nominal radius and density: that of a fast strain, with what relaxes beside the stiffness that stays.
pub(crate) fn youngs_modulus(parameters: &Parameters) -> f64 {
    (1.0 + parameters[Parameter::Relaxing]) * 4.0 * parameters[Parameter::Bending] * LINE_DENSITY
        / (PI * RADIUS.powi(4))
}

/// The law of the joints, if they are not elastic.
pub(crate) fn law(parameters: &Parameters) -> Option<JointLaw> {
    let of = |parameter| parameters[parameter];
    let stiffness = of(Parameter::StrandStiffness) * of(Parameter::Bending) * LINE_DENSITY;
    if stiffness > 0.0 {
        return Some(JointLaw::Friction(StrandFriction { moment: stiffness * of(Parameter::StrandSlip), stiffness }));
    }
    let (relaxing, time) = (of(Parameter::Relaxing), of(Parameter::RelaxationTime));
    let branch = MaxwellBranch { share: relaxing / (1.0 + relaxing), time };
    (relaxing > 0.0).then(|| JointLaw::Viscoelastic(vec![branch]))
}

/// The springs of the grips.
pub(crate) fn springs(parameters: &Parameters) -> Springs {
    let bend = parameters[Parameter::Bending] * LINE_DENSITY / parameters[Parameter::Grip];
    let [first, second] = sides(parameters).factors;
    let moment = [first * bend, second * bend, parameters[Parameter::Twist] * bend];
    Springs { force: [f64::INFINITY; 3], moment }
}

/// The way of a grip: that of its inner marker, turned from its `first` orientation as the smallest rotation from the vertical to
/// the direction to the outer marker turns, if there is one. It goes on a frame at either end, so that it is as fast in the first and
/// the last frame as beside them.
fn grip_motion(
    recording: &Recording,
    inner: usize,
    outer: Option<usize>,
    first: UnitQuaternion<f64>,
) -> Result<Motion, KeyframeError> {
    let heading = |markers: &[Vector3<f64>]| match outer {
        Some(outer) => carry(&Vector3::z(), &(markers[outer] - markers[inner]).normalize()),
        None => UnitQuaternion::identity(),
    };
    let held = heading(&recording.markers[0]).inverse() * first;
    let mut poses = Vec::with_capacity(recording.frames() + 2);
    for (time, markers) in recording.time.iter().zip(&recording.markers) {
        poses.push((*time, Pose { position: markers[inner], orientation: heading(markers) * held }));
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

/// A turn by an angle [rad] about d3.
fn about_axis(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle)
}

/// The smallest rotation that takes one unit vector to another.
fn carry(from: &Vector3<f64>, to: &Vector3<f64>) -> UnitQuaternion<f64> {
    let half_turn = || UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI);
    UnitQuaternion::rotation_between(from, to).unwrap_or_else(half_turn)
}

/// The frame of the rod's start whose d3 is `axis`: the smallest rotation away from one that points down, with d1 along x.
fn start_frame(axis: &Vector3<f64>) -> UnitQuaternion<f64> {
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI);
    carry(&-Vector3::z(), axis) * down
}

/// The frame of the rod's end whose d3 is `axis`: the smallest rotation away from one that points up, with d1 against x, as a rod
/// that hangs in the plane of x and z has it without being twisted.
fn end_frame(axis: &Vector3<f64>) -> UnitQuaternion<f64> {
    let up = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), PI);
    carry(&Vector3::z(), axis) * up
}
