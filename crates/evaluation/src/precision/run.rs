//! Runs a way at several levels of accuracy, beside a yardstick.

use rod::{Model, State};
use serde::{Deserialize, Serialize};
use solver::auto;
use solver::component::Members;
use solver::projection::ProjectionFactory;
use solver::simulation::{GuessFactory, Settings, Simulation, SimulationError};
use solver::step::Status;
use solver::topology::Topology;

use super::clock::{Moment, Turns};
use super::curve::{Curve, GivenUp, Point};
use super::level::{Level, Outer};
use super::metrics::position_error;
use super::problem::Problem;
use crate::guesses::Spread;

/// Steps that one simulation does before the next has its turn: so they share what else the machine does, but not its caches.
const TURN: usize = 25;

/// Where a way's solves begin, or what takes their place.
#[derive(Clone, Copy)]
pub enum Start<'a> {
    /// At zero.
    Zero,
    /// At a guess.
    Guess(GuessFactory<'a>),
    /// Where [`auto::choose`] says for each level.
    Auto,
    /// Predictions in the place of all solves: the paper's end-to-end comparison.
    EndToEnd(ProjectionFactory<'a>),
}

/// A way to simulate a scene.
#[derive(Clone)]
pub struct Way<'a> {
    /// Its name.
    pub name: String,
    /// What sort of way it is: those of one kind are no rivals of each other where the second-fastest kind is asked for.
    pub kind: String,
    /// Formulation, linear solver and caps; a [`Level`] replaces the tolerances.
    pub settings: Settings,
    /// Where solves begin.
    pub start: Start<'a>,
}

/// How much time a level may take.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Budget {
    /// Time of a level [s]. One whose first run takes longer is given up, and nothing is repeated beyond it.
    pub seconds: f64,
    /// Runs of each level; at least one.
    pub repetitions: usize,
}

/// What runs beside each way: the default settings, that is direct solves to 1e-6, from zero.
pub fn yardstick() -> Settings {
    Settings::default()
}

/// Runs a way at all levels, in turns of some steps with the yardstick, several times. After each turn `go_on()` says
/// whether to go on; `None` if not.
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
    let mut found = problem.state.clone();
    let mut yardstick = Turns::default();
    for repetition in 0..budget.repetitions.max(1) {
        let mut beside = Simulation::new(&problem.model, &problem.state, &self::yardstick(), None)?;
        let mut beside_turns = Vec::new();
        let mut simulations = Vec::new();
        for run in runs.iter_mut().filter(|run| run.is_due(repetition, budget)) {
            let simulation = way.simulation(problem, &run.point.level)?;
            simulations.push((run, simulation));
        }
        let mut done = 0;
        while done < problem.steps {
            let until = problem.steps.min(done + TURN);
            let mut turn = 0.0;
            for _ in done..until {
                turn += timed(&mut beside, problem.dt)?.1;
            }
            beside_turns.push(turn);
            for (run, simulation) in &mut simulations {
                run.turn(problem, simulation, (done, until), (repetition, budget), &mut found)?;
            }
            done = until;
            if !go_on() {
                return Ok(None);
            }
        }
        yardstick.push(beside_turns);
        for (run, _) in simulations {
            let turns = std::mem::take(&mut run.turns);
            if run.point.given_up.is_none() {
                run.times.push(turns);
            }
        }
    }
    let simulated = problem.steps as f64 * problem.dt;
    let yardstick = yardstick.spread(simulated);
    Ok(Some(Curve {
        scene: problem.scene.clone(),
        way: way.name.clone(),
        kind: way.kind.clone(),
        dt: problem.dt,
        steps: problem.steps,
        samples: problem.samples.clone(),
        samples_before_contact: problem.samples_before_contact(),
        yardstick,
        points: runs.into_iter().map(|run| run.point(simulated, yardstick)).collect(),
    }))
}

/// Steps, and tells the time of all stages [s], without that in which the thread did not run.
fn timed(simulation: &mut Simulation, dt: f64) -> Result<(Status, f64), SimulationError> {
    let before = simulation.counters().times.total();
    let start = Moment::now();
    let status = simulation.step(dt)?.status;
    let share = start.share();
    Ok((status, share * (simulation.counters().times.total() - before).as_secs_f64()))
}

impl Way<'_> {
    fn simulation(&self, problem: &Problem, level: &Level) -> Result<Simulation, SimulationError> {
        let (model, state, settings) = (&problem.model, &problem.state, level.settings(&self.settings));
        match self.start {
            Start::Zero => Simulation::new(model, state, &settings, None),
            Start::Guess(factory) => Simulation::new(model, state, &settings, Some(factory)),
            Start::Auto => {
                let choice = auto::choose(model, &settings.step, Some(settings.solver));
                let factory = |model: &Model, members: &Members, topology: &Topology| {
                    choice.build_guess(model, members, topology)
                };
                Simulation::new(model, state, &settings, Some(&factory))
            }
            Start::EndToEnd(factory) => Simulation::end_to_end(model, state, &settings.step, factory),
        }
    }
}

/// A level being run.
struct LevelRun {
    /// What it came to, but for the times.
    point: Point,
    /// Worst status of any step.
    status: Status,
    /// Time of all repetitions [s].
    spent: f64,
    /// Times of the turns of the repetition that is running [s].
    turns: Vec<f64>,
    times: Turns,
    /// Index of the way's exact reference among the problem's.
    reference: Option<usize>,
}

impl LevelRun {
    fn new(problem: &Problem, way: &Way<'_>, level: &Level) -> Self {
        let formulation = way.settings.step.formulation;
        let reference = problem.exact.iter().position(|exact| exact.formulation == formulation);
        let reference = reference.filter(|_| level.substeps == 1);
        let point = Point {
            level: *level,
            status: String::new(),
            given_up: None,
            time: None,
            ratio: None,
            outer_per_step: 0.0,
            linear_per_step: 0.0,
            exact: reference.map(|_| Vec::new()),
            converged: problem.converged.as_ref().map(|_| Vec::new()),
        };
        let (turns, times) = (Vec::new(), Turns::default());
        Self { point, status: Status::Converged, spent: 0.0, turns, times, reference }
    }

    /// Whether another repetition, as long as those before, fits into the budget.
    fn is_due(&self, repetition: usize, budget: &Budget) -> bool {
        let after = self.spent * (repetition + 1) as f64 / repetition.max(1) as f64;
        self.point.given_up.is_none()
            && self.times.repetitions() == repetition
            && (repetition == 0 || after <= budget.seconds)
    }

    /// Steps from `done` until `until`; the first repetition is measured.
    fn turn(
        &mut self,
        problem: &Problem,
        simulation: &mut Simulation,
        (done, until): (usize, usize),
        (repetition, budget): (usize, &Budget),
        found: &mut State,
    ) -> Result<(), SimulationError> {
        let substeps = self.point.level.substeps.max(1);
        let mut turn = 0.0;
        for step in done + 1..=until {
            if self.point.given_up.is_some() {
                return Ok(());
            }
            let failures = simulation.counters().linear_failures;
            let mut status = Status::Converged;
            for _ in 0..substeps {
                let (of_substep, time) = timed(simulation, problem.dt / substeps as f64)?;
                status = status.max(of_substep);
                turn += time;
                self.spent += time;
            }
            if repetition > 0 {
                continue;
            }
            self.status = self.status.max(status);
            let counters = simulation.counters();
            let steps = (step * simulation.components()).max(1) as f64;
            self.point.outer_per_step = counters.iterations as f64 / steps;
            self.point.linear_per_step = counters.linear_iterations as f64 / steps;
            let has_failed = status >= Status::OutOfIterations && counters.linear_failures > failures;
            let is_finite = status != Status::NonFinite && self.measure(problem, simulation, step, found);
            let reason = if !is_finite {
                Some(GivenUp::NotFinite)
            } else if has_failed && matches!(self.point.level.outer, Outer::Tolerance(_)) {
                Some(GivenUp::LinearSolver)
            } else {
                (self.spent > budget.seconds).then_some(GivenUp::OverBudget)
            };
            self.point.given_up = reason.map(|reason| (step, reason));
        }
        self.turns.push(turn);
        Ok(())
    }

    /// Takes the errors, if `step` is a sample. Returns whether they are finite.
    fn measure(&mut self, problem: &Problem, simulation: &Simulation, step: usize, found: &mut State) -> bool {
        let Ok(sample) = problem.samples.binary_search(&step) else { return true };
        simulation.store(found);
        let against = |expected| position_error(&problem.model, &found.positions, expected);
        let exact = self.reference.map(|index| against(&problem.exact[index].frames[sample]));
        let converged = problem.converged.as_ref().map(|converged| against(&converged.frames[sample]));
        if !exact.into_iter().chain(converged).all(f64::is_finite) {
            return false;
        }
        for (errors, error) in [(&mut self.point.exact, exact), (&mut self.point.converged, converged)] {
            if let (Some(samples), Some(error)) = (errors, error) {
                samples.push(error);
            }
        }
        true
    }

    /// The point, of a run of `simulated` seconds [s] beside a yardstick.
    fn point(self, simulated: f64, yardstick: Option<Spread>) -> Point {
        let ratio = yardstick.and_then(|yardstick| self.times.spread(simulated * yardstick.median));
        Point { status: self.status.name().to_owned(), time: self.times.spread(simulated), ratio, ..self.point }
    }
}
