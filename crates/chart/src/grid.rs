//! Tables of numbers as heat maps and as stacked bars.

use crate::axis::{Layout, draw_ticks, span};
use crate::drawing::Drawing;
use crate::palette::Palette;
use crate::text::{LINE, paragraph, significant, widest};
use crate::xml::{Px, Xml};

/// Weakest colour of a map of one colour: its smallest value is not a missing one.
const WEAKEST: f64 = 0.08;
/// Colours shown below a heat map.
const SHOWN: u8 = 21;

/// Numbers in rows and columns, printed in cells whose colours follow them.
#[derive(Clone, Debug, Default)]
pub struct HeatMap {
    /// A short title, or none.
    pub title: String,
    /// What the rows are.
    pub row_label: String,
    /// What the columns are.
    pub column_label: String,
    /// What the numbers are, with their unit.
    pub value_label: String,
    /// The rows' names, from above.
    pub rows: Vec<String>,
    /// The columns' names, from the left.
    pub columns: Vec<String>,
    /// The numbers, a list for each row; none where nothing was measured.
    pub values: Vec<Vec<Option<f64>>>,
    /// Where two colours meet, such as 1 for ratios: one for less and one for more, the stronger the farther away. If
    /// none, there is one colour, the stronger the larger.
    pub centre: Option<f64>,
}

/// Level bars, each the sum of the same parts: what a scene costs, stage by stage.
#[derive(Clone, Debug, Default)]
pub struct BarChart {
    /// A short title, or none.
    pub title: String,
    /// What the lengths are, with their unit.
    pub label: String,
    /// The parts' names, from the left.
    pub parts: Vec<String>,
    /// The bars, from above.
    pub bars: Vec<Bar>,
}

/// A bar.
#[derive(Clone, Debug)]
pub struct Bar {
    /// Its name.
    pub name: String,
    /// The length of each part. What is not finite or negative is not drawn, and stays in the CSV file.
    pub values: Vec<f64>,
}

/// Draws a heat map, below it all its colours. It is as wide as its columns need.
pub(crate) fn heat(chart: &HeatMap, font: f64) -> Drawing {
    let HeatMap { title, row_label, column_label, value_label, rows, columns, values, centre } = chart;
    let text = |value: &Option<f64>| value.map_or("–".into(), |value| significant(value, 3));
    let left = widest(rows, font) + 10.0;
    let wide = widest(values.iter().flatten().map(text), font).max(widest(columns, font)).max(2.4 * font) + 10.0;
    let high = 2.1 * font;
    let width = left + (wide * columns.len() as f64).max(20.0 * font);

    let mut svg = Xml::default();
    let mut y = paragraph(&mut svg, title, [0.0, 0.0], width, font, "head");
    let axes = [("↓", row_label), ("→", column_label)];
    let axes = axes.iter().filter(|(_, label)| !label.is_empty()).map(|(arrow, label)| format!("{arrow} {label}"));
    y = paragraph(&mut svg, &axes.collect::<Vec<_>>().join("  "), [0.0, y], width, 0.9 * font, "small")
        + 8.0
        + LINE * font;
    let x = |i: usize| left + wide * i as f64;
    for (i, name) in columns.iter().enumerate() {
        svg.label([x(i) + 0.5 * wide, y - 0.3 * font], "middle", "", name);
    }
    let all = span(values.iter().flatten().flatten().copied().filter(|value| value.is_finite()));
    for (row, values) in rows.iter().zip(values) {
        let foot = y + 0.5 * high + 0.35 * font;
        svg.label([left - 8.0, foot], "end", "", row);
        for (i, (column, value)) in columns.iter().zip(values).enumerate() {
            let number = value.filter(|value| value.is_finite()).zip(all);
            let (class, opacity) = number.map_or(("missing", "1".into()), |(value, all)| colour(value, all, *centre));
            let title = format!("{row}, {column}: {}", text(value));
            svg.rect([x(i), y, wide, high], &format!("cell {class}"), &opacity, &title);
            let class = if value.is_some() { "value" } else { "value small" };
            svg.label([x(i) + 0.5 * wide, foot], "middle", class, &text(value));
        }
        y += high;
    }
    let mut words = "no data".into();
    if let Some([low, high]) = all {
        let step = (width - left) / f64::from(SHOWN);
        for i in 0..SHOWN {
            let (class, opacity) =
                colour(low + (high - low) * f64::from(i) / f64::from(SHOWN - 1), [low, high], *centre);
            svg.rect([left + step * f64::from(i), y + 8.0, step, 6.0], class, &opacity, "");
        }
        words = format!("{} to {}, {value_label}", significant(low, 3), significant(high, 3));
    }
    let height = paragraph(&mut svg, &words, [left, y + 16.0], width - left, 0.9 * font, "small") + 4.0;
    let label =
        format!("Heat map {title}: {value_label}, {} {row_label}, {} {column_label}", rows.len(), columns.len());
    Drawing { size: [width + 1.0, height], font, label, body: svg }
}

/// Class and opacity of a value among all. A half of all colours stands for as much below the centre as above it.
fn colour(value: f64, [low, high]: [f64; 2], centre: Option<f64>) -> (&'static str, String) {
    let share = |part: f64, of: f64| if of == 0.0 { 0.0 } else { part / of };
    let (class, opacity) = match centre {
        None => ("heat", WEAKEST + (1.0 - WEAKEST) * share(value - low, high - low)),
        Some(centre) => {
            let far = (high - centre).max(centre - low);
            (if value < centre { "low" } else { "high" }, share((value - centre).abs(), far))
        }
    };
    (class, ((100.0 * opacity).round() / 100.0).to_string())
}

/// Draws stacked bars without their legend. Each bar's sum stands at its end.
pub(crate) fn bars(chart: &BarChart, [width, font]: [f64; 2], palette: &Palette<'_>) -> Drawing {
    let drawn = |value: &f64| if value.is_finite() { value.max(0.0) } else { 0.0 };
    let sum = |bar: &Bar| bar.values.iter().map(drawn).sum::<f64>();
    let number = |value| significant(value, 3);
    let longest = chart.bars.iter().map(sum).fold(0.0, f64::max);
    let left = (widest(chart.bars.iter().map(|bar| &bar.name), font) + 10.0).min(0.6 * width);
    let right = width - widest(chart.bars.iter().map(|bar| number(sum(bar))), font) - 10.0;
    let axis = Layout { log: false, places: [0.0, longest], pixels: [left, right] };
    let at = |value| axis.at(value).unwrap_or(left);

    let mut svg = Xml::default();
    let top = paragraph(&mut svg, &chart.title, [0.0, 0.0], width, font, "head") + 4.0;
    let high = 2.0 * font;
    let bottom = top + high * chart.bars.len() as f64 + 4.0;
    if longest > 0.0 {
        draw_ticks(&mut svg, &axis, ((right - left) / 60.0) as usize, [bottom, top], true, font);
    } else {
        svg.label([right, top + font], "end", "small", "no data");
    }
    for (i, bar) in chart.bars.iter().enumerate() {
        let y = top + high * i as f64 + 2.0;
        let foot = y + 0.5 * high + 0.35 * font;
        svg.label([left - 8.0, foot], "end", "", &bar.name);
        let mut from = 0.0;
        for (part, value) in chart.parts.iter().zip(&bar.values).filter(|(_, value)| drawn(value) > 0.0) {
            let title = format!("{}, {part}: {} ({:.0} %)", bar.name, number(*value), 100.0 * value / sum(bar));
            let sides = [at(from), y + 0.12 * high, at(from + value) - at(from), 0.76 * high];
            svg.rect(sides, &format!("part {}", palette.colour(part)), "", &title);
            from += value;
        }
        svg.label([at(from) + 5.0, foot], "", "small", &number(from));
    }
    svg.path("box", &format!("M{} {}V{}", Px(left), Px(top), Px(bottom)), "");
    let below = [left, bottom + LINE * font + 2.0];
    let height = paragraph(&mut svg, &chart.label, below, width - left, 0.9 * font, "small") + 4.0;
    let BarChart { title, label, parts, bars } = chart;
    let label = format!("Stacked bars {title}: {label}, {} bars of {} parts", bars.len(), parts.len());
    Drawing { size: [width, height], font, label, body: svg }
}
