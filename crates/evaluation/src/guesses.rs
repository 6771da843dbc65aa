//! Where the guesses stand: how many iterations of conjugate gradients, and how much time, each saves on the same systems.
//!
//! The motion is the direct solver's. At the first outer iteration of every step, each guess proposes a start, and
//! conjugate gradients run from it with every preconditioner to every tolerance; then all guesses learn the exact
//! solution. So a row differs from another by its start alone.
//!
//! A ratio is the sum over a simulation's solves, the guess's divided by the zero start's; over the simulations its median,
//! quartiles and mean are told. Times of a guess include all that it does: its start and what it learns.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use cosserat::guess::{GuessFactory, InitialGuess, Members, Topology};
use cosserat::internals::component::Component;
use cosserat::internals::jointed::linear::LinearSolver;
use cosserat::internals::kernels::Spatial;
use cosserat::simulation::{CgParams, PreconditionerKind, Settings, Simulation, SimulationError, SolverKind};
use cosserat::state::{Model, State};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Steps that are told apart, counted from 1; the last are those after the impulse.
pub const BUCKETS: [&str; 6] = ["step 1", "step 2", "step 3", "steps 4 to 10", "later steps", "after the impulse"];
/// The step after which the rod is struck.
pub const IMPULSE_AFTER: usize = 60;
/// Steps that feel it most.
pub const IMPULSE_STEPS: usize = 5;
/// Speed that it gives to the tip [m/s].
pub const IMPULSE_SPEED: f64 = 2.0;
/// Of the later steps every fifth is measured.
pub const EVERY: usize = 5;
/// Name of the direct solver among the guesses.
pub const DIRECT: &str = "direct solve";

/// The bucket of each of `steps` steps.
pub fn buckets(steps: usize) -> Vec<Option<usize>> {
    let bucket = |step: usize| match step {
        1..=3 => Some(step - 1),
        4..=10 => Some(3),
        _ if (1..=IMPULSE_STEPS).contains(&step.saturating_sub(IMPULSE_AFTER)) => Some(5),
        _ => step.is_multiple_of(EVERY).then_some(4),
    };
    (1..=steps).map(bucket).collect()
}

/// A guess by name; `None`, or a factory that makes none, for a zero start.
pub type NamedStart<'a> = (String, Option<GuessFactory<'a>>);

/// What to measure.
pub struct Plan<'a> {
    /// Guesses; the first must be the zero start, to which the others are compared.
    pub guesses: Vec<NamedStart<'a>>,
    /// Preconditioners, each with each tolerance.
    pub preconditioners: Vec<PreconditionerKind>,
    /// Tolerances, relative to the right-hand side.
    pub tolerances: Vec<f64>,
    /// Cap on the iterations of a solve; `None` for CG's own. A solve that it ends counts as so many.
    pub max_iterations: Option<u64>,
    /// For each step, to which sum its measurements are added; `None` is left out.
    pub buckets: Vec<Option<usize>>,
    /// Whether the rod is struck after step [`IMPULSE_AFTER`].
    pub is_struck: bool,
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

/// All sums of a simulation.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Names of the guesses; [`DIRECT`] comes last, with the same sums in all columns.
    guesses: Vec<String>,
    columns: Vec<CgParams>,
    /// By bucket, guess and column.
    tallies: Vec<Vec<Vec<Tally>>>,
}

impl Measured {
    fn new(plan: &Plan<'_>) -> Self {
        let max_iterations = plan.max_iterations;
        let with_tolerances = |&preconditioner: &PreconditionerKind| {
            plan.tolerances.iter().map(move |&tolerance| CgParams { preconditioner, tolerance, max_iterations })
        };
        let columns: Vec<_> = plan.preconditioners.iter().flat_map(with_tolerances).collect();
        let buckets = plan.buckets.iter().flatten().max().map_or(1, |last| last + 1);
        let names = plan.guesses.iter().map(|(name, _)| name.as_str());
        let guesses: Vec<String> = names.chain([DIRECT]).map(str::to_owned).collect();
        let tallies = vec![vec![vec![Tally::default(); columns.len()]; guesses.len()]; buckets];
        Self { guesses, columns, tallies }
    }

    /// Sums of a guess in a column, by their places in the plan; the direct solver comes after the guesses.
    pub(crate) fn tally(&self, bucket: usize, guess: usize, column: usize) -> Tally {
        self.tallies.get(bucket).map_or_else(Tally::default, |guesses| guesses[guess][column])
    }
}

/// Runs a scene over `plan.buckets.len()` steps of `dt` [s], and measures; after each step `progress()` says whether to go
/// on.
///
/// # Errors
/// If the scene or the settings are not valid.
pub fn measure(
    model: &Model,
    state: &State,
    dt: f64,
    settings: &Settings,
    plan: &Plan<'_>,
    mut progress: impl FnMut() -> bool,
) -> Result<Measured, SimulationError> {
    let measured = Arc::new(Mutex::new(Measured::new(plan)));
    let factory = |model: &Model, members: &Members, topology: &Topology| -> Option<Box<dyn InitialGuess>> {
        Some(Box::new(Shadow::new(plan, model, members, topology, measured.clone())))
    };
    let exact = Settings { step: settings.step, ..Settings::default() };
    let mut simulation = Simulation::new(model, state, &exact, Some(&factory))?;
    let mut now = state.clone();
    for step in 1..=plan.buckets.len() {
        simulation.step(dt)?;
        if plan.is_struck && step == IMPULSE_AFTER {
            simulation.store(&mut now);
            strike(model, &mut now);
            simulation.set_velocities(&now);
        }
        if !progress() {
            break;
        }
    }
    Ok(measured.lock().unwrap_or_else(PoisonError::into_inner).clone())
}

/// Stands in a guess's place, proposes nothing, and measures the others.
struct Shadow {
    guesses: Vec<(Option<Box<dyn InitialGuess>>, Proposal)>,
    /// One a column; `None` where the preconditioner does not fit the graph.
    solvers: Vec<Option<Box<dyn LinearSolver>>>,
    direct: Option<Box<dyn LinearSolver>>,
    solution: Vec<Spatial<f64>>,
    measured: Arc<Mutex<Measured>>,
    buckets: Vec<Option<usize>>,
    step: usize,
}

/// What a guess proposed last.
#[derive(Clone)]
struct Proposal {
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
        let columns = measured.lock().map_or_else(|_| Vec::new(), |measured| measured.columns.clone());
        let none = Proposal { start: vec![Spatial::zero(); topology.joints.len()], given: false };
        let guess = |factory: GuessFactory<'_>| factory(model, members, topology);
        let solver = |kind: SolverKind| kind.build(model, members, topology).ok();
        Self {
            guesses: plan.guesses.iter().map(|(_, factory)| (factory.and_then(guess), none.clone())).collect(),
            solvers: columns.iter().map(|&cg| solver(SolverKind::Cg(cg))).collect(),
            direct: solver(SolverKind::Direct),
            solution: none.start,
            measured,
            buckets: plan.buckets.clone(),
            step: 0,
        }
    }

    /// Where this step's measurements belong.
    fn bucket(&self) -> Option<usize> {
        self.buckets.get(self.step).copied().flatten()
    }

    /// Lets every guess act, and adds its time to the bucket, if there is one.
    fn act(&mut self, bucket: Option<usize>, act: impl Fn(&mut dyn InitialGuess, &mut Proposal)) {
        for (g, (guess, proposal)) in self.guesses.iter_mut().enumerate() {
            let Some(guess) = guess else { continue };
            let begin = Instant::now();
            act(guess.as_mut(), proposal);
            let seconds = begin.elapsed().as_secs_f64();
            if let (Some(bucket), Ok(mut measured)) = (bucket, self.measured.lock()) {
                measured.tallies[bucket][g].iter_mut().for_each(|tally| tally.guess_s += seconds);
            }
        }
    }

    fn measure(&mut self, component: &Component<f64>, bucket: usize) {
        self.act(Some(bucket), |guess, proposal| {
            proposal.start.fill(Spatial::zero());
            proposal.given = guess.start_solve(component, 0, &mut proposal.start);
        });
        let Ok(mut measured) = self.measured.lock() else { return };
        for (column, solver) in self.solvers.iter_mut().enumerate() {
            let Some(solver) = solver else { continue };
            // All starts of a column one after the other, so that they share what else the machine does.
            for (g, (_, proposal)) in self.guesses.iter().enumerate() {
                self.solution.copy_from_slice(&proposal.start);
                let begin = Instant::now();
                let info = solver.solve(&component.system, proposal.given, &mut self.solution);
                let tally = &mut measured.tallies[bucket][g][column];
                tally.solve_s += begin.elapsed().as_secs_f64();
                tally.iterations += info.iterations;
                tally.solves += 1;
                tally.dropped += u64::from(info.start_dropped);
            }
        }
        if let Some(direct) = &mut self.direct {
            let begin = Instant::now();
            direct.solve(&component.system, false, &mut self.solution);
            let seconds = begin.elapsed().as_secs_f64();
            for tally in &mut measured.tallies[bucket][self.guesses.len()] {
                tally.solve_s += seconds;
                tally.solves += 1;
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
        self.act(bucket, |guess, _| guess.observe_solve(component, iteration));
    }

    fn observe_step(&mut self, component: &Component<f64>) {
        self.act(self.bucket(), |guess, _| guess.observe_step(component));
        self.step += 1;
    }
}

/// Adds the velocities of a turn of the whole model about its first segment, with [`IMPULSE_SPEED`] at the last one,
/// about the horizontal axis across the line between the two: in the plane of a planar rod that hangs in one.
fn strike(model: &Model, state: &mut State) {
    let (Some(&first), Some(&last)) = (state.positions.first(), state.positions.last()) else { return };
    let up = if model.gravity.norm() > 0.0 { -model.gravity } else { Vector3::z() };
    let arm = last - first;
    let Some(axis) = [up.cross(&arm), Vector3::x().cross(&arm)].into_iter().find_map(|w| w.try_normalize(1e-9)) else {
        return;
    };
    let turn = axis * (IMPULSE_SPEED / arm.norm());
    for (i, segment) in model.segments.iter().enumerate() {
        if !segment.fixed {
            state.velocities[i] += turn.cross(&(state.positions[i] - first));
            state.angular_velocities[i] += turn;
        }
    }
}

/// How a number is spread over simulations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Lower quartile.
    pub lower: f64,
    /// Median.
    pub median: f64,
    /// Upper quartile.
    pub upper: f64,
}

impl Spread {
    /// Of these values, those that are not finite left out; `None` where nothing is left.
    pub fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let mut values: Vec<f64> = values.filter(|x| x.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let last = values.len().checked_sub(1)?;
        let at = |fraction: f64| {
            let place = fraction * last as f64;
            let (low, high) = (values[place.floor() as usize], values[place.ceil() as usize]);
            low + (high - low) * place.fract()
        };
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        Some(Self { mean, lower: at(0.25), median: at(0.5), upper: at(0.75) })
    }
}

/// A guess, or the direct solver, beside the zero start: on the same systems, in the steps of one bucket.
#[derive(Clone, Debug)]
pub struct BesideZero {
    /// Guess; [`DIRECT`] for the direct solver.
    pub guess: String,
    /// Preconditioner of conjugate gradients.
    pub preconditioner: PreconditionerKind,
    /// Tolerance, relative to the right-hand side.
    pub tolerance: f64,
    /// Of each simulation the sums of the zero start and its own.
    pub sums: Vec<[Tally; 2]>,
}

impl BesideZero {
    /// A count, over all simulations.
    pub fn count(&self, of: fn(&Tally) -> u64) -> u64 {
        self.sums.iter().map(|[_, own]| of(own)).sum()
    }

    /// A number of each simulation, from the sums of the zero start and its own.
    pub fn spread(&self, value: impl Fn(&Tally, &Tally) -> f64) -> Option<Spread> {
        Spread::of(self.sums.iter().map(|[zero, own]| value(zero, own)))
    }

    /// Iterations relative to the zero start's; `None` for the direct solver, which has none.
    pub fn iteration_ratio(&self) -> Option<Spread> {
        self.spread(|zero, own| own.iterations as f64 / zero.iterations as f64).filter(|_| self.guess != DIRECT)
    }

    /// Time relative to the zero start's, the guess's own included.
    pub fn time_ratio(&self) -> Option<Spread> {
        self.spread(|zero, own| (own.guess_s + own.solve_s) / zero.solve_s)
    }
}

/// Each guess of simulations of one plan, the zero start first and the direct solver last, with each preconditioner and
/// tolerance, in one bucket.
pub fn beside_zero(simulations: &[Measured], bucket: usize) -> Vec<BesideZero> {
    let Some(first) = simulations.first() else { return Vec::new() };
    let mut all = Vec::new();
    for (g, guess) in first.guesses.iter().enumerate() {
        for (column, &CgParams { preconditioner, tolerance, .. }) in first.columns.iter().enumerate() {
            let sums = simulations.iter().map(|measured| [0, g].map(|g| measured.tally(bucket, g, column))).collect();
            all.push(BesideZero { guess: guess.clone(), preconditioner, tolerance, sums });
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use cosserat::assembly::{Assembly, Material, RodSpec, shape};

    use super::*;

    #[test]
    fn steps_are_told_apart() {
        let all = buckets(100);
        assert_eq!(all[..4], [Some(0), Some(1), Some(2), Some(3)]);
        assert_eq!((all[9], all[10], all[14]), (Some(3), None, Some(4)));
        assert_eq!(all[59..66], [Some(4), Some(5), Some(5), Some(5), Some(5), Some(5), None]);
        assert_eq!(all.iter().filter(|&&bucket| bucket == Some(4)).count(), 17);
        assert_eq!(buckets(2).len(), 2);
    }

    #[test]
    fn a_spread_has_its_quartiles_and_leaves_out_what_is_not_finite() {
        let spread = Spread::of([4.0, 1.0, f64::NAN, 3.0, 2.0, 10.0].into_iter());
        assert_eq!(spread, Some(Spread { mean: 4.0, lower: 2.0, median: 3.0, upper: 4.0 }));
        assert_eq!(Spread::of([f64::NAN].into_iter()), None);
    }

    #[test]
    fn ratios_are_of_sums_within_a_simulation() {
        let tally = |iterations, solve_s, guess_s| Tally { solves: 2, dropped: 1, iterations, solve_s, guess_s };
        let sums = [10, 20, 60].map(|own| [tally(100, 4.0, 0.0), tally(own, 1.0, 1.0)]).to_vec();
        let of = |guess: &str| BesideZero {
            guess: guess.to_owned(),
            preconditioner: PreconditionerKind::Raw,
            tolerance: 1e-4,
            sums: sums.clone(),
        };
        let (net, median) = (of("net"), |spread: Option<Spread>| spread.map(|spread| spread.median));
        assert_eq!((median(net.iteration_ratio()), median(net.time_ratio())), (Some(0.2), Some(0.5)));
        assert_eq!((net.count(|own| own.dropped), of(DIRECT).iteration_ratio()), (3, None));
    }

    #[test]
    fn the_impulse_turns_the_rod_about_its_clamp_within_its_plane() {
        let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
        let nodes = shape::straight(Vector3::zeros(), Vector3::new(1.0, 0.0, -0.5), 3.0, 10);
        let material = Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };
        let rod = assembly.rod(&RodSpec::new(nodes, 0.05, material));
        assembly.fix(rod.start);
        let (model, mut state) = assembly.finish();
        strike(&model, &mut state);
        assert!((state.velocities[9].norm() - IMPULSE_SPEED).abs() < 1e-12);
        assert_eq!((state.velocities[0].norm(), state.angular_velocities[0].norm()), (0.0, 0.0));
        for i in 1..10 {
            let (v, axis) = (state.velocities[i], state.axis(i));
            assert!(v.y.abs() < 1e-12 && v.dot(&axis).abs() < 1e-12 && v.norm() > 0.1);
            assert!((state.angular_velocities[i] - state.angular_velocities[9]).norm() < 1e-12);
        }
    }
}
