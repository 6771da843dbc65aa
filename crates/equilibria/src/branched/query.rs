//! What is asked: three cables that meet at a junction, and the grips that hold them.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use thiserror::Error;

use crate::query::{Cable, Grip, Query, QueryError};

/// Arms of a cable.
pub const ARMS: usize = 3;

/// The pose of a junction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Junction {
    /// Where it is: [m] in an answer, over L from the first grip without units.
    pub position: Vector3<f64>,
    /// Its frame, see [`directions`].
    pub orientation: UnitQuaternion<f64>,
}

impl Default for Junction {
    fn default() -> Self {
        Self { position: Vector3::zeros(), orientation: UnitQuaternion::identity() }
    }
}

/// A cable with three arms, and three grips. Arm k runs from grip k to the junction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BranchedQuery {
    /// The arms.
    pub arms: [Cable; ARMS],
    /// The grip of each arm's start: centre of the face [m] and material frame there, z along the arm towards the junction.
    pub grips: [Grip; ARMS],
}

/// Why a branched query has no answer.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum BranchedError {
    /// A number of an arm or of its grip that is not allowed.
    #[error("arm {arm}: {error}")]
    Arm {
        /// Which arm, from 1.
        arm: usize,
        /// What is wrong with it.
        error: QueryError,
    },
    /// Two grips are too far apart.
    #[error("grips {first} and {second} are {distance} m apart, but their arms are {reach} m long together")]
    TooFar {
        /// Which grips, from 1.
        first: usize,
        /// The other one.
        second: usize,
        /// Their distance [m].
        distance: f64,
        /// Length of both arms [m].
        reach: f64,
    },
    /// Each two arms meet, but not all three in one place.
    #[error("there is no place that all three arms reach; their lengths are {lengths:?} m")]
    Apart {
        /// Lengths of the arms [m].
        lengths: [f64; ARMS],
    },
    /// No search came to rest.
    #[error("no equilibrium was found in {solves} linear solves")]
    NotFound {
        /// Linear solves of all searches.
        solves: u32,
    },
}

/// Frames of the arms' ends in the junction's frame: z along the arm towards the junction, x along the junction's z. Arm k comes
/// from the junction's x axis turned by k times 120 degrees about its z.
pub fn directions() -> [UnitQuaternion<f64>; ARMS] {
    [0, 1, 2].map(|k| {
        let (sin, cos) = (TAU * f64::from(k) / 3.0).sin_cos();
        let columns = [Vector3::z(), Vector3::new(-sin, cos, 0.0), Vector3::new(-cos, -sin, 0.0)];
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(Matrix3::from_columns(&columns)))
    })
}

/// Compliance of a joint from which an arm may be too short [m/N], and how far it may be stretched, over its length.
const YIELDS: f64 = 1e-9;
const LONGEST: f64 = 1.5;
/// What rounding may take from a reach, over the lengths.
const ROUNDING: f64 = 1e-12;

impl BranchedQuery {
    /// Checks every number, and that the arms reach a common place.
    ///
    /// # Errors
    /// The first thing found wrong.
    pub fn validate(&self) -> Result<(), BranchedError> {
        for (k, (cable, start)) in self.arms.iter().zip(&self.grips).enumerate() {
            let own = Query { cable: *cable, start: *start, end: None };
            own.validate().map_err(|error| BranchedError::Arm { arm: k + 1, error })?;
        }
        let reach =
            self.arms.map(|cable| cable.length * if cable.stretch_compliance >= YIELDS { LONGEST } else { 1.0 });
        for [a, b] in [[0, 1], [1, 2], [0, 2]] {
            let distance = (self.grips[a].position - self.grips[b].position).norm();
            if distance > reach[a] + reach[b] {
                return Err(BranchedError::TooFar {
                    first: a + 1,
                    second: b + 1,
                    distance,
                    reach: reach[a] + reach[b],
                });
            }
        }
        if meet(self.grips.map(|grip| grip.position), reach) {
            Ok(())
        } else {
            Err(BranchedError::Apart { lengths: self.arms.map(|cable| cable.length) })
        }
    }

    /// An arm as a cable between its grip and the junction.
    pub fn arm(&self, arm: usize, junction: &Junction) -> Query {
        let end = Grip { position: junction.position, orientation: junction.orientation * directions()[arm] };
        Query { cable: self.arms[arm], start: self.grips[arm], end: Some(end) }
    }
}

/// Whether three balls have a point in common. If so, so have their sections with the plane of the centres, and of these a
/// centre or a point of two circles is in all three (their common part is a disc or has corners).
fn meet(centres: [Vector3<f64>; ARMS], radii: [f64; ARMS]) -> bool {
    let slack = ROUNDING * radii.iter().sum::<f64>();
    let is_in_all =
        |x: Vector3<f64>| centres.iter().zip(radii).all(|(centre, radius)| (x - centre).norm() <= radius + slack);
    if centres.iter().any(|&centre| is_in_all(centre)) {
        return true;
    }
    [[0, 1, 2], [1, 2, 0], [0, 2, 1]].into_iter().any(|[a, b, c]| {
        let chord = centres[b] - centres[a];
        let distance = chord.norm();
        let along = (distance * distance + radii[a] * radii[a] - radii[b] * radii[b]) / (2.0 * distance);
        let across = (radii[a] * radii[a] - along * along).max(0.0).sqrt();
        let to_third = centres[c] - centres[a];
        let side = to_third - chord * (to_third.dot(&chord) / (distance * distance));
        let side = side.try_normalize(1e-12 * distance).unwrap_or_else(|| {
            let other = if chord.x.abs() < 0.5 * distance { Vector3::x() } else { Vector3::y() };
            chord.cross(&other).normalize()
        });
        let middle = centres[a] + chord * (along / distance);
        [1.0, -1.0].into_iter().any(|sign| is_in_all(middle + side * (sign * across)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn balls_meet_where_a_point_is_in_all() {
        let ring = |radius: f64| [0, 1, 2].map(|k| directions()[k] * Vector3::z() * -radius);
        for (radius, lengths, expected) in [
            (1.0, [1.001; 3], true),
            (1.0, [0.99; 3], false),
            // Each two meet, not all three.
            (1.0, [0.9, 0.9, 0.9], false),
            (1.0, [0.3, 1.8, 1.8], true),
            (0.0, [1.0, 1.0, 1.0], true),
        ] {
            assert_eq!(meet(ring(radius), lengths), expected, "{radius} {lengths:?}");
        }
        let row = |x: f64| Vector3::x() * x;
        assert!(meet([row(0.0), row(1.0), row(2.0)], [1.0, 0.2, 1.0]));
        assert!(!meet([row(0.0), row(0.7), row(2.0)], [1.0, 0.2, 1.0]));
    }

    #[test]
    fn arms_leave_the_junction_at_120_degrees() {
        let axes = directions().map(|q| q * Vector3::z());
        assert!((axes[0] + axes[1] + axes[2]).norm() < 1e-15 && (axes[0] + Vector3::x()).norm() < 1e-15);
        for q in directions() {
            assert!((q * Vector3::x() - Vector3::z()).norm() < 1e-15);
        }
    }
}
