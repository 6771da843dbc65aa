//! Runs a way at several levels of accuracy, beside a yardstick.

use std::ops::Range;

use cosserat::guess::{self, GuessFactory, GuessKind, InitialGuess, Members, Topology};
use cosserat::internals::dynamics::projection::Projection;
use cosserat::simulation::{Settings, Simulation, SimulationError, Status};
use cosserat::state::{Model, State};
use serde::{Deserialize, Serialize};

use super::clock::{of_run, with_share};
use super::curve::{Curve, GivenUp, Point};
use super::level::{Level, Outer};
use super::metrics::position_error;
use super::reference::{Problem, Reference};
use crate::guesses::Spread;

/// Steps that one simulation does before the next has its turn: so they share what else the machine does, but not its caches.
const TURN: usize = 25;

/// What makes something for each connected set of segments.
pub type OfSet<'a, T> = Box<dyn Fn(&Model, &Members, &Topology) -> T + 'a>;

/// Where a way's solves begin, or what takes their place, of each connected set of segments.
pub enum Start<'a> {
    /// A guess without learning.
    Plain(GuessKind),
    /// A learned guess.
    Learned(OfSet<'a, Option<Box<dyn InitialGuess>>>),
    /// Where [`guess::choose`] says for each level.
    Auto,
    /// Predictions in the place of all solves: the paper's end-to-end comparison.
    EndToEnd(OfSet<'a, Box<dyn Projection>>),
}

/// A way to simulate a scene.
pub struct Way<'a> {
    /// Its name.
    pub name: String,
    /// What sort of way it is: those of one kind are no rivals of each other where the second-fastest kind is asked for.
    pub kind: &'static str,
    /// Formulation, linear solver and caps; a [`Level`] replaces the tolerances.
    pub settings: Settings,
    /// Where solves begin.
    pub start: Start<'a>,
}

impl Way<'_> {
    fn simulation(&self, problem: &Problem, level: &Level) -> Result<Simulation, SimulationError> {
        let (model, state, settings) = (&problem.scene.model, &problem.scene.state, level.settings(&self.settings));
        let from = |guess: GuessFactory<'_>| Simulation::new(model, state, &settings, Some(guess));
        match &self.start {
            Start::Plain(kind) => from(&|model, members, topology| kind.build(model, members, topology)),
            Start::Learned(guess) => from(guess),
            Start::Auto => {
                let choice = guess::choose(model, &settings.step, Some(settings.solver));
                from(&|model, members, topology| choice.build_guess(model, members, topology))
            }
            Start::EndToEnd(projection) => Simulation::end_to_end(model, state, &settings.step, projection),
        }
    }
}

/// How much time a level may take.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Budget {
    /// Time of a level [s]. One whose first run takes longer is given up, with the finer ones, and nothing is repeated
    /// beyond it.
    pub seconds: f64,
    /// Runs of each level; at least one.
    pub repetitions: usize,
}

/// Runs a way at all levels, in turns of some steps with the yardstick (the default settings: direct solves to 1e-6, from
/// zero), several times. Levels of one number of substeps come from the roughest to the finest. After each turn `go_on()`
/// says whether to go on; `None` if not.
///
/// Times are those of rayon's current pool, which should have one thread: see the module. Levels that are given up are
/// recorded as such; whether one is over its budget depends on the machine, all else but times does not.
///
/// # Errors
/// If the settings do not fit the model.
pub fn run_way(
    problem: &Problem,
    way: &Way<'_>,
    levels: &[Level],
    budget: &Budget,
    mut go_on: impl FnMut() -> bool,
) -> Result<Option<Curve>, SimulationError> {
    let mut runs: Vec<LevelRun> = levels.iter().map(|level| LevelRun::new(problem, way, level)).collect();
    let (scene, dt) = (&problem.scene, problem.scene.run.dt);
    let mut found = scene.state.clone();
    let mut yardstick: Vec<Vec<f64>> = Vec::new();
    for repetition in 0..budget.repetitions.max(1) {
        let mut beside = Simulation::new(&scene.model, &scene.state, &Settings::default(), None)?;
        let mut beside_turns = Vec::new();
        for run in &mut runs {
            run.begin(way, repetition, budget)?;
        }
        for first in (0..problem.steps).step_by(TURN) {
            let turn = first..problem.steps.min(first + TURN);
            let mut time = 0.0;
            for _ in turn.clone() {
                time += timed(&mut beside, dt)?.1;
            }
            beside_turns.push(time);
            // Levels come from the roughest to the finest: where one takes too long, so do those after it.
            let mut too_long = None;
            for run in &mut runs {
                match too_long.filter(|&(substeps, _)| substeps == run.point.level.substeps) {
                    Some((_, step)) => run.give_up(step, GivenUp::OverBudget),
                    None => run.turn(turn.clone(), budget, &mut found)?,
                }
                if let Some((step, GivenUp::OverBudget)) = run.point.given_up {
                    too_long = Some((run.point.level.substeps, step));
                }
            }
            if !go_on() {
                return Ok(None);
            }
        }
        yardstick.push(beside_turns);
    }
    let simulated = problem.steps as f64 * dt;
    let yardstick = of_run(&yardstick, simulated);
    Ok(Some(Curve {
        scene: scene.name.clone(),
        way: way.name.clone(),
        kind: way.kind.to_owned(),
        dt,
        steps: problem.steps,
        samples: problem.samples.clone(),
        samples_before_contact: problem.samples_before_contact(),
        yardstick,
        points: runs.into_iter().map(|run| run.point(simulated, yardstick)).collect(),
    }))
}

/// Steps, and tells the time of all stages [s], without that in which the thread did not run.
pub(crate) fn timed(simulation: &mut Simulation, dt: f64) -> Result<(Status, f64), SimulationError> {
    let before = simulation.counters().times.total();
    let (step, share) = with_share(|| simulation.step(dt));
    Ok((step?.status, share * (simulation.counters().times.total() - before).as_secs_f64()))
}

/// A level being run.
struct LevelRun<'a> {
    problem: &'a Problem,
    /// What it came to, but for the times.
    point: Point,
    /// Worst status of any step.
    status: Status,
    /// The way's exact reference.
    exact: Option<&'a Reference>,
    /// The repetition that is running; `None` where there is none any more.
    simulation: Option<Simulation>,
    /// Time of all repetitions [s].
    spent: f64,
    /// Times of the turns of each repetition [s].
    times: Vec<Vec<f64>>,
}

impl<'a> LevelRun<'a> {
    fn new(problem: &'a Problem, way: &Way<'_>, level: &Level) -> Self {
        let exact = problem.exact(way.settings.step.formulation).filter(|_| level.substeps == 1);
        let point = Point {
            level: *level,
            status: String::new(),
            given_up: None,
            time: None,
            ratio: None,
            outer_per_step: 0.0,
            linear_per_step: 0.0,
            exact: exact.map(|_| Vec::new()),
            converged: problem.converged.as_ref().map(|_| Vec::new()),
        };
        Self { problem, point, status: Status::Converged, exact, simulation: None, spent: 0.0, times: Vec::new() }
    }

    /// Begins a repetition, if one as long as those before fits into the budget.
    fn begin(&mut self, way: &Way<'_>, repetition: usize, budget: &Budget) -> Result<(), SimulationError> {
        let after = self.spent * (repetition + 1) as f64 / repetition.max(1) as f64;
        let is_due = repetition == 0 || (self.simulation.is_some() && after <= budget.seconds);
        self.simulation = is_due.then(|| way.simulation(self.problem, &self.point.level)).transpose()?;
        if is_due {
            self.times.push(Vec::new());
        }
        Ok(())
    }

    /// Does these steps, counted from 0; the first repetition is measured.
    fn turn(&mut self, steps: Range<usize>, budget: &Budget, found: &mut State) -> Result<(), SimulationError> {
        let Some(mut simulation) = self.simulation.take() else { return Ok(()) };
        let substeps = self.point.level.substeps.max(1);
        let mut turn = 0.0;
        for step in steps.map(|step| step + 1) {
            let failures = simulation.counters().linear_failures;
            let mut status = Status::Converged;
            for _ in 0..substeps {
                let (of_substep, time) = timed(&mut simulation, self.problem.scene.run.dt / substeps as f64)?;
                status = status.max(of_substep);
                turn += time;
                self.spent += time;
            }
            if self.times.len() > 1 {
                continue;
            }
            self.status = self.status.max(status);
            let counters = simulation.counters();
            let steps = (step * simulation.components()).max(1) as f64;
            self.point.outer_per_step = counters.iterations as f64 / steps;
            self.point.linear_per_step = counters.linear_iterations as f64 / steps;
            let has_failed = status >= Status::OutOfIterations && counters.linear_failures > failures;
            let is_finite = status != Status::NonFinite && self.measure(&simulation, step, found);
            let reason = if !is_finite {
                Some(GivenUp::NotFinite)
            } else if has_failed && matches!(self.point.level.outer, Outer::Tolerance(_)) {
                Some(GivenUp::LinearSolver)
            } else {
                (self.spent > budget.seconds).then_some(GivenUp::OverBudget)
            };
            if let Some(reason) = reason {
                self.give_up(step, reason);
                return Ok(());
            }
        }
        if let Some(turns) = self.times.last_mut() {
            turns.push(turn);
        }
        self.simulation = Some(simulation);
        Ok(())
    }

    /// Ends a level in a step, if nothing has ended it before.
    fn give_up(&mut self, step: usize, reason: GivenUp) {
        self.point.given_up.get_or_insert((step, reason));
        self.simulation = None;
        self.times.clear();
    }

    /// Takes the errors, if `step` is a sample. Returns whether they are finite.
    fn measure(&mut self, simulation: &Simulation, step: usize, found: &mut State) -> bool {
        let Self { problem, point, .. } = self;
        let Ok(sample) = problem.samples.binary_search(&step) else { return true };
        simulation.store(found);
        let error = |reference: Option<&Reference>| {
            Some(position_error(&problem.scene.model, &found.positions, &reference?.frames[sample]))
        };
        let errors = [self.exact, problem.converged.as_ref()].map(error);
        if !errors.into_iter().flatten().all(f64::is_finite) {
            return false;
        }
        for (samples, error) in [&mut point.exact, &mut point.converged].into_iter().zip(errors) {
            samples.iter_mut().for_each(|samples| samples.extend(error));
        }
        true
    }

    /// The point, of a run of `simulated` seconds [s] beside a yardstick.
    fn point(self, simulated: f64, yardstick: Option<Spread>) -> Point {
        let ratio = yardstick.and_then(|yardstick| of_run(&self.times, simulated * yardstick.median));
        Point { status: self.status.name().to_owned(), time: of_run(&self.times, simulated), ratio, ..self.point }
    }
}
