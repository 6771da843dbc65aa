//! Drawing curves.

use super::marker::{self, LARGE, RADIUS};
use super::text::LINE;
use super::ticks::{self, Ticks};
use super::{Drawing, Size, description, paragraph};
use crate::axis::{Layout, span};
use crate::{LineChart, Palette, Point, Px, Reference, Series, Xml, polyline, significant};

/// Points of a curve that are marked at most, beside those that stand out.
const MARKED: usize = 40;
/// Height of the plotting area, in its widths.
const HEIGHT: f64 = 0.72;
/// The same for equal units on both axes, at least and at most.
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
            let axes = axes(&mut svg, chart, places, [top, right], size);
            (left, bottom) = (axes.x.pixels[0], axes.y.pixels[0]);
            // A drawing of its own cuts off what reaches over the edge.
            let sides = [left, top, right - left, bottom - top];
            let [x, y, wide, high] = sides.map(Px);
            let view = format!("{x} {y} {wide} {high}");
            svg.open("svg", &[("x", &x), ("y", &y), ("width", &wide), ("height", &high), ("viewBox", &view)]);
            chart.series.iter().for_each(|series| curve(&mut svg, series, &axes, palette));
            references(&mut svg, chart, &axes, font);
            svg.close();
            svg.rect(sides, "box", "", "");
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
}

impl Axes {
    fn at(&self, x: f64, y: f64) -> Option<[f64; 2]> {
        Some([self.x.at(x)?, self.y.at(y)?])
    }
}

/// The places on both axes that the data take up; `None` if no point can be drawn.
fn spans(chart: &LineChart) -> Option<[[f64; 2]; 2]> {
    let (mut xs, mut ys) = (Vec::new(), Vec::new());
    for point in chart.series.iter().flat_map(|series| &series.points) {
        if let (Some(x), Some(y)) = (chart.x.scale.place(point.x), chart.y.scale.place(point.y)) {
            xs.push(x);
            ys.push(y);
            ys.extend(point.band.iter().flatten().filter_map(|value| chart.y.scale.place(*value)));
        }
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

/// Draws the axes over the given places, with the plotting area's upper right corner at `corner`, read as \[top, right\].
fn axes(svg: &mut Xml, chart: &LineChart, places: [[f64; 2]; 2], [top, right]: [f64; 2], size: Size) -> Axes {
    let Size { width, font } = size;
    let mut x_places = Layout::places(&chart.x, places[0]);
    let mut y_places = Layout::places(&chart.y, places[1]);
    // As many ticks as a usual area takes, to know the room that their labels need.
    let label = Ticks::new(chart.y.scale, y_places, 6).width(font).max(2.0 * font);
    let left = label + 8.0;
    let wide = right - left;
    let mut high = HEIGHT * wide;
    if chart.equal_units {
        let [dx, dy] = [x_places, y_places].map(|[low, high]| high - low);
        high = wide * (dy / dx).clamp(HEIGHT_EQUAL[0], HEIGHT_EQUAL[1]);
        let unit = (dx / wide).max(dy / high);
        x_places = about_middle(x_places, unit * wide);
        y_places = about_middle(y_places, unit * high);
    }
    let bottom = top + high;
    let x = Layout { scale: chart.x.scale, places: x_places, pixels: [left, right] };
    let y = Layout { scale: chart.y.scale, places: y_places, pixels: [bottom, top] };
    let x_label = if width < 400.0 { 52.0 } else { 64.0 };
    let x_ticks = Ticks::new(x.scale, x_places, (wide / x_label) as usize);
    let y_ticks = Ticks::new(y.scale, y_places, (high / 40.0) as usize);
    x_ticks.grid(svg, &x, y.pixels, true);
    y_ticks.grid(svg, &y, x.pixels, false);
    for (x, text) in x_ticks.major.iter().filter_map(|(value, text)| Some((x.at(*value)?, text))) {
        ticks::label(svg, text, [x, bottom + 1.1 * font + 2.0], "middle", font);
    }
    for (y, text) in y_ticks.major.iter().filter_map(|(value, text)| Some((y.at(*value)?, text))) {
        ticks::label(svg, text, [left - 6.0, y + 0.35 * font], "end", font);
    }
    Axes { x, y }
}

/// An interval of length `length` about the middle of another.
fn about_middle([low, high]: [f64; 2], length: f64) -> [f64; 2] {
    let middle = 0.5 * (low + high);
    [middle - 0.5 * length, middle + 0.5 * length]
}

/// Lines across with their labels: those of upright lines beside them at the top, one below the other; those of level lines
/// above them at the right.
fn references(svg: &mut Xml, chart: &LineChart, axes: &Axes, font: f64) {
    let ([left, right], [bottom, top]) = (axes.x.pixels, axes.y.pixels);
    let mut next = top + font + 2.0;
    for reference in &chart.references {
        let (label, line, at, anchor) = match reference {
            Reference::Vertical { x, label } => {
                let Some(x) = axes.x.at(*x).filter(|x| (left..=right).contains(x)) else { continue };
                let (along, anchor) = if x > 0.5 * (left + right) { (x - 5.0, "end") } else { (x + 5.0, "start") };
                let at = [along, next];
                next += LINE * font;
                (label, [[x, bottom], [x, top]], at, anchor)
            }
            Reference::Horizontal { y, label } => {
                let Some(y) = axes.y.at(*y).filter(|y| (top..=bottom).contains(y)) else { continue };
                let foot = if y - font < top { y + font } else { y - 5.0 };
                (label, [[left, y], [right, y]], [right - 5.0, foot], "end")
            }
        };
        svg.path("reference", &polyline(line), "");
        svg.label(at, anchor, "small halo", label);
    }
}

/// A point that can be drawn, and where.
struct Placed<'a> {
    at: [f64; 2],
    /// Lower and upper end of its band.
    band: Option<[[f64; 2]; 2]>,
    point: &'a Point,
}

/// Draws a curve: its bands, its lines and its markers.
fn curve(svg: &mut Xml, series: &Series, axes: &Axes, palette: &Palette<'_>) {
    let placed = series.points.iter().map(|point| {
        let Point { x, y, band, .. } = point;
        let band = band.and_then(|[low, high]| Some([axes.at(*x, low)?, axes.at(*x, high)?]));
        Some(Placed { at: axes.at(*x, *y)?, band, point })
    });
    let placed: Vec<Option<Placed<'_>>> = placed.collect();
    svg.open("g", &[("class", &format!("series {}", palette.colour(series.colour_key())))]);
    // What cannot be drawn parts the curve.
    for run in placed.split(Option::is_none) {
        let run: Vec<&Placed<'_>> = run.iter().flatten().collect();
        run.split(|placed| placed.band.is_none()).for_each(|run| band(svg, run));
        if run.len() > 1 {
            svg.path(series.class(), &polyline(run.iter().map(|placed| placed.at)), &series.name);
        }
    }
    let placed: Vec<Placed<'_>> = placed.into_iter().flatten().collect();
    let every = placed.len().div_ceil(MARKED).max(1);
    let shape = palette.marker(&series.name);
    for (i, Placed { at, point, .. }) in placed.iter().enumerate() {
        if point.emphasis {
            marker::draw(svg, shape, *at, LARGE, "marker emphasis", &title(series, point));
        } else if (series.markers && i % every == 0) || placed.len() == 1 {
            marker::draw(svg, shape, *at, RADIUS, "marker", &title(series, point));
        }
    }
    svg.close();
    svg.line();
}

/// The band of points in a row: an area, or an upright line for a point alone.
fn band(svg: &mut Xml, run: &[&Placed<'_>]) {
    let edge = |k: usize| run.iter().filter_map(move |placed| placed.band.map(|ends| ends[k]));
    match run {
        [] => {}
        [_] => svg.path("whisker", &polyline(edge(0).chain(edge(1))), ""),
        _ => svg.path("band", &(polyline(edge(1).chain(edge(0).rev())) + "z"), ""),
    }
}

/// What is read under the mouse.
fn title(series: &Series, point: &Point) -> String {
    let number = |value| significant(value, 4);
    let band = point.band.map(|[low, high]| format!(" [{}, {}]", number(low), number(high))).unwrap_or_default();
    format!("{}: {}, {}{band}", series.name, number(point.x), number(point.y))
}
