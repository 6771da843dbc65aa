//! Pulleys: wheels with a radius over which rods run.

mod checks;

use std::ops::Range;

use nalgebra::{Unit, Vector3};

use crate::Body;
use crate::sliding_joint::linear;

/// A rod runs over a wheel, in a groove about an axle. Where it runs on and off follows from the directions of its spans. The groove holds a slack
/// rod, too; a rod whose end has left the wheel is free of it for good.
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
