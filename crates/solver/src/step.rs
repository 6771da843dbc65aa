//! Algorithm 1 (paper, section 3) for one connected set of segments: predict, outer iterations, velocities.

use crate::component::{Component, Residuals};
use crate::contact::ContactParams;
use crate::counters::{Counters, Stopwatch};
use crate::formulation::{ContactProjection, Formulation};
use crate::guess::InitialGuess;
use crate::kernel::Spatial;
use crate::kernel::dispatch::vectorized;
use crate::kernel::lane::Real;
use crate::linear::{LinearInfo, LinearSolver, LinearStatus};

/// When the outer iterations end and how far a step may be divided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepParams {
    /// Equations to solve.
    pub formulation: Formulation,
    /// Residual to reach, relative to that of the predicted state with lambda = 0 (so that a better start does not buy a
    /// stricter target) or to 1, whichever is less (so that a prediction far off does not make a bad step good enough).
    /// Scaled units: gaps in segment lengths, angles in radians.
    pub relative_tolerance: f64,
    /// Residual that is always good enough, in the same scaled units.
    pub absolute_tolerance: f64,
    /// Error of a contact that is good enough: penetration, or slip where it should stick, relative to the smaller radius.
    pub contact_tolerance: f64,
    /// How contacts are projected.
    pub contact_projection: ContactProjection,
    /// How contacts are found and solved, in numbers.
    pub contact: ContactParams,
    /// Cap on the outer iterations of a step; where it may be halved, one that still converges at the cap may take as many
    /// again, which costs less than doing it over.
    pub max_iterations: usize,
    /// How many times a step that does not converge may be halved.
    pub max_halvings: u32,
}

impl StepParams {
    /// Those that a simulation has unless told otherwise.
    pub const DEFAULT: Self = Self {
        formulation: Formulation::XpbdGeometric,
        relative_tolerance: 1e-6,
        absolute_tolerance: 1e-9,
        contact_tolerance: 1e-3,
        contact_projection: ContactProjection::Coupled,
        contact: ContactParams::DEFAULT,
        max_iterations: 30,
        max_halvings: 6,
    };
}

impl Default for StepParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// A stretch of time to step over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Its start [s].
    pub time: f64,
    /// Its length [s].
    pub dt: f64,
}

impl Interval {
    /// Its two halves.
    pub fn halves(self) -> [Self; 2] {
        let dt = 0.5 * self.dt;
        [Self { dt, ..self }, Self { time: self.time + dt, dt }]
    }
}

/// A step converges where an iteration leaves less than this of the residual.
const CONVERGING: f64 = 0.9;

/// How a step ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Status {
    /// To the tolerance.
    Converged,
    /// To the tolerance, in substeps.
    ConvergedInSubsteps,
    /// The cap on iterations came first, even with the smallest substep.
    OutOfIterations,
    /// More contacts press at once than there is memory for; the segments were left where they were. Shorter steps would not
    /// help, so that there are none.
    TooManyContacts,
    /// The numbers were not finite, even with the smallest substep; the segments were left where they were.
    NonFinite,
}

impl Status {
    /// The status in words.
    pub fn name(self) -> &'static str {
        match self {
            Status::Converged => "converged",
            Status::ConvergedInSubsteps => "converged in substeps",
            Status::OutOfIterations => "out of iterations",
            Status::TooManyContacts => "too many contacts",
            Status::NonFinite => "not finite",
        }
    }

    /// Whether a shorter step may do better.
    pub(crate) fn may_be_halved(self) -> bool {
        matches!(self, Status::OutOfIterations | Status::NonFinite)
    }
}

/// Result of an attempt at a step, a lane each.
#[derive(Clone, Copy, Debug)]
pub struct Attempt<T> {
    /// Residuals at the end.
    pub residuals: Residuals<T>,
    /// The residual to reach.
    pub target: T,
    /// Not 0 where a segment spins by more than half a turn in the step.
    pub unsolved: T,
    /// What became of a guess for the step's start.
    pub start: Start,
}

/// Where a step began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// At the prediction.
    Prediction,
    /// At a guess.
    Guess,
    /// At the prediction, with multipliers of a guess whose poses were dropped.
    Multipliers,
}

impl<T: Real> Attempt<T> {
    /// How a lane ended.
    pub fn status(&self, lane: usize) -> Status {
        if !self.residuals.check.lane(lane).is_finite() {
            Status::NonFinite
        } else if self.residuals.worst().lane(lane) <= self.target.lane(lane) && self.unsolved.lane(lane) == 0.0 {
            Status::Converged
        } else {
            Status::OutOfIterations
        }
    }
}

/// Attempts one step over `interval`. Velocities are left to the caller, who accepts the step or takes it back.
pub fn attempt<T: Real>(
    component: &mut Component<T>,
    interval: Interval,
    params: &StepParams,
    solver: &mut dyn LinearSolver<T>,
    guess: &mut dyn StepGuess<T>,
    counters: &mut Counters,
) -> Attempt<T> {
    let mut attempt = begin(component, interval, params, guess, counters);
    let mut before = attempt.residuals.worst();
    for iteration in 0..params.max_iterations.saturating_mul(2) {
        let now = attempt.residuals.worst();
        // A lane goes on while its residual is above the target, beyond the cap as long as it converges and would be done
        // again in halves. It stops for good when it is not finite.
        let mut active = T::splat(-1.0);
        let mut lanes = 0;
        for lane in 0..component.used {
            let is_due = now.lane(lane) > attempt.target.lane(lane)
                && may_go_on(iteration, now.lane(lane), before.lane(lane), params);
            if is_due && attempt.residuals.check.lane(lane).is_finite() {
                active.set_lane(lane, 1.0);
                lanes += 1;
            }
        }
        if lanes == 0 {
            break;
        }
        before = now;
        solve(component, iteration, lanes, solver, guess, counters);
        update(component, params.formulation, active, counters);
        let mut watch = Stopwatch::start();
        attempt.residuals = evaluate(component, params.formulation, counters);
        watch.mark(&mut counters.times.assemble);
    }
    attempt
}

/// Whether an iteration may follow: up to the cap, and beyond it while it converges and would be done again in halves.
pub(crate) fn may_go_on(iteration: usize, now: f64, before: f64, params: &StepParams) -> bool {
    iteration < params.max_iterations
        || (iteration < params.max_iterations.saturating_mul(2) && params.max_halvings > 0 && now < CONVERGING * before)
}

/// Lines 1 to 5 of Algorithm 1, the guess for the step's start if there is one, and the first evaluation.
pub(crate) fn begin<T: Real>(
    component: &mut Component<T>,
    interval: Interval,
    params: &StepParams,
    guess: &mut dyn StepGuess<T>,
    counters: &mut Counters,
) -> Attempt<T> {
    let formulation = params.formulation;
    let mut watch = Stopwatch::start();
    predict(component, interval, formulation, &mut watch, counters);
    let mut residuals = evaluate(component, formulation, counters);
    watch.mark(&mut counters.times.assemble);
    let target = target(&residuals, params);
    let mut start = Start::Prediction;
    if guess.start_step(component, counters) {
        start = Start::Guess;
        watch.mark(&mut counters.times.guess);
        component.expect_multipliers();
        let predicted = residuals.worst().lane(0);
        residuals = evaluate(component, formulation, counters);
        let started = residuals.worst().lane(0);
        if started > predicted * guess.trust() || started.is_nan() {
            // Further from the solution than the prediction, as it seems: the bodies go back to it. The multipliers stay;
            // with a momentum residual they matter to the next poses through the geometric stiffness alone.
            start = Start::Multipliers;
            component.poses.copy_from_slice(&component.predicted);
            residuals = evaluate(component, formulation, counters);
            counters.guesses_used -= 1;
            counters.guesses_dropped += 1;
        }
        watch.mark(&mut counters.times.assemble);
    }
    counters.load_evaluations += component.load_count() as u64;
    if component.is_damped() {
        counters.damping_evaluations += (component.segments() * component.used) as u64;
    }
    Attempt { residuals, target, unsolved: component.unsolved, start }
}

/// The linear solve of an outer iteration (line 9 of Algorithm 1) for so many `lanes`, from the guess's start if it has one.
pub(crate) fn solve<T: Real>(
    component: &mut Component<T>,
    iteration: usize,
    lanes: u64,
    solver: &mut dyn LinearSolver<T>,
    guess: &mut dyn StepGuess<T>,
    counters: &mut Counters,
) {
    let mut watch = Stopwatch::start();
    let has_start = solver.uses_start() && guess.start_solve(component, iteration, counters);
    if guess.exists() {
        watch.mark(&mut counters.times.guess);
    }
    let info = solver.solve(&component.system, has_start, &mut component.dlambda);
    watch.mark(&mut counters.times.solve);
    if guess.exists() {
        guess.observe_solve(component, iteration);
        watch.mark(&mut counters.times.guess);
    }
    component.solves += 1;
    counters.iterations += lanes;
    counters.segment_iterations += lanes * component.segments() as u64;
    count_solve(component, &info, lanes, solver.uses_start(), counters);
}

/// Lines 10 and 11 of Algorithm 1, in the lanes where `active` >= 0.
pub(crate) fn update<T: Real>(
    component: &mut Component<T>,
    formulation: Formulation,
    active: T,
    counters: &mut Counters,
) {
    let mut watch = Stopwatch::start();
    vectorized(
        #[inline(always)]
        || component.update(formulation, active),
    );
    watch.mark(&mut counters.times.update);
}

/// Drag, where there is air, and the prediction.
pub(crate) fn predict<T: Real>(
    component: &mut Component<T>,
    Interval { time, dt }: Interval,
    formulation: Formulation,
    watch: &mut Stopwatch,
    counters: &mut Counters,
) {
    if component.has_air() {
        vectorized(
            #[inline(always)]
            || component.evaluate_drag(time, dt),
        );
        counters.drag_evaluations += (component.segments() * component.used) as u64;
        watch.mark(&mut counters.times.drag);
    }
    vectorized(
        #[inline(always)]
        || component.predict(time, dt, formulation),
    );
    watch.mark(&mut counters.times.predict);
}

/// The residual to reach, from the prediction's.
pub(crate) fn target<T: Real>(predicted: &Residuals<T>, params: &StepParams) -> T {
    let (reference, one) = (predicted.worst(), T::splat(1.0));
    let reference = (one - reference).select(reference, one);
    (reference * T::splat(params.relative_tolerance)).max(T::splat(params.absolute_tolerance))
}

/// Constraints, residuals and the linear system at the component's poses and multipliers.
pub(crate) fn evaluate<T: Real>(
    component: &mut Component<T>,
    formulation: Formulation,
    counters: &mut Counters,
) -> Residuals<T> {
    component.evaluations += 1;
    let segments = (component.segments() * component.used) as u64;
    counters.geometric_evaluations += if formulation.geometric() { segments } else { 0 };
    counters.momentum_evaluations += if formulation.momentum() { segments } else { 0 };
    vectorized(
        #[inline(always)]
        || component.evaluate(formulation),
    )
}

pub(crate) fn count_solve<T: Real>(
    component: &Component<T>,
    info: &LinearInfo,
    lanes: u64,
    iterative: bool,
    counters: &mut Counters,
) {
    counters.linear_iterations += info.iterations;
    if info.start_dropped {
        counters.guesses_used -= 1;
        counters.guesses_dropped += 1;
    }
    counters.linear_failures += u64::from(info.status != LinearStatus::Solved);
    if !iterative {
        counters.branch_eliminations += lanes * component.system.topology.branches as u64;
    }
}

/// A guess as the step sees it: one rod may have one, rods side by side have none.
pub trait StepGuess<T: Real> {
    /// Whether there is a guess at all: what does not exist takes no time.
    fn exists(&self) -> bool {
        true
    }
    /// How many times the prediction's residual that of a start of a step may be.
    fn trust(&self) -> f64 {
        1.0
    }
    /// Lets the guess replace p* and lambda = 0. Returns whether it did.
    fn start_step(&mut self, component: &mut Component<T>, counters: &mut Counters) -> bool;
    /// Lets the guess fill the start of a linear solve. Returns whether it did.
    fn start_solve(&mut self, component: &mut Component<T>, iteration: usize, counters: &mut Counters) -> bool;
    /// Shows the guess a solution.
    fn observe_solve(&mut self, component: &Component<T>, iteration: usize);
}

/// No guess: every start is zero.
#[derive(Clone, Copy, Debug)]
pub struct NoGuess;

impl<T: Real> StepGuess<T> for NoGuess {
    fn exists(&self) -> bool {
        false
    }
    fn start_step(&mut self, _: &mut Component<T>, _: &mut Counters) -> bool {
        false
    }
    fn start_solve(&mut self, _: &mut Component<T>, _: usize, _: &mut Counters) -> bool {
        false
    }
    fn observe_solve(&mut self, _: &Component<T>, _: usize) {}
}

impl StepGuess<f64> for Box<dyn InitialGuess> {
    fn trust(&self) -> f64 {
        self.as_ref().trust()
    }

    fn start_step(&mut self, component: &mut Component<f64>, counters: &mut Counters) -> bool {
        if !self.helps_steps() {
            return false;
        }
        // The prediction stands twice in the component: one of the two becomes the start.
        let mut poses = std::mem::take(&mut component.predicted);
        let mut lambda = std::mem::take(&mut component.lambda);
        let given = self.as_mut().start_step(component, &mut poses, &mut lambda);
        for ((pose, predicted), is_fixed) in
            poses.iter_mut().zip(&component.poses).zip(&component.system.topology.fixed)
        {
            if *is_fixed {
                *pose = *predicted;
            }
        }
        let finite = lambda.iter().all(is_finite)
            && poses.iter().all(|p| p.x.dot(p.x).is_finite() && (p.q.v.dot(p.q.v) + p.q.w * p.q.w).is_finite());
        component.predicted = std::mem::replace(&mut component.poses, poses);
        component.lambda = lambda;
        if given && !finite {
            component.poses.copy_from_slice(&component.predicted);
            component.lambda.fill(Spatial::zero());
        }
        count_guess(given, finite, counters)
    }

    fn start_solve(&mut self, component: &mut Component<f64>, iteration: usize, counters: &mut Counters) -> bool {
        if !self.helps_solves() {
            return false;
        }
        let mut dlambda = std::mem::take(&mut component.dlambda);
        dlambda.fill(Spatial::zero());
        let given = self.as_mut().start_solve(component, iteration, &mut dlambda);
        let finite = dlambda.iter().all(is_finite);
        component.dlambda = dlambda;
        count_guess(given, finite, counters)
    }

    fn observe_solve(&mut self, component: &Component<f64>, iteration: usize) {
        if self.helps_solves() {
            self.as_mut().observe_solve(component, iteration);
        }
    }
}

pub(crate) fn is_finite(x: &Spatial<f64>) -> bool {
    x.dot(*x).is_finite()
}

fn count_guess(given: bool, finite: bool, counters: &mut Counters) -> bool {
    counters.guesses_used += u64::from(given && finite);
    counters.guesses_dropped += u64::from(given && !finite);
    given && finite
}
