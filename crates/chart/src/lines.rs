//! Curves and points over two axes.

use crate::axis::{Axis, Layout, draw_ticks, place, ticks};
use crate::drawing::Drawing;
use crate::marker::{LARGE, RADIUS, marker};
use crate::palette::Palette;
use crate::text::{LINE, paragraph, significant, widest};
use crate::xml::{Px, Xml, polyline};

/// Points of a curve that are marked at most, beside those that stand out.
const MARKED: usize = 40;
/// Height of the plotting area, in its widths.
const HEIGHT: f64 = 0.72;
/// The same for equal units on both axes, at least and at most.
const HEIGHT_EQUAL: [f64; 2] = [0.35, 1.2];

/// Curves and points over two axes. Values that are not finite, or not positive on a logarithmic axis, leave a gap in
/// the drawing and stay in the CSV file.
#[derive(Clone, Debug, Default)]
pub struct LineChart {
    /// A short title, or none.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The curves, the last on top.
    pub series: Vec<Series>,
    /// Lines across the chart.
    pub references: Vec<Reference>,
    /// What an emphasised point means ("on the Pareto front"), for the legend.
    pub emphasis: Option<String>,
    /// Whether a unit is as long on both axes, as planar shapes need it; both must be linear then. Else each axis fills
    /// its side.
    pub equal_units: bool,
}

/// A curve.
#[derive(Clone, Debug, Default)]
pub struct Series {
    /// Its name in the legend. Series of the same name have the same shape of markers throughout the page.
    pub name: String,
    /// Its points, joined in this order.
    pub points: Vec<Point>,
    /// Whether it is dashed.
    pub dashed: bool,
    /// Whether points are marked. Of a curve with many points, only some are.
    pub markers: bool,
    /// Series of the same key have the same colour throughout the page; the name if none.
    pub colour: Option<String>,
}

impl Series {
    /// A solid curve with markers, in the colour of its name.
    pub fn new<P: Into<Point>>(name: impl Into<String>, points: impl IntoIterator<Item = P>) -> Self {
        let points = points.into_iter().map(Into::into).collect();
        Self { name: name.into(), points, markers: true, ..Self::default() }
    }

    pub(crate) fn colour_key(&self) -> &str {
        self.colour.as_ref().unwrap_or(&self.name)
    }

    /// Classes of its line.
    pub(crate) fn class(&self) -> &'static str {
        if self.dashed { "line dashed" } else { "line" }
    }
}

/// A point of a curve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Point {
    /// Along the horizontal axis, in its unit.
    pub x: f64,
    /// Along the vertical axis, in its unit.
    pub y: f64,
    /// Lower and upper end of a band about y, such as the quartiles.
    pub band: Option<[f64; 2]>,
    /// Whether the point stands out: larger, with an outline.
    pub emphasis: bool,
}

impl From<(f64, f64)> for Point {
    fn from((x, y): (f64, f64)) -> Self {
        Self { x, y, ..Self::default() }
    }
}

/// A line across a chart.
#[derive(Clone, Debug)]
pub enum Reference {
    /// An upright line.
    Vertical {
        /// Where it crosses the horizontal axis.
        x: f64,
        /// What it stands for.
        label: String,
    },
    /// A level line.
    Horizontal {
        /// Where it crosses the vertical axis.
        y: f64,
        /// What it stands for.
        label: String,
    },
}

impl Reference {
    /// Whether it is upright, the value that it crosses, and its label.
    fn parts(&self) -> (bool, f64, &str) {
        match self {
            Self::Vertical { x, label } => (true, *x, label),
            Self::Horizontal { y, label } => (false, *y, label),
        }
    }
}

/// Draws a chart without its legend.
pub(crate) fn draw(chart: &LineChart, [width, font]: [f64; 2], palette: &Palette<'_>) -> Drawing {
    let mut svg = Xml::default();
    let mut top = paragraph(&mut svg, &chart.title, [0.0, 0.0], width, font, "head");
    top = paragraph(&mut svg, &chart.y.label, [0.0, top], width, 0.9 * font, "small") + 6.0;
    let right = width - 14.0;
    let (mut left, mut bottom) = (1.0, top + 0.4 * width);
    if let Some([mut x, mut y]) = axes(chart) {
        // As many ticks as a usual area takes, to know the room that their labels need.
        left = widest(ticks(&y, 6).iter().map(|(_, label)| label), font).max(2.0 * font) + 12.0;
        let wide = right - left;
        let mut high = HEIGHT * wide;
        if chart.equal_units {
            let [dx, dy] = [x, y].map(|axis| axis.places[1] - axis.places[0]);
            high = wide * (dy / dx).clamp(HEIGHT_EQUAL[0], HEIGHT_EQUAL[1]);
            let unit = (dx / wide).max(dy / high);
            x.widen(unit * wide);
            y.widen(unit * high);
        }
        bottom = top + high;
        (x.pixels, y.pixels) = ([left, right], [bottom, top]);
        draw_ticks(&mut svg, &x, (wide / (4.0 * font)) as usize, y.pixels, true, font);
        draw_ticks(&mut svg, &y, (high / 40.0) as usize, x.pixels, false, font);
        let mut curves = Xml::default();
        let labels = references(&mut curves, &chart.references, &[x, y], font);
        chart.series.iter().for_each(|series| curves.push(curve(series, &[x, y], palette)));
        curves.push(labels);
        // A drawing of its own cuts off what reaches over the edge.
        let [x, y, wide, high] = [left, top, wide, high].map(Px);
        let view = format!("{x} {y} {wide} {high}");
        let sides =
            [("x", &x as _), ("y", &y as _), ("width", &wide as _), ("height", &high as _), ("viewBox", &view as _)];
        svg.push(Xml::nest("svg", &sides, [curves]));
    } else {
        svg.label([0.5 * right, 0.5 * (top + bottom)], "middle", "small", "no data");
    }
    svg.rect([left, top, right - left, bottom - top], "box", "", "");
    let below = [left, bottom + LINE * font + 4.0];
    let height = paragraph(&mut svg, &chart.x.label, below, width - left, 0.9 * font, "small") + 4.0;
    let LineChart { title, x, y, series, .. } = chart;
    let label = format!("Line chart {title}: {} over {}, {} series", y.label, x.label, series.len());
    Drawing { size: [width, height], font, label, body: svg }
}

/// The axes over what can be drawn; none if no point can.
fn axes(LineChart { x, y, series, references, .. }: &LineChart) -> Option<[Layout; 2]> {
    let is_drawn = |point: &&Point| place(x.log, point.x).and(place(y.log, point.y)).is_some();
    let points = || series.iter().flat_map(|series| &series.points).filter(is_drawn);
    points().next()?;
    let crossed = |upright| references.iter().map(Reference::parts).filter(move |line| line.0 == upright);
    let (upright, level) = (crossed(true).map(|line| line.1), crossed(false).map(|line| line.1));
    let bands = points().flat_map(|point| point.band).flatten();
    let ys = points().map(|point| point.y).chain(bands).chain(level);
    Some([Layout::new(x, points().map(|point| point.x).chain(upright))?, Layout::new(y, ys)?])
}

/// Draws lines across, and returns their labels: those of upright lines beside them at the top, one below the other; those
/// of level lines above them at the right.
fn references(svg: &mut Xml, references: &[Reference], [x, y]: &[Layout; 2], font: f64) -> Xml {
    let ([left, right], [bottom, top]) = (x.pixels, y.pixels);
    let (mut labels, mut next) = (Xml::default(), top + font + 2.0);
    for (upright, value, label) in references.iter().map(Reference::parts) {
        let axis = if upright { x } else { y };
        let is_seen = |at: &f64| (at - axis.pixels[0]) * (at - axis.pixels[1]) <= 0.0;
        let Some(at) = axis.at(value).filter(is_seen) else { continue };
        let (line, foot, anchor) = if upright {
            next += LINE * font;
            let (along, anchor) = if at > 0.5 * (left + right) { (at - 5.0, "end") } else { (at + 5.0, "start") };
            ([[at, bottom], [at, top]], [along, next - LINE * font], anchor)
        } else {
            let foot = if at - font < top { at + font } else { at - 5.0 };
            ([[left, at], [right, at]], [right - 5.0, foot], "end")
        };
        svg.path("reference", &polyline(line), "");
        labels.label(foot, anchor, "small halo", label);
    }
    labels
}

/// A curve: its bands, its lines and its markers.
fn curve(series: &Series, [x, y]: &[Layout; 2], palette: &Palette<'_>) -> Xml {
    let place = |point| {
        let Point { x: along, y: up, .. }: &Point = point;
        Some(([x.at(*along)?, y.at(*up)?], point))
    };
    let placed: Vec<Option<([f64; 2], &Point)>> = series.points.iter().map(place).collect();
    let mut svg = Xml::default();
    // What cannot be drawn parts the curve.
    for run in placed.split(Option::is_none) {
        let run = || run.iter().flatten();
        let ends = |([x, _], point): &([f64; 2], &Point)| Some(point.band?.map(|end| Some([*x, y.at(end)?])));
        let band: Vec<[[f64; 2]; 2]> = run().filter_map(ends).filter_map(|[low, high]| Some([low?, high?])).collect();
        if !band.is_empty() {
            let around = band.iter().map(|ends| ends[1]).chain(band.iter().rev().map(|ends| ends[0]));
            svg.path("band", &(polyline(around) + "z"), "");
        }
        if run().count() > 1 {
            svg.path(series.class(), &polyline(run().map(|(at, _)| *at)), &series.name);
        }
    }
    let every = placed.iter().flatten().count().div_ceil(MARKED).max(1);
    let shape = palette.marker(&series.name);
    for (i, (at, point)) in placed.iter().flatten().enumerate() {
        if point.emphasis {
            marker(&mut svg, shape, *at, LARGE, "marker emphasis", &title(series, point));
        } else if (series.markers && i % every == 0) || placed.iter().flatten().count() == 1 {
            marker(&mut svg, shape, *at, RADIUS, "marker", &title(series, point));
        }
    }
    Xml::nest("g", &[("class", &format!("series {}", palette.colour(series.colour_key())))], [svg])
}

/// What is read under the mouse.
fn title(series: &Series, point: &Point) -> String {
    let number = |value| significant(value, 4);
    let band = point.band.map(|[low, high]| format!(" [{}, {}]", number(low), number(high))).unwrap_or_default();
    format!("{}: {}, {}{band}", series.name, number(point.x), number(point.y))
}
