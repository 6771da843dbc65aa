//! How error against run time is shown: the charts.

use evaluation::precision::Against;
use evaluation::precision::pareto::{Line, Place, front};
use report::{Axis, Block, LineChart, Point, Reference, Section, Series};

use super::key::{PrecisionKey, Value};
use super::sheet::Sheet;
use super::tables::{Worth, auto, in_short, overview, winners, worth};
use crate::blocks;
use crate::context::Context;
use crate::ways::kinds;

/// The section.
pub(super) fn section(context: &Context, cells: &[(&PrecisionKey, &Value)]) -> Section {
    let by_scene = cells.chunk_by(|(key, _), (next, _)| key.scene == next.scene);
    let sheets: Vec<_> = by_scene.map(|cells| Sheet::new(context, cells)).collect();
    let worth: Vec<Worth<'_>> = sheets.iter().flat_map(worth).collect();
    let mut blocks = vec![Block::Paragraph(in_short(&worth)), overview(context, &worth), auto(context, &sheets)];
    for sheet in &sheets {
        blocks.extend([Against::Exact, Against::Converged].into_iter().filter_map(|against| charts(sheet, against)));
        blocks.push(winners(sheet));
    }
    blocks::section(["precision", "Error against run time", INTRODUCTION], blocks)
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

/// The charts of a figure: each with its title, and what the names of its ways begin with; the first has all others.
const CHARTS: [(&str, &str); 3] = [
    ("direct solves, formulations, end to end", ""),
    ("conjugate gradients, raw", "cg raw,"),
    ("conjugate gradients, block-Jacobi", "cg block-jacobi,"),
];
/// The direct solver in the same formulation: the rival that no chart may be without.
const RIVAL: &str = "xpbd, direct";

fn charts(sheet: &Sheet<'_>, against: Against) -> Option<Block> {
    let lines = sheet.lines(against);
    let places: Vec<_> = lines.iter().flat_map(|line| line.places.iter().copied()).collect();
    if places.is_empty() {
        return None;
    }
    let front = front(&places);
    let series = |line: &Line| {
        let mut places = line.places.clone();
        places.sort_by(|a, b| a.time.total_cmp(&b.time));
        let point = |place: &Place| {
            let (x, emphasis) = (place.time * sheet.yardstick, front.contains(place));
            Point { x, y: place.error, emphasis, ..Point::default() }
        };
        // One colour for a start, whatever the preconditioner.
        let colour =
            line.way.split_once(", ").filter(|_| line.way.starts_with("cg")).map(|(_, start)| start.to_owned());
        let dashed = line.kind != kinds::LEARNED;
        Series { colour, dashed, ..Series::new(line.way.clone(), places.iter().map(point)) }
    };
    let floor = sheet.floor.filter(|_| against == Against::Converged);
    let floor = floor.map(|y| Reference::Horizontal { y, label: "the reference's own error".to_owned() });
    let mut charts = Vec::new();
    for (k, (title, _)) in CHARTS.into_iter().enumerate() {
        let place = |line: &Line| CHARTS.iter().rposition(|(_, begin)| line.way.starts_with(begin));
        let own = || lines.iter().filter(|line| place(line) == Some(k) || line.way == RIVAL);
        if own().any(|line| line.way != RIVAL) {
            let axes = [Axis::log("wall time per simulated second [s]"), error_axis(&places)];
            let chart = blocks::chart(title, axes, own().map(series).collect(), floor.iter().cloned().collect());
            charts.push(LineChart { emphasis: Some("on the Pareto front".to_owned()), ..chart });
        }
    }
    let (id, name, what) = match against {
        Against::Exact => ("precision", "exact", "the same time step, solved to 1e-12"),
        Against::Converged => ("converged", "converged", "finer segments and time steps"),
    };
    let is_all = sheet.curves.iter().all(|curve| curve.samples.len() == sheet.samples);
    let contact = if is_all { "" } else { "; before the first contact" };
    let (id, caption) = (format!("{id}-{}", sheet.scene), format!("Against {what}{contact}."));
    let title = format!("{}: error against run time, {name} reference", sheet.scene);
    Some(blocks::figure([&id, &title, &caption], charts, sheet.conditions.clone()))
}

/// From the smallest error to one at most: predictions alone may run away as far as numbers go.
fn error_axis(places: &[Place]) -> Axis {
    let smallest = places.iter().map(|place| place.error).filter(|&error| error > 0.0).fold(1.0, f64::min);
    let largest = places.iter().map(|place| place.error).fold(0.0, f64::max);
    let range = (largest > 1.0).then_some([0.5 * smallest, 2.0]);
    Axis { range, ..Axis::log("position error") }
}
