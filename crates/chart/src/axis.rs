//! Axes: scales, and where values lie on them.

/// An axis of a chart.
#[derive(Clone, Debug, Default)]
pub struct Axis {
    /// What it measures, with the unit: "time per step \[ms\]".
    pub label: String,
    /// How lengths follow values.
    pub scale: Scale,
    /// First and last value; from the data if none, or if they are not an interval of the scale.
    pub range: Option<[f64; 2]>,
}

impl Axis {
    /// A linear axis over the range of the data.
    pub fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), ..Self::default() }
    }

    /// A logarithmic axis over the range of the data.
    pub fn log(label: impl Into<String>) -> Self {
        Self { label: label.into(), scale: Scale::Log, range: None }
    }
}

/// How lengths and colours follow values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// In proportion.
    #[default]
    Linear,
    /// By the logarithm; values that are not positive have no place.
    Log,
}

impl Scale {
    /// Where `value` lies, the logarithm to base 10 on a logarithmic scale; `None` if it has no place.
    pub(crate) fn place(self, value: f64) -> Option<f64> {
        let place = match self {
            Self::Linear => value,
            Self::Log if value > 0.0 => value.log10(),
            Self::Log => return None,
        };
        place.is_finite().then_some(place)
    }

    /// The value that lies at `place`.
    pub(crate) fn value(self, place: f64) -> f64 {
        match self {
            Self::Linear => place,
            Self::Log => 10f64.powf(place),
        }
    }
}

/// Smallest and largest of `places`; `None` if there are none.
pub(crate) fn span(places: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    places.fold(None, |span, place| Some(span.map_or([place; 2], |[a, b]: [f64; 2]| [a.min(place), b.max(place)])))
}

/// An axis laid out along pixels.
#[derive(Clone, Copy)]
pub(crate) struct Layout {
    pub(crate) scale: Scale,
    /// First and last place, see [`Scale::place`].
    pub(crate) places: [f64; 2],
    /// Where these lie [px].
    pub(crate) pixels: [f64; 2],
}

impl Layout {
    /// The first and the last place of an axis: its own, or those of the data with some room around.
    pub(crate) fn places(axis: &Axis, data: [f64; 2]) -> [f64; 2] {
        if let Some([Some(low), Some(high)]) = axis.range.map(|range| range.map(|value| axis.scale.place(value)))
            && low < high
        {
            return [low, high];
        }
        let [low, high] = data;
        let room = match axis.scale {
            _ if high > low => 0.05 * (high - low),
            Scale::Log => 0.5,
            Scale::Linear if low == 0.0 => 1.0,
            Scale::Linear => 0.1 * low.abs(),
        };
        [low - room, high + room]
    }

    /// Where a value lies [px], also beyond the axis' ends, but not by far; `None` if it has no place.
    pub(crate) fn at(&self, value: f64) -> Option<f64> {
        let ([low, high], [start, end]) = (self.places, self.pixels);
        let share = (self.scale.place(value)? - low) / (high - low);
        Some(start + share.clamp(-20.0, 20.0) * (end - start))
    }
}
