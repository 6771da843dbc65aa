//! What a quantity is that is identified: a number of a cable, with a unit and bounds, and how it is searched for.

use std::fmt::Display;

/// A quantity of what is identified.
pub trait Quantity: Copy + PartialEq + Display + Send + Sync {
    /// Where and how it is searched for.
    fn range(self) -> Range;

    /// Its unit.
    fn unit(self) -> &'static str;

    /// Where searches begin.
    fn start(self) -> f64 {
        self.range().start
    }

    /// The least and the largest value that it may have.
    fn bounds(self) -> [f64; 2] {
        let Range { least, most, .. } = self.range();
        [least, most]
    }

    /// The number that is searched for: the logarithm of `value`, or the value in its unit of search.
    fn coordinate(self, value: f64) -> f64 {
        match self.range().scale {
            Scale::Logarithm => value.ln(),
            Scale::Unit(unit) => value / unit,
        }
    }

    /// The value of a coordinate, within the bounds.
    fn value(self, coordinate: f64) -> f64 {
        let Range { least, most, scale, .. } = self.range();
        let value = match scale {
            Scale::Logarithm => coordinate.exp(),
            Scale::Unit(unit) => coordinate * unit,
        };
        value.clamp(least, most)
    }

    /// Whether its logarithm is searched for, so that its spread is a factor.
    fn is_logarithmic(self) -> bool {
        matches!(self.range().scale, Scale::Logarithm)
    }

    /// Whether it may be left out of the model: it is then 0, whatever its bounds are.
    fn may_be_left_out(self) -> bool {
        false
    }

    /// Whether it is not searched for, but follows from runs with the others: see [`crate::specimen::Specimen::averaged`].
    fn is_averaged(self) -> bool {
        false
    }

    /// The standard deviation of a normal prior of its coordinate about that of its start, if there is one.
    fn prior(self) -> Option<f64> {
        None
    }

    /// Whether a value is as far as it may go.
    fn is_at_bound(self, value: f64) -> bool {
        let [value, least, most] = [value, self.range().least, self.range().most].map(|value| self.coordinate(value));
        value - least < 1e-6 || most - value < 1e-6
    }
}

/// Where and how a quantity is searched for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Where the search begins.
    pub start: f64,
    /// The least value.
    pub least: f64,
    /// The largest value.
    pub most: f64,
    /// What of it is searched for.
    pub scale: Scale,
}

/// What of a quantity is searched for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// Its logarithm.
    Logarithm,
    /// Its value, in this unit.
    Unit(f64),
}
