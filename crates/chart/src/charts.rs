//! The charts of a figure.

use crate::drawing::Drawing;
use crate::grid::{self, BarChart, HeatMap};
use crate::lines::{self, LineChart};
use crate::palette::Palette;

/// The charts of a figure, all of a kind, because a CSV file has one kind of rows.
#[derive(Clone, Debug)]
pub enum Charts {
    /// Curves and points.
    Lines(Vec<LineChart>),
    /// Numbers behind colours.
    Heat(Vec<HeatMap>),
    /// Stacked bars.
    Bars(Vec<BarChart>),
}

/// Width of a chart by itself and size of its text \[px\]: shrunk to a phone of 360 px, the text is still legible.
pub(crate) const SINGLE: [f64; 2] = [460.0, 14.0];
/// The same of one of several: three fit side by side on a desk, one on a phone.
const MULTIPLE: [f64; 2] = [320.0, 12.5];

/// Draws the charts of a figure, without legends.
pub(crate) fn drawings(charts: &Charts, palette: &Palette<'_>) -> Vec<Drawing> {
    let size = |count| if count == 1 { SINGLE } else { MULTIPLE };
    match charts {
        Charts::Lines(charts) => charts.iter().map(|chart| lines::draw(chart, size(charts.len()), palette)).collect(),
        Charts::Heat(charts) => charts.iter().map(|chart| grid::heat(chart, size(charts.len())[1])).collect(),
        Charts::Bars(charts) => charts.iter().map(|chart| grid::bars(chart, size(charts.len()), palette)).collect(),
    }
}
