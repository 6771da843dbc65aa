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
    /// How the axes' scales relate.
    pub aspect: Aspect,
}

/// How the scales of two axes relate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Aspect {
    /// Each axis fills its side.
    #[default]
    Free,
    /// A unit is as long on both axes, as planar shapes need it. Both axes must be linear.
    Equal,
}

/// A curve.
#[derive(Clone, Debug, Default)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// Its points, joined in this order.
    pub points: Vec<Point>,
    /// How they are joined.
    pub style: LineStyle,
    /// Whether points are marked. Of a curve with many points, only some are.
    pub markers: bool,
    /// Series of the same key have the same colour throughout the page; the name if none.
    pub colour: Option<String>,
    /// Series of the same key have the same shape of markers throughout the page; the name if none.
    pub marker: Option<String>,
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

    pub(crate) fn marker_key(&self) -> &str {
        self.marker.as_ref().unwrap_or(&self.name)
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
    /// More about the point ("8 iterations"), seen under the mouse and in the CSV file.
    pub note: String,
}

impl From<(f64, f64)> for Point {
    fn from((x, y): (f64, f64)) -> Self {
        Self { x, y, ..Self::default() }
    }
}

/// How the points of a curve are joined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LineStyle {
    /// By solid lines.
    #[default]
    Solid,
    /// By dashed lines.
    Dashed,
    /// Not at all.
    Points,
    /// By stairs: each value holds until the next point.
    Step,
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
