//! Figures.

use crate::{BarChart, Conditions, HeatMap, LineChart, ReportError, standalone, validate};

/// A figure: one chart, or several small ones of a kind side by side.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Anchor in the page and name of the CSV file: a to z, 0 to 9, '-' and '_', unique in the page.
    pub id: String,
    /// A short title.
    pub title: String,
    /// What the figure shows and how to read it, with inline marks (see [`crate::Block::Paragraph`]).
    pub caption: String,
    /// The charts.
    pub charts: Charts,
    /// Under which conditions the numbers were measured.
    pub conditions: Conditions,
}

impl Figure {
    /// The figure as an SVG file of its own: title, charts, legend and conditions on a white ground, in fixed colours.
    /// Colours are given by first appearance in this figure, not in the page.
    ///
    /// # Errors
    /// [`ReportError::Shape`] and [`ReportError::EmptyCondition`], as [`crate::Page::write`].
    pub fn svg(&self) -> Result<String, ReportError> {
        validate::figure(self)?;
        Ok(standalone::svg(self))
    }
}

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

impl From<LineChart> for Charts {
    fn from(chart: LineChart) -> Self {
        Self::Lines(vec![chart])
    }
}

impl From<HeatMap> for Charts {
    fn from(chart: HeatMap) -> Self {
        Self::Heat(vec![chart])
    }
}

impl From<BarChart> for Charts {
    fn from(chart: BarChart) -> Self {
        Self::Bars(vec![chart])
    }
}
