//! Figures, in a page and as files of their own.

use crate::text::paragraph;
use crate::{Attribute, BarChart, Conditions, HeatMap, LineChart, Palette, Px, Xml, grid, legend, lines, theme};

/// Smallest text of a chart on a narrow screen \[px\]; below it, the chart scrolls.
const SMALLEST_TEXT: f64 = 9.4;
/// Margin around a file's figure \[px\].
const MARGIN: f64 = 16.0;

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

impl Figure {
    /// Its charts and its legend as a part of a page, in the page's colours.
    pub fn draw(&self, palette: &Palette<'_>) -> Xml {
        let drawings = drawings(&self.charts, palette);
        let class = if drawings.len() > 1 { "body wide" } else { "body" };
        let charts = drawings.iter().map(|drawing| {
            let narrowest = format!("min-width:{}px", (drawing.size[0] * SMALLEST_TEXT / drawing.font).ceil());
            Xml::nest("div", &[("class", &"scroll")], [drawing.svg(&[("style", &narrowest)])])
        });
        let charts = Xml::nest("div", &[("class", &"charts")], charts);
        Xml::nest("div", &[("class", &class)], [charts, legend::list(&legend::entries(&self.charts, palette))])
    }

    /// The figure as an SVG file of its own: title, charts in at most two columns, legend and conditions on a white ground,
    /// in fixed colours. These are given by first appearance in this figure, not in a page.
    pub fn svg(&self) -> String {
        let palette = Palette::new([self]);
        let drawings = drawings(&self.charts, &palette);
        let column = drawings.iter().map(|drawing| drawing.size[0] + MARGIN).fold(0.0, f64::max);
        let width = (column * drawings.len().min(2) as f64).max(SINGLE[0]);
        let font = drawings.first().map_or(14.0, |drawing| drawing.font);
        let mut figure = Xml::default();
        let mut y = paragraph(&mut figure, &self.title, [0.0, 0.0], width, 1.15 * font, "title") + 0.5 * MARGIN;
        for row in drawings.chunks(2) {
            for (drawing, x) in row.iter().zip([0.0, column]) {
                figure.push(drawing.svg(&[("x", &Px(x)), ("y", &Px(y))]));
            }
            y += row.iter().map(|drawing| drawing.size[1]).fold(0.0, f64::max) + 0.5 * MARGIN;
        }
        y = legend::columns(&mut figure, &legend::entries(&self.charts, &palette), y, width, font) + 0.5 * MARGIN;
        let conditions: Vec<_> = self.conditions.iter().map(|(key, value)| format!("{key}: {value}")).collect();
        y = paragraph(&mut figure, &conditions.join(" · "), [0.0, y], width, 0.9 * font, "small");

        let size = [width, y].map(|length| (length + 2.0 * MARGIN).ceil());
        let mut body = Xml::element("style", &[], &theme::file_style());
        body.rect([0.0, 0.0, size[0], size[1]], "ground", "", "");
        body.push(Xml::nest("g", &[("transform", &format!("translate({MARGIN} {MARGIN})"))], [figure]));
        let namespace: Attribute<'_> = ("xmlns", &"http://www.w3.org/2000/svg");
        Drawing { size, font, label: self.title.clone(), body }.svg(&[namespace]).to_string()
    }
}

/// A drawn chart.
pub(crate) struct Drawing {
    /// Width and height \[px\].
    pub(crate) size: [f64; 2],
    /// Size of its text \[px\].
    pub(crate) font: f64,
    /// What it shows, for those who do not see it.
    pub(crate) label: String,
    /// Its elements, from (0, 0) on.
    pub(crate) body: Xml,
}

impl Drawing {
    /// The drawing as an element with more attributes.
    pub(crate) fn svg(&self, attributes: &[Attribute<'_>]) -> Xml {
        let [width, height] = self.size.map(Px);
        let view = format!("0 0 {width} {height}");
        let own: [Attribute<'_>; 7] = [
            ("class", &"chart"),
            ("role", &"img"),
            ("aria-label", &self.label),
            ("width", &width),
            ("height", &height),
            ("viewBox", &view),
            ("font-size", &self.font),
        ];
        Xml::nest("svg", &[&own, attributes].concat(), [self.body.clone()])
    }
}

/// Width of a chart by itself and size of its text \[px\]: shrunk to a phone of 360 px, the text is still legible.
const SINGLE: [f64; 2] = [460.0, 14.0];
/// The same of one of several: three fit side by side on a desk, one on a phone.
const MULTIPLE: [f64; 2] = [320.0, 12.5];

/// Draws the charts of a figure, without legends.
fn drawings(charts: &Charts, palette: &Palette<'_>) -> Vec<Drawing> {
    let size = |count| if count == 1 { SINGLE } else { MULTIPLE };
    match charts {
        Charts::Lines(charts) => charts.iter().map(|chart| lines::draw(chart, size(charts.len()), palette)).collect(),
        Charts::Heat(charts) => charts.iter().map(|chart| grid::heat(chart, size(charts.len())[1])).collect(),
        Charts::Bars(charts) => charts.iter().map(|chart| grid::bars(chart, size(charts.len()), palette)).collect(),
    }
}
