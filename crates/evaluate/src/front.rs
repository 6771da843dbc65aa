//! The first page of a report: answers, each with a number from the CSV files of the other pages and a link to them.
//!
//! It measures nothing and remembers nothing: whatever pages lie beside it, measured at one time or at several, it quotes
//! them as they are and says when and where each was measured. What a page does not have is said to be missing.

mod claims;
mod starts;

use std::path::Path;

use anyhow::{Context as _, Result};
use report::{Axis, Block, Cell, Charts, Conditions, Figure, LineChart, Page, Point, Section, Series};

use crate::blocks::{chart, quoted, section, table};
use crate::numbers::{Folder, PAGE};
use crate::show::number;
use crate::sources::{Provenance, REVISION};

/// Scenes whose error over run time stands on the first page: free, slack, stiff and heavy rods, a tree, and contacts.
const SCENES: [&str; 6] = ["bending-rod", "tip-mass", "ball-in-orbit", "tree-10", "drum", "wire-on-floor"];

/// The first page of the report in this folder, with pages in these folders below, each with what it is about.
pub(crate) fn page(out: &Path, pages: &[(&str, &str)]) -> Result<Page> {
    let folder = Folder(out.to_owned());
    let sections = vec![
        paper(&folder)?,
        starts::section(&folder)?,
        accuracy(&folder)?,
        stability(&folder)?,
        left_out(&folder)?,
        measured(&folder, pages)?,
    ];
    Ok(Page {
        title: "Elastic rods: what holds, what pays, what to trust".to_owned(),
        lead: vec![format!(
            "Should I use a learned guess? For equilibria without a history and for real cables, yes; for steps of a motion, no: \
             the tables below have the ratios. Which defaults should I trust? Formulation `newton` with integrator `bdf2`, which the \
             simulator takes by itself. How accurate and how fast is my scene? The figure shows six kinds of scenes; {} has the \
             others.",
            link(&folder, "accuracy", "accuracy")
        )],
        conditions: Conditions::new("program", format!("evaluate {}", env!("CARGO_PKG_VERSION")))
            .with("revision", REVISION)
            .with("numbers", "from the CSV files of the pages that the tables name"),
        sections,
    })
}

/// A link to another page, in a paragraph; plain text where there is no such page.
fn link(folder: &Folder, page: &str, text: &str) -> String {
    if folder.0.join(page).join(PAGE).is_file() { format!("[{text}]({page}/index.html)") } else { text.to_owned() }
}

/// What the paper claims.
fn paper(folder: &Folder) -> Result<Section> {
    let rows = claims::rows(folder)?;
    let count = |verdict| rows.iter().filter(|row| row.verdict == verdict).count();
    let introduction = format!(
        "The claims of \"Accurately Solving Physical Systems with Graph Learning\" (ICLR 2021), and what came of them here: {} hold, \
         {} hold in part, {} do not. Savings are of time against conjugate gradients from zero, as in the paper; \
         {} of the paper stand beside ours.",
        count(claims::HOLDS),
        count(claims::IN_PART),
        count(claims::FAILS),
        link(folder, "paper", "all 93 numbers")
    );
    let cells = rows.into_iter().map(|claims::Row { claim, verdict, number, page }| {
        let verdict = if verdict == claims::HOLDS { Cell::strong(verdict) } else { verdict.into() };
        vec![claim.into(), verdict, number.into(), page.into()]
    });
    let head = ["paper-claims", "What the paper claims, and whether it holds here", ""];
    let table = table(head, "claim | here | measured | page", cells.collect(), quoted("paper/, accuracy/"));
    Ok(section(["paper-holds", "The paper", &introduction], vec![table]))
}

/// Error against run time in one figure.
fn accuracy(folder: &Folder) -> Result<Section> {
    let mut charts = Vec::new();
    for scene in SCENES {
        charts.extend(scene_chart(folder, scene)?);
    }
    let overview = folder.read("accuracy", "time-step-overview")?;
    let ratios = overview.map(|overview| {
        let all = overview.distinct("scene").len();
        let ratios = overview.values(&[], "default, to it");
        let within = |bar: f64| ratios.iter().filter(|&&ratio| ratio <= bar).count();
        let compared = overview.select(&[], ["scene"]).count();
        format!(
            "In {all} scenes and {compared} comparisons at equal error the default is the fastest of the four combinations of \
             formulation and integrator in {}, and within 1.25 times the fastest in {}.",
            within(1.0),
            within(1.25)
        )
    });
    let introduction = ratios.unwrap_or("Not measured yet.".to_owned());
    let mut blocks = Vec::new();
    if !charts.is_empty() {
        blocks.push(Block::Figure(Figure {
            id: "error-and-time".to_owned(),
            title: "Error against run time, from four times each scene's time step to an eighth of it".to_owned(),
            caption: "Lower and further left is better; solid: the default. Positions, but for the force of the wire and the angular \
                      momentum of the ball."
                .to_owned(),
            charts: Charts::Lines(charts),
            conditions: quoted("accuracy/csv/time-step-SCENE.csv"),
        }));
    }
    Ok(section(["accuracy", "Accuracy and speed", &introduction], blocks))
}

/// The first chart of a scene's figure.
fn scene_chart(folder: &Folder, scene: &str) -> Result<Option<LineChart>> {
    let Some(numbers) = folder.read("accuracy", &format!("time-step-{scene}"))? else { return Ok(None) };
    let Some(first) = numbers.distinct("chart").first().copied() else { return Ok(None) };
    let series = numbers.distinct("series").into_iter().map(|name| {
        let points = numbers.curve(first, name).into_iter().map(|[x, y]| Point { x, y, ..Point::default() });
        Series { dashed: !name.contains("(default)"), ..Series::new(name, points) }
    });
    let axes = [Axis::log("wall time per simulated second [ms]"), Axis::log("error")];
    Ok(Some(chart(scene, axes, series.collect(), Vec::new())))
}

/// Stability in one table.
fn stability(folder: &Folder) -> Result<Section> {
    let mut rows = Vec::new();
    if let Some(cases) = folder.read("accuracy", "stability-cases")? {
        for formulation in cases.distinct("formulation") {
            let having = [("formulation", formulation)];
            let all: Vec<_> = cases.select(&having, ["status", "case"]).collect();
            let failed: Vec<&str> =
                all.iter().filter(|[status, _]| !status.starts_with("converged")).map(|[_, case]| *case).collect();
            let most = |column| cases.values(&having, column).into_iter().fold(0.0, f64::max);
            rows.push(vec![
                format!("extreme cases, {formulation}").into(),
                all.len().to_string().into(),
                failed.len().to_string().into(),
                number(most("energy rise")).into(),
                number(most("depth")).into(),
                if failed.is_empty() { Cell::muted("-") } else { failed.join("; ").into() },
            ]);
        }
    }
    if let Some(laws) = folder.read("random", "laws-broken")? {
        for [what, count, of, remark] in laws.select(&[], ["law", "scenes", "of", "which"]) {
            rows.push(vec![
                format!("random scenes: {what}").into(),
                of.into(),
                count.into(),
                "".into(),
                "".into(),
                remark.into(),
            ]);
        }
    }
    let introduction = format!(
        "Stiff (1e12 Pa), slack, tiny, huge and degenerate rods, and scenes drawn at random and held against laws of mechanics. Each row \
         counts what is not as it must be; {} lists every case, {} every scene.",
        link(folder, "accuracy", "accuracy"),
        link(folder, "random", "random scenes")
    );
    let mut blocks = Vec::new();
    if !rows.is_empty() {
        let head = [
            "stability-in-short",
            "Numerical stability",
            "Energy rise relative to the energy at stake; depth relative to the radius.",
        ];
        let headings = "what | #cases | #not as it must be | #largest energy rise | #deepest overlap | which";
        blocks.push(table(
            head,
            headings,
            rows,
            quoted("accuracy/csv/stability-cases.csv, random/csv/laws-broken.csv"),
        ));
    }
    Ok(section(["stability", "Stability", &introduction], blocks))
}

/// What each scene leaves out in one table.
fn left_out(folder: &Folder) -> Result<Section> {
    let Some(needs) = folder.read("accuracy", "needs-left-out")? else {
        return Ok(section(["needs", "What each scene leaves out", "Not measured yet."], Vec::new()));
    };
    let done: f64 = needs.values(&[], "times done all the same").iter().sum();
    let all = needs.distinct("left out");
    let row = |scene: &str| {
        let own: Vec<&str> = needs.select(&[("scene", scene)], ["left out"]).map(|[what]| what).collect();
        let mark = |what: &&str| if own.contains(what) { Cell::muted("-") } else { Cell::from("yes") };
        [Cell::from(scene)].into_iter().chain(all.iter().map(mark)).collect()
    };
    let rows = needs.distinct("scene").into_iter().map(row).collect();
    let introduction = format!(
        "A scene pays for nothing that it does not use. \"-\": the stage does not run, which counters confirm ({done} of them ran all \
         the same)."
    );
    let head = ["left-out", "Which stages run in which scene", ""];
    let table = table(
        head,
        &["scene"].into_iter().chain(all.iter().copied()).collect::<Vec<_>>().join(" | "),
        rows,
        quoted("accuracy/csv/needs-left-out.csv"),
    );
    Ok(section(["needs", "What each scene leaves out", &introduction], vec![table]))
}

/// When and where each page was measured.
fn measured(folder: &Folder, pages: &[(&str, &str)]) -> Result<Section> {
    let mut rows = Vec::new();
    for &(page, what) in pages {
        let file = folder.0.join(page).join(PAGE);
        if !file.is_file() {
            rows.push(vec![page.into(), Cell::muted("not measured"), "".into(), "".into(), "".into()]);
            continue;
        }
        let html = std::fs::read_to_string(&file).with_context(|| format!("cannot read {}", file.display()))?;
        let name = Cell::from(format!("{page}: {what}"));
        rows.push([name].into_iter().chain(Provenance::of_page(&html).texts().map(Cell::from)).collect());
    }
    let head = ["provenance", "When and where each page was measured", ""];
    let headings = "page | date | machine | revision | #minutes of one core";
    let table = table(head, headings, rows, Conditions::new("from", "the end of each section of the pages"));
    Ok(section(["measured-at", "Measured", "Times of one table come from one machine in one run."], vec![table]))
}
