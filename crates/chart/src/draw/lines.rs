//! Drawing curves.

use super::legend::line_class;
use super::marker::{self, LARGE, RADIUS};
use super::text::LINE;
use super::ticks::{self, Ticks};
use super::{Drawing, Size, description, paragraph};
use crate::axis::{Layout, span};
use crate::{Aspect, LineChart, LineStyle, NumberFormat, Palette, Point, Px, Reference, Series, Xml, polyline};

/// Points of a curve that are marked at most, beside those that stand out.
const MARKED: usize = 40;
/// Height of the plotting area, in its widths.
const HEIGHT: f64 = 0.72;
/// The same for equal scales on both axes, at least and at most.
const HEIGHT_EQUAL: [f64; 2] = [0.35, 1.2];

/// Draws a chart without its legend.
pub(super) fn draw(chart: &LineChart, size: Size, palette: &Palette<'_>) -> Drawing {
    let Size { width, font } = size;
    let mut svg = Xml::default();
    let mut top = paragraph(&mut svg, &chart.title, [0.0, 0.0], width, font, "head");
    top = paragraph(&mut svg, &chart.y.label, [0.0, top], width, font, "small") + 6.0;

    let right = width - 14.0;
    let (mut left, mut bottom) = (1.0, top + 0.4 * width);
    match spans(chart) {
        None => {
            svg.rect([left, top, right - left, bottom - top], "box", "", "");
            svg.label([0.5 * right, 0.5 * (top + bottom)], "middle", "small", "no data");
        }
        Some(places) => {
            let axes = layout(chart, places, [top, right], size);
            (left, bottom) = (axes.x.pixels[0], axes.y.pixels[0]);
            grid(&mut svg, &axes, font);
            // A drawing of its own cuts off what reaches over the edge.
            let sides = [left, top, right - left, bottom - top];
            let [x, y, wide, high] = sides.map(Px);
            let view = format!("{x} {y} {wide} {high}");
            svg.open("svg", &[("x", &x), ("y", &y), ("width", &wide), ("height", &high), ("viewBox", &view)]);
            chart.references.iter().for_each(|reference| line_across(&mut svg, reference, &axes));
            chart.series.iter().for_each(|series| curve(&mut svg, series, &axes, palette));
            svg.close();
            svg.rect(sides, "box", "", "");
            reference_labels(&mut svg, chart, &axes, font);
        }
    }
    let below = [left, bottom + LINE * font + 4.0];
    let height = paragraph(&mut svg, &chart.x.label, below, width - left, font, "small") + 4.0;
    let rest = format!("{} over {}, {} series", chart.y.label, chart.x.label, chart.series.len());
    Drawing { width, height, font, label: description("Line chart", &chart.title, &rest), body: svg.finish() }
}

/// A chart's axes on the drawing.
struct Axes {
    x: Layout,
    y: Layout,
    x_ticks: Ticks,
    y_ticks: Ticks,
}

/// The places on both axes that the data take up; `None` if no point can be drawn.
fn spans(chart: &LineChart) -> Option<[[f64; 2]; 2]> {
    let points = chart.series.iter().flat_map(|series| &series.points);
    let placed = points.filter_map(|p| Some((chart.x.scale.place(p.x)?, chart.y.scale.place(p.y)?, p)));
    let (mut xs, mut ys) = (Vec::new(), Vec::new());
    for (x, y, point) in placed {
        xs.push(x);
        ys.push(y);
        ys.extend(point.band.iter().flatten().filter_map(|value| chart.y.scale.place(*value)));
    }
    if xs.is_empty() {
        return None;
    }
    for reference in &chart.references {
        match reference {
            Reference::Vertical { x, .. } => xs.extend(chart.x.scale.place(*x)),
            Reference::Horizontal { y, .. } => ys.extend(chart.y.scale.place(*y)),
        }
    }
    Some([span(xs.into_iter())?, span(ys.into_iter())?])
}

/// Axes over the given places, with the plotting area's upper right corner at `corner`, read as \[top, right\].
fn layout(chart: &LineChart, places: [[f64; 2]; 2], [top, right]: [f64; 2], size: Size) -> Axes {
    let Size { width, font } = size;
    let mut x_places = Layout::places(&chart.x, places[0]);
    let mut y_places = Layout::places(&chart.y, places[1]);
    // As many ticks as a usual area takes, to know the room that their labels need.
    let label = Ticks::new(chart.y.scale, y_places, 6).width(font).max(2.0 * font);
    let left = label + 8.0;
    let wide = right - left;
    let mut high = HEIGHT * wide;
    if chart.aspect == Aspect::Equal {
        let [dx, dy] = [x_places[1] - x_places[0], y_places[1] - y_places[0]];
        high = wide * (dy / dx).clamp(HEIGHT_EQUAL[0], HEIGHT_EQUAL[1]);
        let unit = (dx / wide).max(dy / high);
        x_places = about_middle(x_places, unit * wide);
        y_places = about_middle(y_places, unit * high);
    }
    let bottom = top + high;
    let x_label = if width < 400.0 { 52.0 } else { 64.0 };
    Axes {
        x: Layout { scale: chart.x.scale, places: x_places, pixels: [left, right] },
        y: Layout { scale: chart.y.scale, places: y_places, pixels: [bottom, top] },
        x_ticks: Ticks::new(chart.x.scale, x_places, (wide / x_label) as usize),
        y_ticks: Ticks::new(chart.y.scale, y_places, (high / 40.0) as usize),
    }
}

/// An interval of length `length` about the middle of another.
fn about_middle([low, high]: [f64; 2], length: f64) -> [f64; 2] {
    let middle = 0.5 * (low + high);
    [middle - 0.5 * length, middle + 0.5 * length]
}

fn grid(svg: &mut Xml, axes: &Axes, font: f64) {
    let (left, bottom) = (axes.x.pixels[0], axes.y.pixels[0]);
    axes.x_ticks.grid(svg, &axes.x, axes.y.pixels, true);
    axes.y_ticks.grid(svg, &axes.y, axes.x.pixels, false);
    for (x, text) in axes.x_ticks.major.iter().filter_map(|(value, text)| Some((axes.x.at(*value)?, text))) {
        ticks::label(svg, text, [x, bottom + 1.1 * font + 2.0], "middle", font);
    }
    for (y, text) in axes.y_ticks.major.iter().filter_map(|(value, text)| Some((axes.y.at(*value)?, text))) {
        ticks::label(svg, text, [left - 6.0, y + 0.35 * font], "end", font);
    }
}

fn line_across(svg: &mut Xml, reference: &Reference, axes: &Axes) {
    let ([left, right], [bottom, top]) = (axes.x.pixels, axes.y.pixels);
    let ends = match reference {
        Reference::Vertical { x, .. } => axes.x.at(*x).map(|x| [[x, bottom], [x, top]]),
        Reference::Horizontal { y, .. } => axes.y.at(*y).map(|y| [[left, y], [right, y]]),
    };
    svg.path("reference", &polyline(ends.into_iter().flatten()), "");
}

/// Labels inside of the plotting area: those of upright lines beside them at the top, one below the other; those of level
/// lines above them at the right.
fn reference_labels(svg: &mut Xml, chart: &LineChart, axes: &Axes, font: f64) {
    let ([left, right], [_, top]) = (axes.x.pixels, axes.y.pixels);
    let mut next = top + font + 2.0;
    for reference in &chart.references {
        let (label, x, y, anchor) = match reference {
            Reference::Vertical { x, label } if axes.x.holds(*x) => {
                let Some(x) = axes.x.at(*x) else { continue };
                let y = next;
                next += LINE * font;
                if x > 0.5 * (left + right) { (label, x - 5.0, y, "end") } else { (label, x + 5.0, y, "start") }
            }
            Reference::Horizontal { y, label } if axes.y.holds(*y) => {
                let Some(y) = axes.y.at(*y) else { continue };
                (label, right - 5.0, if y - font < top { y + font } else { y - 5.0 }, "end")
            }
            _ => continue,
        };
        svg.label([x, y], anchor, "small halo", label);
    }
}

/// A point that can be drawn, and where.
struct Placed<'a> {
    at: [f64; 2],
    band: Option<[f64; 2]>,
    point: &'a Point,
}

/// Draws a curve: its bands, its lines and its markers.
fn curve(svg: &mut Xml, series: &Series, axes: &Axes, palette: &Palette<'_>) {
    let placed = series.points.iter().map(|point| {
        let at = [axes.x.at(point.x)?, axes.y.at(point.y)?];
        let band = point.band.and_then(|[low, high]| Some([axes.y.at(low)?, axes.y.at(high)?]));
        Some(Placed { at, band, point })
    });
    let placed: Vec<Option<Placed<'_>>> = placed.collect();
    svg.open("g", &[("class", &format!("series {}", palette.colour(series.colour_key())))]);
    // What cannot be drawn parts the curve.
    for run in placed.split(Option::is_none) {
        let run: Vec<&Placed<'_>> = run.iter().flatten().collect();
        bands(svg, &run);
        if let Some(class) = line_class(series.style).filter(|_| run.len() > 1) {
            svg.path(class, &path(&run, series.style), &series.name);
        }
    }
    let placed: Vec<Placed<'_>> = placed.into_iter().flatten().collect();
    let every = placed.len().div_ceil(MARKED).max(1);
    let marked = series.markers || series.style == LineStyle::Points || placed.len() == 1;
    let shape = palette.marker(series.marker_key());
    for (i, Placed { at, point, .. }) in placed.iter().enumerate() {
        let scattered = series.style == LineStyle::Points;
        if point.emphasis {
            marker::draw(svg, shape, *at, LARGE, "marker emphasis", &title(series, point));
        } else if marked && (scattered || i % every == 0) {
            marker::draw(svg, shape, *at, RADIUS, "marker", &title(series, point));
        }
    }
    svg.close();
    svg.line();
}

/// The bands of points in a row: one area, or an upright line for a point alone.
fn bands(svg: &mut Xml, run: &[&Placed<'_>]) {
    for run in run.split(|placed| placed.band.is_none()) {
        let ends: Vec<[f64; 3]> = run.iter().filter_map(|p| p.band.map(|[low, high]| [p.at[0], low, high])).collect();
        match ends.as_slice() {
            [] => {}
            [[x, low, high]] => {
                svg.path("whisker", &polyline([[*x, *low], [*x, *high]]), "");
            }
            ends => {
                let upper = ends.iter().map(|[x, _, high]| [*x, *high]);
                let lower = ends.iter().rev().map(|[x, low, _]| [*x, *low]);
                svg.path("band", &(polyline(upper.chain(lower)) + "z"), "");
            }
        }
    }
}

fn path(run: &[&Placed<'_>], style: LineStyle) -> String {
    let stair = |pair: &[&Placed<'_>]| [[pair[1].at[0], pair[0].at[1]], pair[1].at];
    match style {
        LineStyle::Step => polyline(run[..1].iter().map(|first| first.at).chain(run.windows(2).flat_map(stair))),
        _ => polyline(run.iter().map(|placed| placed.at)),
    }
}

/// What is read under the mouse.
fn title(series: &Series, point: &Point) -> String {
    let number = |value| NumberFormat::Significant(4).format(value);
    let mut title = format!("{}: {}, {}", series.name, number(point.x), number(point.y));
    if let Some([low, high]) = point.band {
        title += &format!(" [{}, {}]", number(low), number(high));
    }
    if !point.note.is_empty() {
        title += &format!("; {}", point.note);
    }
    title
}
