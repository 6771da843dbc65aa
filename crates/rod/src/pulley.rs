//! Pulleys: wheels with a radius over which rods run.

use std::ops::Range;

use nalgebra::{Unit, Vector3};

use crate::sliding_joint::linear;
use crate::{Body, Model, ModelError};

/// A rod runs over a wheel, in a groove about an axle. Where it runs on and off follows from the directions of its spans. A rod that does not press
/// on the wheel is free of it; its end leaves it.
#[derive(Clone, Debug, PartialEq)]
pub struct Pulley {
    /// The rod's segments, in order.
    pub segments: Range<usize>,
    /// What the axle is part of, or the wheel itself: an anchor, or a segment that is none of the rod's.
    pub holder: Body,
    /// Middle of the wheel in the holder's frame, from its centre [m].
    pub centre: Vector3<f64>,
    /// The axle in the holder's frame.
    pub axis: Unit<Vector3<f64>>,
    /// Distance of the rod's centreline from the axle [m].
    pub radius: f64,
    /// How the wheel turns.
    pub wheel: Wheel,
}

/// How the wheel of a pulley turns. A taut rod that is on it over the angle theta slips where its tensions differ by the factor
/// exp(friction theta).
#[derive(Clone, Debug, PartialEq)]
pub enum Wheel {
    /// By itself, without inertia: the rod has the same tension on both sides.
    Free,
    /// With the pulley's holder: the ground, or a body that may turn about the axle.
    Held {
        /// Coefficient of Coulomb friction.
        friction: f64,
    },
    /// By a drive on the holder.
    Driven {
        /// Coefficient of Coulomb friction.
        friction: f64,
        /// Times [s], each later than the one before, and rates [rad/s]; positive ones move the rod from its start towards its end. Linear
        /// between the times, constant before and after.
        rates: Vec<[f64; 2]>,
        /// The largest torque [N m]. Where more is needed the drive slips.
        max_torque: f64,
    },
}

/// Where a rod is on a pulley, and what that does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OnPulley {
    /// The angle over which the rod is on the wheel [rad]; 0 where it is free of it.
    pub wrap: f64,
    /// By how much the rod has turned about the axle since the start [rad], from its start towards its end.
    pub turned: f64,
    /// Its rate over the last step [rad/s].
    pub rate: f64,
    /// Force of the wheel on the rod at the end of the last step [N].
    pub force: Vector3<f64>,
    /// Torque of the wheel on the rod about the axle [N m]: positive moves it from its start towards its end.
    pub torque: f64,
}

impl Wheel {
    /// The rate of its drive at a time [s], in rad/s; `None` of a wheel without one.
    pub fn rate(&self, time: f64) -> Option<f64> {
        if let Wheel::Driven { rates, .. } = self { Some(linear(rates, time)) } else { None }
    }

    /// The coefficient of Coulomb friction; 0 of a wheel that passes no force along the rod.
    pub fn friction(&self) -> f64 {
        match self {
            Wheel::Free => 0.0,
            Wheel::Held { friction } | Wheel::Driven { friction, .. } => *friction,
        }
    }
}

impl Pulley {
    /// Checks it.
    pub(crate) fn validate(&self, model: &Model, index: usize) -> Result<(), ModelError> {
        let what = "pulley";
        let value = |quantity, value, allowed| Err(ModelError::Value { what, index, quantity, value, allowed });
        model.check_threaded(what, index, &self.segments, self.holder)?;
        if let Some(&x) = self.centre.iter().chain(self.axis.iter()).find(|x| !x.is_finite()) {
            return value("centre or axis", x, "finite");
        }
        if !(self.radius.is_finite() && self.radius > 0.0) {
            return value("radius", self.radius, "finite and > 0");
        }
        let longest = model.segments[self.segments.clone()].iter().map(|segment| segment.length).fold(0.0, f64::max);
        if longest > self.radius {
            return value("length of a segment of its rod", longest, "at most the radius");
        }
        let friction = self.wheel.friction();
        if !(friction.is_finite() && friction >= 0.0) {
            return value("friction", friction, "finite and >= 0");
        }
        let Wheel::Driven { rates, max_torque, .. } = &self.wheel else { return Ok(()) };
        if max_torque.is_nan() || *max_torque < 0.0 {
            return value("largest torque", *max_torque, ">= 0");
        }
        if let Some([time, rate]) = rates.iter().find(|pair| !(pair[0].is_finite() && pair[1].is_finite())) {
            return value("rate, or its time,", if time.is_finite() { *rate } else { *time }, "finite");
        }
        if let Some(pair) = rates.windows(2).find(|pair| pair[0][0] >= pair[1][0]) {
            return value("time of a rate", pair[1][0], "later than the one before");
        }
        Ok(())
    }
}
