//! Drawing stacked bars.

use super::text::width;
use super::ticks::{self, Ticks};
use super::{Drawing, LINE, Size, paragraph, wrap};
use crate::axis::Layout;
use crate::palette::Palette;
use crate::xml::{Px, Xml};
use crate::{Axis, BarChart, NumberFormat, Scale};

/// Longest name of a bar before it is broken, in widths of the drawing.
const NAME: f64 = 0.36;

/// Draws a chart without its legend. Each bar's sum stands at its end.
pub(super) fn draw(chart: &BarChart, size: Size, palette: &Palette<'_>) -> Drawing {
    let Size { width: wide, font } = size;
    let number = |value| NumberFormat::Significant(3).format(value);
    let drawn = |value: &f64| if value.is_finite() { value.max(0.0) } else { 0.0 };
    let sums: Vec<f64> = chart.bars.iter().map(|bar| bar.values.iter().map(drawn).sum()).collect();
    let longest = sums.iter().copied().fold(0.0, f64::max);

    let mut svg = Xml::default();
    let top = paragraph(&mut svg, &chart.title, [0.0, 0.0], wide, font, "head") + 4.0;
    if longest == 0.0 {
        let bottom = paragraph(&mut svg, "no data", [0.0, top], wide, font, "small");
        let height = paragraph(&mut svg, &chart.label, [0.0, bottom], wide, font, "small") + 4.0;
        return Drawing { width: wide, height, font, label: chart.description(), body: svg.finish() };
    }

    let names: Vec<_> = chart.bars.iter().map(|bar| wrap(&bar.name, font, NAME * wide)).collect();
    let left = names.iter().flatten().map(|line| width(line, font)).fold(0.0, f64::max) + 10.0;
    let right = wide - sums.iter().map(|sum| width(&number(*sum), font)).fold(0.0, f64::max) - 10.0;
    let axis = Axis { range: Some([0.0, longest]), ..Axis::default() };
    let layout = Layout { scale: Scale::Linear, places: Layout::places(&axis, [0.0, longest]), pixels: [left, right] };
    let ticks = Ticks::new(Scale::Linear, layout.places, ((right - left) / 60.0) as usize);

    let high = |lines: &Vec<String>| (2.0 * font).max(LINE * font * lines.len() as f64 + 4.0);
    let bottom = top + names.iter().map(high).sum::<f64>() + 4.0;
    ticks.grid(&mut svg, &layout, [bottom, top], true);
    for (value, text) in &ticks.major {
        let x = layout.at(*value).unwrap_or(left);
        ticks::label(
            &mut svg,
            text,
            &[("x", &Px(x)), ("y", &Px(bottom + 1.1 * font)), ("text-anchor", &"middle")],
            font,
        );
    }

    let mut y = top + 2.0;
    for ((bar, lines), sum) in chart.bars.iter().zip(&names).zip(&sums) {
        let high = high(lines);
        let first = y + 0.5 * (high - LINE * font * lines.len() as f64);
        for (i, line) in lines.iter().enumerate() {
            let y = first + LINE * font * i as f64 + font;
            svg.element("text", &[("x", &Px(left - 8.0)), ("y", &Px(y)), ("text-anchor", &"end")], line);
        }
        let mut from = 0.0;
        for (part, value) in chart.parts.iter().zip(&bar.values).filter(|(_, value)| drawn(value) > 0.0) {
            let [start, end] = [from, from + value].map(|value| layout.at(value).unwrap_or(left));
            let class = format!("part s{}", palette.colour(part));
            svg.open(
                "rect",
                &[
                    ("x", &Px(start)),
                    ("y", &Px(y + 0.12 * high)),
                    ("width", &Px(end - start)),
                    ("height", &Px(0.76 * high)),
                    ("class", &class),
                ],
            );
            let title = format!("{}, {part}: {} ({:.0} %)", bar.name, number(*value), 100.0 * value / sum);
            svg.element("title", &[], &title);
            svg.close();
            from += value;
        }
        let end = layout.at(*sum).unwrap_or(left);
        svg.element(
            "text",
            &[("x", &Px(end + 5.0)), ("y", &Px(y + 0.5 * high + 0.35 * font)), ("class", &"small")],
            &number(*sum),
        );
        y += high;
    }
    svg.leaf("path", &[("class", &"box"), ("d", &format!("M{} {}V{}", Px(left), Px(top), Px(bottom)))]);
    let height =
        paragraph(&mut svg, &chart.label, [left, bottom + LINE * font + 2.0], wide - left, font, "small") + 4.0;
    Drawing { width: wide, height, font, label: chart.description(), body: svg.finish() }
}
