//! What segments can touch: each other, and obstacles that stand still or follow motions.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Unit, UnitQuaternion, Vector3};

use crate::driven::begins_at;
use crate::error::unit;
use crate::{BodyShape, Carried, Mesh, ModelError, MovingPose, Pose};

/// Flat sides that stand for the round side of a cylinder that rigid bodies touch, and edges of its rim: they lie within it, by 0.12
/// percent of its radius at most.
pub const CYLINDER_SIDES: usize = 64;

/// Coulomb friction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Friction {
    /// Coefficient while the two surfaces stick to each other.
    pub at_rest: f64,
    /// Coefficient while they slide; not above `at_rest`.
    pub sliding: f64,
}

impl Friction {
    /// The same coefficient at rest and sliding.
    pub fn new(coefficient: f64) -> Self {
        Self { at_rest: coefficient, sliding: coefficient }
    }
}

/// How a contact answers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Surface {
    /// Friction.
    pub friction: Friction,
    /// Speed at which two bodies part, relative to that at which they met: 0 (they stay) to 1 (elastic).
    pub restitution: f64,
}

/// Shape of an obstacle.
#[derive(Clone, Debug, PartialEq)]
pub enum ObstacleShape {
    /// All space beyond a plane: the ground, a wall.
    HalfSpace {
        /// A point of the plane [m].
        point: Vector3<f64>,
        /// Out of the obstacle.
        normal: Unit<Vector3<f64>>,
    },
    /// A full sphere.
    Sphere {
        /// Centre [m].
        centre: Vector3<f64>,
        /// Radius [m].
        radius: f64,
    },
    /// A full cylinder with round ends.
    Capsule {
        /// Start of the axis [m].
        start: Vector3<f64>,
        /// End of the axis [m].
        end: Vector3<f64>,
        /// Radius [m].
        radius: f64,
    },
    /// A full box.
    Box {
        /// Its centre, and the orientation of its sides.
        pose: Pose,
        /// Lengths of its sides along its own x, y and z [m].
        sides: Vector3<f64>,
    },
    /// A full cylinder with flat ends. For rods its side is round, its rim has [`CYLINDER_SIDES`] edges; for rigid bodies its side
    /// is as many flat ones.
    Cylinder {
        /// Centre of the one end [m].
        start: Vector3<f64>,
        /// Centre of the other end [m].
        end: Vector3<f64>,
        /// Radius [m].
        radius: f64,
    },
    /// A surface of triangles, closed or open. Segments stay on the side of it that they are on, so that a closed one is full
    /// for what is outside of it, and a room for what is inside.
    Mesh {
        /// Its origin, and the orientation of its axes.
        pose: Pose,
        /// The triangles.
        mesh: Arc<Mesh>,
    },
}

/// Something that segments do not enter. It stands still unless a motion moves it; nothing else does.
///
/// Its pose is that of a frame at [`ObstacleShape::pivot`], which has the axes of the world at time 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Obstacle {
    /// Its shape, where it is at time 0.
    pub shape: ObstacleShape,
    /// How contacts with it answer. Friction and restitution see the velocity of its surface.
    pub surface: Surface,
    /// What moves it, if anything does.
    pub motion: Option<Carried>,
}

/// A rod runs inside another one: a wire in a cable housing, a tube in a tube. The wall of the outer rod keeps the centre of each segment of the
/// inner one within the clearance of the outer rod's smooth centreline ([`crate::Centreline`]), and rubs on it where they slide or twist against each
/// other. It begins and ends with the outer rod, at its two mouths; what is beyond them is free. The two rods do not touch each other otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheath {
    /// The segments of the rod inside, in order, each joined to the next.
    pub inner: Range<usize>,
    /// Those of the rod around it.
    pub outer: Range<usize>,
    /// Radius of the bore less the largest radius of the rod inside [m]: above 0, and the bore is within the outer rod.
    pub clearance: f64,
    /// Coulomb friction of the two on each other.
    pub friction: Friction,
}

/// What segments can touch. The default is nothing, and costs nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contacts {
    /// How segments answer each other, of one rod or of two; `None` where they pass through each other.
    pub between_segments: Option<Surface>,
    /// What stands about.
    pub obstacles: Vec<Obstacle>,
    /// Rods that run inside other rods.
    pub sheaths: Vec<Sheath>,
    /// Whether bodies may overlap at the start. They are moved apart at a bounded speed then; otherwise a model that starts
    /// with an overlap is refused.
    pub allow_overlap: bool,
}

impl Contacts {
    /// Whether there is nothing to touch.
    pub fn is_empty(&self) -> bool {
        self.between_segments.is_none() && self.obstacles.is_empty() && self.sheaths.is_empty()
    }

    pub(crate) fn validate(&self) -> Result<(), ModelError> {
        if let Some(surface) = &self.between_segments {
            surface.validate("contact between segments", 0)?;
        }
        for (i, obstacle) in self.obstacles.iter().enumerate() {
            obstacle.surface.validate("obstacle", i)?;
            obstacle.shape.validate(i)?;
            if let Some(motion) = &obstacle.motion {
                let begins = begins_at(&obstacle.first_pose(), &motion.at(0.0).pose);
                begins.map_err(|mistake| ModelError::ObstacleMotion { index: i, mistake })?;
            }
        }
        Ok(())
    }
}

impl Surface {
    fn validate(&self, what: &'static str, index: usize) -> Result<(), ModelError> {
        let Friction { at_rest, sliding } = self.friction;
        let check = |quantity, value: f64, most, allowed| {
            if (0.0..=most).contains(&value) {
                return Ok(());
            }
            Err(ModelError::Value { what, index, quantity, value, allowed })
        };
        check("friction at rest", at_rest, f64::MAX, "finite and >= 0")?;
        check("sliding friction", sliding, at_rest, ">= 0 and not above the friction at rest")?;
        check("restitution", self.restitution, 1.0, ">= 0 and <= 1")
    }
}

impl Obstacle {
    /// One that stands still.
    pub fn new(shape: ObstacleShape, surface: Surface) -> Self {
        Self { shape, surface, motion: None }
    }

    /// Its pose at `time` [s], and how fast it goes on from there.
    pub fn at(&self, time: f64) -> MovingPose {
        let still =
            || MovingPose { pose: self.first_pose(), velocity: Vector3::zeros(), angular_velocity: Vector3::zeros() };
        self.motion.as_ref().map_or_else(still, |motion| motion.at(time))
    }

    /// Its shape, where it is at `time` [s].
    pub fn shape_at(&self, time: f64) -> ObstacleShape {
        self.motion.as_ref().map_or_else(|| self.shape.clone(), |motion| self.shape.placed(&motion.at(time).pose))
    }

    /// Its pose at time 0.
    fn first_pose(&self) -> Pose {
        Pose { position: self.shape.pivot(), orientation: UnitQuaternion::identity() }
    }
}

impl ObstacleShape {
    /// The place that an obstacle's pose is of, and about which it turns [m]: a sphere's and a box's centre, a capsule's and a
    /// cylinder's middle, a mesh's origin, the given point of a plane.
    pub fn pivot(&self) -> Vector3<f64> {
        match *self {
            ObstacleShape::HalfSpace { point, .. } => point,
            ObstacleShape::Sphere { centre, .. } => centre,
            ObstacleShape::Capsule { start, end, .. } | ObstacleShape::Cylinder { start, end, .. } => {
                0.5 * (start + end)
            }
            ObstacleShape::Box { pose, .. } | ObstacleShape::Mesh { pose, .. } => pose.position,
        }
    }

    /// The shape, moved from the pose at its pivot with the axes of the world to `pose`.
    pub fn placed(&self, pose: &Pose) -> Self {
        let pivot = self.pivot();
        let place = |x: Vector3<f64>| pose.position + pose.orientation * (x - pivot);
        let turned = |own: Pose| Pose { position: pose.position, orientation: pose.orientation * own.orientation };
        match *self {
            ObstacleShape::HalfSpace { point, normal } => {
                ObstacleShape::HalfSpace { point: place(point), normal: pose.orientation * normal }
            }
            ObstacleShape::Sphere { centre, radius } => ObstacleShape::Sphere { centre: place(centre), radius },
            ObstacleShape::Capsule { start, end, radius } => {
                ObstacleShape::Capsule { start: place(start), end: place(end), radius }
            }
            ObstacleShape::Box { pose, sides } => ObstacleShape::Box { pose: turned(pose), sides },
            ObstacleShape::Cylinder { start, end, radius } => {
                ObstacleShape::Cylinder { start: place(start), end: place(end), radius }
            }
            ObstacleShape::Mesh { pose, ref mesh } => {
                ObstacleShape::Mesh { pose: turned(pose), mesh: Arc::clone(mesh) }
            }
        }
    }

    /// The surface of a box, a cylinder or a mesh as triangles, and the orientation in which it stands about the pivot; `None`
    /// for what is round or flat.
    pub fn surface(&self) -> Option<(Arc<Mesh>, UnitQuaternion<f64>)> {
        match self {
            ObstacleShape::HalfSpace { .. } | ObstacleShape::Sphere { .. } | ObstacleShape::Capsule { .. } => None,
            ObstacleShape::Box { pose, sides } => {
                Some((Arc::new(BodyShape::Box { sides: *sides }.mesh()), pose.orientation))
            }
            ObstacleShape::Cylinder { start, end, radius } => {
                let axis = end - start;
                let turn = UnitQuaternion::face_towards(&axis, &Vector3::ith(axis.iamin(), 1.0));
                Some((Arc::new(Mesh::cylinder(*radius, axis.norm(), CYLINDER_SIDES)), turn))
            }
            ObstacleShape::Mesh { pose, mesh } => Some((Arc::clone(mesh), pose.orientation)),
        }
    }

    /// What it is, in a word: "plane", "sphere", "capsule", "box", "cylinder" or "mesh".
    pub fn kind(&self) -> &'static str {
        match self {
            ObstacleShape::HalfSpace { .. } => "plane",
            ObstacleShape::Sphere { .. } => "sphere",
            ObstacleShape::Capsule { .. } => "capsule",
            ObstacleShape::Box { .. } => "box",
            ObstacleShape::Cylinder { .. } => "cylinder",
            ObstacleShape::Mesh { .. } => "mesh",
        }
    }

    /// Ends of the axis [m] and radius [m]; a sphere's axis is its centre twice. `None` for what is not round.
    pub fn capsule(&self) -> Option<([Vector3<f64>; 2], f64)> {
        match *self {
            ObstacleShape::HalfSpace { .. }
            | ObstacleShape::Box { .. }
            | ObstacleShape::Cylinder { .. }
            | ObstacleShape::Mesh { .. } => None,
            ObstacleShape::Sphere { centre, radius } => Some(([centre; 2], radius)),
            ObstacleShape::Capsule { start, end, radius } => Some(([start, end], radius)),
        }
    }

    fn validate(&self, index: usize) -> Result<(), ModelError> {
        let what = "obstacle";
        let finite = |quantity, v: &Vector3<f64>| match v.iter().find(|x| !x.is_finite()) {
            None => Ok(()),
            Some(&value) => Err(ModelError::Value { what, index, quantity, value, allowed: "finite" }),
        };
        let size = |quantity, value: f64| {
            if value.is_finite() && value > 0.0 {
                return Ok(());
            }
            Err(ModelError::Value { what, index, quantity, value, allowed: "finite and > 0" })
        };
        let positive = |radius| size("radius", radius);
        let posed = |pose: &Pose| {
            finite("position", &pose.position)?;
            unit(what, index, "length of the orientation", pose.orientation.norm())
        };
        match self {
            ObstacleShape::HalfSpace { point, normal } => {
                finite("point", point)?;
                finite("normal", normal)?;
                unit(what, index, "length of the normal", normal.norm())
            }
            ObstacleShape::Sphere { centre, radius } => {
                finite("centre", centre)?;
                positive(*radius)
            }
            ObstacleShape::Capsule { start, end, radius } => {
                finite("start", start)?;
                finite("end", end)?;
                positive(*radius)
            }
            ObstacleShape::Box { pose, sides } => {
                posed(pose)?;
                sides.iter().try_for_each(|&side| size("side", side))
            }
            ObstacleShape::Cylinder { start, end, radius } => {
                finite("start", start)?;
                finite("end", end)?;
                size("length", (end - start).norm())?;
                positive(*radius)
            }
            ObstacleShape::Mesh { pose, mesh } => {
                posed(pose)?;
                size("number of triangles", mesh.triangles.len() as f64)?;
                let count = mesh.positions.len();
                if let Some(&vertex) = mesh.triangles.iter().flatten().find(|&&vertex| vertex as usize >= count) {
                    let (quantity, allowed) = ("vertex of a triangle", "one of its vertices");
                    return Err(ModelError::Value { what, index, quantity, value: f64::from(vertex), allowed });
                }
                mesh.positions.iter().try_for_each(|place| finite("vertex", place))
            }
        }
    }
}
