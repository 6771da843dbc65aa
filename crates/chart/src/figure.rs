//! Figures, in a page and as files of their own.

use crate::charts::{Charts, SINGLE, drawings};
use crate::drawing::Drawing;
use crate::palette::Palette;
use crate::text::paragraph;
use crate::xml::{Attribute, Px, Xml};
use crate::{Conditions, legend, theme};

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

impl<'a> Palette<'a> {
    /// The palette of `figures`, in their order.
    pub fn new(figures: impl IntoIterator<Item = &'a Figure>) -> Self {
        let mut palette = Self::default();
        for figure in figures {
            match &figure.charts {
                Charts::Lines(charts) => charts.iter().flat_map(|chart| &chart.series).for_each(|series| {
                    palette.enter_colour(series.colour_key());
                    palette.enter_marker(&series.name);
                }),
                Charts::Heat(_) => {}
                Charts::Bars(charts) => {
                    charts.iter().flat_map(|chart| &chart.parts).for_each(|part| palette.enter_colour(part));
                }
            }
        }
        palette
    }
}
