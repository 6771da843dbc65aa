//! What is identified of a noodle.

use std::ops::{Index, IndexMut};

use names::names;

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

impl Number {
    /// How many there are.
    pub const COUNT: usize = Self::ALL.len();

    /// Its unit.
    pub fn unit(self) -> &'static str {
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

    /// The least and the largest value that it may have.
    pub fn bounds(self) -> [f64; 2] {
        match self {
            Self::Length => [0.05, 20.0],
            Self::Middle => [0.1, 0.9],
            Self::Bending => [1e-3, 1e3],
            Self::Twist => [0.05, 20.0],
            Self::InnerDamping => [1e-4, 10.0],
            Self::OuterDamping => [1e-3, 100.0],
            Self::DragAcross => [1e-3, 100.0],
            Self::Curvature1 | Self::Curvature2 => [-5.0, 5.0],
            Self::HeadingY | Self::HeadingZ => [-1.5, 1.5],
        }
    }

    /// Whether its logarithm is searched for, so that its spread is a factor.
    pub fn is_logarithmic(self) -> bool {
        self.bounds()[0] > 0.0
    }

    /// The number that is searched for: the logarithm of `value`, or the value.
    pub fn coordinate(self, value: f64) -> f64 {
        if self.is_logarithmic() { value.ln() } else { value }
    }

    /// The value of a coordinate, within the bounds.
    pub fn value(self, coordinate: f64) -> f64 {
        let [least, most] = self.bounds();
        let value = if self.is_logarithmic() { coordinate.exp() } else { coordinate };
        value.clamp(least, most)
    }
}

/// A value for each number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Numbers([f64; Number::COUNT]);

impl Numbers {
    /// Where a search begins, for a noodle of this length [m].
    pub fn start(length: f64) -> Self {
        Self([length, 0.5, 1.0, 0.7, 0.05, 0.1, 0.1, 0.0, 0.0, 0.0, 0.0])
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
