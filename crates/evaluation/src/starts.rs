//! How many iterations of conjugate gradients, and how much time, each guess saves: on the same systems for all of them.
//!
//! The motion is the direct solver's. At the first outer iteration of every step, each guess proposes a start, and
//! conjugate gradients run from it with every preconditioner to every tolerance; then all guesses learn the exact
//! solution. So a row differs from another by its start alone.

use std::sync::{Arc, Mutex};
use std::time::Instant;

use rod::{Model, State};
use serde::{Deserialize, Serialize};
use solver::component::{Component, Members};
use solver::guess::InitialGuess;
use solver::kernel::Spatial;
use solver::linear::LinearSolver;
use solver::linear::cg::CgParams;
use solver::linear::precondition::PreconditionerKind;
use solver::linear::solvers::SolverKind;
use solver::simulation::{GuessFactory, Settings, Simulation, SimulationError};
use solver::topology::Topology;

/// What to measure.
pub struct Plan<'a> {
    /// Guesses by name; the first should be the zero start (`None`), to which the others are compared.
    pub guesses: Vec<(String, Option<GuessFactory<'a>>)>,
    /// Preconditioners.
    pub preconditioners: Vec<PreconditionerKind>,
    /// Tolerances, relative to the right-hand side.
    pub tolerances: Vec<f64>,
    /// Cap on the iterations of a solve; `None` for CG's own. A solve that it ends counts as so many.
    pub max_iterations: Option<u64>,
    /// For each step, to which sum its measurements are added; `None` (and what comes after the list) is left out.
    pub buckets: Vec<Option<usize>>,
}

impl Plan<'_> {
    /// Preconditioners and tolerances, in the order of a row's columns.
    pub fn columns(&self) -> impl Iterator<Item = (PreconditionerKind, f64)> + '_ {
        let tolerances = |&preconditioner| self.tolerances.iter().map(move |&tolerance| (preconditioner, tolerance));
        self.preconditioners.iter().flat_map(tolerances)
    }
}

/// Sums over the solves of a bucket.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tally {
    /// Number of solves.
    pub solves: u64,
    /// Those whose start was dropped.
    pub dropped: u64,
    /// Iterations of conjugate gradients.
    pub iterations: u64,
    /// Time of the solves, preconditioner included [s].
    pub solve_s: f64,
    /// Time of the guess, both for its starts and for what it learns [s].
    pub guess_s: f64,
}

/// All sums of a run.
#[derive(Clone, Debug)]
pub struct Measured {
    /// By bucket, guess and column.
    tallies: Vec<Tally>,
    /// Of the direct solver, by bucket.
    direct: Vec<Tally>,
    guesses: usize,
    columns: usize,
}

impl Measured {
    fn new(plan: &Plan<'_>) -> Self {
        let buckets = plan.buckets.iter().flatten().max().map_or(1, |last| last + 1);
        let (guesses, columns) = (plan.guesses.len(), plan.columns().count());
        let zero = Tally::default();
        Self { tallies: vec![zero; buckets * guesses * columns], direct: vec![zero; buckets], guesses, columns }
    }

    /// Sums of a guess in a column, both by their places in the plan.
    pub fn tally(&self, bucket: usize, guess: usize, column: usize) -> Tally {
        let index = (bucket * self.guesses + guess) * self.columns + column;
        self.tallies.get(index).copied().unwrap_or_default()
    }

    /// Sums of the direct solver on the same systems, without iterations.
    pub fn direct(&self, bucket: usize) -> Tally {
        self.direct.get(bucket).copied().unwrap_or_default()
    }

    fn tally_mut(&mut self, bucket: usize, guess: usize, column: usize) -> &mut Tally {
        &mut self.tallies[(bucket * self.guesses + guess) * self.columns + column]
    }

    fn add_guess_time(&mut self, bucket: usize, guess: usize, begin: Instant) {
        let seconds = begin.elapsed().as_secs_f64();
        for column in 0..self.columns {
            self.tally_mut(bucket, guess, column).guess_s += seconds;
        }
    }
}

/// Runs the scene and measures; after each step `after(step, simulation)` says whether to go on, and may give the
/// motion a push.
///
/// # Errors
/// If the scene or the settings are not valid.
pub fn run(
    model: &Model,
    state: &State,
    (dt, steps): (f64, usize),
    settings: &Settings,
    plan: &Plan<'_>,
    mut after: impl FnMut(usize, &mut Simulation) -> bool,
) -> Result<Measured, SimulationError> {
    let measured = Arc::new(Mutex::new(Measured::new(plan)));
    let factory = |model: &Model, members: &Members, topology: &Topology| -> Option<Box<dyn InitialGuess>> {
        Some(Box::new(Shadow::new(plan, model, members, topology, measured.clone())))
    };
    let exact = Settings { step: settings.step, ..Settings::default() };
    let mut simulation = Simulation::new(model, state, &exact, Some(&factory))?;
    for step in 1..=steps {
        simulation.step(dt)?;
        if !after(step, &mut simulation) {
            break;
        }
    }
    drop(simulation);
    let measured = measured.lock().map(|measured| measured.clone());
    Ok(measured.unwrap_or_else(|_| Measured::new(plan)))
}

/// Stands in a guess's place, proposes nothing, and measures the others.
struct Shadow {
    guesses: Vec<Guess>,
    /// One a column; `None` where the preconditioner does not fit the graph.
    solvers: Vec<Option<Box<dyn LinearSolver>>>,
    direct: Option<Box<dyn LinearSolver>>,
    solution: Vec<Spatial<f64>>,
    measured: Arc<Mutex<Measured>>,
    buckets: Vec<Option<usize>>,
    step: usize,
}

/// A guess and what it proposed last.
struct Guess {
    guess: Option<Box<dyn InitialGuess>>,
    start: Vec<Spatial<f64>>,
    given: bool,
}

impl Shadow {
    fn new(
        plan: &Plan<'_>,
        model: &Model,
        members: &Members,
        topology: &Topology,
        measured: Arc<Mutex<Measured>>,
    ) -> Self {
        let zero = vec![Spatial::zero(); topology.joints.len()];
        let guess = |factory: &Option<GuessFactory<'_>>| Guess {
            guess: factory.and_then(|factory| factory(model, members, topology)),
            start: zero.clone(),
            given: false,
        };
        let solver = |(preconditioner, tolerance)| {
            let params = CgParams { preconditioner, tolerance, max_iterations: plan.max_iterations };
            SolverKind::Cg(params).build(model, members, topology).ok()
        };
        Self {
            guesses: plan.guesses.iter().map(|(_, factory)| guess(factory)).collect(),
            solvers: plan.columns().map(solver).collect(),
            direct: SolverKind::Direct.build(model, members, topology).ok(),
            solution: zero.clone(),
            measured,
            buckets: plan.buckets.clone(),
            step: 0,
        }
    }

    /// Where this step's measurements belong.
    fn bucket(&self) -> Option<usize> {
        self.buckets.get(self.step).copied().flatten()
    }

    fn measure(&mut self, component: &Component<f64>, bucket: usize) {
        let Ok(mut measured) = self.measured.lock() else { return };
        for (g, Guess { guess, start, given }) in self.guesses.iter_mut().enumerate() {
            let Some(guess) = guess else { continue };
            let begin = Instant::now();
            start.fill(Spatial::zero());
            *given = guess.start_solve(component, 0, start);
            measured.add_guess_time(bucket, g, begin);
        }
        for (column, solver) in self.solvers.iter_mut().enumerate() {
            let Some(solver) = solver else { continue };
            // All starts of a column one after the other, so that they share what else the machine does.
            for (g, Guess { start, given, .. }) in self.guesses.iter().enumerate() {
                self.solution.copy_from_slice(start);
                let begin = Instant::now();
                let info = solver.solve(&component.system, *given, &mut self.solution);
                let tally = measured.tally_mut(bucket, g, column);
                tally.solve_s += begin.elapsed().as_secs_f64();
                tally.iterations += info.iterations;
                tally.solves += 1;
                tally.dropped += u64::from(info.start_dropped);
            }
        }
        if let Some(direct) = &mut self.direct {
            let begin = Instant::now();
            direct.solve(&component.system, false, &mut self.solution);
            measured.direct[bucket].solve_s += begin.elapsed().as_secs_f64();
            measured.direct[bucket].solves += 1;
        }
    }

    /// Lets every guess learn, and adds the time to the bucket, if there is one.
    fn teach(&mut self, bucket: Option<usize>, lesson: impl Fn(&mut dyn InitialGuess)) {
        for (g, Guess { guess, .. }) in self.guesses.iter_mut().enumerate() {
            let Some(guess) = guess else { continue };
            let begin = Instant::now();
            lesson(guess.as_mut());
            if let (Some(bucket), Ok(mut measured)) = (bucket, self.measured.lock()) {
                measured.add_guess_time(bucket, g, begin);
            }
        }
    }
}

impl InitialGuess for Shadow {
    fn helps_solves(&self) -> bool {
        true
    }

    fn observe_solve(&mut self, component: &Component<f64>, iteration: usize) {
        let bucket = self.bucket().filter(|_| iteration == 0);
        if let Some(bucket) = bucket {
            self.measure(component, bucket);
        }
        self.teach(bucket, |guess| guess.observe_solve(component, iteration));
    }

    fn observe_step(&mut self, component: &Component<f64>) {
        self.teach(self.bucket(), |guess| guess.observe_step(component));
        self.step += 1;
    }
}
