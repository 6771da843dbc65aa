//! Drawing heat maps.

use super::text::{LINE, lines, widest, width, wrap};
use super::{Drawing, Size, description, paragraph};
use crate::axis::span;
use crate::{ColourScale, HeatMap, Xml};

/// Longest name of a row before it is broken \[px\].
const ROW_NAME: f64 = 150.0;
/// Width of the bar that explains the colours \[px\], and how many steps it has.
const BAR: (f64, u32) = (140.0, 28);
/// Weakest colour of a sequential scale: its smallest value is not a missing one.
const WEAKEST: f64 = 0.08;

/// Draws a heat map. It is as wide as its columns need.
pub(super) fn draw(chart: &HeatMap, size: Size) -> Drawing {
    let font = size.font;
    let colours = Colours::new(chart);
    let text = |value: &Option<f64>| value.map_or("–".into(), |value| chart.format.format(value));

    let names: Vec<_> = chart.rows.iter().map(|name| wrap(name, font, ROW_NAME)).collect();
    let left = widest(names.iter().flatten(), font) + 10.0;
    let numbers = widest(chart.values.iter().flatten().map(text), font);
    let words = widest(chart.columns.iter().flat_map(|name| name.split_whitespace()), font);
    let cell = (numbers + 14.0).max(words + 8.0).max(3.2 * font);
    let heads: Vec<_> = chart.columns.iter().map(|name| wrap(name, font, cell - 8.0)).collect();
    let right = left + cell * chart.columns.len() as f64;
    let wide = right.max(left + BAR.0 + 10.0 * font);

    let mut svg = Xml::default();
    let mut top = paragraph(&mut svg, &chart.title, [0.0, 0.0], wide, font, "head");
    let axes = [("↓", &chart.row_label), ("→", &chart.column_label)];
    let axes = axes.iter().filter(|(_, label)| !label.is_empty()).map(|(arrow, label)| format!("{arrow} {label}"));
    top = paragraph(&mut svg, &axes.collect::<Vec<_>>().join("  "), [0.0, top], wide, font, "small") + 4.0;
    let foot = top + LINE * font * heads.iter().map(Vec::len).max().unwrap_or(0) as f64;
    for (i, head) in heads.iter().enumerate() {
        let at = [left + cell * (i as f64 + 0.5), foot - LINE * font * head.len() as f64];
        lines(&mut svg, head, at, font, "middle", "");
    }
    top = foot + 4.0;

    for ((row, name), values) in chart.rows.iter().zip(&names).zip(&chart.values) {
        let high = (2.1 * font).max(LINE * font * name.len() as f64 + 6.0);
        lines(&mut svg, name, [left - 8.0, top + 0.5 * (high - LINE * font * name.len() as f64)], font, "end", "");
        for (i, (column, value)) in chart.columns.iter().zip(values).enumerate() {
            let x = left + cell * i as f64;
            let (class, opacity) = value.and_then(|value| colours.of(value)).unwrap_or(("missing", "1".into()));
            svg.rect([x, top, cell, high], "ground", "", "");
            let title = format!("{row}, {column}: {}", text(value));
            svg.rect([x, top, cell, high], &format!("cell {class}"), &opacity, &title);
            let class = if value.is_some() { "value" } else { "value small" };
            svg.label([x + 0.5 * cell, top + 0.5 * high + 0.35 * font], "middle", class, &text(value));
        }
        top += high;
    }
    if chart.values.iter().flatten().all(Option::is_none) {
        top = paragraph(&mut svg, "no data", [0.0, top + 4.0], wide, font, "small");
    }
    let height = colours.explain(&mut svg, [left, top + 10.0], wide - left, font) + 4.0;
    let (rows, columns) = (chart.rows.len(), chart.columns.len());
    let HeatMap { row_label, column_label, value_label, .. } = chart;
    let rest = format!("{value_label} by {row_label} ({rows}) and {column_label} ({columns})");
    let label = description("Heat map", &chart.title, &rest);
    Drawing { width: wide + 1.0, height, font, label, body: svg.finish() }
}

/// How colours follow values.
struct Colours<'a> {
    chart: &'a HeatMap,
    /// First and last place on the scale, the same distance from the centre if there is one.
    ends: Option<[f64; 2]>,
    centre: Option<f64>,
}

impl<'a> Colours<'a> {
    fn new(chart: &'a HeatMap) -> Self {
        let values = chart.values.iter().flatten().flatten();
        let mut ends = span(values.filter_map(|value| chart.scale.place(*value)));
        let centre = match chart.colours {
            ColourScale::Sequential => None,
            ColourScale::Diverging { centre } => chart.scale.place(centre),
        };
        if let (Some([low, high]), Some(centre)) = (ends, centre) {
            let far = (high - centre).max(centre - low);
            ends = Some([centre - far, centre + far]);
        }
        Self { chart, ends, centre }
    }

    /// Class and opacity of a value; `None` if it has no place on the scale.
    fn of(&self, value: f64) -> Option<(&'static str, String)> {
        Some(self.at(self.chart.scale.place(value)?))
    }

    fn at(&self, place: f64) -> (&'static str, String) {
        let [low, high] = self.ends.unwrap_or([place; 2]);
        let share = |from: f64, to: f64| if to == from { 0.0 } else { ((place - from) / (to - from)).clamp(0.0, 1.0) };
        let (class, opacity) = match self.centre {
            None => ("heat", WEAKEST + (1.0 - WEAKEST) * share(low, high)),
            Some(centre) if place < centre => ("low", share(centre, low)),
            Some(centre) => ("high", share(centre, high)),
        };
        (class, ((100.0 * opacity).round() / 100.0).to_string())
    }

    /// Draws a bar of all colours with the values at its ends and what they are, in `room` \[px\]; returns its bottom.
    fn explain(&self, svg: &mut Xml, [x, y]: [f64; 2], room: f64, font: f64) -> f64 {
        let chart = self.chart;
        let Some([low, high]) = self.ends.filter(|[low, high]| high > low) else {
            return paragraph(svg, &chart.value_label, [x, y], room, font, "small");
        };
        let (length, steps) = BAR;
        let print = |place: f64| chart.format.format(chart.scale.value(place));
        let start = x + width(&print(low), font) + 6.0;
        for i in 0..steps {
            let (class, opacity) = self.at(low + (high - low) * (f64::from(i) + 0.5) / f64::from(steps));
            let step = length / f64::from(steps);
            svg.rect([start + step * f64::from(i), y + 1.0, step, font], class, &opacity, "");
        }
        svg.rect([start, y + 1.0, length, font], "box", "", "");
        svg.label([start - 6.0, y + font], "end", "small", &print(low));
        svg.label([start + length + 6.0, y + font], "", "small", &print(high));
        let mut bottom = y + LINE * font;
        if let Some(centre) = self.centre {
            svg.label([start + 0.5 * length, bottom + font], "middle", "small", &print(centre));
            bottom += LINE * font;
        }
        paragraph(svg, &chart.value_label, [x, bottom], room, font, "small")
    }
}
