//! Drawing heat maps.

use super::text::{width, wrap};
use super::{Drawing, LINE, Size, paragraph};
use crate::axis::span;
use crate::xml::{Px, Xml};
use crate::{ColourScale, HeatMap};

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
    let text = |value: Option<f64>| value.map_or("–".into(), |value| chart.format.format(value));

    let names: Vec<_> = chart.rows.iter().map(|name| wrap(name, font, ROW_NAME)).collect();
    let widest = |lines: &[String]| lines.iter().map(|line| width(line, font)).fold(0.0, f64::max);
    let left = names.iter().map(|lines| widest(lines)).fold(0.0, f64::max) + 10.0;
    let numbers = chart.values.iter().flatten().map(|value| width(&text(*value), font)).fold(0.0, f64::max);
    let words = chart.columns.iter().flat_map(|name| name.split_whitespace());
    let words = words.map(|word| width(word, font)).fold(0.0, f64::max);
    let cell = (numbers + 14.0).max(words + 8.0).max(3.2 * font);
    let heads: Vec<_> = chart.columns.iter().map(|name| wrap(name, font, cell - 8.0)).collect();
    let right = left + cell * chart.columns.len() as f64;
    let wide = right.max(left + BAR.0 + 10.0 * font);

    let mut svg = Xml::default();
    let mut top = paragraph(&mut svg, &chart.title, [0.0, 0.0], wide, font, "head");
    let axes = match (chart.row_label.as_str(), chart.column_label.as_str()) {
        ("", "") => String::new(),
        (rows, "") => format!("↓ {rows}"),
        ("", columns) => format!("→ {columns}"),
        (rows, columns) => format!("↓ {rows}  → {columns}"),
    };
    top = paragraph(&mut svg, &axes, [0.0, top], wide, font, "small") + 4.0;
    let lines = heads.iter().map(Vec::len).max().unwrap_or(0) as f64;
    for (i, head) in heads.iter().enumerate() {
        let x = left + cell * (i as f64 + 0.5);
        // Short names stand at the foot of the heading.
        let y = top + LINE * font * (lines - head.len() as f64);
        lines_about(&mut svg, head, [x, y], font, "middle");
    }
    top += LINE * font * lines + 4.0;

    for ((name, lines), values) in chart.rows.iter().zip(&names).zip(&chart.values) {
        let high = (2.1 * font).max(LINE * font * lines.len() as f64 + 6.0);
        lines_about(&mut svg, lines, [left - 8.0, top + 0.5 * (high - LINE * font * lines.len() as f64)], font, "end");
        for (i, (column, value)) in chart.columns.iter().zip(values).enumerate() {
            let x = left + cell * i as f64;
            let (class, opacity) = value.and_then(|value| colours.of(value)).unwrap_or(("missing", 1.0));
            let place: [(&str, &dyn std::fmt::Display); 4] =
                [("x", &Px(x)), ("y", &Px(top)), ("width", &Px(cell)), ("height", &Px(high))];
            svg.leaf("rect", &[&place[..], &[("class", &"ground")]].concat());
            let opacity = (100.0 * opacity).round() / 100.0;
            svg.open(
                "rect",
                &[&place[..], &[("class", &format!("cell {class}")), ("fill-opacity", &opacity)]].concat(),
            );
            svg.element("title", &[], &format!("{name}, {column}: {}", text(*value)));
            svg.close();
            let class = if value.is_some() { "" } else { "small" };
            let at = [x + 0.5 * cell, top + 0.5 * high + 0.35 * font];
            svg.element(
                "text",
                &[
                    ("x", &Px(at[0])),
                    ("y", &Px(at[1])),
                    ("text-anchor", &"middle"),
                    ("class", &class),
                    ("pointer-events", &"none"),
                ],
                &text(*value),
            );
        }
        top += high;
    }
    if chart.values.iter().flatten().all(Option::is_none) {
        top = paragraph(&mut svg, "no data", [0.0, top + 4.0], wide, font, "small");
    }
    let height = colours.explain(&mut svg, [left, top + 10.0], wide - left, font) + 4.0;
    Drawing { width: wide + 1.0, height, font, label: chart.description(), body: svg.finish() }
}

/// Lines of text below one another from `y` on, about `x`.
fn lines_about(svg: &mut Xml, lines: &[String], [x, y]: [f64; 2], font: f64, anchor: &str) {
    for (i, line) in lines.iter().enumerate() {
        let y = y + LINE * font * i as f64 + font;
        svg.element("text", &[("x", &Px(x)), ("y", &Px(y)), ("text-anchor", &anchor)], line);
    }
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
        let ends = span(values.filter_map(|value| chart.scale.place(*value)));
        let centre = match chart.colours {
            ColourScale::Sequential => None,
            ColourScale::Diverging { centre } => chart.scale.place(centre),
        };
        let ends = match centre {
            Some(centre) => ends.map(|[low, high]| {
                let far = (high - centre).max(centre - low);
                [centre - far, centre + far]
            }),
            None => ends,
        };
        Self { chart, ends, centre }
    }

    /// Class and opacity of a value; `None` if it has no place on the scale.
    fn of(&self, value: f64) -> Option<(&'static str, f64)> {
        Some(self.at(self.chart.scale.place(value)?))
    }

    fn at(&self, place: f64) -> (&'static str, f64) {
        let [low, high] = self.ends.unwrap_or([place; 2]);
        let share = |from: f64, to: f64| if to == from { 0.0 } else { ((place - from) / (to - from)).clamp(0.0, 1.0) };
        match self.centre {
            None => ("heat", WEAKEST + (1.0 - WEAKEST) * share(low, high)),
            Some(centre) if place < centre => ("low", share(centre, low)),
            Some(centre) => ("high", share(centre, high)),
        }
    }

    /// Draws a bar of all colours with the values at its ends and what they are, in `room` \[px\]; returns its bottom.
    fn explain(&self, svg: &mut Xml, [x, y]: [f64; 2], room: f64, font: f64) -> f64 {
        let chart = self.chart;
        let Some([low, high]) = self.ends.filter(|[low, high]| high > low) else {
            return paragraph(svg, &chart.value_label, [x, y], room, font, "small");
        };
        let (length, steps) = BAR;
        let step = length / f64::from(steps);
        let print = |place: f64| chart.format.format(chart.scale.value(place));
        let start = x + width(&print(low), font) + 6.0;
        for i in 0..steps {
            let (class, opacity) = self.at(low + (high - low) * (f64::from(i) + 0.5) / f64::from(steps));
            let opacity = (100.0 * opacity).round() / 100.0;
            let x = start + step * f64::from(i);
            svg.leaf(
                "rect",
                &[
                    ("x", &Px(x)),
                    ("y", &Px(y + 1.0)),
                    ("width", &Px(step)),
                    ("height", &Px(font)),
                    ("class", &class),
                    ("fill-opacity", &opacity),
                ],
            );
        }
        let end = start + length;
        svg.leaf(
            "rect",
            &[("x", &Px(start)), ("y", &Px(y + 1.0)), ("width", &Px(length)), ("height", &Px(font)), ("class", &"box")],
        );
        svg.element(
            "text",
            &[("x", &Px(start - 6.0)), ("y", &Px(y + font)), ("text-anchor", &"end"), ("class", &"small")],
            &print(low),
        );
        svg.element("text", &[("x", &Px(end + 6.0)), ("y", &Px(y + font)), ("class", &"small")], &print(high));
        let mut bottom = y + LINE * font;
        if let Some(centre) = self.centre {
            svg.element(
                "text",
                &[
                    ("x", &Px(0.5 * (start + end))),
                    ("y", &Px(bottom + font)),
                    ("text-anchor", &"middle"),
                    ("class", &"small"),
                ],
                &print(centre),
            );
            bottom += LINE * font;
        }
        paragraph(svg, &chart.value_label, [x, bottom], room, font, "small")
    }
}
