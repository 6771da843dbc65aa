//! `evaluate guesses`: where the guesses of linear solves stand, on random scenes that none of them has seen.

use anyhow::{Result, bail};
use catalogue::{GuessName, Row, rows};
use clap::Args;
use dataset::Scenario;
use evaluation::guesses::{
    self, BUCKETS, BesideZero, DIRECT, EVERY, IMPULSE_AFTER, IMPULSE_SPEED, IMPULSE_STEPS, Spread, beside_zero,
};
use evaluation::starts::{Measured, Plan};
use graph::planar_normal;
use report::{Block, Cell, Column, Conditions, Section, Table};
use solver::formulation::Formulation;
use solver::simulation::{GuessFactory, Settings};
use terminal::Progress;

use super::{ScenesArgs, with_networks};
use crate::Outcome;
use crate::ways::PRECONDITIONERS;

/// Tolerances of the tables.
pub(super) const TOLERANCES: [f64; 3] = [1e-2, 1e-4, 1e-6];
/// Columns of a table, and cells of a guess in a bucket.
const COLUMNS: usize = PRECONDITIONERS.len() * TOLERANCES.len();

#[derive(Args, Debug)]
pub(crate) struct GuessesArgs {
    #[command(flatten)]
    scenes: ScenesArgs,
    /// Guesses to compare with the zero start. Where the scenes are planar (rod), knn and gn are shown a second time,
    /// restricted to the plane; gn-best always is.
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "GUESSES",
        default_value = "previous,linear,quadratic,fischer,frozen,knn,gn,gn-best"
    )]
    guess: Vec<GuessName>,
}

/// What was measured in one scenario: of each bucket with solves, the guesses.
struct OfScenario {
    title: String,
    buckets: Vec<(usize, Vec<BesideZero>)>,
}

/// Measures all guesses and shows the tables.
pub(crate) fn guesses(args: &GuessesArgs) -> Result<Outcome> {
    if let Some(name) = args.guess.iter().find(|name| name.helps_steps()) {
        bail!("--guess {name} starts whole steps, but guesses of linear solves are compared here");
    }
    let scenes = &args.scenes;
    let loaded = scenes.load(&args.guess)?;
    let progress = Progress::new(loaded.len() * scenes.simulations * scenes.steps, "steps", scenes.output.quiet)?;
    let mut conditions = scenes.conditions();
    let mut measured = Vec::new();
    for (scenario, guesses) in &loaded {
        let rows = rows(guesses, *scenario == Scenario::Rod);
        conditions = with_networks(conditions, scenario.name(), &rows);
        measured.push((scenario.name(), measure(scenes, *scenario, &rows, &progress)?));
    }
    let mut blocks = vec![Block::Paragraph(format!(
        "Formulation xpbd, exact motion, first outer iteration of each step (of the later ones every {EVERY}th); after step\n\
         {IMPULSE_AFTER} the rod is struck: its tip gets {IMPULSE_SPEED} m/s, and the {IMPULSE_STEPS} steps after it are told apart. Per cent of \
         the zero\nstart: sum over a simulation's solves divided by the zero start's sum on the same systems; median over the\n\
         simulations, and its quartiles; * where it is the least. Times include all that a guess does and learns."
    ))];
    for (name, OfScenario { title, buckets }) in &measured {
        for (bucket, cells) in buckets {
            for (what, is_time) in [("iterations", false), ("time of guess and solve", true)] {
                let id = format!("guesses-{name}-{bucket}-{}", if is_time { "time" } else { "iterations" });
                let title = format!("{title}, {}: {what}", BUCKETS[*bucket]);
                blocks.push(Block::Table(table(&id, title, cells, is_time, conditions.clone())));
            }
        }
    }
    for (_, of_scenario) in measured.iter().filter(|(_, of_scenario)| !of_scenario.buckets.is_empty()) {
        blocks.push(Block::Paragraph(in_words(of_scenario)));
        let cells = of_scenario.buckets.iter().flat_map(|(_, cells)| cells);
        blocks.extend(dropped(cells).map(Block::Paragraph));
    }
    let section = Section { id: "guesses".to_owned(), title: "Guesses on random scenes".to_owned(), blocks };
    scenes.output.finish(section, conditions, progress)
}

fn measure(args: &ScenesArgs, scenario: Scenario, rows: &[Row<'_>], progress: &Progress) -> Result<OfScenario> {
    // The paper's formulation, and the data sets'.
    let mut settings = Settings::default();
    settings.step.formulation = Formulation::Xpbd;
    let measured: Vec<Measured> = args.measure(scenario, false, progress, |scene| {
        let plane = planar_normal(&scene.model, &scene.state);
        let factories: Vec<_> = rows.iter().map(|row| row.factory(plane)).collect();
        let guess = |(row, factory)| {
            let row: &Row<'_> = row;
            (row.name.clone(), row.guess_name.helps_solves().then_some(factory as GuessFactory<'_>))
        };
        let plan = plan(rows.iter().zip(&factories).map(guess).collect(), args.steps);
        let (model, state, dt) = (&scene.model, &scene.state, scene.run.dt);
        Ok(guesses::measure(model, state, dt, &settings, &plan, || progress.advance())?)
    })?;
    // The names and columns are all that a table takes of a plan.
    let plan = plan(rows.iter().map(|row| (row.name.clone(), None)).collect(), args.steps);
    let buckets = (0..BUCKETS.len()).map(|bucket| (bucket, beside_zero(&plan, &measured, bucket)));
    let buckets = buckets.filter(|(_, cells)| cells.iter().any(|cell| cell.count(|own| own.solves) > 0)).collect();
    Ok(OfScenario { title: format!("{scenario}, {} simulations", measured.len()), buckets })
}

fn plan(guesses: Vec<(String, Option<GuessFactory<'_>>)>, steps: usize) -> Plan<'_> {
    Plan {
        guesses,
        preconditioners: PRECONDITIONERS.to_vec(),
        tolerances: TOLERANCES.to_vec(),
        max_iterations: None,
        buckets: guesses::buckets(steps),
    }
}

/// What is shown of a cell relative to the zero start.
fn ratio(cell: &BesideZero, is_time: bool) -> Option<Spread> {
    if is_time { cell.time_ratio() } else { cell.iteration_ratio() }
}

/// The cell with the smallest median of each column; of equal ones the first.
fn best(cells: &[BesideZero], is_time: bool) -> Vec<&BesideZero> {
    let median = |cell: &BesideZero| ratio(cell, is_time).map_or(f64::INFINITY, |spread| spread.median);
    let column = |k: usize| cells.iter().skip(k).step_by(COLUMNS);
    (0..COLUMNS).filter_map(|k| column(k).min_by(|a, b| median(a).total_cmp(&median(b)))).collect()
}

/// A row a guess: the zero start in numbers, the others in per cent of it.
pub(super) fn table(id: &str, title: String, cells: &[BesideZero], is_time: bool, conditions: Conditions) -> Table {
    let best = best(cells, is_time);
    let cell = |cell: &BesideZero, is_zero: bool, best: &BesideZero| {
        let number = |zero: &evaluation::starts::Tally| match is_time {
            true => 1e6 * zero.solve_s / zero.solves as f64,
            false => zero.iterations as f64 / zero.solves as f64,
        };
        let spread = if is_zero { cell.spread(|zero, _| number(zero)) } else { ratio(cell, is_time) };
        let Some(Spread { lower, median, upper, .. }) = spread else { return Cell::muted("-") };
        let [lower, per_cent, upper] = [lower, median, upper].map(|x| 100.0 * x);
        match (is_zero, is_time || cell.sums.len() == 1) {
            (true, _) => format!("{median:.0}").into(),
            (false, true) if best.guess == cell.guess => Cell::strong(format!("{per_cent:.0}")),
            (false, true) => format!("{per_cent:.0}").into(),
            (false, false) if best.guess == cell.guess => Cell::strong(format!("{per_cent:.0} {lower:.0}-{upper:.0}")),
            (false, false) => format!("{per_cent:.0} {lower:.0}-{upper:.0}").into(),
        }
    };
    let rows = cells.chunks(COLUMNS).enumerate().map(|(k, own)| {
        let name = match (k, is_time) {
            (0, false) => "zero, count",
            (0, true) => "zero, us",
            _ => own[0].guess.as_str(),
        };
        let cells = own.iter().zip(&best).map(|(own, best)| cell(own, k == 0, best));
        std::iter::once(name.into()).chain(cells).collect::<Vec<Cell>>()
    });
    let columns = PRECONDITIONERS.iter().flat_map(|kind| TOLERANCES.map(|tolerance| format!("{kind} {tolerance:e}")));
    Table {
        id: id.to_owned(),
        title,
        caption: "Per cent of the zero start, which stands in numbers.".to_owned(),
        columns: std::iter::once(Column::text("%")).chain(columns.map(Column::number)).collect(),
        rows: rows.filter(|row| row[1..].iter().any(|cell| *cell != "-".into())).collect(),
        conditions,
    }
}

/// Each guess once, in their order.
fn names<'a>(cells: impl Iterator<Item = &'a BesideZero>) -> Vec<&'a str> {
    let mut names: Vec<&str> = Vec::new();
    for cell in cells {
        if !names.contains(&cell.guess.as_str()) {
            names.push(&cell.guess);
        }
    }
    names
}

/// How many starts of which guesses were dropped; `None` where none was.
pub(super) fn dropped<'a>(cells: impl IntoIterator<Item = &'a BesideZero> + Clone) -> Option<String> {
    let of = |name: &&str| {
        let own = || cells.clone().into_iter().filter(|cell| cell.guess == *name);
        let dropped: u64 = own().map(|cell| cell.count(|own| own.dropped)).sum();
        let solves: u64 = own().map(|cell| cell.count(|own| own.solves)).sum();
        (dropped > 0).then(|| format!("{name} {dropped} of {solves}"))
    };
    let lines: Vec<String> = names(cells.clone().into_iter()).iter().filter_map(of).collect();
    let words = || format!("Starts dropped, since their rounding errors would show: {}", lines.join("; "));
    (!lines.is_empty()).then(words)
}

/// How the direct solve, Fischer's projection and networks do.
fn in_words(of_scenario: &OfScenario) -> String {
    let buckets = || of_scenario.buckets.iter().map(|(_, cells)| cells);
    let total = of_scenario.buckets.len() * COLUMNS;
    let wins = |is: fn(&str) -> bool, is_time| {
        buckets().flat_map(|cells| best(cells, is_time)).filter(|cell| is(&cell.guess)).count()
    };
    let mut words = format!(
        "{}: the direct solve takes less time than conjugate gradients from any start in {} of {total} cells.",
        of_scenario.title,
        wins(|name| name == DIRECT, true)
    );
    let names = names(buckets().flatten());
    if names.iter().any(|name| name.starts_with("fischer")) {
        let fewest = wins(|name| name.starts_with("fischer"), false);
        words += &format!("\nFischer's projection needs the fewest iterations in {fewest} of {total} cells.");
    }
    for name in names.into_iter().filter(|name| name.starts_with("gn")) {
        let [iterations, time] = [false, true].map(|is_time| {
            let own = buckets().flatten().filter(|cell| cell.guess == name);
            own.filter(|cell| ratio(cell, is_time).is_some_and(|spread| spread.median < 1.0)).count()
        });
        words += &format!(
            "\n{name} needs fewer iterations than the zero start in {iterations} of {total} cells, less time in {time}."
        );
    }
    words
}
