//! The model (what stays the same over time) and the state (what moves).

use std::fmt;

use nalgebra::{UnitQuaternion, Vector3};
use thiserror::Error;

use crate::driven::{self, DriveError};
use crate::{
    Air, BodyShape, CYLINDER_SIDES, Change, Contacts, Driven, Freedom, InnerDamping, LineInertia, Mesh, Mount,
    RigidBody, track,
};

/// A pose in the world: position [m] and orientation (local z is the rod's axis d3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Position [m].
    pub position: Vector3<f64>,
    /// Orientation.
    pub orientation: UnitQuaternion<f64>,
}

/// A rigid cylinder, one node of the paper's graph (section 3.1); or a rigid body of any shape that rods are joined to.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// Length l [m].
    pub length: f64,
    /// Radius r [m]: of the section where that is round; with it a segment touches and feels the air.
    pub radius: f64,
    /// Density rho [kg/m^3].
    pub density: f64,
    /// Inertia per length of a section that is not round; `None`: that of a full circle of radius r and density rho.
    pub line_inertia: Option<LineInertia>,
    /// Mass added at the centre [kg], without inertia of its own.
    pub added_mass: f64,
    /// A fixed segment keeps its velocity whatever acts on it (the paper's clamp): where that is zero it stays where it is,
    /// else it moves and turns at that rate.
    pub fixed: bool,
    /// Index of the rod that the segment belongs to; below the number of segments.
    pub rod: usize,
    /// Makes it a rigid body of its own mass, inertia and shape. Length, radius and density are then those of a cylinder
    /// of about its size and mass.
    pub body: Option<RigidBody>,
}

impl Segment {
    /// A rigid body that moves freely, as the only segment of `rod`.
    pub fn of_body(body: RigidBody, rod: usize) -> Self {
        let (length, radius) = body.size();
        let density = body.mass / (std::f64::consts::PI * radius.powi(2) * length);
        Self { length, radius, density, line_inertia: None, added_mass: 0.0, fixed: false, rod, body: Some(body) }
    }

    /// Mass m = rho pi r^2 l [kg], or that of its section or body, without the added mass.
    pub fn own_mass(&self) -> f64 {
        match (&self.body, self.line_inertia) {
            (Some(body), _) => body.mass,
            (None, Some(inertia)) => inertia.mass * self.length,
            (None, None) => self.density * std::f64::consts::PI * self.radius.powi(2) * self.length,
        }
    }

    /// Mass [kg], the added mass included.
    pub fn mass(&self) -> f64 {
        self.own_mass() + self.added_mass
    }

    /// Moment of inertia across the axis, m (3 r^2 + l^2) / 12 [kg m^2]. Of a section that is not round it is the mean of
    /// those about d1 and d2, which differ in the section's share alone: of second order in its size over the length. Of a
    /// rigid body it is the mean of its two.
    pub fn transverse_inertia(&self) -> f64 {
        match (&self.body, self.line_inertia) {
            (Some(body), _) => 0.5 * (body.inertia.x + body.inertia.y),
            (None, Some(inertia)) => (inertia.mass * self.length.powi(2) / 12.0 + 0.5 * inertia.polar) * self.length,
            (None, None) => self.own_mass() * (3.0 * self.radius.powi(2) + self.length.powi(2)) / 12.0,
        }
    }

    /// Moment of inertia about the axis, m r^2 / 2 [kg m^2], or that of its section.
    pub fn axial_inertia(&self) -> f64 {
        match (&self.body, self.line_inertia) {
            (Some(body), _) => body.inertia.z,
            (None, Some(inertia)) => inertia.polar * self.length,
            (None, None) => self.own_mass() * self.radius.powi(2) / 2.0,
        }
    }

    /// The surface with which it touches rods and obstacles, in its own frame: that of a rigid body that is a box, a mesh or a
    /// cylinder, this with [`crate::CYLINDER_SIDES`] flat sides. `None` of all others.
    pub fn surface(&self) -> Option<Mesh> {
        let body = self.body.as_ref().filter(|body| body.touches)?;
        match body.shape {
            BodyShape::Box { .. } | BodyShape::Mesh(_) => Some(body.shape.mesh()),
            BodyShape::Cylinder { radius, length } => Some(Mesh::cylinder(radius, length, CYLINDER_SIDES)),
            BodyShape::Hidden | BodyShape::Sphere { .. } | BodyShape::Capsule { .. } => None,
        }
    }

    /// Half the length of the axis and the radius [m] of the capsule with which it touches others; `None` of a rigid body
    /// that is none, or touches nothing.
    pub fn capsule(&self) -> Option<(f64, f64)> {
        match &self.body {
            None => Some((0.5 * self.length, self.radius)),
            Some(body) => body.shape.capsule().filter(|_| body.touches),
        }
    }
}

/// What a joint holds on to: a segment or an anchor in the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Body {
    /// Index into [`Model::segments`].
    Segment(usize),
    /// Index into [`Model::anchors`].
    Anchor(usize),
}

impl fmt::Display for Body {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Body::Segment(i) => write!(f, "segment {i}"),
            Body::Anchor(i) => write!(f, "anchor {i}"),
        }
    }
}

/// A stretch-shear and a bend-twist constraint between two bodies: one edge of the paper's graph (section 3.1).
///
/// With connectors at `offset_a` and `offset_b` along the axes,
/// `C_s = x_a + offset_a d3_a - x_b - offset_b d3_b` and `C_b = (2 / l) Im(conj(q_a f_a) q_b f_b) - Omega_0`. The paper's joints
/// have the rest frames f_a = f_b = 1: see [`Joint::measure_from_rest`]. On rigid bodies [`Joint::mount`] adds places across
/// the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// First body; the Darboux vector and the bend-twist multiplier are expressed in its frame, turned by f_a.
    pub a: Body,
    /// Second body.
    pub b: Body,
    /// Place of the connector along the axis of `a`, from its centre [m].
    pub offset_a: f64,
    /// Place of the connector along the axis of `b`, from its centre [m].
    pub offset_b: f64,
    /// Length l over which the joint bends [m].
    pub length: f64,
    /// Rest Darboux vector Omega_0 in the frame of `a`, turned by f_a [1/m].
    pub rest_darboux: Vector3<f64>,
    /// Rest frames f_a and f_b, in the frames of `a` and `b`, between which the Darboux vector is measured; the identity
    /// for the paper's measure.
    pub rest_frames: [UnitQuaternion<f64>; 2],
    /// Compliance along the axis of `a` [m/N].
    pub stretch_compliance: f64,
    /// Compliance across the axis of `a` [m/N]: along its d1, and along its d2 less `shear_extra`.
    pub shear_compliance: f64,
    /// Compliance along d2 of `a` less that along its d1 [m/N]; 0 where it yields alike along both, as all rods do.
    pub shear_extra: f64,
    /// Compliance 1 / (l Y I) of the Darboux vector's curvature about d1, and of that about d2 less `bend_extra` [1/(N m^3)].
    pub bend_compliance: f64,
    /// Compliance of the curvature about d2 less that about d1 [1/(N m^3)]; 0 for a section that bends alike about both.
    pub bend_extra: f64,
    /// Compliance 1 / (l T J) of the Darboux vector's twist [1/(N m^3)].
    pub twist_compliance: f64,
    /// Inner damping.
    pub inner_damping: InnerDamping,
    /// Young's modulus Y of the joint's material [Pa] (an edge feature of the paper's graph).
    pub youngs_modulus: f64,
    /// Torsion modulus T of the joint's material [Pa] (an edge feature of the paper's graph).
    pub torsion_modulus: f64,
    /// How it holds on to rigid bodies; `None` between rods.
    pub mount: Option<Mount>,
    /// Which turns it leaves free.
    pub freedom: Freedom,
}

impl Joint {
    /// From the centre of body a, which is oriented so, to its connector [m].
    pub fn arm_a(&self, q_a: &UnitQuaternion<f64>) -> Vector3<f64> {
        self.arm(q_a, &(q_a * Vector3::z()), 0)
    }

    /// From the centre of body b, which is oriented so, to its connector [m].
    pub fn arm_b(&self, q_b: &UnitQuaternion<f64>) -> Vector3<f64> {
        self.arm(q_b, &(q_b * Vector3::z()), 1)
    }

    /// Makes body b body a. The Darboux vector and its energy stay what they are but for the sign; compliances of stretch and
    /// shear are those along the axes of the other body from now on.
    pub(crate) fn exchange_bodies(&mut self) {
        std::mem::swap(&mut self.a, &mut self.b);
        std::mem::swap(&mut self.offset_a, &mut self.offset_b);
        self.rest_frames.swap(0, 1);
        self.rest_darboux = -self.rest_darboux;
        if let Some(mount) = &mut self.mount {
            mount.across.swap(0, 1);
        }
    }

    /// From the centre of body a (`end` 0) or b (1), which is oriented so and has this axis d3, to its connector [m].
    #[inline]
    pub(crate) fn arm(&self, q: &UnitQuaternion<f64>, axis: &Vector3<f64>, end: usize) -> Vector3<f64> {
        let along = axis * if end == 0 { self.offset_a } else { self.offset_b };
        match &self.mount {
            None => along,
            Some(mount) => along + q * mount.across[end].push(0.0),
        }
    }
}

/// A load on one segment, in world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// Index of the segment.
    pub segment: usize,
    /// Place along the segment's axis at which the force acts, from its centre [m].
    pub offset: f64,
    /// Force [N].
    pub force: Vector3<f64>,
    /// Torque [N m].
    pub torque: Vector3<f64>,
}

/// Damping against the still surroundings: velocities decay as exp(-rate t) where nothing else acts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Damping {
    /// Rate for velocities [1/s].
    pub linear: f64,
    /// Rate for angular velocities [1/s].
    pub angular: f64,
}

/// What stays the same over time. Built by [`crate::Assembly`] or by hand; checked by [`Model::validate`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// All segments.
    pub segments: Vec<Segment>,
    /// All joints.
    pub joints: Vec<Joint>,
    /// Places in the ground that joints hold on to.
    pub anchors: Vec<Pose>,
    /// Loads; constant unless [`Model::changes`] names them.
    pub loads: Vec<Load>,
    /// Motions of fixed segments and anchors; what has none keeps its first velocity, or stays where it is. One with times
    /// takes hold of its body and lets it go again.
    pub motions: Vec<Driven>,
    /// Anchors that hold nothing, open grips: their joints transmit nothing, and they go with the faces that they may hold.
    pub open: Vec<usize>,
    /// Loads and gravity that change over time.
    pub changes: Vec<Change>,
    /// Gravitational acceleration [m/s^2]; constant unless [`Model::changes`] names it.
    pub gravity: Vector3<f64>,
    /// Damping against the surroundings.
    pub damping: Damping,
    /// What segments can touch.
    pub contacts: Contacts,
    /// The air about the segments; `None` where it is not felt.
    pub air: Option<Air>,
    /// The first step of an [`crate::Assembly`] that could not be done; [`Model::validate`] returns it.
    pub mistake: Option<ModelError>,
}

/// What moves: arrays with one entry a segment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Positions of the centres x [m].
    pub positions: Vec<Vector3<f64>>,
    /// Orientations q; local z is the rod's axis d3.
    pub orientations: Vec<UnitQuaternion<f64>>,
    /// Velocities v [m/s].
    pub velocities: Vec<Vector3<f64>>,
    /// Angular velocities w in world axes [rad/s], angle over time also where a segment turns far in a step.
    pub angular_velocities: Vec<Vector3<f64>>,
}

/// Why a model cannot be simulated.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ModelError {
    /// A number is not finite or outside of what is allowed.
    #[error("{what} {index}: {quantity} = {value}, but it must be {allowed}")]
    Value {
        /// "segment", "joint", "anchor", "load", "obstacle", "contact between segments" or "model".
        what: &'static str,
        /// Index of the offender.
        index: usize,
        /// Which quantity.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// An index points outside of the model.
    #[error("{what} {index}: {target} {to} does not exist (there are {count})")]
    Index {
        /// What points there: "joint", "load", "segment", or a step of an assembly.
        what: &'static str,
        /// Index of the offender; in an assembly, of the next joint.
        index: usize,
        /// "segment", "anchor" or "rod".
        target: &'static str,
        /// The index it points to.
        to: usize,
        /// How many of the target there are.
        count: usize,
    },
    /// A list of an assembly's step is too short or too long.
    #[error("{what} {index}: {found} {quantity}, but there must be {allowed}")]
    Count {
        /// "rod", "branch", "clamp" or "copy".
        what: &'static str,
        /// Index of the rod, or of the next joint.
        index: usize,
        /// What the list holds.
        quantity: &'static str,
        /// How many there are.
        found: usize,
        /// How many there must be.
        allowed: String,
    },
    /// A motion that its body cannot follow.
    #[error("motion {index}: {mistake}")]
    Motion {
        /// Index into [`Model::motions`].
        index: usize,
        /// Why not.
        mistake: DriveError,
    },
    /// A motion that its obstacle cannot follow.
    #[error("the motion of obstacle {index}: {mistake}")]
    ObstacleMotion {
        /// Index into [`Contacts::obstacles`].
        index: usize,
        /// Why not.
        mistake: DriveError,
    },
    /// Two changes of the same load or of gravity.
    #[error("change {index}: change {other} is of the same")]
    Twice {
        /// Index into [`Model::changes`].
        index: usize,
        /// The one before it.
        other: usize,
    },
    /// A joint that holds no segment, or the same segment twice.
    #[error("joint {index}: it must hold two different bodies, at least one of them a segment")]
    Degenerate {
        /// Index of the joint.
        index: usize,
    },
    /// The state's arrays do not fit the model.
    #[error("state has {found} entries for {expected} segments")]
    StateSize {
        /// Entries found.
        found: usize,
        /// Entries expected.
        expected: usize,
    },
}

impl Model {
    /// Pose of a body in `state`, both of which must exist; of an anchor that moves that of the time that was set last
    /// ([`Model::set_time`]), the first one if none was.
    pub fn pose(&self, body: Body, state: &State) -> Pose {
        match body {
            Body::Segment(i) => Pose { position: state.positions[i], orientation: state.orientations[i] },
            Body::Anchor(i) => self.anchors[i],
        }
    }

    /// Checks every number and index, and that `state` fits: what all functions that take a model and a state expect.
    ///
    /// # Errors
    /// The first thing found wrong, with the place and what is allowed.
    pub fn validate(&self, state: &State) -> Result<(), ModelError> {
        const POSITIVE: &str = "finite and > 0";
        const NOT_NEGATIVE: &str = "finite and >= 0";
        const FINITE: &str = "finite";
        let positive = |what, index, quantity, value: f64| {
            if value.is_finite() && value > 0.0 {
                return Ok(());
            }
            Err(ModelError::Value { what, index, quantity, value, allowed: POSITIVE })
        };
        let not_negative = |what, index, quantity, value: f64| {
            if value.is_finite() && value >= 0.0 {
                return Ok(());
            }
            Err(ModelError::Value { what, index, quantity, value, allowed: NOT_NEGATIVE })
        };
        let finite = |what, index, quantity, values: &[f64]| match values.iter().find(|v| !v.is_finite()) {
            None => Ok(()),
            Some(&value) => Err(ModelError::Value { what, index, quantity, value, allowed: FINITE }),
        };
        if let Some(mistake) = &self.mistake {
            return Err(mistake.clone());
        }
        for (i, s) in self.segments.iter().enumerate() {
            let count = self.segments.len();
            if s.rod >= count {
                return Err(ModelError::Index { what: "segment", index: i, target: "rod", to: s.rod, count });
            }
            positive("segment", i, "length", s.length)?;
            positive("segment", i, "radius", s.radius)?;
            positive("segment", i, "density", s.density)?;
            positive("segment", i, "axial inertia", s.axial_inertia())?;
            positive("segment", i, "mass", s.own_mass())?;
            not_negative("segment", i, "added mass", s.added_mass)?;
            if let Some(body) = &s.body {
                positive("segment", i, "mass", body.mass)?;
                body.shape.sizes().into_iter().try_for_each(|(name, size)| positive("segment", i, name, size))?;
                body.inertia.iter().try_for_each(|&moment| positive("segment", i, "moment of inertia", moment))?;
                not_negative("segment", i, "drag area", body.drag_area)?;
                let (most, sum) = (body.inertia.max(), body.inertia.sum());
                if most > (sum - most) * (1.0 + 1e-9) {
                    let (quantity, allowed) = ("largest moment of inertia", "no more than the sum of the other two");
                    return Err(ModelError::Value { what: "segment", index: i, quantity, value: most, allowed });
                }
            }
        }
        for (i, j) in self.joints.iter().enumerate() {
            self.validate_joint(i, j)?;
            positive("joint", i, "length", j.length)?;
            finite("joint", i, "offset", &[j.offset_a, j.offset_b])?;
            finite("joint", i, "rest Darboux vector", j.rest_darboux.as_slice())?;
            not_negative("joint", i, "stretch compliance", j.stretch_compliance)?;
            not_negative("joint", i, "shear compliance", j.shear_compliance)?;
            not_negative("joint", i, "shear compliance along d2", j.shear_compliance + j.shear_extra)?;
            not_negative("joint", i, "bend compliance", j.bend_compliance)?;
            not_negative("joint", i, "bend compliance about d2", j.bend_twist_compliance().y)?;
            not_negative("joint", i, "twist compliance", j.twist_compliance)?;
            if let Some(Mount { across: [a, b] }) = &j.mount {
                finite("joint", i, "place", &[a.x, a.y, b.x, b.y])?;
            }
            for frame in &j.rest_frames {
                unit("joint", i, "norm of a rest frame", frame.as_vector().norm())?;
            }
            let InnerDamping { bending, twist, stretch } = j.inner_damping;
            not_negative("joint", i, "relaxation time of bending", bending)?;
            not_negative("joint", i, "relaxation time of twist", twist)?;
            not_negative("joint", i, "relaxation time of stretch", stretch)?;
        }
        for (i, a) in self.anchors.iter().enumerate() {
            finite("anchor", i, "position", a.position.as_slice())?;
            finite("anchor", i, "orientation", a.orientation.as_vector().as_slice())?;
            unit("anchor", i, "norm of the orientation", a.orientation.as_vector().norm())?;
        }
        for &to in &self.open {
            self.check_body("open", to, Body::Anchor(to))?;
        }
        for (i, l) in self.loads.iter().enumerate() {
            if l.segment >= self.segments.len() {
                let count = self.segments.len();
                return Err(ModelError::Index { what: "load", index: i, target: "segment", to: l.segment, count });
            }
            finite("load", i, "offset", &[l.offset])?;
            finite("load", i, "force", l.force.as_slice())?;
            finite("load", i, "torque", l.torque.as_slice())?;
        }
        finite("model", 0, "gravity", self.gravity.as_slice())?;
        not_negative("model", 0, "linear damping", self.damping.linear)?;
        not_negative("model", 0, "angular damping", self.damping.angular)?;
        self.contacts.validate()?;
        if let Some(air) = &self.air {
            air.validate()?;
        }
        self.validate_state(state)?;
        track::validate(self)?;
        driven::validate(self, state)
    }

    /// Checks that there is the body that something of the model points to.
    pub(crate) fn check_body(&self, what: &'static str, index: usize, body: Body) -> Result<(), ModelError> {
        let (target, to, count) = match body {
            Body::Segment(to) => ("segment", to, self.segments.len()),
            Body::Anchor(to) => ("anchor", to, self.anchors.len()),
        };
        if to >= count { Err(ModelError::Index { what, index, target, to, count }) } else { Ok(()) }
    }

    fn validate_joint(&self, index: usize, joint: &Joint) -> Result<(), ModelError> {
        for body in [joint.a, joint.b] {
            self.check_body("joint", index, body)?;
        }
        if joint.a == joint.b || matches!((joint.a, joint.b), (Body::Anchor(_), Body::Anchor(_))) {
            return Err(ModelError::Degenerate { index });
        }
        Ok(())
    }

    fn validate_state(&self, state: &State) -> Result<(), ModelError> {
        let expected = self.segments.len();
        let sizes =
            [state.positions.len(), state.orientations.len(), state.velocities.len(), state.angular_velocities.len()];
        if let Some(&found) = sizes.iter().find(|&&n| n != expected) {
            return Err(ModelError::StateSize { found, expected });
        }
        for index in 0..expected {
            let vectors = [
                ("position", state.positions[index].as_slice()),
                ("orientation", state.orientations[index].as_vector().as_slice()),
                ("velocity", state.velocities[index].as_slice()),
                ("angular velocity", state.angular_velocities[index].as_slice()),
            ];
            for (quantity, values) in vectors {
                if let Some(&value) = values.iter().find(|v| !v.is_finite()) {
                    return Err(ModelError::Value { what: "segment", index, quantity, value, allowed: "finite" });
                }
            }
            unit("segment", index, "norm of the orientation", state.orientations[index].as_vector().norm())?;
        }
        Ok(())
    }
}

/// How far from 1 the norm of a quaternion or of a unit vector may be.
const UNIT_TOLERANCE: f64 = 1e-6;

/// Checks a norm that must be 1.
pub(crate) fn unit(what: &'static str, index: usize, quantity: &'static str, value: f64) -> Result<(), ModelError> {
    if (value - 1.0).abs() <= UNIT_TOLERANCE {
        return Ok(());
    }
    Err(ModelError::Value { what, index, quantity, value, allowed: "1 to within 1e-6" })
}

impl State {
    /// Number of segments.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is no segment.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Axis d3 of segment `i`.
    pub fn axis(&self, i: usize) -> Vector3<f64> {
        self.orientations[i] * Vector3::z()
    }
}
