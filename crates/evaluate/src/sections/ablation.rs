//! The ablation sweep: heat maps of what `train sweep` measured.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context as _, Result};
use evaluation::ablation::{Architecture, Budget, FREE, GuessSavings, PLANAR, SCHEMA_VERSION, Summary, Sweep, Test};
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

impl Job for Ablation {
    fn prepare(&mut self, context: &Context) -> Result<f64> {
        self.summary = read(&context.sweep).context("--sweep")?;
        Ok(0.0)
    }

    fn show(&self, _: &Context) -> Result<PageSection> {
        let absent = "There is no summary of a sweep. `cargo run -p train -- sweep` makes the networks, and \
                      `cargo run -p train -- sweep merge` the summary.";
        let blocks = self.summary.as_ref().map_or_else(|| vec![Block::Paragraph(absent.to_owned())], blocks);
        Ok(PageSection { id: "ablation".to_owned(), title: "Ablation".to_owned(), blocks })
    }

    fn claims(&self, _: &Context) -> Result<BTreeMap<String, String>> {
        let Some(summary) = &self.summary else { return Ok(BTreeMap::new()) };
        let Sweep { grid, test, .. } = &summary.sweep;
        let minutes = summary.cells.iter().map(|cell| cell.outcome.training_s / 60.0);
        let [least, most] = minutes.fold([f64::INFINITY, 0.0], |[low, high], x| [low.min(x), high.max(x)]);
        let mut claims = BTreeMap::from([
            ("ablation-simulations".to_owned(), test.simulations.to_string()),
            ("ablation-steps".to_owned(), test.steps.to_string()),
            ("training-hours-all".to_owned(), format!("{least:.1} to {most:.1} minutes")),
        ]);
        type With = fn(u16, Architecture) -> Architecture;
        let varied: [(&str, &[u16], With); 3] = [
            ("ablation-blocks", &grid.gn_blocks, |gn_blocks, others| Architecture { gn_blocks, ..others }),
            ("ablation-layers", &grid.mlp_layers, |mlp_layers, others| Architecture { mlp_layers, ..others }),
            ("ablation-width", &grid.widths, |width, others| Architecture { width, ..others }),
        ];
        for (id, values, with) in varied {
            let of_subject = |subject: Subject<'_>| {
                let ratio = |&value: &u16| {
                    let ratio = subject.mean(with(value, grid.benchmark), iterations);
                    format!("{value}: {}", ratio.map_or("-".to_owned(), number))
                };
                let ratios = values.iter().map(ratio).collect::<Vec<_>>().join(", ");
                format!("{} {ratios}", subject.name())
            };
            let words = subjects(summary).map(of_subject).collect::<Vec<_>>().join("; ");
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
        Ok(bytes) => Ok(Some(export::unseal(file, &bytes, SCHEMA_VERSION)?)),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error).with_context(|| format!("cannot read {}", file.display())),
    }
}

/// What is shown of a guess: a number of its savings.
type Shown = fn(&GuessSavings) -> Option<Spread>;

fn iterations(savings: &GuessSavings) -> Option<Spread> {
    savings.iteration_ratio
}

/// A guess, [`FREE`] or [`PLANAR`], of the networks of one kind of scenes.
#[derive(Clone, Copy)]
struct Subject<'a> {
    summary: &'a Summary,
    scenario: &'a str,
    guess: &'a str,
    /// Preconditioner and tolerance of conjugate gradients.
    solver: (&'a str, f64),
}

/// Each kind of scenes with each guess that was measured there, with the solver whose numbers are told in words.
fn subjects(summary: &Summary) -> impl Iterator<Item = Subject<'_>> {
    let Sweep { sources, grid, .. } = &summary.sweep;
    let all = sources.iter().flat_map(|source| {
        [FREE, PLANAR].map(|guess| Subject { summary, scenario: &source.scenario, guess, solver: ("raw", 1e-4) })
    });
    all.filter(|subject| grid.architectures().iter().any(|&own| subject.mean(own, iterations).is_some()))
}

impl Subject<'_> {
    fn name(self) -> String {
        format!("{}, gn{}", self.scenario, if self.guess == PLANAR { ", planar" } else { "" })
    }

    /// The medians of an architecture's networks, with their seeds.
    fn medians(self, architecture: Architecture, shown: Shown) -> impl Iterator<Item = (u64, f64)> {
        let Self { summary, scenario, guess, solver } = self;
        let cells = summary.cells.iter();
        let networks = cells.filter(move |cell| cell.scenario == scenario && cell.architecture == architecture);
        networks.filter_map(move |cell| {
            let mut rows = cell.outcome.rows.iter().filter(|own| own.guess == guess);
            let row = rows.find(|own| (own.preconditioner.as_str(), own.tolerance) == solver)?;
            Some((cell.seed, shown(row)?.median))
        })
    }

    /// Mean over the seeds.
    fn mean(self, architecture: Architecture, shown: Shown) -> Option<f64> {
        Some(Spread::of(self.medians(architecture, shown).map(|(_, median)| median))?.mean)
    }
}

const INTRODUCTION: &str = "The supplement's figure on the architecture: networks of other sizes after equal budgets of \
    training, measured on held-out simulations. The paper says in words that more than four GN blocks bring nothing more, \
    deeper perceptrons nothing, and wider ones something, most for the helix.";

fn blocks(summary: &Summary) -> Vec<Block> {
    let mut blocks = vec![Block::Paragraph(INTRODUCTION.to_owned())];
    if !summary.lost.is_empty() {
        blocks.push(Block::Paragraph(format!("**{} cells are missing.**", summary.lost.len())));
    }
    for subject in subjects(summary) {
        let other = Subject { solver: ("block-jacobi", 1e-2), ..subject };
        blocks.extend([subject, other].map(|own| Block::Figure(figure(own))));
    }
    blocks.push(Block::Table(seeds(summary)));
    blocks
}

fn figure(subject: Subject<'_>) -> Figure {
    let grid = &subject.summary.sweep.grid;
    let benchmark = grid.benchmark;
    let by_width = grid.widths.iter().map(|&width| (width, Architecture { width, ..benchmark })).collect::<Vec<_>>();
    let of_layers = |&mlp_layers: &u16| (mlp_layers, Architecture { mlp_layers, ..benchmark });
    let by_layers = grid.mlp_layers.iter().map(of_layers).collect();
    let maps = [("width", grid.gn_blocks.clone(), by_width), ("MLP layers", vec![benchmark.gn_blocks], by_layers)];
    let shown: [(&str, &str, Shown); 3] = [
        ("iterations", "relative to zero", iterations),
        ("inference", "us a solve", |savings| savings.inference_us),
        ("speed-up of the solve, guess included", "time of zero over time", |savings| savings.speed_up),
    ];
    let mut charts = Vec::new();
    for (column_label, rows, columns) in maps {
        for (title, value_label, shown) in shown {
            let value = |gn_blocks, own| subject.mean(Architecture { gn_blocks, ..own }, shown);
            charts.push(HeatMap {
                title: title.to_owned(),
                row_label: "GN blocks".to_owned(),
                column_label: column_label.to_owned(),
                value_label: value_label.to_owned(),
                rows: rows.iter().map(u16::to_string).collect(),
                columns: columns.iter().map(|(name, _)| name.to_string()).collect(),
                values: rows.iter().map(|&row| columns.iter().map(|&(_, own)| value(row, own)).collect()).collect(),
                centre: (title != "inference").then_some(1.0),
            });
        }
    }
    let Subject { scenario, guess, solver: (preconditioner, tolerance), .. } = subject;
    Figure {
        id: format!("ablation-{scenario}-{guess}-{preconditioner}"),
        title: format!("{}: {preconditioner} conjugate gradients to {tolerance:e}", subject.name()),
        caption: "Means over the seeds of medians over the held-out simulations.".to_owned(),
        charts: Charts::Heat(charts),
        conditions: conditions(subject.summary, scenario),
    }
}

fn conditions(summary: &Summary, scenario: &str) -> report::Conditions {
    let Sweep { seeds, budget, test: Test { simulations, steps, seed }, sources, .. } = &summary.sweep;
    let Budget { recipe, batch, learning_rate, schedule, loss, epochs, .. } = budget;
    let visits = sources.iter().find(|source| source.scenario == scenario).map_or(0, |source| source.nodes * epochs);
    let mut machines: Vec<&str> = summary.cells.iter().map(|cell| cell.outcome.machine.as_str()).collect();
    machines.dedup();
    let measured = format!("{simulations} simulations of {steps} steps, seed {seed}, every fifth step after the tenth");
    report::Conditions::new("budget", format!("{epochs} epochs, {visits} node visits, equal for all"))
        .with("recipe", format!("{recipe}, batch {batch}, rate {learning_rate:e} ({schedule}), loss {loss}"))
        .with("seeds", format!("{seeds:?}"))
        .with("measured on", measured)
        .with("time", "guess with features and inference, and solve; ratios within one run")
        .with("machine", machines.join("; "))
}

/// How far seeds differ.
fn seeds(summary: &Summary) -> Table {
    let Sweep { seeds, grid, .. } = &summary.sweep;
    let row = |subject: Subject<'_>, architecture: Architecture| {
        let medians: BTreeMap<u64, f64> = subject.medians(architecture, iterations).collect();
        let name = Cell::from(format!("{}, {architecture}", subject.name()));
        let own = |seed| medians.get(seed).map_or("-".to_owned(), |&median| number(median)).into();
        std::iter::once(name).chain(seeds.iter().map(own)).collect()
    };
    let of_subject = |subject| grid.architectures().into_iter().map(move |own| row(subject, own));
    let of_seed = seeds.iter().map(|seed| Column::number(format!("seed {seed}")));
    Table {
        id: "ablation-seeds".to_owned(),
        title: "Iterations relative to zero, raw 1e-4, by seed".to_owned(),
        caption: "Medians over the held-out simulations.".to_owned(),
        columns: std::iter::once(Column::text("network")).chain(of_seed).collect(),
        rows: subjects(summary).flat_map(of_subject).collect(),
        conditions: conditions(summary, subjects(summary).next().map_or("", |subject| subject.scenario)),
    }
}
