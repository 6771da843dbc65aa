//! Which colour and which marker a series has, and legends that say so.

use std::collections::{BTreeMap, BTreeSet};

use crate::text::widest;
use crate::{Charts, Figure, Px, Xml};

/// Radius of a marker \[px\].
pub(crate) const RADIUS: f64 = 3.2;
/// Radius of a marker that stands out \[px\].
pub(crate) const LARGE: f64 = 5.6;

/// Paths about (0, 0), all of about one area: circle, square, triangle, diamond, triangle upside down, stars of four and
/// five. With no factor in common with the number of colours, 70 series in a row differ in colour, shape or both.
const SHAPES: [&str; 7] = [
    "M-1 0a1 1 0 1 0 2 0a1 1 0 1 0-2 0z",
    "M-.9-.9H.9V.9H-.9z",
    "M0-1.4 1.2.7H-1.2z",
    "M0-1.35 1.35 0 0 1.35-1.35 0z",
    "M0 1.4 1.2-.7H-1.2z",
    "M1.6 0 .44.44 0 1.6-.44.44-1.6 0-.44-.44 0-1.6 .44-.44z",
    "M0-1.5 .38-.53 1.43-.46 .62.2 .88 1.21 0 .65-.88 1.21-.62.2-1.43-.46-.38-.53z",
];

/// Draws marker number `shape` with what is read under the mouse.
pub(crate) fn marker(svg: &mut Xml, shape: usize, [x, y]: [f64; 2], radius: f64, class: &str, title: &str) {
    let place = format!("translate({} {})scale({radius})", Px(x), Px(y));
    svg.shape("path", &[("class", &class), ("transform", &place), ("d", &SHAPES[shape % SHAPES.len()])], title);
}

/// Colours there are. See [`crate::theme`].
pub(crate) const COLOURS: usize = 10;

/// Colours and markers of all series of a page, given in turn to each key at its first appearance.
#[derive(Default)]
pub struct Palette<'a> {
    colours: BTreeMap<&'a str, usize>,
    markers: BTreeMap<&'a str, usize>,
}

impl<'a> Palette<'a> {
    /// The palette of `figures`, in their order.
    pub fn new(figures: impl IntoIterator<Item = &'a Figure>) -> Self {
        let mut palette = Self::default();
        for figure in figures {
            match &figure.charts {
                Charts::Lines(charts) => charts.iter().flat_map(|chart| &chart.series).for_each(|series| {
                    enter(&mut palette.colours, series.colour_key());
                    enter(&mut palette.markers, &series.name);
                }),
                Charts::Heat(_) => {}
                Charts::Bars(charts) => {
                    charts.iter().flat_map(|chart| &chart.parts).for_each(|part| enter(&mut palette.colours, part));
                }
            }
        }
        palette
    }

    /// Class of the colour of `key`.
    pub(crate) fn colour(&self, key: &str) -> String {
        format!("s{}", self.colours.get(key).map_or(0, |i| i % COLOURS))
    }

    /// Number of the marker of `key`.
    pub(crate) fn marker(&self, key: &str) -> usize {
        self.markers.get(key).copied().unwrap_or(0)
    }
}

fn enter<'a>(indices: &mut BTreeMap<&'a str, usize>, key: &'a str) {
    let next = indices.len();
    indices.entry(key).or_insert(next);
}

/// Width and height of a sample \[px\].
const SAMPLE: [f64; 2] = [30.0, 14.0];

/// Names and samples for all charts of a figure, each name once.
pub(crate) fn entries<'a>(charts: &'a Charts, palette: &Palette<'_>) -> Vec<(&'a str, Xml)> {
    let mut entries: Vec<(&str, Xml)> = Vec::new();
    let centre = SAMPLE.map(|length| length / 2.0);
    match charts {
        Charts::Lines(charts) => {
            for series in charts.iter().flat_map(|chart| &chart.series) {
                let mut svg = Xml::default();
                svg.path(series.class(), "M1 7h28", "");
                if series.markers {
                    marker(&mut svg, palette.marker(&series.name), centre, RADIUS + 0.6, "marker", "");
                }
                entries.push((&series.name, Xml::nest("g", &[("class", &palette.colour(series.colour_key()))], [svg])));
            }
            for name in charts.iter().filter_map(|chart| chart.emphasis.as_ref()) {
                let mut svg = Xml::default();
                marker(&mut svg, 0, centre, LARGE, "marker emphasis neutral", "");
                entries.push((name, svg));
            }
        }
        Charts::Heat(_) => {}
        Charts::Bars(charts) => {
            for part in charts.iter().flat_map(|chart| &chart.parts) {
                let mut svg = Xml::default();
                svg.rect([4.0, 1.0, 22.0, 12.0], &format!("part {}", palette.colour(part)), "", "");
                entries.push((part, svg));
            }
        }
    }
    let mut seen = BTreeSet::new();
    entries.retain(|(name, _)| seen.insert(*name));
    entries
}

/// The legend as a list of a page; nothing where it has no entries.
pub(crate) fn list(entries: &[(&str, Xml)]) -> Xml {
    let view = format!("0 0 {} {}", SAMPLE[0], SAMPLE[1]);
    let items = entries.iter().map(|(name, sample)| {
        let look = [("class", &"chart" as _), ("viewBox", &view as _), ("aria-hidden", &"true" as _)];
        Xml::nest("li", &[], [Xml::nest("svg", &look, [sample.clone()]), Xml::text(name)])
    });
    if entries.is_empty() { Xml::default() } else { Xml::nest("ul", &[("class", &"legend")], items) }
}

/// The legend in columns, the names below one another, in a drawing of width `room` \[px\], from (0, `y`) on; returns its
/// bottom.
pub(crate) fn columns(svg: &mut Xml, entries: &[(&str, Xml)], y: f64, room: f64, font: f64) -> f64 {
    let height = 1.5 * font;
    let wide = SAMPLE[0] + widest(entries.iter().map(|(name, _)| name), font) + 20.0;
    let rows = entries.len().div_ceil(((room / wide) as usize).max(1));
    for (i, (name, sample)) in entries.iter().enumerate() {
        let (x, y) = (wide * (i / rows) as f64, y + height * (i % rows) as f64);
        let place = format!("translate({} {})", Px(x), Px(y + (height - SAMPLE[1]) / 2.0));
        svg.push(Xml::nest("g", &[("transform", &place)], [sample.clone()]));
        svg.label([x + SAMPLE[0] + 6.0, y + 0.5 * height + 0.35 * font], "", "", name);
    }
    y + height * rows as f64
}
