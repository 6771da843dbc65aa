//! Drawings of charts as SVG elements, coloured by classes (`chart.css`).

mod bars;
mod heat;
mod legend;
mod lines;
mod marker;
mod text;
mod ticks;

pub(crate) use legend::{columns, entries, list};
pub(crate) use text::paragraph;

use crate::{Charts, Palette};

/// A drawn chart.
pub(crate) struct Drawing {
    /// \[px\].
    pub(crate) width: f64,
    /// \[px\].
    pub(crate) height: f64,
    /// Size of its text \[px\].
    pub(crate) font: f64,
    /// What it shows, for those who do not see it.
    pub(crate) label: String,
    /// Its elements, from (0, 0) on.
    pub(crate) body: String,
}

/// How large charts are drawn.
#[derive(Clone, Copy)]
struct Size {
    /// \[px\].
    width: f64,
    /// Size of text \[px\].
    font: f64,
}

/// A chart by itself: shrunk to a phone of 360 px, its text is still legible.
const SINGLE: Size = Size { width: 460.0, font: 14.0 };
/// One of several: three fit side by side on a desk, one on a phone.
const MULTIPLE: Size = Size { width: 320.0, font: 12.5 };

/// Draws the charts of a figure.
pub(crate) fn charts(charts: &Charts, palette: &Palette<'_>) -> Vec<Drawing> {
    let size = |count| if count == 1 { SINGLE } else { MULTIPLE };
    match charts {
        Charts::Lines(charts) => charts.iter().map(|chart| lines::draw(chart, size(charts.len()), palette)).collect(),
        Charts::Heat(charts) => charts.iter().map(|chart| heat::draw(chart, size(charts.len()))).collect(),
        Charts::Bars(charts) => charts.iter().map(|chart| bars::draw(chart, size(charts.len()), palette)).collect(),
    }
}

/// What a chart shows, in words.
fn description(kind: &str, title: &str, rest: &str) -> String {
    if title.is_empty() { format!("{kind}: {rest}") } else { format!("{kind}, {title}: {rest}") }
}
