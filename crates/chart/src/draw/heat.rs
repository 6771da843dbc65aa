//! Drawing heat maps.

use super::text::{LINE, lines, widest, wrap};
use super::{Drawing, Size, description, paragraph};
use crate::axis::span;
use crate::{HeatMap, Xml, significant};

/// Longest name of a row before it is broken \[px\].
const ROW_NAME: f64 = 150.0;
/// Weakest colour of a map of one colour: its smallest value is not a missing one.
const WEAKEST: f64 = 0.08;

/// Draws a heat map. It is as wide as its columns need.
pub(super) fn draw(chart: &HeatMap, size: Size) -> Drawing {
    let font = size.font;
    let text = |value: &Option<f64>| value.map_or("–".into(), |value| significant(value, 3));

    let names: Vec<_> = chart.rows.iter().map(|name| wrap(name, font, ROW_NAME)).collect();
    let left = widest(names.iter().flatten(), font) + 10.0;
    let numbers = widest(chart.values.iter().flatten().map(text), font);
    let words = widest(chart.columns.iter().flat_map(|name| name.split_whitespace()), font);
    let cell = (numbers + 14.0).max(words + 8.0).max(3.2 * font);
    let heads: Vec<_> = chart.columns.iter().map(|name| wrap(name, font, cell - 8.0)).collect();
    let wide = left + (cell * chart.columns.len() as f64).max(20.0 * font);

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

    let colour = colours(chart);
    for ((row, name), values) in chart.rows.iter().zip(&names).zip(&chart.values) {
        let high = (2.1 * font).max(LINE * font * name.len() as f64 + 6.0);
        lines(&mut svg, name, [left - 8.0, top + 0.5 * (high - LINE * font * name.len() as f64)], font, "end", "");
        for (i, (column, value)) in chart.columns.iter().zip(values).enumerate() {
            let x = left + cell * i as f64;
            let (class, opacity) = value.filter(|value| value.is_finite()).map_or(("missing", 1.0), &colour);
            let opacity = ((100.0 * opacity).round() / 100.0).to_string();
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
    let HeatMap { row_label, column_label, value_label, rows, columns, .. } = chart;
    let height = paragraph(&mut svg, value_label, [left, top + 10.0], wide - left, font, "small") + 4.0;
    let rest = format!("{value_label} by {row_label} ({}) and {column_label} ({})", rows.len(), columns.len());
    let label = description("Heat map", &chart.title, &rest);
    Drawing { width: wide + 1.0, height, font, label, body: svg.finish() }
}

/// Class and opacity of a value. A half of all colours stands for as much below the centre as above it.
fn colours(chart: &HeatMap) -> impl Fn(f64) -> (&'static str, f64) {
    let values = chart.values.iter().flatten().flatten().copied().filter(|value| value.is_finite());
    let ([low, high], centre) = (span(values).unwrap_or_default(), chart.centre);
    let share = |part: f64, of: f64| if of == 0.0 { 0.0 } else { part / of };
    move |value| match centre {
        None => ("heat", WEAKEST + (1.0 - WEAKEST) * share(value - low, high - low)),
        Some(centre) => {
            let far = (high - centre).max(centre - low);
            (if value < centre { "low" } else { "high" }, share((value - centre).abs(), far))
        }
    }
}
