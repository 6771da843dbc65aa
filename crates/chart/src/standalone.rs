//! Figures as SVG files of their own.

use crate::draw::{self, Drawing, paragraph};
use crate::{Figure, Palette, Px, Xml, theme};

/// Margin around the figure, and distance of charts \[px\].
const MARGIN: f64 = 16.0;
/// Narrowest figure \[px\].
const NARROWEST: f64 = 480.0;

/// The figure with title, charts in at most two columns, legend and conditions, on a ground of its own.
pub(crate) fn svg(figure: &Figure) -> String {
    let palette = Palette::new([figure]);
    let drawings = draw::charts(&figure.charts, &palette);
    let first = drawings.iter().step_by(2).map(|drawing| drawing.width).fold(0.0, f64::max);
    let second = first + 1.5 * MARGIN;
    let right = drawings.iter().skip(1).step_by(2).map(|drawing| second + drawing.width);
    let width = right.chain([NARROWEST, first]).fold(0.0, f64::max);
    let font = drawings.first().map_or(14.0, |drawing| drawing.font);

    let mut body = Xml::default();
    body.open("g", &[("font-size", &Px(1.15 * font))]);
    let mut y = paragraph(&mut body, &figure.title, [0.0, 0.0], width, 1.15 * font, "head") + 0.5 * MARGIN;
    body.close();
    for row in drawings.chunks(2) {
        for (Drawing { body: drawing, .. }, x) in row.iter().zip([0.0, second]) {
            body.open("g", &[("transform", &format!("translate({} {})", Px(x), Px(y)))]);
            body.raw(drawing);
            body.close();
        }
        y += row.iter().map(|drawing| drawing.height).fold(0.0, f64::max) + 0.5 * MARGIN;
    }
    y = draw::columns(&mut body, &draw::entries(&figure.charts, &palette), y, width, font) + 0.5 * MARGIN;
    let conditions: Vec<_> = figure.conditions.iter().map(|(key, value)| format!("{key}: {value}")).collect();
    y = paragraph(&mut body, &conditions.join(" · "), [0.0, y], width, 0.9 * font, "small");

    let [wide, high] = [width, y].map(|length| (length + 2.0 * MARGIN).ceil());
    let view = format!("0 0 {wide} {high}");
    let mut svg = Xml::default();
    svg.open(
        "svg",
        &[
            ("xmlns", &"http://www.w3.org/2000/svg"),
            ("width", &wide),
            ("height", &high),
            ("viewBox", &view),
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
