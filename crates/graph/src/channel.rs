//! What kind of number a feature is, and so what a reflection does to it.

use crate::Normal;

/// Kind of one feature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// A scalar: no reflection changes it.
    Scalar,
    /// Component along d1, d2 or d3 (0 to 2) of a polar vector: a place, a shift, a force.
    Polar(usize),
    /// Component along d1, d2 or d3 (0 to 2) of an axial vector: a turn, a curvature, a moment.
    Axial(usize),
}

impl Channel {
    /// Components of a polar vector.
    pub const POLAR: [Channel; 3] = [Self::Polar(0), Self::Polar(1), Self::Polar(2)];
    /// Components of an axial vector.
    pub const AXIAL: [Channel; 3] = [Self::Axial(0), Self::Axial(1), Self::Axial(2)];

    /// Whether the mirror across the plane with this normal leaves the feature's sign as it is.
    pub fn is_even(self, normal: Normal) -> bool {
        match self {
            Self::Scalar => true,
            Self::Polar(axis) => axis != normal.axis(),
            Self::Axial(axis) => axis == normal.axis(),
        }
    }

    /// Whether the feature is a component of a vector.
    pub fn is_vector(self) -> bool {
        self != Self::Scalar
    }
}

/// Sets the features that a planar rod cannot have to zero in every row of `rows`. `[any, channels]`
///
/// The mirror across the rod's plane leaves a planar rod as it is and changes the sign of these features. A network
/// whose inputs and outputs are masked is therefore exactly symmetric under that mirror.
pub fn mask(channels: &[Channel], normal: Normal, rows: &mut [f32]) {
    if channels.is_empty() {
        return;
    }
    for row in rows.chunks_exact_mut(channels.len()) {
        for (value, channel) in row.iter_mut().zip(channels) {
            if !channel.is_even(normal) {
                *value = 0.0;
            }
        }
    }
}
