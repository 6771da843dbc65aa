//! The paper's claims, each held against what was measured by a rule.

use anyhow::Result;

use crate::numbers::Folder;
use crate::show::number;

pub(super) const HOLDS: &str = "holds";
pub(super) const IN_PART: &str = "in part";
pub(super) const FAILS: &str = "does not hold";
const MISSING: &str = "not measured";

/// A claim, and what came of it.
pub(super) struct Row {
    pub(super) claim: String,
    pub(super) verdict: &'static str,
    pub(super) number: String,
    /// The page with the numbers.
    pub(super) page: &'static str,
}

/// The verdict on a saving [%] that the paper puts at `claimed`: nine tenths of it hold, any gain holds in part.
fn saving(saved: f64, claimed: f64) -> &'static str {
    if saved >= 0.9 * claimed {
        HOLDS
    } else if saved > 0.0 {
        IN_PART
    } else {
        FAILS
    }
}

/// A row of a share of time saved [%].
fn row_of_saving(claim: &str, claimed: f64, saved: Option<f64>, what: &str) -> Row {
    let verdict = saved.map_or(MISSING, |saved| saving(saved, claimed));
    let number = saved.map_or(String::new(), |saved| format!("{} %{what}", number(saved)));
    Row { claim: claim.to_owned(), verdict, number, page: "paper" }
}

/// A row of a number that must be below a bar, or above.
fn row_of_bar(claim: &str, value: Option<f64>, holds: impl Fn(f64) -> bool, words: &str, page: &'static str) -> Row {
    let verdict = value.map_or(MISSING, |value| if holds(value) { HOLDS } else { FAILS });
    let number = value.map_or(String::new(), |value| format!("{} {words}", number(value)));
    Row { claim: claim.to_owned(), verdict, number, page }
}

fn most(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    values.into_iter().reduce(f64::max)
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// All claims with numbers.
pub(super) fn rows(folder: &Folder) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (scenario, what) in [("rod", "rods"), ("helix", "helices")] {
        let file = folder.read("paper", &format!("performance-{scenario}-segments-raw"))?;
        let saved = |chart: &str, guess: &str| file.as_ref().map_or(Vec::new(), |file| file.curve(chart, guess));
        let projection = saved("projection: time saved", "gn");
        rows.push(row_of_saving(
            &format!("the guess saves up to 50 % of the first solve of a step, {what}"),
            50.0,
            most(projection.iter().map(|[_, y]| *y)),
            " at best, over the number of segments",
        ));
        let whole = saved("whole simulation: time saved", "gn");
        rows.push(row_of_saving(
            &format!("the whole simulation comes to save as much as the solve with growing N, {what}"),
            projection.last().map_or(50.0, |[_, y]| y.max(1.0)),
            whole.last().map(|[_, y]| *y),
            &format!(
                " of the whole and {} % of the solve at the largest N",
                projection.last().map_or("-".to_owned(), |[_, y]| number(*y))
            ),
        ));
    }
    for (scenario, claim, claimed) in [
        ("helix", "helices save about 50 % beyond the 50 frames of the training", 50.0),
        ("rod", "rods go on saving beyond them", 1.0),
    ] {
        let file = folder.read("paper", &format!("temporal-{scenario}-raw"))?;
        let curve = file.map_or(Vec::new(), |file| file.curve("iterations", "gn"));
        let beyond: Vec<f64> = curve.iter().filter(|[frame, _]| *frame > 50.0).map(|[_, y]| *y).collect();
        let saved = mean(&beyond).map(|mean| 100.0 * (1.0 - mean));
        rows.push(row_of_saving(claim, claimed, saved, " of the iterations"));
    }
    for (scene, name, claimed, file) in [
        ("helix-on-plane", "a helix on a plane", 10.0, "speedups-raw"),
        ("two-rods", "two rods that collide", 6.0, "speedups-raw"),
        ("knot", "the knot", 10.4, "speedups-raw"),
        ("trees-10", "trees of 10 rods", 17.0, "speedups-block-jacobi"),
        ("trees-70", "trees of 70 rods", 11.1, "speedups-block-jacobi"),
    ] {
        let numbers = folder.read("paper", file)?;
        let saved = numbers.and_then(|numbers| {
            let name =
                numbers.distinct("scene").into_iter().find(|own| own.split(' ').next() == Some(scene))?.to_owned();
            numbers.value(&[("scene", &name), ("way", "gn")], "total saved")
        });
        rows.push(row_of_saving(&format!("{name}: {claimed} % of the whole time saved"), claimed, saved, ""));
    }
    let worst = folder.read("paper", "long-term-worst")?;
    let length =
        |way: &str| worst.as_ref().and_then(|worst| most(worst.values(&[("way", way)], "largest change of length")));
    let claim = "with the guess in the solver a rod keeps its length";
    rows.push(row_of_bar(
        claim,
        length("gn"),
        |change| change < 1e-3,
        "is the largest relative change in 2,000 steps",
        "paper",
    ));
    let claim = "predictions alone diverge";
    rows.push(row_of_bar(
        claim,
        length("gn, end to end"),
        |change| change > 1.0,
        "is the largest relative change",
        "paper",
    ));
    let agreement = folder.read("paper", "dynamics-agreement")?;
    let distance = agreement.and_then(|agreement| {
        most(
            ["rod, gn", "helix, gn"]
                .into_iter()
                .flat_map(|way| agreement.values(&[("scenes, way", way)], "largest distance of any segment")),
        )
    });
    let claim = "motions with the guess are those without";
    rows.push(row_of_bar(claim, distance, |distance| distance < 1e-3, "rod lengths apart at most", "paper"));
    let knot =
        folder.read("paper", "knot-ways")?.and_then(|knot| knot.value(&[("way", "gn")], "determinant at the end"));
    rows.push(row_of_bar(
        "the knot stays a knot",
        knot,
        |value| (value - 3.0).abs() < 0.1,
        "is its determinant (a trefoil's is 3)",
        "paper",
    ));
    let choices = folder.read("accuracy", "needs-choices")?;
    let rate = choices.and_then(|choices| {
        let having = [("scene", "tree-70"), ("formulation", "newton")];
        choices.value(&having, "times real time")
    });
    let claim = "a tree of over 1,000 nodes runs at interactive rates";
    rows.push(row_of_bar(claim, rate, |rate| rate >= 1.0, "times real time, with the direct solver", "accuracy"));
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_saving_is_judged_by_the_paper_s() {
        assert_eq!([46.0, 10.0, -1.0].map(|saved| saving(saved, 50.0)), [HOLDS, IN_PART, FAILS]);
    }

    #[test]
    fn what_is_not_there_is_not_measured() {
        let nowhere = tempfile::tempdir().unwrap();
        let rows = rows(&Folder(nowhere.path().to_owned())).unwrap();
        assert!(rows.len() > 12 && rows.iter().all(|row| row.verdict == MISSING));
    }
}
