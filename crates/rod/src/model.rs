//! The model: what stays the same over time.

use nalgebra::{UnitQuaternion, Vector3};

use crate::{
    Air, Body, BodyShape, BreakableJoint, CYLINDER_SIDES, Change, Contacts, Driven, Freedom, InelasticJoint,
    InnerDamping, LineInertia, Mesh, ModelError, Mount, Pose, Pulley, RigidBody, SlidingJoint, State, StrainMeasure,
};

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

/// A load on one segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// Index of the segment.
    pub segment: usize,
    /// Place along the segment's axis at which the force acts, from its centre [m].
    pub offset: f64,
    /// Force [N], in world axes or the segment's.
    pub force: Vector3<f64>,
    /// Torque [N m], in the same axes.
    pub torque: Vector3<f64>,
    /// Whether it turns with the segment (a follower load: a thruster, a jet, pressure): force and torque are in the segment's axes.
    pub follows: bool,
}

impl Load {
    /// Force [N] and torque [N m] in world axes, on a segment that is oriented so.
    pub fn in_world(&self, q: &UnitQuaternion<f64>) -> [Vector3<f64>; 2] {
        let own = [self.force, self.torque];
        if self.follows { own.map(|own| q * own) } else { own }
    }
}

/// A load that stands for buoyancy: Archimedes' force, minus gravity times the mass of what is displaced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lift {
    /// Index of the load.
    pub load: usize,
    /// Mass of the fluid that the segment displaces [kg].
    pub mass: f64,
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
    /// What of the rotation of joints their moments go with. Formulation `xpbd` has the paper's, whatever this says.
    pub strain_measure: StrainMeasure,
    /// Places in the ground that joints hold on to.
    pub anchors: Vec<Pose>,
    /// Loads; constant unless [`Model::changes`] names them.
    pub loads: Vec<Load>,
    /// Loads that stand for what the fluid about a segment lifts it by: they follow gravity. In ascending order of their loads.
    pub lifts: Vec<Lift>,
    /// Motions of fixed segments and anchors; what has none keeps its first velocity, or stays where it is. One with times
    /// takes hold of its body and lets it go again.
    pub motions: Vec<Driven>,
    /// Eyelets through which rods run.
    pub sliding_joints: Vec<SlidingJoint>,
    /// Pulleys over which rods run.
    pub pulleys: Vec<Pulley>,
    /// Joints that are not elastic, in ascending order of their joints.
    pub laws: Vec<InelasticJoint>,
    /// Joints that can break, in ascending order of their joints.
    pub breakable: Vec<BreakableJoint>,
    /// Anchors that hold nothing, open grips: their joints transmit nothing, and they go with the faces that they may hold.
    pub open: Vec<usize>,
    /// Loads, gravity and rest shapes that change over time.
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

impl Model {
    /// Whether any of its loads turns with its segment.
    pub fn has_followers(&self) -> bool {
        self.loads.iter().any(|load| load.follows)
    }

    /// Pose of a body in `state`, both of which must exist; of an anchor that moves that of the time that was set last
    /// ([`Model::set_time`]), the first one if none was.
    pub fn pose(&self, body: Body, state: &State) -> Pose {
        match body {
            Body::Segment(i) => Pose { position: state.positions[i], orientation: state.orientations[i] },
            Body::Anchor(i) => self.anchors[i],
        }
    }
}
