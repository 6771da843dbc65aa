//! Legends: beside the plotting area, in the page or in an SVG file.

use super::marker::{self, LARGE, RADIUS};
use super::text::widest;
use crate::{Charts, Palette, Px, Xml};

/// Width and height of a sample \[px\].
const SAMPLE: [f64; 2] = [30.0, 14.0];

/// An entry of a legend.
pub(crate) struct Entry {
    name: String,
    sample: Sample,
}

/// What stands for a name. Colours are classes.
enum Sample {
    Line { colour: String, class: &'static str, marker: Option<usize> },
    Part { colour: String },
    Emphasis,
}

/// The entries for all charts of a figure, each name once.
pub(crate) fn entries(charts: &Charts, palette: &Palette<'_>) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    let mut add = |name: &str, sample| {
        if entries.iter().all(|entry| entry.name != name) {
            entries.push(Entry { name: name.into(), sample });
        }
    };
    match charts {
        Charts::Lines(charts) => {
            for series in charts.iter().flat_map(|chart| &chart.series) {
                let marker = series.markers.then(|| palette.marker(&series.name));
                let colour = palette.colour(series.colour_key());
                add(&series.name, Sample::Line { colour, class: series.class(), marker });
            }
            charts.iter().filter_map(|chart| chart.emphasis.as_ref()).for_each(|text| add(text, Sample::Emphasis));
        }
        Charts::Heat(_) => {}
        Charts::Bars(charts) => {
            let parts = charts.iter().flat_map(|chart| &chart.parts);
            parts.for_each(|part| add(part, Sample::Part { colour: palette.colour(part) }));
        }
    }
    entries
}

/// The legend as a list of a page; nothing where it has no entries.
pub(crate) fn list(xml: &mut Xml, entries: &[Entry]) {
    if entries.is_empty() {
        return;
    }
    xml.open("ul", &[("class", &"legend")]);
    for entry in entries {
        xml.open("li", &[]);
        let view = format!("0 0 {} {}", SAMPLE[0], SAMPLE[1]);
        xml.open("svg", &[("class", &"chart"), ("viewBox", &view), ("aria-hidden", &"true")]);
        sample(xml, &entry.sample, [0.0, 0.0]);
        xml.close();
        xml.text(&entry.name);
        xml.close();
        xml.line();
    }
    xml.close();
}

/// The legend in columns, the names below one another, in a drawing of width `room` \[px\], from (0, `y`) on; returns its bottom.
pub(crate) fn columns(svg: &mut Xml, entries: &[Entry], y: f64, room: f64, font: f64) -> f64 {
    let height = 1.5 * font;
    let wide = SAMPLE[0] + widest(entries.iter().map(|entry| &entry.name), font) + 20.0;
    let rows = entries.len().div_ceil(((room / wide) as usize).max(1));
    for (i, entry) in entries.iter().enumerate() {
        let (x, y) = (wide * (i / rows) as f64, y + height * (i % rows) as f64);
        sample(svg, &entry.sample, [x, y + (height - SAMPLE[1]) / 2.0]);
        svg.label([x + SAMPLE[0] + 6.0, y + 0.5 * height + 0.35 * font], "", "", &entry.name);
    }
    y + height * rows as f64
}

fn sample(svg: &mut Xml, sample: &Sample, [x, y]: [f64; 2]) {
    let [wide, high] = SAMPLE;
    let centre = [x + wide / 2.0, y + high / 2.0];
    match sample {
        Sample::Line { colour, class, marker } => {
            svg.open("g", &[("class", colour)]);
            svg.path(class, &format!("M{} {}h{}", Px(x + 1.0), Px(centre[1]), Px(wide - 2.0)), "");
            if let Some(shape) = marker {
                marker::draw(svg, *shape, centre, RADIUS + 0.6, "marker", "");
            }
            svg.close();
        }
        Sample::Part { colour } => {
            svg.rect([x + 4.0, y + 1.0, wide - 8.0, high - 2.0], &format!("part {colour}"), "", "");
        }
        Sample::Emphasis => marker::draw(svg, 0, centre, LARGE, "marker emphasis neutral", ""),
    }
}
