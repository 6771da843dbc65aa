//! How error against run time is shown: the charts.

use evaluation::guesses::Spread;
use evaluation::precision::pareto::{Line, Place, front};
use evaluation::precision::{Against, Curve, Part};
use report::{Axis, Block, Figure, LineChart, Point, Reference, Section, Series};

use super::tables::{Worth, auto, in_short, overview, winners_of, worth};
use super::{Key, Value};
use crate::context::Context;
use crate::show::ALL_STAGES;
use crate::ways::{PRECONDITIONERS, kinds};

/// Errors that rounding alone makes.
const FREE_FALL: f64 = 1e-12;

/// A scene's curves.
pub(super) struct Sheet<'a> {
    pub(super) scene: &'a str,
    steps: usize,
    pub(super) curves: Vec<&'a Curve>,
    floor: Option<f64>,
    /// Median of the yardstick's time over all cells [s/s].
    pub(super) yardstick: f64,
}

/// The section.
pub(super) fn section(context: &Context, cells: &[(&Key, &Value)]) -> Section {
    let sheets = sheets(cells);
    let worth: Vec<Worth<'_>> = sheets.iter().flat_map(worth).collect();
    let mut blocks = vec![Block::Paragraph(INTRODUCTION.to_owned()), Block::Paragraph(in_short(&worth))];
    blocks.push(Block::Table(overview(context, &worth)));
    blocks.push(Block::Table(auto(context, &sheets)));
    for sheet in &sheets {
        for against in [Against::Exact, Against::Converged] {
            blocks.extend(figure(context, sheet, against).map(Block::Figure));
        }
        blocks.extend(winners_of(context, sheet).map(Block::Table));
    }
    Section { id: "precision".to_owned(), title: "Error against run time".to_owned(), blocks }
}

const INTRODUCTION: &str = "Every scene in every way, at several tolerances (conjugate gradients, cg, as tight as the outer iterations). The \
    error is that of the segments' positions, root mean square relative to the rods' mean length, the largest of \
    about ten samples; in scenes with contacts, of those before the first contact, because contacts take the \
    smallest differences apart (but of all where everything falls freely until then). A curve that is lower and \
    further left is better; points on the Pareto front, which no way beats in both, are outlined. A level that takes \
    longer than its budget of time, or whose linear solver runs out of iterations, is given up, and stands nowhere. \
    Against the **exact** reference, the same formulation solved to 1e-12 at the same time step, a curve shows what \
    the solver is answerable for; against the **converged** one, with finer segments and time steps, what the user \
    gets.";

fn sheets<'a>(cells: &[(&'a Key, &'a Value)]) -> Vec<Sheet<'a>> {
    let mut sheets: Vec<Sheet<'a>> = Vec::new();
    for (key, value) in cells {
        if sheets.last().is_none_or(|sheet| sheet.scene != key.scene) {
            let (scene, steps, floor) = (key.scene.as_str(), key.steps, value.floor);
            sheets.push(Sheet { scene, steps, curves: Vec::new(), floor, yardstick: 0.0 });
        }
        if let Some(sheet) = sheets.last_mut() {
            sheet.curves.push(&value.curve);
        }
    }
    for sheet in &mut sheets {
        let medians = sheet.curves.iter().filter_map(|curve| Some(curve.yardstick?.median));
        sheet.yardstick = Spread::of(medians).map_or(f64::NAN, |spread| spread.median);
    }
    sheets
}

impl Sheet<'_> {
    /// Samples before contacts, where there are some that say anything: what falls freely errs in nothing.
    pub(super) fn part(&self) -> Part {
        let before = self.curves.iter().flat_map(|curve| curve.line(Against::Exact, Part::BeforeContact).places);
        if before.map(|place| place.error).fold(0.0, f64::max) > FREE_FALL { Part::BeforeContact } else { Part::All }
    }

    fn lines(&self, against: Against) -> Vec<Line> {
        self.curves.iter().map(|curve| curve.line(against, self.part())).collect()
    }

    /// The lines against the exact reference of all that is compared: a way of its own each, with an error to choose.
    pub(super) fn contenders(&self) -> Vec<Line> {
        let mut lines = self.lines(Against::Exact);
        lines.retain(|line| line.kind != kinds::AUTO && line.kind != kinds::END_TO_END);
        lines
    }
}

/// Which chart of a figure a way stands in: its title.
fn chart_of(curve: &Curve) -> Vec<&'static str> {
    let of_cg = PRECONDITIONERS.iter().zip(CG_CHARTS);
    let own = of_cg.filter(|(preconditioner, _)| curve.way.starts_with(&format!("cg {preconditioner},")));
    match own.map(|(_, title)| title).next() {
        Some(title) => vec![title],
        // The rival that no chart may be without.
        None if curve.way == RIVAL => std::iter::once(OTHERS).chain(CG_CHARTS).collect(),
        None => vec![OTHERS],
    }
}

const OTHERS: &str = "direct solves, formulations, end to end";
const CG_CHARTS: [&str; 3] =
    ["conjugate gradients, raw", "conjugate gradients, Jacobi", "conjugate gradients, block-Jacobi"];
/// The direct solver in the same formulation.
const RIVAL: &str = "xpbd, direct";

fn figure(context: &Context, sheet: &Sheet<'_>, against: Against) -> Option<Figure> {
    let lines = sheet.lines(against);
    let places: Vec<_> = lines.iter().flat_map(|line| line.places.iter().copied()).collect();
    if places.is_empty() {
        return None;
    }
    let on_front: Vec<_> = front(&places).into_iter().map(|i| places[i]).collect();
    let mut charts = Vec::new();
    for title in std::iter::once(OTHERS).chain(CG_CHARTS) {
        let of_chart = || sheet.curves.iter().zip(&lines).filter(|(curve, _)| chart_of(curve).contains(&title));
        if of_chart().all(|(curve, _)| curve.way == RIVAL) {
            continue;
        }
        let series = of_chart().map(|(curve, line)| {
            let mut places = line.places.clone();
            places.sort_by(|a, b| a.time.total_cmp(&b.time));
            let point = |place: &Place| {
                let Place { error, time } = *place;
                Point { x: time * sheet.yardstick, y: error, emphasis: on_front.contains(place), ..Point::default() }
            };
            // One colour for a start, whatever the preconditioner.
            let colour = curve.way.split_once(", ").filter(|_| curve.way.starts_with("cg")).map(|(_, start)| start);
            Series {
                colour: colour.map(str::to_owned),
                dashed: curve.kind != kinds::LEARNED,
                ..Series::new(curve.way.clone(), places.iter().map(point))
            }
        });
        let floor = sheet.floor.filter(|_| against == Against::Converged);
        charts.push(LineChart {
            title: title.to_owned(),
            x: Axis::log("wall time per simulated second [s]"),
            y: error_axis(&places),
            series: series.collect(),
            references: floor
                .map(|y| Reference::Horizontal { y, label: "the reference's own error".to_owned() })
                .into_iter()
                .collect(),
            emphasis: Some("on the Pareto front".to_owned()),
            ..LineChart::default()
        });
    }
    let (id, name, what) = match against {
        Against::Exact => ("precision", "exact", "the same time step, solved to 1e-12"),
        Against::Converged => ("converged", "converged", "finer segments and time steps"),
    };
    let first = sheet.curves.first()?;
    let contact = match sheet.part() {
        Part::BeforeContact if first.samples_before_contact < first.samples.len() => "; before the first contact",
        _ => "",
    };
    Some(Figure {
        id: format!("{id}-{}", sheet.scene),
        title: format!("{}: error against run time, {name} reference", sheet.scene),
        caption: format!("Against {what}{contact}."),
        charts: report::Charts::Lines(charts),
        conditions: conditions(context, sheet, first),
    })
}

/// From the smallest error to one at most: predictions alone may run away as far as numbers go.
fn error_axis(places: &[Place]) -> Axis {
    let smallest = places.iter().map(|place| place.error).filter(|&error| error > 0.0).fold(1.0, f64::min);
    let largest = places.iter().map(|place| place.error).fold(0.0, f64::max);
    let range = (largest > 1.0).then_some([0.5 * smallest, 2.0]);
    Axis { range, ..Axis::log("position error") }
}

pub(super) fn conditions(context: &Context, sheet: &Sheet<'_>, curve: &Curve) -> report::Conditions {
    let time = format!(
        "{ALL_STAGES}; setting up left out; ratios to the default settings run beside, \
         times the median of those"
    );
    context.conditions(&time).with("scene", format!("{}, {} steps of {} s", sheet.scene, sheet.steps, curve.dt))
}
