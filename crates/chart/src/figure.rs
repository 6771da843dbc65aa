//! Figures.

use crate::draw::{self, Drawing};
use crate::{Attribute, BarChart, Conditions, HeatMap, LineChart, Palette, Px, Xml, standalone};

/// Smallest text of a chart on a narrow screen \[px\]; below it, the chart scrolls.
const SMALLEST_TEXT: f64 = 9.4;

/// A figure: one chart, or several small ones of a kind side by side.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Anchor in a page and name of its files: a to z, 0 to 9, '-' and '_', unique in the page.
    pub id: String,
    /// A short title.
    pub title: String,
    /// What the figure shows and how to read it; in a page, with inline marks.
    pub caption: String,
    /// The charts.
    pub charts: Charts,
    /// Under which conditions the numbers were measured.
    pub conditions: Conditions,
}

impl Figure {
    /// The figure as an SVG file of its own: title, charts, legend and conditions on a white ground, in fixed colours.
    /// Colours are given by first appearance in this figure, not in a page.
    pub fn svg(&self) -> String {
        standalone::svg(self)
    }

    /// Its charts and its legend as a part of a page, in the page's colours.
    pub fn draw(&self, xml: &mut Xml, palette: &Palette<'_>) {
        let drawings = draw::charts(&self.charts, palette);
        xml.open("div", &[("class", &if drawings.len() > 1 { "body wide" } else { "body" })]);
        xml.open("div", &[("class", &"charts")]);
        for Drawing { width, height, font, label, body } in &drawings {
            let [wide, high] = [Px(*width), Px(*height)];
            let view = format!("0 0 {wide} {high}");
            let narrowest = format!("min-width:{}px", (width * SMALLEST_TEXT / font).ceil());
            let look: [Attribute<'_>; 4] =
                [("class", &"chart"), ("style", &narrowest), ("role", &"img"), ("aria-label", label)];
            let size: [Attribute<'_>; 4] =
                [("width", &wide), ("height", &high), ("viewBox", &view), ("font-size", font)];
            xml.open("div", &[("class", &"scroll")]);
            xml.open("svg", &[look, size].concat());
            xml.raw(body);
            xml.close();
            xml.close();
            xml.line();
        }
        xml.close();
        draw::list(xml, &draw::entries(&self.charts, palette));
        xml.close();
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
