//! Curves and points over two axes.

use crate::Axis;

/// Curves and points over two axes. Values that are not finite, or not positive on a logarithmic axis, leave a gap in
/// the drawing and stay in the CSV file.
#[derive(Clone, Debug, Default)]
pub struct LineChart {
    /// A short title, or none.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The curves, the last on top.
    pub series: Vec<Series>,
    /// Lines across the chart.
    pub references: Vec<Reference>,
    /// What an emphasised point means ("on the Pareto front"), for the legend.
    pub emphasis: Option<String>,
    /// Whether a unit is as long on both axes, as planar shapes need it; both must be linear then. Else each axis fills
    /// its side.
    pub equal_units: bool,
}

/// A curve.
#[derive(Clone, Debug, Default)]
pub struct Series {
    /// Its name in the legend. Series of the same name have the same shape of markers throughout the page.
    pub name: String,
    /// Its points, joined in this order.
    pub points: Vec<Point>,
    /// Whether it is dashed.
    pub dashed: bool,
    /// Whether points are marked. Of a curve with many points, only some are.
    pub markers: bool,
    /// Series of the same key have the same colour throughout the page; the name if none.
    pub colour: Option<String>,
}

impl Series {
    /// A solid curve with markers, in the colour of its name.
    pub fn new<P: Into<Point>>(name: impl Into<String>, points: impl IntoIterator<Item = P>) -> Self {
        let points = points.into_iter().map(Into::into).collect();
        Self { name: name.into(), points, markers: true, ..Self::default() }
    }

    pub(crate) fn colour_key(&self) -> &str {
        self.colour.as_ref().unwrap_or(&self.name)
    }

    /// Classes of its line.
    pub(crate) fn class(&self) -> &'static str {
        if self.dashed { "line dashed" } else { "line" }
    }
}

/// A point of a curve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Point {
    /// Along the horizontal axis, in its unit.
    pub x: f64,
    /// Along the vertical axis, in its unit.
    pub y: f64,
    /// Lower and upper end of a band about y, such as the quartiles.
    pub band: Option<[f64; 2]>,
    /// Whether the point stands out: larger, with an outline.
    pub emphasis: bool,
}

impl From<(f64, f64)> for Point {
    fn from((x, y): (f64, f64)) -> Self {
        Self { x, y, ..Self::default() }
    }
}

/// A line across a chart.
#[derive(Clone, Debug)]
pub enum Reference {
    /// An upright line.
    Vertical {
        /// Where it crosses the horizontal axis.
        x: f64,
        /// What it stands for.
        label: String,
    },
    /// A level line.
    Horizontal {
        /// Where it crosses the vertical axis.
        y: f64,
        /// What it stands for.
        label: String,
    },
}
