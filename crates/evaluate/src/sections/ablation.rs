//! The ablation sweep: heat maps of what `train sweep` measured.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context as _, Result};
use evaluation::ablation::{Architecture, Budget, FREE, PLANAR, Row, SCHEMA_VERSION, Summary, Sweep, SweepCell, Test};
use evaluation::guesses::Spread;
use report::{Block, Cell, Charts, Column, Figure, HeatMap, Section as PageSection, Table};

use crate::cells::Job;
use crate::context::Context;
use crate::show::number;
use crate::sources::Provenance;

/// The section, with the sweep's summary where there is one.
#[derive(Default)]
pub(crate) struct Ablation {
    summary: Option<Summary>,
}

const ID: &str = "ablation";

impl Job for Ablation {
    fn prepare(&mut self, context: &Context) -> Result<f64> {
        self.summary = read(&context.sweep)?;
        Ok(0.0)
    }

    fn show(&self, _: &Context) -> Result<PageSection> {
        let blocks = match &self.summary {
            Some(summary) => blocks(summary),
            None => vec![Block::Paragraph(
                "There is no summary of a sweep. `cargo run -p train -- sweep` makes the networks, and \
                 `cargo run -p train -- sweep merge` the summary."
                    .to_owned(),
            )],
        };
        Ok(PageSection { id: ID.to_owned(), title: "Ablation".to_owned(), blocks })
    }

    fn claims(&self, _: &Context) -> Result<BTreeMap<String, String>> {
        let Some(summary) = &self.summary else { return Ok(BTreeMap::new()) };
        let mut claims = BTreeMap::from([
            ("ablation-simulations".to_owned(), summary.sweep.test.simulations.to_string()),
            ("ablation-steps".to_owned(), summary.sweep.test.steps.to_string()),
        ]);
        let training = summary.cells.iter().map(|cell| cell.outcome.training_s / 60.0);
        let ends = training.fold([f64::INFINITY, 0.0], |[low, high]: [f64; 2], x| [low.min(x), high.max(x)]);
        claims.insert("training-hours-all".to_owned(), format!("{:.1} to {:.1} minutes", ends[0], ends[1]));
        let vary = |of: &dyn Fn(u16) -> Architecture, values: &[u16]| {
            let of_subject = |subject: Subject<'_>| {
                let ratios = values.iter().map(|&value| match mean(summary, subject, of(value), SOLVER, iterations) {
                    Some(ratio) => format!("{value}: {}", number(ratio)),
                    None => format!("{value}: -"),
                });
                format!("{}, {} {}", subject.scenario, subject.name, ratios.collect::<Vec<_>>().join(", "))
            };
            subjects(summary).into_iter().map(of_subject).collect::<Vec<_>>().join("; ")
        };
        let (grid, benchmark) = (&summary.sweep.grid, summary.sweep.grid.benchmark);
        let blocks = vary(&|gn_blocks| Architecture { gn_blocks, ..benchmark }, &grid.gn_blocks);
        let layers = vary(&|mlp_layers| Architecture { mlp_layers, ..benchmark }, &grid.mlp_layers);
        let widths = vary(&|width| Architecture { width, ..benchmark }, &grid.widths);
        for (id, words) in [("ablation-blocks", blocks), ("ablation-layers", layers), ("ablation-width", widths)] {
            claims.insert(id.to_owned(), format!("iterations relative to zero, raw 1e-4: {words}"));
        }
        Ok(claims)
    }

    fn provenance(&self) -> Provenance {
        let mut provenance = Provenance::default();
        for outcome in self.summary.iter().flat_map(|summary| &summary.cells).map(|cell| &cell.outcome) {
            let revision = outcome.git_revision.as_deref().unwrap_or("unknown");
            provenance.add(&outcome.machine, revision, None, outcome.measuring_s);
        }
        provenance
    }
}

/// The summary; `None` where there is no file.
fn read(file: &Path) -> Result<Option<Summary>> {
    match std::fs::read(file) {
        Ok(bytes) => Ok(Some(export::unseal(file, &bytes, SCHEMA_VERSION).context("--sweep")?)),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error).with_context(|| format!("--sweep: cannot read {}", file.display())),
    }
}

/// Preconditioner and tolerance whose numbers are told in words.
const SOLVER: (&str, f64) = ("raw", 1e-4);

/// What is shown of a row, with its name and unit.
type Shown = (&'static str, &'static str, fn(&Row) -> Option<Spread>);

const SHOWN: [Shown; 3] = [
    ("iterations", "relative to zero", iterations),
    ("inference", "us a solve", |row| row.inference_us),
    ("speed-up of the solve, guess included", "time of zero over time", |row| row.speed_up),
];

fn iterations(row: &Row) -> Option<Spread> {
    row.iteration_ratio
}

/// A guess of the networks of one kind of scenes.
#[derive(Clone, Copy)]
struct Subject<'a> {
    scenario: &'a str,
    /// As it stands in rows.
    guess: &'a str,
    /// As it is shown.
    name: &'a str,
}

/// Each kind of scenes with each guess that was measured there.
fn subjects(summary: &Summary) -> Vec<Subject<'_>> {
    let all = summary.sweep.sources.iter().flat_map(|source| {
        [(FREE, "gn"), (PLANAR, "gn, planar")].map(|(guess, name)| Subject { scenario: &source.scenario, guess, name })
    });
    let is_there = |subject: &Subject<'_>| {
        let mut own = summary.cells.iter().filter(|cell| cell.scenario == subject.scenario);
        own.any(|cell| cell.outcome.rows.iter().any(|row| row.guess == subject.guess))
    };
    all.filter(is_there).collect()
}

/// The medians of a network with one guess and solver.
fn of_cell(
    cell: &SweepCell,
    guess: &str,
    (preconditioner, tolerance): (&str, f64),
    value: fn(&Row) -> Option<Spread>,
) -> Option<f64> {
    let is_asked =
        |row: &&Row| row.guess == guess && row.preconditioner == preconditioner && row.tolerance == tolerance;
    value(cell.outcome.rows.iter().find(is_asked)?).map(|spread| spread.median)
}

/// The networks of an architecture, one a seed.
fn networks<'a>(
    summary: &'a Summary,
    scenario: &str,
    architecture: Architecture,
) -> impl Iterator<Item = &'a SweepCell> {
    summary.cells.iter().filter(move |cell| cell.scenario == scenario && cell.architecture == architecture)
}

/// Mean over the seeds.
fn mean(
    summary: &Summary,
    subject: Subject<'_>,
    architecture: Architecture,
    solver: (&str, f64),
    value: fn(&Row) -> Option<Spread>,
) -> Option<f64> {
    let networks = networks(summary, subject.scenario, architecture);
    let medians = networks.filter_map(|cell| of_cell(cell, subject.guess, solver, value));
    Some(Spread::of(medians)?.mean)
}

fn blocks(summary: &Summary) -> Vec<Block> {
    let mut blocks = vec![Block::Paragraph(INTRODUCTION.to_owned())];
    if !summary.lost.is_empty() {
        blocks.push(Block::Paragraph(format!("**{} cells are missing.**", summary.lost.len())));
    }
    for subject in subjects(summary) {
        for solver in [SOLVER, ("block-jacobi", 1e-2)] {
            blocks.push(Block::Figure(figure(summary, subject, solver)));
        }
    }
    blocks.push(Block::Table(seeds(summary)));
    blocks
}

fn figure(summary: &Summary, subject: Subject<'_>, solver: (&str, f64)) -> Figure {
    let (grid, benchmark) = (&summary.sweep.grid, summary.sweep.grid.benchmark);
    let names = |values: &[u16]| values.iter().map(u16::to_string).collect::<Vec<_>>();
    let by_width = |gn_blocks, width| Architecture { gn_blocks, width, ..benchmark };
    let by_layers = |_, mlp_layers| Architecture { mlp_layers, ..benchmark };
    type Of<'a> = &'a dyn Fn(u16, u16) -> Architecture;
    let maps: [(&str, &[u16], &[u16], Of<'_>); 2] = [
        ("width", &grid.gn_blocks, &grid.widths, &by_width),
        ("MLP layers", &[benchmark.gn_blocks], &grid.mlp_layers, &by_layers),
    ];
    let map = |(column_label, rows, columns, of): (&str, &[u16], &[u16], Of<'_>), &(title, label, value): &Shown| {
        let value = |row: u16, column: u16| mean(summary, subject, of(row, column), solver, value);
        HeatMap {
            title: title.to_owned(),
            row_label: "GN blocks".to_owned(),
            column_label: column_label.to_owned(),
            value_label: label.to_owned(),
            rows: names(rows),
            columns: names(columns),
            values: rows.iter().map(|&row| columns.iter().map(|&column| value(row, column)).collect()).collect(),
            centre: (title != "inference").then_some(1.0),
        }
    };
    let (Subject { scenario, guess, name }, (preconditioner, tolerance)) = (subject, solver);
    Figure {
        id: format!("ablation-{scenario}-{guess}-{preconditioner}"),
        title: format!("{scenario}, {name}: {preconditioner} conjugate gradients to {tolerance:e}"),
        caption: "Means over the seeds of medians over the held-out simulations.".to_owned(),
        charts: Charts::Heat(
            maps.into_iter().flat_map(|maps| SHOWN.iter().map(move |shown| map(maps, shown))).collect(),
        ),
        conditions: conditions(summary, scenario),
    }
}

const INTRODUCTION: &str = "The supplement's figure on the architecture: networks of other sizes after equal budgets of \
    training, measured on held-out simulations. The paper says in words that more than four GN blocks bring nothing more, \
    deeper perceptrons nothing, and wider ones something, most for the helix.";

fn conditions(summary: &Summary, scenario: &str) -> report::Conditions {
    let Sweep { seeds, budget, test, sources, .. } = &summary.sweep;
    let visits =
        sources.iter().find(|source| source.scenario == scenario).map_or(0, |source| source.nodes * budget.epochs);
    let mut machines: Vec<&str> = summary.cells.iter().map(|cell| cell.outcome.machine.as_str()).collect();
    machines.dedup();
    let Budget { recipe, batch, learning_rate, schedule, loss, epochs, .. } = budget;
    let Test { simulations, steps, seed } = test;
    report::Conditions::new("budget", format!("{epochs} epochs, {visits} node visits, equal for all"))
        .with("recipe", format!("{recipe}, batch {batch}, rate {learning_rate:e} ({schedule}), loss {loss}"))
        .with("seeds", format!("{seeds:?}"))
        .with(
            "measured on",
            format!("{simulations} simulations of {steps} steps, seed {seed}, every fifth step after the tenth"),
        )
        .with("time", "guess with features and inference, and solve; ratios within one run")
        .with("machine", machines.join("; "))
}

/// How far seeds differ.
fn seeds(summary: &Summary) -> Table {
    let all = subjects(summary).into_iter().flat_map(|subject| {
        summary.sweep.grid.architectures().into_iter().map(move |architecture| (subject, architecture))
    });
    let row = |(Subject { scenario, guess, name }, architecture): (Subject<'_>, Architecture)| {
        let own = |&seed: &u64| {
            let cell = networks(summary, scenario, architecture).find(|cell| cell.seed == seed);
            cell.and_then(|cell| of_cell(cell, guess, SOLVER, iterations)).map_or("-".to_owned(), number).into()
        };
        let name = Cell::from(format!("{scenario}, {name}, {architecture}"));
        std::iter::once(name).chain(summary.sweep.seeds.iter().map(own)).collect()
    };
    let of_seed = summary.sweep.seeds.iter().map(|seed| Column::number(format!("seed {seed}")));
    Table {
        id: "ablation-seeds".to_owned(),
        title: "Iterations relative to zero, raw 1e-4, by seed".to_owned(),
        caption: "Medians over the held-out simulations.".to_owned(),
        columns: std::iter::once(Column::text("network")).chain(of_seed).collect(),
        rows: all.map(row).collect(),
        conditions: conditions(summary, subjects(summary).first().map_or("", |subject| subject.scenario)),
    }
}
