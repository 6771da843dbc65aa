//! Figures as SVG files of their own.

use crate::Figure;
use crate::draw::{self, Drawing, LINE, wrap};
use crate::palette::Palette;
use crate::theme;
use crate::xml::{Px, Xml};

/// Margin around the figure, and distance of charts \[px\].
const MARGIN: f64 = 16.0;
/// Narrowest figure \[px\].
const NARROWEST: f64 = 480.0;

/// The figure with title, charts in at most two columns, legend and conditions, on a ground of its own.
pub(crate) fn svg(figure: &Figure) -> String {
    let palette = Palette::new([figure]);
    let drawings = draw::charts(&figure.charts, &palette);
    let legend = draw::entries(&figure.charts, &palette);
    let rows: Vec<&[Drawing]> = drawings.chunks(2).collect();
    let second = drawings.iter().step_by(2).map(|drawing| drawing.width).fold(0.0, f64::max) + 1.5 * MARGIN;
    let right = drawings.iter().skip(1).step_by(2).map(|drawing| second + drawing.width);
    let width = right.chain([NARROWEST, second - 1.5 * MARGIN]).fold(0.0, f64::max);
    let font = drawings.first().map_or(14.0, |drawing| drawing.font);

    let mut body = Xml::default();
    let mut y = 0.0;
    for line in wrap(&figure.title, 1.15 * font, width) {
        body.element(
            "text",
            &[("y", &Px(y + 1.15 * font)), ("font-size", &Px(1.15 * font)), ("class", &"head")],
            &line,
        );
        y += LINE * 1.15 * font;
    }
    y += 0.5 * MARGIN;
    for row in rows {
        for (drawing, x) in row.iter().zip([0.0, second]) {
            body.open("g", &[("transform", &format!("translate({} {})", Px(x), Px(y)))]);
            body.raw(&drawing.body);
            body.close();
        }
        y += row.iter().map(|drawing| drawing.height).fold(0.0, f64::max) + 0.5 * MARGIN;
    }
    y = draw::columns(&mut body, &legend, y, width, font) + 0.5 * MARGIN;
    let conditions: Vec<_> = figure.conditions.iter().map(|(key, value)| format!("{key}: {value}")).collect();
    let small = 0.9 * font;
    for line in wrap(&conditions.join(" · "), small, width) {
        body.element("text", &[("y", &Px(y + small)), ("class", &"small")], &line);
        y += LINE * small;
    }

    let (wide, high) = ((width + 2.0 * MARGIN).ceil(), (y + 2.0 * MARGIN).ceil());
    let mut svg = Xml::default();
    svg.open(
        "svg",
        &[
            ("xmlns", &"http://www.w3.org/2000/svg"),
            ("width", &wide),
            ("height", &high),
            ("viewBox", &format!("0 0 {wide} {high}")),
            ("class", &"chart"),
            ("role", &"img"),
            ("aria-label", &figure.title),
            ("font-size", &Px(font)),
        ],
    );
    svg.element("style", &[], &theme::file_style());
    svg.leaf("rect", &[("width", &wide), ("height", &high), ("rx", &"6"), ("class", &"ground")]);
    svg.open("g", &[("transform", &format!("translate({0} {0})", Px(MARGIN)))]);
    svg.raw(&body.finish());
    svg.finish()
}
