//! `evaluate guesses`, `evaluate steps`: where guesses of linear solves, and starts of whole steps, stand on random scenes
//! that none of them has seen. A table has a row a guess; a number is the median over the simulations.

use anyhow::{Result, bail};
use catalogue::{GuessName, Row, Sources, Training, load, rows};
use clap::Args;
use dataset::{Config, Scenario};
use evaluation::compare::{Entry, EntryRun, run_in_turns};
use evaluation::guesses::{
    self, BUCKETS, BesideZero, DIRECT, EVERY, IMPULSE_AFTER, IMPULSE_SPEED, IMPULSE_STEPS, Plan, Spread, Tally,
    beside_zero,
};
use evaluation::precision::{Level, Outer};
use graph::planar_normal;
use report::{Block, Column, Conditions, Section, Table};
use scene::Scene;
use solver::formulation::Formulation;
use solver::guess::GuessKind;
use solver::simulation::{GuessFactory, Settings};
use solver::step::StepParams;
use terminal::{Progress, positive};

use super::{OutputArgs, at_least_one, conditions, with_networks};
use crate::Outcome;
use crate::library::Guesses;
use crate::show::number;
use crate::ways::PRECONDITIONERS;

/// Tolerances of conjugate gradients.
pub(super) const TOLERANCES: [f64; 3] = [1e-2, 1e-4, 1e-6];
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
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "GUESSES",
        default_value = "previous,linear,quadratic,fischer,frozen,knn,gn,gn-best"
    )]
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
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "GUESSES",
        default_value = "step-previous,step-linear,step-quadratic,gn-step"
    )]
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
        let with_guesses = |training: &Training| {
            let names = std::iter::once(GuessName::Plain(GuessKind::Zero)).chain(guesses.iter().copied());
            Ok((training.scenario, load(names, training)?))
        };
        trainings.iter().map(with_guesses).collect()
    }

    /// Measures scenes of one kind, slack variants of Table 1's or those themselves, with these guesses; what Ctrl-C cut
    /// off is left out.
    fn measure<T>(
        &self,
        (scenario, is_slack): (Scenario, bool),
        rows: &[Row<'_>],
        progress: &Progress,
        mut measure: impl FnMut(&Scene, Vec<(String, Option<GuessFactory<'_>>)>) -> Result<T>,
    ) -> Result<Vec<T>> {
        let mut measured = Vec::new();
        for index in 0..self.simulations as u64 {
            let parameters = scenario.sample(self.seed, index);
            let slack = if is_slack { parameters.slack() } else { None };
            let scene = slack.unwrap_or(parameters).scene()?;
            let plane = planar_normal(&scene.model, &scene.state);
            let factories: Vec<_> = rows.iter().map(|row| row.factory(plane)).collect();
            let one = measure(&scene, named(rows, factories.iter().map(|own| own as GuessFactory<'_>)))?;
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

/// Each guess with its name; none for the zero start.
pub(super) fn named<'a>(
    rows: &[Row<'_>],
    factories: impl Iterator<Item = GuessFactory<'a>>,
) -> Vec<(String, Option<GuessFactory<'a>>)> {
    let is_zero = |row: &Row<'_>| row.guess_name == GuessName::Plain(GuessKind::Zero);
    rows.iter().zip(factories).map(|(row, own)| (row.name.clone(), (!is_zero(row)).then_some(own))).collect()
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
        "Formulation xpbd, exact motion, first outer iteration of each step (of the later ones every {EVERY}th); after step\n\
         {IMPULSE_AFTER} the rod is struck: its tip gets {IMPULSE_SPEED} m/s, and the {IMPULSE_STEPS} steps after it are told apart. {PER_CENT} \
         Times\ninclude all that a guess does and learns."
    ))];
    // The paper's formulation, and the data sets'.
    let mut settings = Settings::default();
    settings.step.formulation = Formulation::Xpbd;
    for (scenario, guesses) in &loaded {
        let rows = rows(guesses, *scenario == Scenario::Rod);
        conditions = with_networks(conditions, scenario.name(), &rows);
        let measured = scenes.measure((*scenario, false), &rows, &progress, |scene, guesses| {
            let plan = Plan {
                guesses,
                preconditioners: PRECONDITIONERS.to_vec(),
                tolerances: TOLERANCES.to_vec(),
                max_iterations: None,
                buckets: guesses::buckets(scenes.steps),
                is_struck: true,
            };
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
                blocks.push(Block::Table(solves_table(&id, title, &cells, is_time, conditions.clone())));
            }
            all.extend(cells);
        }
        blocks.extend(dropped(&all).map(Block::Paragraph));
    }
    let section = Section { id: "guesses".to_owned(), title: "Guesses on random scenes".to_owned(), blocks };
    scenes.output.finish(section, conditions, progress)
}

/// What ratios are.
const PER_CENT: &str = "Per cent of\nthe zero start, which stands in numbers (iterations or us a solve): sum over a \
                        simulation's solves divided by the\nzero start's sum on the same systems; median over the simulations, and \
                        its quartiles.";

/// A row a guess: the zero start in numbers, the others in per cent of it.
pub(super) fn solves_table(
    id: &str,
    title: String,
    cells: &[BesideZero],
    is_time: bool,
    conditions: Conditions,
) -> Table {
    let zero = cells.first().map_or("", |zero| &zero.guess);
    let of_zero = |zero: &Tally| match is_time {
        true => 1e6 * zero.solve_s / zero.solves as f64,
        false => zero.iterations as f64 / zero.solves as f64,
    };
    let text = |cell: &BesideZero| match is_time {
        _ if cell.guess == zero => cell.spread(|zero, _| of_zero(zero)).map(|spread| format!("{:.0}", spread.median)),
        true => cell.time_ratio().map(per_cent),
        false => cell.iteration_ratio().map(per_cent),
    };
    let columns: Vec<String> =
        PRECONDITIONERS.iter().flat_map(|kind| TOLERANCES.map(|tolerance| format!("{kind} {tolerance:e}"))).collect();
    let rows = cells.chunks(columns.len()).map(|own| (own[0].guess.clone(), own.iter().map(text).collect()));
    table(id, title, columns, rows.collect(), conditions)
}

/// Median and quartiles, of which there are none among ratios that are all alike.
fn per_cent(Spread { lower, median, upper, .. }: Spread) -> String {
    let [median, lower, upper] = [median, lower, upper].map(|ratio| format!("{:.0}", 100.0 * ratio));
    if lower == upper { median } else { format!("{median} {lower}-{upper}") }
}

/// A table of guesses, without rows where nothing was measured.
fn table(
    id: &str,
    title: String,
    columns: Vec<String>,
    mut rows: Vec<(String, Vec<Option<String>>)>,
    conditions: Conditions,
) -> Table {
    rows.retain(|(_, cells)| cells.iter().any(Option::is_some));
    let row = |(name, cells): (String, Vec<Option<String>>)| {
        let cells = cells.into_iter().map(|cell| cell.unwrap_or_else(|| "-".to_owned()).into());
        std::iter::once(name.into()).chain(cells).collect()
    };
    Table {
        id: id.to_owned(),
        title,
        caption: String::new(),
        columns: std::iter::once(Column::text("guess")).chain(columns.into_iter().map(Column::number)).collect(),
        rows: rows.into_iter().map(row).collect(),
        conditions,
    }
}

/// How many starts of which guesses were dropped; `None` where none was.
pub(super) fn dropped(cells: &[BesideZero]) -> Option<String> {
    let mut counts: Vec<(&str, [u64; 2])> = Vec::new();
    for cell in cells.iter().filter(|cell| cell.guess != DIRECT) {
        let own = [cell.count(|own| own.dropped), cell.count(|own| own.solves)];
        match counts.iter_mut().find(|(name, _)| *name == cell.guess) {
            Some((_, all)) => *all = [all[0] + own[0], all[1] + own[1]],
            None => counts.push((&cell.guess, own)),
        }
    }
    counts.retain(|(_, [dropped, _])| *dropped > 0);
    let words: Vec<_> = counts.iter().map(|(name, [dropped, of])| format!("{name} {dropped} of {of}")).collect();
    let words = format!("Starts dropped, since their rounding errors would show: {}", words.join("; "));
    (!counts.is_empty()).then_some(words)
}

/// What is shown of the runs from a start.
#[derive(Clone, Copy, PartialEq)]
enum Shown {
    Median,
    /// As per cent.
    Mean,
    /// Relative to the start without learning that has the least, in the median; within simulations.
    OfBest,
}

/// A number of a run.
type Value = fn(&EntryRun) -> f64;

const ITERATIONS: Value = |run| run.counters.iterations as f64 / run.by_step.len() as f64;
const TIME_US: Value = |run| 1e6 * run.counters.times.total().as_secs_f64() / run.by_step.len() as f64;

/// Tables of each kind of scenes: name, title, and what is shown.
const TABLES: [(&str, &str, Shown, Value); 7] = [
    ("outer", "outer iterations a step", Shown::Median, ITERATIONS),
    ("outer-ratio", "outer iterations, % of the best start without learning", Shown::OfBest, ITERATIONS),
    ("time", "time a step [us]", Shown::Median, TIME_US),
    ("time-ratio", "time, % of the best start without learning", Shown::OfBest, TIME_US),
    ("again", "starts dropped, and steps done again, % of all steps", Shown::Mean, |run| {
        (run.counters.guesses_dropped + run.counters.retries) as f64 / run.by_step.len() as f64
    }),
    ("failed", "steps that did not converge, %", Shown::Mean, |run| {
        (run.counters.not_converged + run.counters.non_finite) as f64 / run.by_step.len() as f64
    }),
    ("error", "largest position error against a tight reference", Shown::Median, |run| run.error),
];

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
    let mut blocks = vec![Block::Paragraph(
        "Formulation newton, direct solves; slack: rods of radius 0.01 m and 1000 kg/m^3, helices of radius 0.02 m, moduli 1e4\n\
         to 1e5 Pa. Medians over the simulations, and quartiles of ratios within them; shares are means. Times are of whole\n\
         steps, guesses included. Columns: time step [s] and tolerance."
            .to_owned(),
    )];
    for (scenario, guesses) in &loaded {
        // In planar scenes starts stay in the plane where they know of it.
        let rows = rows(guesses, false);
        conditions = with_networks(conditions, scenario.name(), &rows);
        for is_slack in [false, true] {
            let of_cell = |&cell: &(f64, f64)| {
                scenes.measure((*scenario, is_slack), &rows, &progress, |scene, guesses| {
                    from_starts(scene, guesses, cell, scenes.steps, &progress)
                })
            };
            let measured = cells.iter().map(of_cell).collect::<Result<Vec<_>>>()?;
            let kind = if is_slack { "slack-" } else { "" };
            let least = measured.iter().map(Vec::len).min().unwrap_or(0);
            for (id, title, shown, value) in TABLES.iter().filter(|_| measured.iter().any(|cell| !cell.is_empty())) {
                let of_row = |(start, row): (usize, &Row<'_>)| {
                    let text = |simulations: &Vec<_>| in_cell(simulations, &rows, start, *shown, *value);
                    (row.name.clone(), measured.iter().map(text).collect())
                };
                let columns = cells.iter().map(|(dt, tolerance)| format!("{dt} {tolerance:e}")).collect();
                blocks.push(Block::Table(table(
                    &format!("steps-{kind}{scenario}-{id}"),
                    format!("{kind}{scenario}, {least} simulations: {title}"),
                    columns,
                    rows.iter().enumerate().map(of_row).collect(),
                    conditions.clone(),
                )));
            }
        }
    }
    let section = Section { id: "steps".to_owned(), title: "Starts of whole steps".to_owned(), blocks };
    scenes.output.finish(section, conditions, progress)
}

/// Simulates a scene from all starts.
fn from_starts(
    scene: &Scene,
    guesses: Vec<(String, Option<GuessFactory<'_>>)>,
    (dt_s, tolerance): (f64, f64),
    steps: usize,
    progress: &Progress,
) -> Result<Vec<EntryRun>> {
    let step = StepParams { formulation: Formulation::Newton, ..StepParams::DEFAULT };
    let at = |tolerance| Level::new(Outer::Tolerance(tolerance)).settings(&Settings { step, ..Settings::default() });
    let (settings, mut reference) = (at(tolerance), at(1e-3 * tolerance.min(1e-6)));
    reference.step.absolute_tolerance = reference.step.relative_tolerance;
    let entries: Vec<_> = guesses.into_iter().map(|(name, guess)| Entry { name, settings, guess }).collect();
    let advance = |steps| progress.advance_by(steps);
    Ok(run_in_turns(&scene.model, &scene.state, (dt_s, steps), (TURN, &reference), &entries, advance)?.rows)
}

/// What is shown of a start over the simulations, each of which has a run from each start.
fn in_cell(
    simulations: &[Vec<EntryRun>],
    rows: &[Row<'_>],
    start: usize,
    shown: Shown,
    value: Value,
) -> Option<String> {
    let spread = |start: usize| Spread::of(simulations.iter().map(|runs| value(&runs[start])));
    match shown {
        Shown::Median => Some(number(spread(start)?.median)),
        Shown::Mean => Some(format!("{:.1}", 100.0 * spread(start)?.mean)),
        Shown::OfBest => {
            let median = |&start: &usize| spread(start).map_or(f64::INFINITY, |spread| spread.median);
            let plain = (0..rows.len()).filter(|&start| !rows[start].guess_name.is_learned());
            let best = plain.min_by(|a, b| median(a).total_cmp(&median(b)))?;
            Spread::of(simulations.iter().map(|runs| value(&runs[start]) / value(&runs[best]))).map(per_cent)
        }
    }
}
