//! Drawing stacked bars.

use super::text::{LINE, lines, widest, wrap};
use super::ticks::{self, Ticks};
use super::{Drawing, Size, description, paragraph};
use crate::axis::Layout;
use crate::{BarChart, Palette, Px, Scale, Xml, significant};

/// Longest name of a bar before it is broken, in widths of the drawing.
const NAME: f64 = 0.36;

/// Draws a chart without its legend. Each bar's sum stands at its end.
pub(super) fn draw(chart: &BarChart, size: Size, palette: &Palette<'_>) -> Drawing {
    let Size { width: wide, font } = size;
    let number = |value: &f64| significant(*value, 3);
    let drawn = |value: &f64| if value.is_finite() { value.max(0.0) } else { 0.0 };
    let sums: Vec<f64> = chart.bars.iter().map(|bar| bar.values.iter().map(drawn).sum()).collect();
    let longest = sums.iter().copied().fold(0.0, f64::max);
    let rest = format!("{}, {} bars of {} parts", chart.label, chart.bars.len(), chart.parts.len());
    let label = description("Stacked bars", &chart.title, &rest);

    let mut svg = Xml::default();
    let top = paragraph(&mut svg, &chart.title, [0.0, 0.0], wide, font, "head") + 4.0;
    if longest == 0.0 {
        let bottom = paragraph(&mut svg, "no data", [0.0, top], wide, font, "small");
        let height = paragraph(&mut svg, &chart.label, [0.0, bottom], wide, font, "small") + 4.0;
        return Drawing { width: wide, height, font, label, body: svg.finish() };
    }

    let names: Vec<_> = chart.bars.iter().map(|bar| wrap(&bar.name, font, NAME * wide)).collect();
    let left = widest(names.iter().flatten(), font) + 10.0;
    let right = wide - widest(sums.iter().map(number), font) - 10.0;
    let layout = Layout { scale: Scale::Linear, places: [0.0, longest], pixels: [left, right] };
    let ticks = Ticks::new(Scale::Linear, layout.places, ((right - left) / 60.0) as usize);

    let high = |lines: &[String]| (2.0 * font).max(LINE * font * lines.len() as f64 + 4.0);
    let bottom = top + names.iter().map(|lines| high(lines)).sum::<f64>() + 4.0;
    ticks.grid(&mut svg, &layout, [bottom, top], true);
    for (value, text) in &ticks.major {
        ticks::label(&mut svg, text, [layout.at(*value).unwrap_or(left), bottom + 1.1 * font], "middle", font);
    }

    let mut y = top + 2.0;
    for ((bar, name), sum) in chart.bars.iter().zip(&names).zip(&sums) {
        let high = high(name);
        lines(&mut svg, name, [left - 8.0, y + 0.5 * (high - LINE * font * name.len() as f64)], font, "end", "");
        let mut from = 0.0;
        for (part, value) in chart.parts.iter().zip(&bar.values).filter(|(_, value)| drawn(value) > 0.0) {
            let [start, end] = [from, from + value].map(|value| layout.at(value).unwrap_or(left));
            let title = format!("{}, {part}: {} ({:.0} %)", bar.name, number(value), 100.0 * value / sum);
            let class = format!("part {}", palette.colour(part));
            svg.rect([start, y + 0.12 * high, end - start, 0.76 * high], &class, "", &title);
            from += value;
        }
        let end = layout.at(*sum).unwrap_or(left);
        svg.label([end + 5.0, y + 0.5 * high + 0.35 * font], "", "small", &number(sum));
        y += high;
    }
    svg.path("box", &format!("M{} {}V{}", Px(left), Px(top), Px(bottom)), "");
    let below = [left, bottom + LINE * font + 2.0];
    let height = paragraph(&mut svg, &chart.label, below, wide - left, font, "small") + 4.0;
    Drawing { width: wide, height, font, label, body: svg.finish() }
}
