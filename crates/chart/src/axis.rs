//! Axes: where values lie on them, and where they have ticks.

use crate::{Px, Xml, significant};

/// An axis of a chart.
#[derive(Clone, Debug, Default)]
pub struct Axis {
    /// What it measures, with the unit: "time per step \[ms\]".
    pub label: String,
    /// Whether lengths follow the logarithm; values that are not positive have no place then.
    pub log: bool,
    /// First and last value; from the data if none, or if the axis has no such interval.
    pub range: Option<[f64; 2]>,
}

impl Axis {
    /// A linear axis over the range of the data.
    pub fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), ..Self::default() }
    }

    /// A logarithmic axis over the range of the data.
    pub fn log(label: impl Into<String>) -> Self {
        Self { log: true, ..Self::linear(label) }
    }
}

/// Smallest and largest of `values`; `None` if there are none.
pub(crate) fn span(values: impl IntoIterator<Item = f64>) -> Option<[f64; 2]> {
    values.into_iter().fold(None, |span, x| Some(span.map_or([x; 2], |[a, b]: [f64; 2]| [a.min(x), b.max(x)])))
}

/// An axis laid out along pixels.
#[derive(Clone, Copy)]
pub(crate) struct Layout {
    pub(crate) log: bool,
    /// First and last place: values, or their logarithms to base 10.
    pub(crate) places: [f64; 2],
    /// Where these lie [px].
    pub(crate) pixels: [f64; 2],
}

impl Layout {
    /// An axis over its own range, or over that of the data with some room around; `None` if no value has a place.
    pub(crate) fn new(axis: &Axis, data: impl IntoIterator<Item = f64>) -> Option<Self> {
        let log = axis.log;
        let [low, high] = span(data.into_iter().filter_map(|value| place(log, value)))?;
        let room = match log {
            _ if high > low => 0.05 * (high - low),
            true => 0.5,
            false if low == 0.0 => 1.0,
            false => 0.1 * low.abs(),
        };
        let own = axis.range.and_then(|[low, high]| Some([place(log, low)?, place(log, high)?]));
        let places = own.filter(|[low, high]| low < high).unwrap_or([low - room, high + room]);
        Some(Self { log, places, pixels: [0.0, 1.0] })
    }

    /// Where a value lies [px], also beyond the axis' ends, but not by far; `None` if it has no place.
    pub(crate) fn at(&self, value: f64) -> Option<f64> {
        let ([low, high], [start, end]) = (self.places, self.pixels);
        let share = (place(self.log, value)? - low) / (high - low);
        Some(start + share.clamp(-20.0, 20.0) * (end - start))
    }

    /// The same pixels for an interval of `length` about the middle.
    pub(crate) fn widen(&mut self, length: f64) {
        let middle = self.places.iter().sum::<f64>() / 2.0;
        self.places = [middle - 0.5 * length, middle + 0.5 * length];
    }
}

/// Where a value lies among others: at itself, or at its logarithm to base 10; `None` if it has no place.
pub(crate) fn place(log: bool, value: f64) -> Option<f64> {
    let place = if log { value.log10() } else { value };
    place.is_finite().then_some(place)
}

/// About `count` labelled ticks of an axis, and others without labels: values and labels, in which an exponent stands behind
/// a '^'.
pub(crate) fn ticks(axis: &Layout, count: usize) -> Vec<(f64, String)> {
    let [low, high] = axis.places;
    match axis.log {
        true if high - low >= 0.5 => logarithmic(low, high, count),
        // Less than half a decade: a decade's ticks are too few.
        true => linear(10f64.powf(low), 10f64.powf(high), count),
        false => linear(low, high, count),
    }
}

fn linear(low: f64, high: f64, count: usize) -> Vec<(f64, String)> {
    let rough = (high - low) / count.max(1) as f64;
    let decade = 10f64.powf(rough.log10().floor());
    // Slack for rounding in the division.
    let step = decade * [1.0, 2.0, 5.0].into_iter().find(|m| rough / decade <= m + 1e-9).unwrap_or(10.0);
    let slack = 1e-9 * (high - low);
    let decimals = (-(step * (1.0 + 1e-9)).log10().floor()).max(0.0) as usize;
    let plain = decimals <= 4 && low.abs().max(high.abs()) < 1e6;
    let label = |value: f64| match plain {
        true => format!("{value:.decimals$}"),
        false => significant(value, (value.abs() / step).log10().floor().max(0.0) as usize + 2).replace('e', "·10^"),
    };
    let multiples = ((low - slack) / step).ceil() as i64..=((high + slack) / step).floor() as i64;
    // Adding zero takes the sign off a negative zero.
    multiples.map(|i| i as f64 * step + 0.0).map(|value| (value, minus(&label(value)))).collect()
}

/// Ticks between two places, which are logarithms to base 10.
fn logarithmic(low: f64, high: f64, count: usize) -> Vec<(f64, String)> {
    let (width, slack) = (high - low, 1e-9 * (high - low));
    let stride = (width / count.max(1) as f64).ceil().max(1.0) as i32;
    let plain = low >= -3.5 && high <= 4.5;
    let tick = |e: i32, digit: i32| {
        let value = f64::from(digit) * 10f64.powi(e);
        let label = match digit {
            1 if e.rem_euclid(stride) != 0 => String::new(),
            1 if !plain => minus(&format!("10^{e}")),
            // Few decades: their halves and fifths have labels too.
            1 => significant(value, 1),
            2 | 5 if plain && width < 1.6 => significant(value, 1),
            _ => String::new(),
        };
        (value, label)
    };
    let digits = if width > 6.0 { 1..=1 } else { 1..=9 };
    let all =
        (low.floor() as i32..=(high + slack).floor() as i32).flat_map(|e| digits.clone().map(move |d| tick(e, d)));
    all.filter(|(value, _)| (low - slack..=high + slack).contains(&value.log10())).collect()
}

fn minus(number: &str) -> String {
    number.replace('-', "\u{2212}")
}

/// Draws lines at the ticks, from `from` to `to` across the axis, which is level or upright, and labels before them.
pub(crate) fn draw_ticks(svg: &mut Xml, axis: &Layout, count: usize, [from, to]: [f64; 2], level: bool, font: f64) {
    let (mut lines, mut labels) = ([String::new(), String::new()], Xml::default());
    for (value, label) in ticks(axis, count) {
        let Some(at) = axis.at(value) else { continue };
        let (line, [x, y], anchor) = match level {
            true => (format!("M{} {}V{}", Px(at), Px(from), Px(to)), [at, from + 1.1 * font + 2.0], "middle"),
            false => (format!("M{} {}H{}", Px(from), Px(at), Px(to)), [from - 6.0, at + 0.35 * font], "end"),
        };
        lines[usize::from(!label.is_empty())] += &line;
        let (base, power) = label.split_once('^').unwrap_or((&label, ""));
        let raised = Xml::element("tspan", &[("dy", &Px(-0.4 * font)), ("font-size", &Px(0.75 * font))], power);
        let text = [Some(Xml::text(base)), (!power.is_empty()).then_some(raised)];
        labels.push(Xml::nest(
            "text",
            &[("x", &Px(x)), ("y", &Px(y)), ("text-anchor", &anchor)],
            text.into_iter().flatten(),
        ));
    }
    svg.path("minor", &lines[0], "");
    svg.path("grid", &lines[1], "");
    svg.push(labels);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(log: bool, places: [f64; 2]) -> Vec<String> {
        let ticks = ticks(&Layout { log, places, pixels: [0.0, 1.0] }, 5);
        ticks.into_iter().map(|(_, label)| label).filter(|label| !label.is_empty()).collect()
    }

    #[test]
    fn linear_ticks_are_round() {
        assert_eq!(labels(false, [-0.03, 0.42]), ["0.0", "0.1", "0.2", "0.3", "0.4"]);
        assert_eq!(labels(false, [-3.0, 3.0]), ["−2", "0", "2"]);
        assert_eq!(labels(false, [0.0, 2e7]), ["0", "5.0·10^6", "1.0·10^7", "1.5·10^7", "2.0·10^7"]);
    }

    #[test]
    fn logarithmic_ticks_are_powers_of_ten() {
        assert_eq!(labels(true, [-2.0, 2.2]), ["0.01", "0.1", "1", "10", "100"]);
        assert_eq!(labels(true, [-12.3, -0.5]), ["10^−12", "10^−9", "10^−6", "10^−3"]);
        assert_eq!(labels(true, [-0.2, 1.1]), ["1", "2", "5", "10"]);
        assert_eq!(labels(true, [2f64.log10(), 4f64.log10()]), ["2.0", "2.5", "3.0", "3.5", "4.0"]);
    }
}
