//! `evaluate guesses`, `evaluate steps`: where guesses of linear solves, and starts of whole steps, stand on random scenes
//! that none of them has seen. A table has a row a guess; a number is the median over the simulations.

use std::collections::BTreeMap;

use anyhow::{Result, bail};
use catalogue::{GuessName, Row, Sources, Training, load, rows};
use clap::Args;
use cosserat::guess::{GuessFactory, GuessKind};
use cosserat::scene::Scene;
use cosserat::simulation::{Formulation, Integrator, Settings, StepParams};
use dataset::{Config, Scenario};
use evaluation::compare::{Entry, EntryRun, run_in_turns};
use evaluation::guesses::{
    self, BUCKETS, BesideZero, EVERY, IMPULSE_AFTER, IMPULSE_SPEED, IMPULSE_STEPS, NamedStart, Plan, Spread, Tally,
    beside_zero,
};
use evaluation::precision::{Level, Outer};
use graph::planar_normal;
use report::{Block, Cell, Conditions};
use terminal::{Progress, positive};

use super::{OutputArgs, at_least_one, conditions, with_networks};
use crate::blocks::table;
use crate::library::Guesses;
use crate::outcome::Outcome;
use crate::show::number;
use crate::ways::PRECONDITIONERS;

/// Tolerances of conjugate gradients.
const TOLERANCES: [f64; 3] = [1e-2, 1e-4, 1e-6];
/// Steps of a turn.
const TURN: usize = 10;

/// Random scenes to measure on.
#[derive(Args, Debug)]
struct ScenesArgs {
    /// Which random scenes: rod, helix, knot, tree (`steps`: rod, helix).
    #[arg(long, value_delimiter = ',', default_value = "rod,helix")]
    scenario: Vec<Scenario>,
    /// Simulations of each kind of scenes (for `steps`, at each time step and tolerance).
    #[arg(long, default_value = "50", value_parser = at_least_one, allow_hyphen_values = true)]
    simulations: usize,
    /// Steps of each. In `guesses` the rod is struck after step 60.
    #[arg(long, default_value = "100", value_parser = at_least_one, allow_hyphen_values = true)]
    steps: usize,
    /// Seed of the scenes. Those that learned guesses know have seed 0.
    #[arg(long, default_value = "1")]
    seed: u64,
    #[command(flatten)]
    learned: Sources,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Args, Debug)]
pub(crate) struct GuessesArgs {
    #[command(flatten)]
    scenes: ScenesArgs,
    /// Guesses to compare with the zero start. Where the scenes are planar (rod), knn and gn are shown a second time,
    /// restricted to the plane; gn-best always is.
    #[arg(long, value_delimiter = ',', default_value = "previous,linear,quadratic,fischer,frozen,knn,gn,gn-best")]
    guess: Vec<GuessName>,
}

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
    #[arg(long, value_delimiter = ',', default_value = "step-previous,step-linear,step-quadratic,gn-step")]
    guess: Vec<GuessName>,
}

impl ScenesArgs {
    /// The zero start and these guesses, for each scenario that is asked for.
    fn load(&self, guesses: &[GuessName]) -> Result<Vec<(Scenario, Guesses)>> {
        if self.seed == Config::table_1(Scenario::Rod).seed {
            bail!(
                "--seed {}, but it must differ from the data sets' seed: learned guesses have seen those scenes",
                self.seed
            );
        }
        self.output.prepare()?;
        let scenarios: Vec<Scenario> = Scenario::ALL.into_iter().filter(|one| self.scenario.contains(one)).collect();
        let trainings = Training::of(&self.learned, guesses, &scenarios, self.output.quiet)?;
        let names = || std::iter::once(GuessName::Plain(GuessKind::Zero)).chain(guesses.iter().copied());
        trainings.iter().map(|training| Ok((training.scenario, load(names(), training)?))).collect()
    }

    /// Measures scenes of one kind, or slack variants of them, with these guesses; leaves out what Ctrl-C cut off.
    fn measure<T>(
        &self,
        (scenario, is_slack): (Scenario, bool),
        rows: &[Row<'_>],
        progress: &Progress,
        mut measure: impl FnMut(&Scene, Vec<NamedStart<'_>>) -> Result<T>,
    ) -> Result<Vec<T>> {
        let mut measured = Vec::new();
        for index in 0..self.simulations as u64 {
            let parameters = scenario.sample(self.seed, index);
            let slack = if is_slack { parameters.slack() } else { None };
            let scene = slack.unwrap_or(parameters).scene()?;
            let plane = planar_normal(&scene.model, &scene.state);
            let factories: Vec<_> = rows.iter().map(|row| row.factory(plane)).collect();
            let starts =
                rows.iter().zip(&factories).map(|(row, own)| (row.name.clone(), Some(own as GuessFactory<'_>)));
            let one = measure(&scene, starts.collect())?;
            if progress.stopped() {
                break;
            }
            measured.push(one);
        }
        Ok(measured)
    }

    /// What holds for all numbers on these scenes.
    fn conditions(&self) -> Conditions {
        conditions()
            .with("scenes", format!("random ones of the paper's Table 1, seed {}", self.seed))
            .with("steps", self.steps.to_string())
    }
}

/// These guesses of linear solves, with each preconditioner and tolerance.
pub(super) fn plan(
    guesses: Vec<NamedStart<'_>>,
    max_iterations: Option<u64>,
    buckets: Vec<Option<usize>>,
    is_struck: bool,
) -> Plan<'_> {
    let (preconditioners, tolerances) = (PRECONDITIONERS.to_vec(), TOLERANCES.to_vec());
    Plan { guesses, preconditioners, tolerances, max_iterations, buckets, is_struck }
}

/// Direct solves of a formulation.
fn direct(formulation: Formulation) -> Settings {
    Settings {
        step: StepParams { formulation, integrator: Integrator::Euler, ..StepParams::DEFAULT },
        ..Settings::default()
    }
}

/// Measures guesses of linear solves and shows the tables.
pub(crate) fn guesses(args: &GuessesArgs) -> Result<Outcome> {
    if let Some(name) = args.guess.iter().find(|name| name.helps_steps()) {
        bail!("--guess {name} starts whole steps, but guesses of linear solves are compared here");
    }
    let scenes = &args.scenes;
    let loaded = scenes.load(&args.guess)?;
    let progress = Progress::new(loaded.len() * scenes.simulations * scenes.steps, "steps", scenes.output.quiet)?;
    let mut conditions = scenes.conditions();
    let mut blocks = vec![Block::Paragraph(format!(
        "Formulation xpbd, exact motion, first outer iteration of each step (of the later ones every {EVERY}th); after step \
         {IMPULSE_AFTER} the rod is struck: its tip gets {IMPULSE_SPEED} m/s, and the {IMPULSE_STEPS} steps after it are \
         told apart. Per cent of the zero start, which stands in numbers (iterations or us a solve): sum over a \
         simulation's solves divided by the zero start's sum on the same systems; median over the simulations, and its \
         quartiles. Times include all that a guess does and learns."
    ))];
    // The paper's formulation, and the data sets'.
    let settings = direct(Formulation::Xpbd);
    for (scenario, guesses) in &loaded {
        let rows = rows(guesses, *scenario == Scenario::Rod);
        conditions = with_networks(conditions, scenario.name(), &rows);
        let measured = scenes.measure((*scenario, false), &rows, &progress, |scene, starts| {
            let plan = plan(starts, None, guesses::buckets(scenes.steps), true);
            Ok(guesses::measure(&scene.model, &scene.state, scene.run.dt, &settings, &plan, || progress.advance())?)
        })?;
        let mut all = Vec::new();
        for (bucket, name) in BUCKETS.iter().enumerate() {
            let cells = beside_zero(&measured, bucket);
            if cells.iter().all(|cell| cell.count(|own| own.solves) == 0) {
                continue;
            }
            for (what, is_time) in [("iterations", false), ("time", true)] {
                let title = format!("{scenario}, {} simulations, {name}: {what}", measured.len());
                let id = format!("guesses-{scenario}-{bucket}-{what}");
                blocks.push(solves_table([&id, &title], &cells, is_time, conditions.clone()));
            }
            all.extend(cells);
        }
        blocks.extend(dropped(&all));
    }
    scenes.output.finish(["guesses", "Guesses on random scenes"], blocks, conditions, progress)
}

/// A row a guess: the zero start in numbers, the others in per cent of it; none of those that have no numbers.
pub(super) fn solves_table(
    [id, title]: [&str; 2],
    cells: &[BesideZero],
    is_time: bool,
    conditions: Conditions,
) -> Block {
    let of_zero = |zero: &Tally, _: &Tally| {
        (if is_time { 1e6 * zero.solve_s } else { zero.iterations as f64 }) / zero.solves as f64
    };
    let ratio = if is_time { BesideZero::time_ratio } else { BesideZero::iteration_ratio };
    let is_zero = |cell: &BesideZero| cell.guess == cells[0].guess;
    let text = |cell: &BesideZero| match is_zero(cell) {
        true => cell.spread(of_zero).map(|spread| format!("{:.0}", spread.median)),
        false => ratio(cell).map(quartiles),
    };
    let row = |own: &[BesideZero]| {
        let texts: Vec<_> = own.iter().map(text).collect();
        texts.iter().any(Option::is_some).then(|| named([own[0].guess.clone()], texts))
    };
    let columns = cells.iter().filter(|cell| is_zero(cell));
    let columns = columns.map(|cell| format!(" | #{} {:e}", cell.preconditioner, cell.tolerance));
    let rows = cells.chunk_by(|a, b| a.guess == b.guess).filter_map(row).collect();
    table([id, title, ""], &format!("guess{}", columns.collect::<String>()), rows, conditions)
}

/// A row of a table: its names and its numbers, '-' where nothing was measured.
fn named<const N: usize>(names: [String; N], numbers: impl IntoIterator<Item = Option<String>>) -> Vec<Cell> {
    let numbers = numbers.into_iter().map(|number| number.unwrap_or_else(|| "-".to_owned()));
    names.into_iter().chain(numbers).map(Cell::from).collect()
}

/// Median and quartiles in per cent; one number where all ratios are alike.
fn quartiles(Spread { lower, median, upper, .. }: Spread) -> String {
    let [median, lower, upper] = [median, lower, upper].map(|ratio| format!("{:.0}", 100.0 * ratio));
    if lower == upper { median } else { format!("{median} {lower}-{upper}") }
}

/// How many starts of which guesses were dropped; `None` where none was.
pub(super) fn dropped(cells: &[BesideZero]) -> Option<Block> {
    let mut counts = BTreeMap::new();
    for cell in cells {
        let [dropped, solves] = counts.entry(&cell.guess).or_insert([0; 2]);
        *dropped += cell.count(|own| own.dropped);
        *solves += cell.count(|own| own.solves);
    }
    counts.retain(|_, [dropped, _]| *dropped > 0);
    let words: Vec<_> = counts.iter().map(|(name, [dropped, of])| format!("{name} {dropped} of {of}")).collect();
    let words = format!("Starts dropped, since their rounding errors would show: {}", words.join("; "));
    (!counts.is_empty()).then_some(Block::Paragraph(words))
}

/// A number of a run.
type Value = fn(&EntryRun) -> f64;

/// A count a step.
fn a_step(run: &EntryRun, count: u64) -> f64 {
    count as f64 / run.by_step.len() as f64
}

/// Columns of the tables of starts.
const HEADINGS: &str =
    "dt [s] | tolerance | start | #outer | #outer % | #time [us] | #time % | #again % | #failed % | #error";

/// Measures starts of whole steps and shows the tables.
pub(crate) fn steps(args: &StepsArgs) -> Result<Outcome> {
    let scenes = &args.scenes;
    if let Some(scenario) = scenes.scenario.iter().find(|scenario| !scenario.teaches_steps()) {
        bail!("--scenario {scenario}, but starts of whole steps are compared on rod and helix: in free motion");
    }
    if let Some(name) = args.guess.iter().find(|name| name.helps_solves()) {
        bail!("--guess {name} starts linear solves, but starts of whole steps are compared here");
    }
    let loaded = scenes.load(&args.guess)?;
    let cells: Vec<(f64, f64)> =
        args.dt.iter().flat_map(|&dt| args.tolerance.iter().map(move |&tolerance| (dt, tolerance))).collect();
    let count = loaded.len() * 2 * cells.len() * scenes.simulations * scenes.steps;
    let progress = Progress::new(count, "steps", scenes.output.quiet)?;
    let mut conditions = scenes.conditions();
    let words = "Formulation newton, direct solves; slack: rods of radius 0.01 m and 1000 kg/m^3, helices of radius 0.02 m, \
                 moduli 1e4 to 1e5 Pa. Outer iterations and time a step, guesses included: medians over the simulations, and \
                 in per cent of the best start without learning, median and quartiles. Again: starts dropped, and steps done \
                 again; failed: steps that did not converge; both of all steps. Error: the largest of positions against a \
                 tight reference, median.";
    let mut blocks = vec![Block::Paragraph(words.to_owned())];
    let at = |tolerance| Level::new(Outer::Tolerance(tolerance)).settings(&direct(Formulation::Newton));
    for (scenario, guesses) in &loaded {
        // In planar scenes starts stay in the plane where they know of it.
        let rows = rows(guesses, false);
        conditions = with_networks(conditions, scenario.name(), &rows);
        for (kind, is_slack) in [("", false), ("slack-", true)] {
            let (mut lines, mut least) = (Vec::new(), scenes.simulations);
            for &(dt, tolerance) in &cells {
                let (settings, mut reference) = (at(tolerance), at(1e-3 * tolerance.min(1e-6)));
                reference.step.absolute_tolerance = reference.step.relative_tolerance;
                let measured = scenes.measure((*scenario, is_slack), &rows, &progress, |scene, starts| {
                    let entry = |(name, guess)| Entry { name, settings, guess };
                    let entries: Vec<_> = starts.into_iter().map(entry).collect();
                    let (times, turns) = ((dt, scenes.steps), (TURN, &reference));
                    let advance = |steps| progress.advance_by(steps);
                    Ok(run_in_turns(&scene.model, &scene.state, times, turns, &entries, advance)?.rows)
                })?;
                least = least.min(measured.len());
                lines.extend((0..rows.len()).map(|start| line((dt, tolerance), &measured, &rows, start)));
            }
            let (id, title) = (format!("steps-{kind}{scenario}"), format!("{kind}{scenario}, {least} simulations"));
            blocks.push(table([&id, &title, ""], HEADINGS, lines, conditions.clone()));
        }
    }
    scenes.output.finish(["steps", "Starts of whole steps"], blocks, conditions, progress)
}

/// A start with this time step and tolerance over the simulations, each of which has a run from each start.
fn line((dt, tolerance): (f64, f64), simulations: &[Vec<EntryRun>], rows: &[Row<'_>], start: usize) -> Vec<Cell> {
    let spread = |start: usize, value: Value| Spread::of(simulations.iter().map(|runs| value(&runs[start])));
    let median = |value: Value| Some(number(spread(start, value)?.median));
    let share = |value: Value| Some(format!("{:.1}", 100.0 * spread(start, value)?.mean));
    let of_best = |value: Value| {
        let median = |&start: &usize| spread(start, value).map_or(f64::INFINITY, |spread| spread.median);
        let plain = (0..rows.len()).filter(|&start| !rows[start].guess_name.is_learned());
        let best = plain.min_by(|a, b| median(a).total_cmp(&median(b)))?;
        Spread::of(simulations.iter().map(|runs| value(&runs[start]) / value(&runs[best]))).map(quartiles)
    };
    let names = [dt.to_string(), format!("{tolerance:e}"), rows[start].name.clone()];
    let iterations: Value = |run| a_step(run, run.counters.iterations);
    let time_us: Value = |run| 1e6 * run.counters.times.total().as_secs_f64() / run.by_step.len() as f64;
    let numbers = [
        median(iterations),
        of_best(iterations),
        median(time_us),
        of_best(time_us),
        share(|run| a_step(run, run.counters.guesses_dropped + run.counters.retries)),
        share(|run| a_step(run, run.counters.not_converged + run.counters.non_finite)),
        median(|run| run.error),
    ];
    named(names, numbers)
}
