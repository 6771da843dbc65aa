//! How error against run time is shown: who is fastest, and what a learned guess is worth.

use evaluation::precision::pareto::{Line, Timed, fastest};
use evaluation::precision::{Against, Curve};
use report::{Cell, Table};
use solver::formulation::Formulation;

use super::show::{Sheet, conditions};
use crate::context::Context;
use crate::show::{ALL_STAGES, columns, number};
use crate::ways::kinds;

/// Errors of the overview.
const OVERVIEW: [f64; 3] = [1e-2, 1e-4, 1e-6];

/// Auto must not take longer than so many times the best fixed way.
const AUTO_BAR: f64 = 1.1;

/// Errors at which ways are compared.
const ERRORS: [f64; 5] = [1e-2, 1e-3, 1e-4, 1e-6, 1e-8];

/// Who is compared.
const CONTENDERS: &str =
    "Predictions end to end stand in the charts alone: they have no tolerance, so that no error can be asked of them.";

/// Who wins at each error in a scene.
pub(super) fn winners_of(context: &Context, sheet: &Sheet<'_>) -> Option<Table> {
    let first = sheet.curves.first()?;
    let (lines, mut rows) = (sheet.contenders(), Vec::new());
    for error in ERRORS {
        let Some(own) = fastest(&lines, error, |_| true) else { continue };
        let rival = fastest(&lines, error, |line| line.kind != own.kind);
        let lead = rival.as_ref().map_or("-".to_owned(), |rival| format!("{:.2}", rival.time / own.time));
        let rival = rival.map_or(Cell::muted("-"), |rival| rival.way.into());
        let time = format!("{:.3}", 1e3 * own.time * sheet.yardstick);
        rows.push(vec![format!("{error:e}").into(), Cell::strong(own.way), time.into(), rival, lead.into()]);
    }
    Some(Table {
        id: format!("winners-{}", sheet.scene),
        title: format!("{}: the fastest way at each error", sheet.scene),
        caption: format!(
            "The rival is the fastest way of another kind; the lead is its time over the fastest one's. {CONTENDERS}"
        ),
        columns: columns(&["#error", "fastest", "#time [ms/s]", "rival", "#lead"]),
        rows,
        conditions: conditions(context, sheet, first),
    })
}

/// What a learned guess is worth in a scene at an error: ways with their times.
pub(super) struct Worth<'a> {
    scene: &'a str,
    error: f64,
    fastest: Option<Timed>,
    /// Conjugate gradients from a learned guess.
    learned: Option<Timed>,
    /// Time of the learned over that of the fastest conjugate gradients without learning.
    to_cg: Option<f64>,
    /// And over that of the fastest direct solve.
    to_direct: Option<f64>,
    /// Of implicit Euler from a learned start over that from the best other one.
    newton: Option<f64>,
}

pub(super) fn worth<'a>(sheet: &Sheet<'a>) -> Vec<Worth<'a>> {
    let lines = sheet.contenders();
    let at = |&error: &f64| {
        let of_kind = |kind: &'static str| fastest(&lines, error, |line| line.kind == kind);
        let newton = |is_learned: bool| {
            let is_kind = |line: &Line| (line.kind == kinds::NEWTON_LEARNED) == is_learned;
            fastest(&lines, error, |line| line.way.starts_with("newton") && is_kind(line))
        };
        let ratio = |own: Option<Timed>, other: Option<Timed>| Some(own?.time / other?.time);
        let learned = of_kind(kinds::LEARNED);
        Worth {
            scene: sheet.scene,
            error,
            fastest: fastest(&lines, error, |_| true),
            to_cg: ratio(learned.clone(), of_kind(kinds::CG)),
            to_direct: ratio(learned.clone(), of_kind(kinds::DIRECT)),
            newton: ratio(newton(true), newton(false)),
            learned,
        }
    };
    OVERVIEW.iter().map(at).collect()
}

/// The table of [`overview`] in a few words.
pub(super) fn in_short(all: &[Worth<'_>]) -> String {
    let count = |pick: fn(&Worth<'_>) -> Option<f64>| {
        let ratios: Vec<f64> = all.iter().filter_map(pick).collect();
        let below = ratios.iter().filter(|&&ratio| ratio < 1.0).count();
        let best = ratios.iter().copied().fold(f64::INFINITY, f64::min);
        format!("in {below} of {} places (at best in {} of its time)", ratios.len(), number(best))
    };
    format!(
        "**In short**, a place being a scene at an error: conjugate gradients from a learned guess are faster than those \
         from the best start without learning {}, and faster than the direct solve {}. Implicit Euler from a learned start \
         of the whole step is faster than from the best other start {}.",
        count(|worth| worth.to_cg),
        count(|worth| worth.to_direct),
        count(|worth| worth.newton)
    )
}

/// What a learned guess is worth in each scene.
pub(super) fn overview(context: &Context, all: &[Worth<'_>]) -> Table {
    let name = |way: &Option<Timed>| match way {
        Some(way) => Cell::from(way.way.as_str()),
        None => Cell::muted("none reaches it"),
    };
    let ratio = |ratio: Option<f64>| match ratio {
        Some(ratio) if ratio < 1.0 => Cell::strong(number(ratio)),
        Some(ratio) => number(ratio).into(),
        None => Cell::muted("-"),
    };
    let row = |worth: &Worth<'_>| {
        let error = format!("{:e}", worth.error);
        let ways = [worth.scene.into(), error.into(), name(&worth.fastest), name(&worth.learned)];
        ways.into_iter().chain([worth.to_cg, worth.to_direct, worth.newton].map(ratio)).collect()
    };
    let rows = all.iter().map(row).collect();
    Table {
        id: "precision-overview".to_owned(),
        title: "What a learned guess is worth, at equal error".to_owned(),
        caption: format!(
            "Time of the fastest conjugate gradients from a learned guess over that of the fastest without one, and over \
             the fastest direct solve's; and of implicit Euler from a learned start of the whole step over that from the \
             best start without learning. Below 1 the learned guess pays; these cells are bold. {CONTENDERS}"
        ),
        columns: columns(&[
            "scene",
            "#error",
            "fastest of all",
            "best learned",
            "#time, to cg without learning",
            "#time, to direct",
            "#newton: time, to without learning",
        ]),
        rows,
        conditions: context.conditions(ALL_STAGES),
    }
}

/// What is chosen by itself beside the best of all fixed ways of the same formulation.
pub(super) fn auto(context: &Context, sheets: &[Sheet<'_>]) -> Table {
    let mut rows = Vec::new();
    for sheet in sheets {
        for formulation in Formulation::ALL {
            let own = format!("{formulation}, {}", kinds::AUTO);
            let is_own = |curve: &&&Curve| {
                let name = &curve.way;
                let of_xpbd = name.starts_with("cg ") && formulation == Formulation::Xpbd;
                name.starts_with(&format!("{formulation}, ")) || of_xpbd
            };
            let curves: Vec<&Curve> = sheet.curves.iter().filter(is_own).copied().collect();
            let lines: Vec<Line> = curves.iter().map(|curve| curve.line(Against::Exact, sheet.part())).collect();
            for error in ERRORS {
                let at = |is_own| fastest(&lines, error, |line| (line.way == own) == is_own);
                let (Some(own), Some(other)) = (at(true), at(false)) else { continue };
                let ratio = own.time / other.time;
                let text = number(ratio);
                rows.push(vec![
                    sheet.scene.into(),
                    formulation.name().into(),
                    format!("{error:e}").into(),
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
        columns: columns(&["scene", "formulation", "#error", "best fixed way", "#time of auto over its"]),
        rows,
        conditions: context.conditions(ALL_STAGES),
    }
}
