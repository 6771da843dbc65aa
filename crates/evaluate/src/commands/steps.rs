//! `evaluate steps`: where starts of whole steps stand, on random scenes that no network has seen.

use anyhow::{Result, bail};
use catalogue::{GuessName, Row, rows};
use clap::Args;
use dataset::Scenario;
use evaluation::compare::{Entry, EntryRun, run_in_turns};
use evaluation::guesses::Spread;
use evaluation::precision::{Level, Outer};
use graph::planar_normal;
use report::{Block, Conditions, Section, Table};
use solver::counters::Counters;
use solver::formulation::Formulation;
use solver::simulation::{GuessFactory, Settings};
use solver::step::StepParams;
use terminal::{Progress, positive};

use super::{ScenesArgs, with_networks};
use crate::Outcome;
use crate::show::{columns, number, per_cent, spread};

/// Steps of a turn.
const TURN: usize = 10;

#[derive(Args, Debug)]
pub(crate) struct StepsArgs {
    #[command(flatten)]
    scenes: ScenesArgs,
    /// Time steps [s].
    #[arg(long, value_delimiter = ',', default_value = "0.02,0.05,0.1", value_parser = positive,
        allow_hyphen_values = true)]
    dt: Vec<f64>,
    /// Residuals at which a step is done, relative to that of its prediction.
    #[arg(long, value_delimiter = ',', default_value = "1e-3,1e-6", value_parser = positive,
        allow_hyphen_values = true)]
    tolerance: Vec<f64>,
    /// Starts to compare with the prediction (zero).
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "GUESSES",
        default_value = "step-previous,step-linear,step-quadratic,gn-step"
    )]
    guess: Vec<GuessName>,
}

/// One kind of scenes at one time step and tolerance.
struct Sheet {
    /// In words.
    kind: String,
    dt_s: f64,
    tolerance: f64,
    /// Name of each start, and whether it has learned before the first step.
    starts: Vec<(String, bool)>,
    /// Of each simulation a run from each start.
    simulations: Vec<Vec<EntryRun>>,
}

/// Measures all starts and shows the tables.
pub(crate) fn steps(args: &StepsArgs) -> Result<Outcome> {
    let scenes = &args.scenes;
    if let Some(scenario) = scenes.scenario.iter().find(|scenario| !scenario.teaches_steps()) {
        bail!("--scenario {scenario}, but starts of whole steps are compared on rod and helix: in free motion");
    }
    if let Some(name) = args.guess.iter().find(|name| name.helps_solves()) {
        bail!("--guess {name} starts linear solves, but starts of whole steps are compared here");
    }
    let loaded = scenes.load(&args.guess)?;
    let cells = args.dt.iter().flat_map(|&dt| args.tolerance.iter().map(move |&tolerance| (dt, tolerance)));
    let count = loaded.len() * 2 * cells.clone().count() * scenes.simulations * scenes.steps;
    let progress = Progress::new(count, "steps", scenes.output.quiet)?;
    let mut conditions = scenes.conditions();
    let mut kinds: Vec<Vec<Sheet>> = Vec::new();
    for (scenario, guesses) in &loaded {
        // In planar scenes starts stay in the plane where they know of it.
        let rows = rows(guesses, false);
        conditions = with_networks(conditions, scenario.name(), &rows);
        for is_slack in [false, true] {
            let sheet = |cell| measure(scenes, *scenario, is_slack, cell, &rows, &progress);
            let mut sheets = cells.clone().map(sheet).collect::<Result<Vec<_>>>()?;
            sheets.retain(|sheet| !sheet.simulations.is_empty());
            kinds.push(sheets);
        }
    }
    kinds.retain(|sheets| !sheets.is_empty());
    let mut blocks = vec![Block::Paragraph(
        "Formulation newton, direct solves; slack: rods of radius 0.01 m and 1000 kg/m^3, helices of radius 0.02 m, moduli 1e4\n\
         to 1e5 Pa. Medians over the simulations; ratios are to the best start without learning, in the same simulation;\n\
         times are of whole steps, guesses included; the error is that of positions against a tight reference."
            .to_owned(),
    )];
    blocks.extend(kinds.iter().map(|sheets| Block::Table(table(sheets, conditions.clone()))));
    let sheets: Vec<&Sheet> = kinds.iter().flatten().collect();
    blocks.extend(in_words(&sheets).into_iter().map(Block::Paragraph));
    let section = Section { id: "steps".to_owned(), title: "Starts of whole steps".to_owned(), blocks };
    scenes.output.finish(section, conditions, progress)
}

/// Simulates all scenes of a sheet from all starts.
fn measure(
    args: &ScenesArgs,
    scenario: Scenario,
    is_slack: bool,
    (dt_s, tolerance): (f64, f64),
    rows: &[Row<'_>],
    progress: &Progress,
) -> Result<Sheet> {
    let step = StepParams { formulation: Formulation::Newton, ..StepParams::DEFAULT };
    let at = |tolerance| Level::new(Outer::Tolerance(tolerance)).settings(&Settings { step, ..Settings::default() });
    let (settings, mut reference) = (at(tolerance), at(1e-3 * tolerance.min(1e-6)));
    reference.step.absolute_tolerance = reference.step.relative_tolerance;
    let simulations = args.measure(scenario, is_slack, progress, |scene| {
        let plane = planar_normal(&scene.model, &scene.state);
        let factories: Vec<_> = rows.iter().map(|row| row.factory(plane)).collect();
        let entry = |(row, factory)| {
            let row: &Row<'_> = row;
            let guess = row.guess_name.helps_steps().then_some(factory as GuessFactory<'_>);
            Entry { name: row.name.clone(), settings, guess }
        };
        let entries: Vec<_> = rows.iter().zip(&factories).map(entry).collect();
        let (span, beside) = ((dt_s, args.steps), (TURN, &reference));
        let advance = |steps| progress.advance_by(steps);
        Ok(run_in_turns(&scene.model, &scene.state, span, beside, &entries, advance)?.rows)
    })?;
    let starts = rows.iter().map(|row| (row.name.clone(), row.guess_name.is_learned())).collect();
    let kind = format!("{}{scenario}", if is_slack { "slack " } else { "" });
    Ok(Sheet { kind, dt_s, tolerance, starts, simulations })
}

/// Outer iterations a step.
fn iterations(run: &EntryRun) -> f64 {
    run.counters.iterations as f64 / run.by_step.len() as f64
}

/// Time a step [us].
fn time_us(run: &EntryRun) -> f64 {
    1e6 * run.counters.times.total().as_secs_f64() / run.by_step.len() as f64
}

impl Sheet {
    /// A number of a start, over the simulations.
    fn spread(&self, start: usize, value: impl Fn(&EntryRun) -> f64) -> Option<Spread> {
        Spread::of(self.simulations.iter().map(|runs| value(&runs[start])))
    }

    /// The same relative to that of the start without learning that has the least, in the median.
    fn ratio(&self, start: usize, value: fn(&EntryRun) -> f64) -> Option<Spread> {
        let median = |&start: &usize| self.spread(start, value).map_or(f64::INFINITY, |spread| spread.median);
        let plain = (0..self.starts.len()).filter(|&start| !self.starts[start].1);
        let best = plain.min_by(|a, b| median(a).total_cmp(&median(b)))?;
        Spread::of(self.simulations.iter().map(|runs| value(&runs[start]) / value(&runs[best])))
    }

    /// How often something happened, of all steps.
    fn share(&self, start: usize, count: fn(&Counters) -> u64) -> f64 {
        let runs = || self.simulations.iter().map(|runs| &runs[start]);
        let steps: usize = runs().map(|run| run.by_step.len()).sum();
        runs().map(|run| count(&run.counters)).sum::<u64>() as f64 / steps.max(1) as f64
    }
}

const RETRIED: fn(&Counters) -> u64 = |counters| counters.retries;
const DROPPED: fn(&Counters) -> u64 = |counters| counters.guesses_dropped;
const FAILED: fn(&Counters) -> u64 = |counters| counters.not_converged + counters.non_finite;

/// A row for each start of each sheet of one kind.
fn table(sheets: &[Sheet], conditions: Conditions) -> Table {
    let median = |spread: Option<Spread>| spread.map_or("-".to_owned(), |spread| number(spread.median));
    let row = |sheet: &Sheet, start: usize| {
        let own = |value: fn(&EntryRun) -> f64| median(sheet.spread(start, value));
        vec![
            sheet.dt_s.to_string().into(),
            format!("{:e}", sheet.tolerance).into(),
            sheet.starts[start].0.as_str().into(),
            own(iterations).into(),
            median(sheet.ratio(start, iterations)).into(),
            own(time_us).into(),
            spread(sheet.ratio(start, time_us).as_ref(), 1.0).into(),
            own(|run| 1e6 * run.counters.times.guess.as_secs_f64() / run.by_step.len() as f64).into(),
            per_cent(sheet.share(start, RETRIED)).into(),
            per_cent(sheet.share(start, DROPPED)).into(),
            per_cent(sheet.share(start, FAILED)).into(),
            own(|run| run.error).into(),
        ]
    };
    let kind = sheets.first().map_or("", |sheet| sheet.kind.as_str());
    let least = sheets.iter().map(|sheet| sheet.simulations.len()).min().unwrap_or(0);
    Table {
        id: format!("steps-{}", kind.replace(' ', "-")),
        title: format!("{kind}, {least} simulations"),
        caption: "Outer iterations and time a step; the guess's part of the time; shares are of all steps.".to_owned(),
        columns: columns(&[
            "#dt [s]",
            "#tolerance",
            "start",
            "#outer",
            "#ratio",
            "#us",
            "#ratio (quartiles)",
            "#guess [us]",
            "#halved",
            "#dropped",
            "#not converged",
            "#error",
        ]),
        rows: sheets.iter().flat_map(|sheet| (0..sheet.starts.len()).map(|start| row(sheet, start))).collect(),
        conditions,
    }
}

/// How each learned start does.
fn in_words(sheets: &[&Sheet]) -> Vec<String> {
    let Some(first) = sheets.first() else { return Vec::new() };
    let learned = first.starts.iter().enumerate().filter(|(_, (_, is_learned))| *is_learned);
    let words = |(start, (name, _)): (usize, &(String, bool))| {
        let less = |value: fn(&EntryRun) -> f64| {
            let ratios = sheets.iter().filter_map(|sheet| sheet.ratio(start, value));
            ratios.filter(|ratio| ratio.median < 1.0).count()
        };
        let highest = |count| sheets.iter().map(|sheet| sheet.share(start, count)).fold(0.0, f64::max);
        let (fewer, faster, total) = (less(iterations), less(time_us), sheets.len());
        let (dropped, failed) = (per_cent(highest(DROPPED)), per_cent(highest(FAILED)));
        format!(
            "{name} needs fewer outer iterations than every start without learning in {fewer} of {total} cells, and less\n\
             time, its own included, in {faster}. At most {dropped} of its starts were dropped, or their step done again;\n\
             at most {failed} of the steps did not converge."
        )
    };
    learned.map(words).collect()
}
