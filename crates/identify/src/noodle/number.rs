//! What is identified of a noodle.

use std::ops::{Index, IndexMut};

use names::names;

use crate::quantity::{Quantity, Range, Scale};
use crate::specimen;

/// A number of a noodle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Number {
    /// Length from the clamp to the tip's marker [m].
    Length,
    /// Where the middle marker lies, as a share of the length.
    Middle,
    /// Bending stiffness over mass per length, EI / (rho A) [m^4/s^2].
    Bending,
    /// Stiffness of twist over that of bending, GJ / EI.
    Twist,
    /// Relaxation time of bending and twist (Kelvin-Voigt) [s].
    InnerDamping,
    /// Rate at which velocities decay [1/s].
    OuterDamping,
    /// Drag across the axis: deceleration over the square of the velocity [1/m].
    DragAcross,
    /// Curvature at rest about d1, the clamp's y where the headings are 0 [1/m].
    Curvature1,
    /// Curvature at rest about d2, the clamp's z where the headings are 0 [1/m].
    Curvature2,
    /// Turn about the clamp's y from its x to the noodle's direction [rad].
    HeadingY,
    /// Turn about the clamp's z from its x to the noodle's direction [rad].
    HeadingZ,
}

names!(Number {
    Length = "length",
    Middle = "middle",
    Bending = "bending",
    Twist = "twist",
    InnerDamping = "inner-damping",
    OuterDamping = "outer-damping",
    DragAcross = "drag-across",
    Curvature1 = "curvature-1",
    Curvature2 = "curvature-2",
    HeadingY = "heading-y",
    HeadingZ = "heading-z",
});

impl Quantity for Number {
    fn range(self) -> Range {
        let logarithm = |start, least, most| Range { start, least, most, scale: Scale::Logarithm };
        let unit = |most: f64| Range { start: 0.0, least: -most, most, scale: Scale::Unit(1.0) };
        match self {
            Self::Length => logarithm(1.0, 0.05, 20.0),
            Self::Middle => logarithm(0.5, 0.1, 0.9),
            Self::Bending => logarithm(1.0, 1e-3, 1e3),
            Self::Twist => logarithm(0.7, 0.05, 20.0),
            Self::InnerDamping => logarithm(0.05, 1e-4, 10.0),
            Self::OuterDamping => logarithm(0.1, 1e-3, 100.0),
            Self::DragAcross => logarithm(0.1, 1e-3, 100.0),
            Self::Curvature1 | Self::Curvature2 => unit(5.0),
            Self::HeadingY | Self::HeadingZ => unit(1.5),
        }
    }

    fn unit(self) -> &'static str {
        match self {
            Self::Length => "m",
            Self::Middle | Self::Twist => "1",
            Self::Bending => "m^4/s^2",
            Self::InnerDamping => "s",
            Self::OuterDamping => "1/s",
            Self::DragAcross | Self::Curvature1 | Self::Curvature2 => "1/m",
            Self::HeadingY | Self::HeadingZ => "rad",
        }
    }

    fn may_be_left_out(self) -> bool {
        self == Self::DragAcross
    }
}

/// Bending stiffnesses [m^4/s^2] from which a search may begin, for a noodle of 1 m; they go with the length's cube.
const BEGINNINGS: [f64; 4] = [0.1, 0.4, 1.6, 6.4];

/// A value for each number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Numbers([f64; Number::ALL.len()]);

impl Numbers {
    /// Where a search begins, for a noodle of this length [m].
    pub fn start(length: f64) -> Self {
        let mut numbers = Self(Number::ALL.map(Quantity::start));
        numbers[Number::Length] = length;
        numbers
    }
}

impl Index<Number> for Numbers {
    type Output = f64;

    fn index(&self, number: Number) -> &f64 {
        &self.0[number as usize]
    }
}

impl IndexMut<Number> for Numbers {
    fn index_mut(&mut self, number: Number) -> &mut f64 {
        &mut self.0[number as usize]
    }
}

impl specimen::Numbers for Numbers {
    type Quantity = Number;

    fn quantities(&self) -> Vec<Number> {
        Number::ALL.to_vec()
    }

    fn beginnings(&self) -> Vec<Self> {
        let with = |scale: f64| {
            let mut numbers = *self;
            numbers[Number::Bending] = scale * self[Number::Length].powi(3);
            numbers
        };
        BEGINNINGS.map(with).to_vec()
    }
}
