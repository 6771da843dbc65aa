//! Numbers as text and curves, the same way in all sections.

use evaluation::guesses::Spread;
use report::{Axis, LineChart, Point, Series, significant};

use crate::sections::paper::is_end_to_end;

/// What times of whole runs include.
pub(crate) const ALL_STAGES: &str = "all stages of a step, guesses with features, inference and guards";

/// A number with three digits.
pub(crate) fn number(value: f64) -> String {
    significant(value, 3)
}

/// A median with its quartiles; a dash where nothing was measured.
pub(crate) fn spread(value: Option<&Spread>, scale: f64) -> String {
    value.map_or("-".to_owned(), |Spread { lower, median, upper, .. }| {
        let [lower, median, upper] = [lower, median, upper].map(|x| number(x * scale));
        format!("{median} ({lower} to {upper})")
    })
}

/// A share as per cent.
pub(crate) fn per_cent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// Adds words to a list in words.
pub(crate) fn join(list: &mut String, words: &str) {
    if !list.is_empty() {
        list.push_str("; ");
    }
    list.push_str(words);
}

/// A curve of medians with a band of quartiles.
pub(crate) fn band(name: impl Into<String>, values: impl Iterator<Item = (f64, Option<Spread>)>, scale: f64) -> Series {
    let point = |(x, spread): (f64, Option<Spread>)| {
        let spread = spread?;
        let band = Some([spread.lower * scale, spread.upper * scale]);
        Some(Point { x, y: spread.median * scale, band, ..Point::default() })
    };
    Series::new(name, values.filter_map(point))
}

/// The curve of a way over steps: dashed where predictions take the place of all solves.
pub(crate) fn of_way(series: Series) -> Series {
    Series { dashed: is_end_to_end(&series.name), markers: false, ..series }
}

/// A picture of curves in a plane.
pub(crate) fn picture(title: String, [x, y]: [&str; 2], series: Vec<Series>) -> LineChart {
    LineChart { title, x: Axis::linear(x), y: Axis::linear(y), series, equal_units: true, ..LineChart::default() }
}
