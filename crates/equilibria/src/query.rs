//! What is asked: a cable and the grips that hold it.

use nalgebra::{UnitQuaternion, Vector3};
use thiserror::Error;

/// A uniform cable. The weight pulls along world -z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cable {
    /// Length L [m].
    pub length: f64,
    /// Bending stiffness E I about d1 and about d2 [N m^2].
    pub bending: [f64; 2],
    /// Torsional stiffness G J [N m^2].
    pub torsion: f64,
    /// Weight a metre [N/m].
    pub weight: f64,
    /// Curvatures about d1 and d2 and twist at rest [1/m]: its Darboux vector.
    pub rest: Vector3<f64>,
    /// Compliance of each joint against stretch and shear [m/N]; 1e-10 is in effect none.
    pub stretch_compliance: f64,
    /// A weight that hangs from it.
    pub carried: Carried,
}

/// A weight at a place of a cable, such as a connector or a lamp.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Carried {
    /// Weight [N].
    pub weight: f64,
    /// Place along the cable's axis, from its start [m].
    pub place: f64,
}

impl Cable {
    /// One that is straight at rest, round, does not stretch, and carries nothing.
    pub fn new(length: f64, bending: f64, torsion: f64, weight: f64) -> Self {
        let rest = Vector3::zeros();
        Self {
            length,
            bending: [bending; 2],
            torsion,
            weight,
            rest,
            stretch_compliance: 1e-10,
            carried: Carried::default(),
        }
    }
}

/// The pose of an end of a cable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grip {
    /// Centre of the end face [m].
    pub position: Vector3<f64>,
    /// Material frame there: z along the cable, from its start to its end at both ends.
    pub orientation: UnitQuaternion<f64>,
}

/// A cable between two grips, or in one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Query {
    /// The cable.
    pub cable: Cable,
    /// The grip of its start.
    pub start: Grip,
    /// The grip of its end; `None`: the end is free.
    pub end: Option<Grip>,
}

/// Why a query has no answer.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum QueryError {
    /// A number that is not allowed.
    #[error("{key} = {value}, but it must be {allowed}")]
    Value {
        /// Which number.
        key: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The grips are too far apart.
    #[error("the grips are {distance} m apart, but the cable is {length} m long")]
    TooFar {
        /// Distance of the grips [m].
        distance: f64,
        /// Length of the cable [m].
        length: f64,
    },
    /// No search came to rest.
    #[error("no equilibrium was found in {solves} linear solves")]
    NotFound {
        /// Linear solves of all searches.
        solves: u32,
    },
}

/// By how much the norm of an orientation may differ from 1.
const NORM: f64 = 1e-6;
/// Compliance of a joint from which a cable may be too short [m/N], and how far it may be stretched, over its length.
const YIELDS: f64 = 1e-9;
const LONGEST: f64 = 1.5;
/// Largest magnitude of a number, in its unit.
const LARGEST: f64 = 1e12;

impl Grip {
    fn validate(&self, keys: [&'static str; 2]) -> Result<(), QueryError> {
        for value in self.position.iter().copied() {
            check(keys[0], value, value.abs() <= LARGEST, "finite and at most 1e12")?;
        }
        let norm = self.orientation.as_vector().norm();
        check(keys[1], norm, (norm - 1.0).abs() <= NORM, "a norm of 1")
    }
}

fn check(key: &'static str, value: f64, is_allowed: bool, allowed: &'static str) -> Result<(), QueryError> {
    if is_allowed { Ok(()) } else { Err(QueryError::Value { key, value, allowed }) }
}

impl Query {
    /// Checks every number, and that the cable reaches.
    ///
    /// # Errors
    /// The first thing found wrong.
    pub fn validate(&self) -> Result<(), QueryError> {
        let Self { cable, start, end } = self;
        let positive = |key, x: f64| check(key, x, (1.0 / LARGEST..=LARGEST).contains(&x), "from 1e-12 to 1e12");
        positive("length", cable.length)?;
        positive("EI", cable.bending[0])?;
        positive("EI of the second axis", cable.bending[1])?;
        positive("GJ", cable.torsion)?;
        check("weight", cable.weight, (0.0..=LARGEST).contains(&cable.weight), "from 0 to 1e12")?;
        for rest in cable.rest.iter().copied() {
            check("curvature at rest", rest, rest.abs() <= LARGEST, "finite and at most 1e12")?;
        }
        let compliance = cable.stretch_compliance;
        check("stretch compliance", compliance, (0.0..=LARGEST).contains(&compliance), "from 0 to 1e12")?;
        let Carried { weight, place } = cable.carried;
        check("carried weight", weight, (0.0..=LARGEST).contains(&weight), "from 0 to 1e12")?;
        let is_on_it = (0.0..=cable.length).contains(&place);
        check("place of the carried weight", place, is_on_it, "from 0 to the length")?;
        start.validate(["position of the start", "orientation of the start"])?;
        let Some(end) = end else { return Ok(()) };
        end.validate(["position of the end", "orientation of the end"])?;
        let distance = (end.position - start.position).norm();
        // One that stretches may be too short: it is taut then.
        let reach = if compliance >= YIELDS { LONGEST } else { 1.0 };
        if distance > reach * cable.length {
            return Err(QueryError::TooFar { distance, length: cable.length });
        }
        Ok(())
    }
}
