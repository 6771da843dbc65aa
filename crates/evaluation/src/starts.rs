//! How many iterations of conjugate gradients each guess saves, on the same systems for all of them.
//!
//! The motion is the direct solver's. At the first outer iteration of every step, each guess proposes a start, and
//! conjugate gradients run from it with every preconditioner to every tolerance; then all guesses learn the exact
//! solution. So a row differs from another by its start alone.

use std::sync::{Arc, Mutex};

use rod::{Model, State};
use serde::Serialize;
use solver::component::{Component, Members};
use solver::guess::InitialGuess;
use solver::linear::LinearSolver;
use solver::linear::cg::CgParams;
use solver::linear::precondition::PreconditionerKind;
use solver::linear::solvers::SolverKind;
use solver::simulation::{GuessFactory, Settings, Simulation, SimulationError};
use solver::system::Six;
use solver::topology::Topology;

/// What to measure.
pub struct Plan<'a> {
    /// Guesses by name; the first should be the zero start (`None`), to which the others are compared.
    pub guesses: Vec<(String, Option<GuessFactory<'a>>)>,
    /// Preconditioners.
    pub preconditioners: Vec<PreconditionerKind>,
    /// Tolerances, relative to the right-hand side.
    pub tolerances: Vec<f64>,
    /// Steps left out at the beginning, where a history is not full yet.
    pub skip: usize,
}

/// Mean iterations of a guess with one preconditioner to one tolerance.
#[derive(Clone, Debug, Serialize)]
pub struct Cell {
    /// Guess.
    pub guess: String,
    /// Preconditioner.
    pub preconditioner: &'static str,
    /// Tolerance.
    pub tolerance: f64,
    /// Mean iterations per solve; not a number where the preconditioner does not fit the scene.
    pub iterations: f64,
    /// Iterations relative to the first guess of the plan.
    pub ratio: f64,
    /// Number of solves.
    pub solves: u64,
}

/// Runs the scene and measures; after each step `progress(step)` says whether to go on.
///
/// # Errors
/// If the scene or the settings are not valid.
pub fn run(
    model: &Model,
    state: &State,
    (dt, steps): (f64, usize),
    settings: &Settings,
    plan: &Plan<'_>,
    mut progress: impl FnMut(usize) -> bool,
) -> Result<Vec<Cell>, SimulationError> {
    let cells = plan.guesses.len() * plan.preconditioners.len() * plan.tolerances.len();
    let counts = Arc::new(Mutex::new(vec![(0_u64, 0_u64); cells]));
    let factory = |model: &Model, members: &Members, topology: &Topology| -> Option<Box<dyn InitialGuess>> {
        Some(Box::new(Shadow::new(plan, model, members, topology, counts.clone())))
    };
    let exact = Settings { step: settings.step, ..Settings::default() };
    let mut simulation = Simulation::new(model, state, &exact, Some(&factory))?;
    for step in 1..=steps {
        simulation.step(dt)?;
        if !progress(step) {
            break;
        }
    }
    drop(simulation);
    let counts = counts.lock().map(|counts| counts.clone()).unwrap_or_default();
    Ok(table(plan, &counts))
}

fn table(plan: &Plan<'_>, counts: &[(u64, u64)]) -> Vec<Cell> {
    let columns = plan.preconditioners.len() * plan.tolerances.len();
    let mean = |(iterations, solves): (u64, u64)| iterations as f64 / solves as f64;
    let mut cells = Vec::new();
    for (g, (guess, _)) in plan.guesses.iter().enumerate() {
        for (p, preconditioner) in plan.preconditioners.iter().enumerate() {
            for (t, &tolerance) in plan.tolerances.iter().enumerate() {
                let column = p * plan.tolerances.len() + t;
                let own = counts[g * columns + column];
                cells.push(Cell {
                    guess: guess.clone(),
                    preconditioner: preconditioner.name(),
                    tolerance,
                    iterations: mean(own),
                    ratio: mean(own) / mean(counts[column]),
                    solves: own.1,
                });
            }
        }
    }
    cells
}

/// Stands in a guess's place, proposes nothing, and measures the others.
struct Shadow {
    guesses: Vec<Option<Box<dyn InitialGuess>>>,
    /// `None` where the preconditioner does not fit the graph.
    solvers: Vec<Option<Box<dyn LinearSolver>>>,
    start: Vec<Six<f64>>,
    solution: Vec<Six<f64>>,
    counts: Arc<Mutex<Vec<(u64, u64)>>>,
    step: usize,
    skip: usize,
}

impl Shadow {
    fn new(
        plan: &Plan<'_>,
        model: &Model,
        members: &Members,
        topology: &Topology,
        counts: Arc<Mutex<Vec<(u64, u64)>>>,
    ) -> Self {
        let build = |factory: &Option<GuessFactory<'_>>| factory.and_then(|f| f(model, members, topology));
        let mut solvers = Vec::new();
        for &preconditioner in &plan.preconditioners {
            for &tolerance in &plan.tolerances {
                let params = CgParams { preconditioner, tolerance, ..CgParams::default() };
                solvers.push(SolverKind::Cg(params).build(model, members, topology).ok());
            }
        }
        let zero = vec![Six::zero(); topology.joints.len()];
        Self {
            guesses: plan.guesses.iter().map(|(_, factory)| build(factory)).collect(),
            solvers,
            start: zero.clone(),
            solution: zero,
            counts,
            step: 0,
            skip: plan.skip,
        }
    }

    fn measure(&mut self, component: &Component<f64>, iteration: usize) {
        let Ok(mut counts) = self.counts.lock() else { return };
        let columns = self.solvers.len();
        for (g, guess) in self.guesses.iter_mut().enumerate() {
            self.start.fill(Six::zero());
            if let Some(guess) = guess {
                guess.start_solve(component, iteration, &mut self.start);
            }
            for (s, solver) in self.solvers.iter_mut().enumerate() {
                let Some(solver) = solver else { continue };
                self.solution.copy_from_slice(&self.start);
                let info = solver.solve(&component.system, true, &mut self.solution);
                let count = &mut counts[g * columns + s];
                count.0 += info.iterations;
                count.1 += 1;
            }
        }
    }
}

impl InitialGuess for Shadow {
    fn helps_solves(&self) -> bool {
        true
    }

    fn observe_solve(&mut self, component: &Component<f64>, iteration: usize) {
        if iteration == 0 && self.step >= self.skip {
            self.measure(component, iteration);
        }
        for guess in self.guesses.iter_mut().flatten() {
            guess.observe_solve(component, iteration);
        }
    }

    fn observe_step(&mut self, component: &Component<f64>) {
        self.step += 1;
        for guess in self.guesses.iter_mut().flatten() {
            guess.observe_step(component);
        }
    }
}
