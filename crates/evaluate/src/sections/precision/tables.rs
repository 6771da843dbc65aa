//! How error against run time is shown: who is fastest, and what a learned guess is worth.

use cosserat::simulation::Formulation;
use evaluation::precision::Against;
use evaluation::precision::pareto::{Line, fastest};
use report::{Block, Cell};

use super::sheet::Sheet;
use crate::blocks::table;
use crate::context::Context;
use crate::show::{ALL_STAGES, number};
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

/// The lines against the exact reference of all that is compared: a way of its own each, with an error to choose.
fn contenders(sheet: &Sheet<'_>) -> Vec<Line> {
    let mut lines = sheet.lines(Against::Exact);
    lines.retain(|line| ![kinds::AUTO, kinds::END_TO_END].contains(&line.kind.as_str()));
    lines
}

/// Who wins at each error in a scene.
pub(super) fn winners(sheet: &Sheet<'_>) -> Block {
    let lines = contenders(sheet);
    let row = |error: f64| {
        let (own, time) = fastest(&lines, error, |_| true)?;
        let [rival, lead] = match fastest(&lines, error, |line| line.kind != own.kind) {
            Some((rival, other)) => [Cell::from(rival.way.as_str()), format!("{:.2}", other / time).into()],
            None => [Cell::muted("-"), "-".into()],
        };
        let time = format!("{:.3}", 1e3 * time * sheet.yardstick);
        Some(vec![format!("{error:e}").into(), Cell::strong(own.way.as_str()), time.into(), rival, lead])
    };
    let caption = format!(
        "The rival is the fastest way of another kind; the lead is its time over the fastest one's. {CONTENDERS}"
    );
    let (id, title) = (format!("winners-{}", sheet.scene), format!("{}: the fastest way at each error", sheet.scene));
    let rows = ERRORS.into_iter().filter_map(row).collect();
    let headings = "#error | fastest | #time [ms/s] | rival | #lead";
    table([&id, &title, &caption], headings, rows, sheet.conditions.clone())
}

/// What a learned guess is worth in a scene at an error.
pub(super) struct Worth<'a> {
    scene: &'a str,
    error: f64,
    /// The fastest way of all, and the fastest conjugate gradients from a learned guess.
    fastest: [Option<String>; 2],
    /// Time of the latter over that of the fastest conjugate gradients without learning, and over that of the fastest
    /// direct solve; and time of implicit Euler from a learned start over that from the best other one.
    ratios: [Option<f64>; 3],
}

pub(super) fn worth<'a>(sheet: &Sheet<'a>) -> [Worth<'a>; 3] {
    let lines = contenders(sheet);
    OVERVIEW.map(|error| {
        let of_kind = |kind: &str| fastest(&lines, error, |line| line.kind == kind);
        let is_plain_newton = |line: &Line| line.way.starts_with("newton") && line.kind != kinds::NEWTON_LEARNED;
        let learned = of_kind(kinds::LEARNED);
        let pairs = [
            (learned, of_kind(kinds::CG)),
            (learned, of_kind(kinds::DIRECT)),
            (of_kind(kinds::NEWTON_LEARNED), fastest(&lines, error, is_plain_newton)),
        ];
        Worth {
            scene: sheet.scene,
            error,
            fastest: [fastest(&lines, error, |_| true), learned].map(|way| Some(way?.0.way.clone())),
            ratios: pairs.map(|(own, other)| Some(own?.1 / other?.1)),
        }
    })
}

/// The table of [`overview`] in a few words.
pub(super) fn in_short(all: &[Worth<'_>]) -> String {
    let [to_cg, to_direct, newton] = [0, 1, 2].map(|k| {
        let ratios: Vec<f64> = all.iter().filter_map(|worth| worth.ratios[k]).collect();
        let below = ratios.iter().filter(|&&ratio| ratio < 1.0).count();
        let best = ratios.iter().copied().fold(f64::INFINITY, f64::min);
        format!("in {below} of {} comparisons (at best in {} of its time)", ratios.len(), number(best))
    });
    format!(
        "**In short**, comparing at one error in one scene at a time: conjugate gradients from a learned guess are faster \
         than those from the best start without learning {to_cg}, and faster than the direct solve {to_direct}. Implicit Euler from a \
         learned start of the whole step is faster than from the best other start {newton}."
    )
}

/// What a learned guess is worth in each scene.
pub(super) fn overview(context: &Context, all: &[Worth<'_>]) -> Block {
    let name = |way: &Option<String>| way.as_ref().map_or(Cell::muted("none reaches it"), |way| way.as_str().into());
    let ratio = |ratio: Option<f64>| match ratio {
        Some(ratio) if ratio < 1.0 => Cell::strong(number(ratio)),
        Some(ratio) => number(ratio).into(),
        None => Cell::muted("-"),
    };
    let row = |Worth { scene, error, fastest, ratios }: &Worth<'_>| {
        let place = [Cell::from(*scene), format!("{error:e}").into()];
        place.into_iter().chain(fastest.each_ref().map(name)).chain(ratios.map(ratio)).collect()
    };
    let caption = format!(
        "Time of the fastest conjugate gradients from a learned guess over that of the fastest without one, and over \
         the fastest direct solve's; and of implicit Euler from a learned start of the whole step over that from the \
         best start without learning. Below 1 the learned guess pays; these cells are bold. {CONTENDERS}"
    );
    let headings = "scene | #error | fastest of all | best learned | #time, to cg without learning | #time, to direct | \
        #newton: time, to without learning";
    let head = ["precision-overview", "What a learned guess is worth, at equal error", &caption];
    table(head, headings, all.iter().map(row).collect(), context.conditions(ALL_STAGES))
}

/// What is chosen by itself beside the best of all fixed ways of the same formulation.
pub(super) fn auto(context: &Context, sheets: &[Sheet<'_>]) -> Block {
    let mut rows = Vec::new();
    for (sheet, formulation) in sheets.iter().flat_map(|sheet| Formulation::ALL.map(|formulation| (sheet, formulation)))
    {
        let mut lines = sheet.lines(Against::Exact);
        let is_cg = |line: &Line| line.way.starts_with("cg ") && formulation == Formulation::Xpbd;
        lines.retain(|line| line.way.starts_with(&format!("{formulation}, ")) || is_cg(line));
        for error in ERRORS {
            let at = |is_auto| fastest(&lines, error, |line| (line.kind == kinds::AUTO) == is_auto);
            let (Some((_, own)), Some((best, other))) = (at(true), at(false)) else { continue };
            let ratio = number(own / other);
            let ratio = if own / other > AUTO_BAR { Cell::strong(ratio) } else { ratio.into() };
            let texts = [sheet.scene, formulation.name(), &format!("{error:e}"), &best.way].map(Cell::from);
            rows.push(texts.into_iter().chain([ratio]).collect());
        }
    }
    let caption = format!(
        "Time of `--solver auto` over that of the fastest fixed way of the same formulation, learned guesses among them. Bold: above \
         {AUTO_BAR}. Where the best fixed way is what auto chose, the ratio shows how far times are to be trusted."
    );
    let head = ["precision-auto", "What auto takes, beside the best fixed way at equal error", &caption];
    let headings = "scene | formulation | #error | best fixed way | #time of auto over its";
    table(head, headings, rows, context.conditions(ALL_STAGES))
}
