//! How error against run time is shown.

use evaluation::precision::pareto::{Line, Place, front, standings, time_at_error, winners};
use evaluation::precision::{Against, Curve, Part};
use report::{Axis, Block, Cell, Column, Figure, LineChart, LineStyle, Point, Reference, Section, Series, Table};

use super::{Key, Value};
use solver::formulation::Formulation;

use crate::context::Context;
use crate::show::number;
use crate::ways::{AUTO, PRECONDITIONERS, kinds};

/// Errors of the overview.
const OVERVIEW: [f64; 3] = [1e-2, 1e-4, 1e-6];

/// Auto must not take longer than so many times the best fixed way.
const AUTO_BAR: f64 = 1.1;

/// Errors at which ways are compared.
const ERRORS: [f64; 5] = [1e-2, 1e-3, 1e-4, 1e-6, 1e-8];

/// Who is compared.
const CONTENDERS: &str = "Predictions end to end stand in the charts alone: their error grows with every step, so that a \
    short run would flatter them.";

/// Errors that rounding alone makes.
const FREE_FALL: f64 = 1e-12;

/// A scene's curves.
struct Sheet<'a> {
    scene: &'a str,
    steps: usize,
    curves: Vec<&'a Curve>,
    floor: Option<f64>,
    /// Median of the yardstick's time over all cells [s/s].
    yardstick: f64,
}

/// The section.
pub(super) fn section(context: &Context, cells: &[(&Key, &Value)]) -> Section {
    let sheets = sheets(cells);
    let mut blocks = vec![Block::Paragraph(INTRODUCTION.to_owned())];
    blocks.push(Block::Table(overview(context, &sheets)));
    blocks.push(Block::Table(auto(context, &sheets)));
    for sheet in &sheets {
        for against in [Against::Exact, Against::Converged] {
            blocks.extend(figure(context, sheet, against).map(Block::Figure));
        }
        blocks.extend(table(context, sheet).map(Block::Table));
    }
    Section { id: "precision".to_owned(), title: "Error against run time".to_owned(), blocks }
}

const INTRODUCTION: &str = "Every scene in every way, at several tolerances (conjugate gradients, cg, as tight as the \
    outer iterations). The error is that of the segments' positions, root mean \
    square relative to the rods' mean length, the largest of about ten samples; in scenes with contacts, of those before \
    the first contact, because contacts take the smallest differences apart (but of all where everything falls freely \
    until then). A curve that is lower and further left is \
    better; points on the Pareto front, which no way beats in both, are outlined. Against the **exact** reference, the same \
    formulation solved to 1e-12 at the same time step, a curve shows what the solver is answerable for; against the \
    **converged** one, with finer segments and time steps, what the user gets.";

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
        sheet.yardstick = Curve::common_yardstick(sheet.curves.iter().copied()).unwrap_or(f64::NAN);
    }
    sheets
}

impl Sheet<'_> {
    /// Samples before contacts, where there are some that say anything: what falls freely errs in nothing.
    fn part(&self) -> Part {
        let before = self.curves.iter().flat_map(|curve| curve.line(Against::Exact, Part::BeforeContact).places);
        if before.map(|place| place.error).fold(0.0, f64::max) > FREE_FALL { Part::BeforeContact } else { Part::All }
    }

    fn lines(&self, against: Against) -> Vec<Line> {
        self.curves.iter().map(|curve| curve.line(against, self.part())).collect()
    }

    /// The lines against the exact reference of all that is compared: a way of its own each, with an error to choose.
    fn contenders(&self) -> Vec<Line> {
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
                style: if curve.kind == kinds::LEARNED { LineStyle::Solid } else { LineStyle::Dashed },
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
    let (id, what) = match against {
        Against::Exact => (format!("precision-{}", sheet.scene), "the same time step, solved to 1e-12"),
        Against::Converged => (format!("converged-{}", sheet.scene), "finer segments and time steps"),
    };
    let first = sheet.curves.first()?;
    let contact = match sheet.part() {
        Part::BeforeContact if first.samples_before_contact < first.samples.len() => "; before the first contact",
        _ => "",
    };
    Some(Figure {
        id,
        title: format!("{}: error against run time", sheet.scene),
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

fn conditions(context: &Context, sheet: &Sheet<'_>, curve: &Curve) -> report::Conditions {
    let time = "all stages of a step, guesses with features, inference and guards; setting up left out; ratios to the \
                default settings run beside, times the median of those";
    context.conditions(time).with("scene", format!("{}, {} steps of {} s", sheet.scene, sheet.steps, curve.dt))
}

/// Who wins at each error in a scene.
fn table(context: &Context, sheet: &Sheet<'_>) -> Option<Table> {
    let first = sheet.curves.first()?;
    let mut rows = Vec::new();
    for winner in winners(&sheet.contenders(), &ERRORS) {
        let Some(fastest) = winner.fastest else { continue };
        let rival = winner.rival.map_or(Cell::muted("-"), |rival| rival.way.into());
        let lead = winner.lead.map_or("-".to_owned(), |lead| format!("{lead:.2}"));
        let time = format!("{:.3}", 1e3 * fastest.time * sheet.yardstick);
        rows.push(vec![
            format!("{:e}", winner.error).into(),
            Cell::strong(fastest.way),
            time.into(),
            rival,
            lead.into(),
        ]);
    }
    Some(Table {
        id: format!("winners-{}", sheet.scene),
        title: format!("{}: the fastest way at each error", sheet.scene),
        caption: format!(
            "The rival is the fastest way of another kind; the lead is its time over the fastest one's. {CONTENDERS}"
        ),
        columns: vec![
            Column::number("error"),
            Column::text("fastest"),
            Column::number("time [ms/s]"),
            Column::text("rival"),
            Column::number("lead"),
        ],
        rows,
        conditions: conditions(context, sheet, first),
    })
}

/// What a learned guess is worth in each scene.
fn overview(context: &Context, sheets: &[Sheet<'_>]) -> Table {
    let mut rows = Vec::new();
    for sheet in sheets {
        let lines = sheet.contenders();
        let best = |error: f64, among: &dyn Fn(&Line) -> bool| {
            let timed = |line: &Line| Some((line.way.clone(), time_at_error(&line.places, error)?));
            lines.iter().filter(|line| among(line)).filter_map(timed).min_by(|a, b| a.1.total_cmp(&b.1))
        };
        for error in OVERVIEW {
            let of_kind = |kind: &'static str| best(error, &move |line: &Line| line.kind == kind);
            let fastest = best(error, &|_| true);
            let [learned, plain, direct] = [kinds::LEARNED, kinds::CG, kinds::DIRECT].map(of_kind);
            let [step, newton] = [true, false].map(|is_learned| {
                best(error, &move |line: &Line| {
                    line.way.starts_with("newton") && (line.kind == kinds::NEWTON_LEARNED) == is_learned
                })
            });
            let ratio = |own: &Option<(String, f64)>, other: &Option<(String, f64)>| match (own, other) {
                (Some((_, own)), Some((_, other))) => verdict(own / other),
                _ => Cell::muted("-"),
            };
            let name = |way: &Option<(String, f64)>| match way {
                Some((name, _)) => Cell::from(name.as_str()),
                None => Cell::muted("none reaches it"),
            };
            rows.push(vec![
                sheet.scene.into(),
                format!("{error:e}").into(),
                name(&fastest),
                name(&learned),
                ratio(&learned, &plain),
                ratio(&learned, &direct),
                ratio(&step, &newton),
            ]);
        }
    }
    Table {
        id: "precision-overview".to_owned(),
        title: "What a learned guess is worth, at equal error".to_owned(),
        caption: format!(
            "Time of the fastest conjugate gradients from a learned guess over that of the fastest without one, and over \
             the fastest direct solve's; and of implicit Euler from a learned start of the whole step over that from the \
             best start without learning. Below 1 the learned guess pays; these cells are bold. {CONTENDERS}"
        ),
        columns: vec![
            Column::text("scene"),
            Column::number("error"),
            Column::text("fastest of all"),
            Column::text("best learned"),
            Column::number("time, to cg without learning"),
            Column::number("time, to direct"),
            Column::number("newton: time, to without learning"),
        ],
        rows,
        conditions: context.conditions("all stages of a step, guesses with features, inference and guards"),
    }
}

/// What is chosen by itself beside the best of all fixed ways of the same formulation.
fn auto(context: &Context, sheets: &[Sheet<'_>]) -> Table {
    let mut rows = Vec::new();
    for sheet in sheets {
        for formulation in Formulation::ALL {
            let own = format!("{formulation}, {AUTO}");
            let is_own = |curve: &&&Curve| {
                let name = &curve.way;
                let of_xpbd = name.starts_with("cg ") && formulation == Formulation::Xpbd;
                name.starts_with(&format!("{formulation}, ")) || of_xpbd
            };
            let curves: Vec<&Curve> = sheet.curves.iter().filter(is_own).copied().collect();
            let lines: Vec<Line> = curves.iter().map(|curve| curve.line(Against::Exact, sheet.part())).collect();
            for standing in standings(&lines, &own, &ERRORS) {
                let (Some(ratio), Some(other)) = (standing.ratio, standing.best_other) else { continue };
                let text = number(ratio);
                rows.push(vec![
                    sheet.scene.into(),
                    formulation.name().into(),
                    format!("{:e}", standing.error).into(),
                    other.way.into(),
                    if ratio > AUTO_BAR { Cell::strong(text) } else { text.into() },
                ]);
            }
        }
    }
    Table {
        id: "precision-auto".to_owned(),
        title: "What auto takes, beside the best fixed way at equal error".to_owned(),
        caption: format!(
            "Time of `--solver auto` over that of the fastest fixed way of the same formulation, learned guesses among them. Bold: above \
             {AUTO_BAR}. Where the best fixed way is what auto chose, the ratio shows how far times are to be trusted."
        ),
        columns: vec![
            Column::text("scene"),
            Column::text("formulation"),
            Column::number("error"),
            Column::text("best fixed way"),
            Column::number("time of auto over its"),
        ],
        rows,
        conditions: context.conditions("all stages of a step, guesses with features, inference and guards"),
    }
}

/// A ratio of times, bold where it is a gain.
fn verdict(ratio: f64) -> Cell {
    let text = number(ratio);
    if ratio < 1.0 { Cell::strong(text) } else { text.into() }
}
