//! Where something learned pays, and where it does not.

use anyhow::Result;
use report::{Cell, Section};

use crate::blocks::{self, quoted, table};
use crate::numbers::Folder;
use crate::show::number;

/// A row: for what, against which rival, the gain, and whether it pays.
fn row(what: &str, rival: &str, gain: String, pays: bool, page: &str) -> Vec<Cell> {
    let verdict = if pays { Cell::strong("yes") } else { Cell::from("no") };
    vec![what.into(), rival.into(), gain.into(), verdict, page.into()]
}

fn rows(folder: &Folder) -> Result<Vec<Vec<Cell>>> {
    let mut rows = Vec::new();
    if let Some(gain) = folder.read("equilibria", "cables-gain")? {
        for [set, rival, ratio, any] in gain.select(&[], ["set", "rival", "rival, to learned", "for any equilibrium"]) {
            let pays = ratio.parse::<f64>().is_ok_and(|ratio| ratio > 1.0);
            let words = format!("{ratio} times as fast for the lowest, {any} for any");
            rows.push(row(&format!("equilibria of a cable: {set}"), rival, words, pays, "equilibria"));
        }
    }
    if let Some(gain) = folder.read("branched", "branched-gain")? {
        for [asked, rival, ratio] in gain.select(&[], ["asked for", "rival", "rival, to learned"]) {
            let pays = ratio.parse::<f64>().is_ok_and(|ratio| ratio > 1.0);
            let what = format!("equilibria of three cables that meet: {asked}");
            rows.push(row(&what, rival, format!("{ratio} times as fast"), pays, "branched"));
        }
    }
    if let Some(real) = folder.read("real", "real-cables-errors")? {
        for cable in ["DLO1", "DLO2", "DLO3"] {
            let column = format!("{cable} [cm]");
            let of = |prediction: &str| real.value(&[("prediction", prediction)], &column);
            if let Some((before, after)) = of("identified").zip(of("corrected by a perceptron, seed 1")) {
                let words = format!("error {} cm, was {} cm", number(after), number(before));
                rows.push(row(&format!("a real cable: {cable}"), "identified physics", words, after < before, "real"));
            }
        }
    }
    if let Some(overview) = folder.read("solvers", "precision-overview")? {
        for (column, what, rival) in [
            (
                "time, to cg without learning",
                "steps of a motion, conjugate gradients",
                "the best start without learning",
            ),
            ("time, to direct", "steps of a motion, conjugate gradients", "the direct solver"),
            (
                "newton: time, to without learning",
                "steps of a motion, formulation newton",
                "the best start without learning",
            ),
        ] {
            let ratios = overview.values(&[], column);
            let below = ratios.iter().filter(|&&ratio| ratio < 1.0).count();
            let best = ratios.iter().copied().fold(f64::INFINITY, f64::min);
            let words = format!(
                "faster in {below} of {} comparisons at equal error, at best {} times as fast",
                ratios.len(),
                number(1.0 / best)
            );
            rows.push(row(what, rival, words, 2 * below > ratios.len(), "solvers"));
        }
    }
    Ok(rows)
}

pub(super) fn section(folder: &Folder) -> Result<Section> {
    let rows = rows(folder)?;
    let introduction =
        "Against the strongest rival without learning in each row, times of features, inference and guards included.";
    let mut own = Vec::new();
    if !rows.is_empty() {
        let head = ["learning-pays", "Where something learned pays", ""];
        let headings = "for | against | gain | pays | page";
        own.push(table(head, headings, rows, quoted("equilibria/, branched/, real/, solvers/")));
    }
    Ok(blocks::section(["learning", "Where learning pays", introduction], own))
}
