//! Legends: which colour and which marker stand for which name.

use std::collections::BTreeSet;

use crate::charts::Charts;
use crate::marker::{LARGE, RADIUS, marker};
use crate::palette::Palette;
use crate::text::widest;
use crate::xml::{Px, Xml};

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
