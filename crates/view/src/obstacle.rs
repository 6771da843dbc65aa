//! Obstacles as they stand in a run's JSON.

use rod::ObstacleShape;
use serde::{Deserialize, Serialize};

use crate::DecodeError;

/// [`ObstacleShape`] in plain numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum Obstacle {
    HalfSpace { point: [f64; 3], normal: [f64; 3] },
    Sphere { centre: [f64; 3], radius: f64 },
    Capsule { start: [f64; 3], end: [f64; 3], radius: f64 },
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
        }
    }
}

impl Obstacle {
    pub(crate) fn validate(&self) -> Result<(), DecodeError> {
        let (places, radius) = match self {
            Self::HalfSpace { point, normal } => ([point, normal], 1.0),
            Self::Sphere { centre, radius } => ([centre; 2], *radius),
            Self::Capsule { start, end, radius } => ([start, end], *radius),
        };
        if places.into_iter().flatten().all(|x| x.is_finite()) && radius.is_finite() && radius > 0.0 {
            return Ok(());
        }
        Err(DecodeError::new("obstacles", format!("{self:?}: places must be finite, radii finite and > 0")))
    }
}
