//! Obstacles as they stand in a run's JSON.

use rod::{Mesh, ObstacleShape, Pose};
use serde::{Deserialize, Serialize};

use crate::DecodeError;
use crate::body::Surface;

/// [`ObstacleShape`] in plain numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum Obstacle {
    HalfSpace {
        point: [f64; 3],
        normal: [f64; 3],
    },
    Sphere {
        centre: [f64; 3],
        radius: f64,
    },
    Capsule {
        start: [f64; 3],
        end: [f64; 3],
        radius: f64,
    },
    /// A surface about its pivot, in the axes of the world at time 0, and the radius of the ball about it.
    Mesh {
        centre: [f64; 3],
        radius: f64,
        surface: Surface,
    },
}

/// The poses of an obstacle that moves. What moves none stands where its shape says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Moved {
    /// Index of the obstacle.
    pub(crate) obstacle: usize,
    /// One a frame: place of the pivot [m], then orientation x, y, z, w.
    pub(crate) poses: Vec<[f32; 7]>,
}

impl Moved {
    pub(crate) fn push(&mut self, pose: &Pose) {
        let mut values = pose.position.iter().chain(pose.orientation.coords.iter());
        self.poses.push(std::array::from_fn(|_| values.next().map_or(0.0, |&x| x as f32)));
    }

    pub(crate) fn validate(&self, obstacles: usize, frames: usize) -> Result<(), DecodeError> {
        let is_turn = |[_, _, _, q @ ..]: &[f32; 7]| (q.iter().map(|x| x * x).sum::<f32>() - 1.0).abs() < 1e-3;
        let fits = self.obstacle < obstacles && self.poses.len() == frames;
        if fits && self.poses.iter().all(|pose| pose.iter().all(|x| x.is_finite()) && is_turn(pose)) {
            return Ok(());
        }
        let must = format!("there must be {frames} poses of an obstacle below {obstacles}, finite, turns of norm 1");
        Err(DecodeError::new("obstacle_motions", must))
    }
}

impl From<&ObstacleShape> for Obstacle {
    fn from(shape: &ObstacleShape) -> Self {
        match *shape {
            ObstacleShape::HalfSpace { point, normal } => {
                Self::HalfSpace { point: point.into(), normal: normal.into_inner().into() }
            }
            ObstacleShape::Sphere { centre, radius } => Self::Sphere { centre: centre.into(), radius },
            ObstacleShape::Capsule { start, end, radius } => {
                Self::Capsule { start: start.into(), end: end.into(), radius }
            }
            ObstacleShape::Box { .. } | ObstacleShape::Cylinder { .. } | ObstacleShape::Mesh { .. } => {
                let turned = shape.surface().map(|(mesh, turn)| Mesh::clone(&mesh).turned(&turn));
                let mesh = turned.unwrap_or_default();
                let radius = mesh.positions.iter().map(|place| place.norm()).fold(0.0, f64::max);
                Self::Mesh { centre: shape.pivot().into(), radius, surface: Surface::from(&mesh) }
            }
        }
    }
}

impl Obstacle {
    pub(crate) fn validate(&self) -> Result<(), DecodeError> {
        let (places, radius) = match self {
            Self::HalfSpace { point, normal } => ([point, normal], 1.0),
            Self::Sphere { centre, radius } => ([centre; 2], *radius),
            Self::Capsule { start, end, radius } => ([start, end], *radius),
            Self::Mesh { surface, .. } if !surface.fits() => {
                return Err(DecodeError::new("obstacles", "each mesh must be a surface of triangles"));
            }
            Self::Mesh { centre, radius, .. } => ([centre; 2], *radius),
        };
        if places.into_iter().flatten().all(|x| x.is_finite()) && radius.is_finite() && radius > 0.0 {
            return Ok(());
        }
        Err(DecodeError::new("obstacles", format!("{self:?}: places must be finite, radii finite and > 0")))
    }
}
