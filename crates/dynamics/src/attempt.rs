//! One attempt at a step: Algorithm 1 (paper, section 3) for one connected set of segments, or for several in lanes.

mod exact;
mod tangent_choice;

use component::{Component, Residuals};
use jointed::linear::{LinearInfo, LinearSolver, LinearStatus};
use kernels::lane::Real;

use crate::counters::{Counters, Stopwatch};
use crate::formulation::Formulation;
use crate::start::{Start, StepGuess};
use crate::step::{Interval, Status, StepParams};

pub(crate) use exact::{Exact, attempt_exactly};
pub(crate) use tangent_choice::TangentChoice;

/// A step converges where an iteration leaves less than this of the residual.
const CONVERGING: f64 = 0.9;

/// A joint may transmit another moment than its law's by this share of that at which it yields or slips.
const OF_MOMENT: f64 = 1e-3;

/// Result of an attempt at a step, a lane each.
#[derive(Clone, Copy, Debug)]
pub struct Attempt<T> {
    /// Residuals at the end.
    pub(crate) residuals: Residuals<T>,
    /// How far the state may be from the solution: a way of surfaces (`component/measure.rs`), or without a momentum residual the worst one.
    pub(crate) error: T,
    /// The error to reach.
    pub target: T,
    /// The last correction; infinite before the first.
    pub(crate) correction: T,
    /// Not 0 where a segment spins by more than half a turn in the step, or by more than a right angle under loads alone, or is pressed far beyond its buckling load.
    pub unsolved: T,
    /// What became of a guess for the step's start.
    pub start: Start,
}

impl<T: Real> Attempt<T> {
    /// Takes what an iteration came to in the lanes where `active` >= 0: the residuals after it, and by how much it corrected the
    /// state.
    pub(crate) fn take(&mut self, residuals: Residuals<T>, correction: T, active: T) {
        self.residuals = residuals;
        for lane in (0..T::LANES).filter(|&lane| active.lane(lane) >= 0.0) {
            let [now, before] = [correction, self.correction].map(|x| x.lane(lane));
            self.judge(lane, now, convergence_rate(now, before));
            self.correction.set_lane(lane, now);
        }
    }

    /// Judges a lane by its last correction, where each is this share of the one before; by its residual where no correction is known.
    pub(crate) fn judge(&mut self, lane: usize, correction: f64, rate: f64) {
        let is_known = correction != f64::INFINITY;
        let error = if is_known { remaining(correction, rate) } else { self.residuals.worst().lane(lane) };
        self.error.set_lane(lane, error);
    }

    /// Judges an attempt after an iteration by residuals, which a small correction may hide: near a grip that holds a rod twice along its axis 1e-8 m carry
    /// 100 N. It is not at its end while forces are not in balance, while joints are off by more than the target, as where one has just turned past half a
    /// turn, nor while a joint with a law transmits another moment than its law's.
    pub(crate) fn judge_residuals(&mut self, component: &Component<T>, formulation: Formulation) {
        let is_due = |lane: usize| self.error.lane(lane) <= self.target.lane(lane);
        if !(0..T::LANES).any(is_due) {
            return;
        }
        self.unsolved = component.unsolved.max(component.overturns());
        // Without a momentum residual the error is the joints' residual.
        if !formulation.momentum() {
            return;
        }
        let of_forces = component.missing_balance(self.target);
        let of_joints = self.residuals.stretch.max(self.residuals.bend);
        let of_laws = component.missed_by_laws() / OF_MOMENT;
        for lane in 0..T::LANES {
            let (error, target) = (self.error.lane(lane), self.target.lane(lane));
            let off = (of_forces.lane(lane).max(of_laws) * target).max(of_joints.lane(lane));
            if error <= target && off > target {
                self.error.set_lane(lane, off);
            }
        }
        self.unsolved = self.unsolved.max(component.buckles());
    }

    /// How a lane ended.
    pub fn status(&self, lane: usize) -> Status {
        if !self.residuals.check.lane(lane).is_finite() {
            Status::NonFinite
        } else if self.error.lane(lane) <= self.target.lane(lane) && self.unsolved.lane(lane) == 0.0 {
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
    let mut before = attempt.error;
    for iteration in 0..params.max_iterations.saturating_mul(2) {
        let now = attempt.error;
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
        let residuals = evaluate(component, params.formulation, counters);
        watch.mark(&mut counters.times.assemble);
        attempt.take(residuals, component.correction, active);
        attempt.judge_residuals(component, params.formulation);
    }
    attempt
}

/// The share of a correction that the next one leaves, from the last two. It counts as a half at least: what is measured early is that of
/// the parts that converge fast.
pub(crate) fn convergence_rate(now: f64, before: f64) -> f64 {
    if now.is_finite() { (now / before).max(0.5) } else { 0.5 }
}

/// How far a state is from the solution after a correction, where each is a share `rate` of the one before: those to come sum up to
/// rate / (1 - rate) of the last (Hairer and Wanner 1996, IV.8).
pub(crate) fn remaining(correction: f64, rate: f64) -> f64 {
    if correction == 0.0 {
        0.0
    } else if rate < 1.0 {
        correction * rate / (1.0 - rate)
    } else {
        f64::INFINITY
    }
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
    let tolerance = params.allowed_motion(!component.pushed.is_empty());
    if formulation.momentum() {
        component.begin_measure(tolerance);
    }
    let mut evaluated = None;
    if !formulation.momentum() || guess.reads_prediction() {
        evaluated = Some(evaluate(component, formulation, counters));
        watch.mark(&mut counters.times.assemble);
    }
    let target = match &evaluated {
        Some(predicted) if !formulation.momentum() => target(predicted, params),
        _ => T::splat(tolerance),
    };
    let mut start = Start::Prediction;
    if guess.start_step(component, counters) {
        start = Start::Guess;
        watch.mark(&mut counters.times.guess);
        component.expect_multipliers();
        if component.leads_away() {
            // The multipliers stay: they matter to the next poses through the geometric stiffness alone.
            start = Start::Multipliers;
            component.poses.copy_from_slice(&component.predicted);
            counters.guesses_dropped += 1;
        }
        evaluated = None;
    }
    if component.slides() {
        component.begin_sliding(start != Start::Prediction);
        evaluated = None;
    }
    let residuals = match evaluated {
        Some(predicted) => predicted,
        None => evaluate(component, formulation, counters),
    };
    watch.mark(&mut counters.times.assemble);
    counters.load_evaluations += component.load_count() as u64;
    if component.is_damped() {
        counters.damping_evaluations += (component.segments() * component.used) as u64;
    }
    let error = if formulation.momentum() { T::splat(f64::INFINITY) } else { residuals.worst() };
    Attempt { residuals, error, target, correction: T::splat(f64::INFINITY), unsolved: component.unsolved, start }
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
    component.drop_free();
    watch.mark(&mut counters.times.solve);
    if guess.exists() {
        guess.observe_solve(component, iteration);
        watch.mark(&mut counters.times.guess);
    }
    if has_start {
        counters.guesses_used += u64::from(!info.start_dropped);
        counters.guesses_dropped += u64::from(info.start_dropped);
    }
    count_iteration(component, &info, lanes, solver.uses_start(), counters);
}

/// Counts an outer iteration with its linear solve.
pub(crate) fn count_iteration<T: Real>(
    component: &mut Component<T>,
    info: &LinearInfo,
    lanes: u64,
    iterative: bool,
    counters: &mut Counters,
) {
    component.solves += 1;
    counters.iterations += lanes;
    counters.segment_iterations += lanes * component.segments() as u64;
    count_solve(component, info, lanes, iterative, counters);
}

/// Lines 10 and 11 of Algorithm 1, in the lanes where `active` >= 0.
pub(crate) fn update<T: Real>(
    component: &mut Component<T>,
    formulation: Formulation,
    active: T,
    counters: &mut Counters,
) {
    let mut watch = Stopwatch::start();
    component.update(formulation, active);
    watch.mark(&mut counters.times.update);
}

/// Forces as they are at the end of the step, drag, where there is air, and the prediction.
pub(crate) fn predict<T: Real>(
    component: &mut Component<T>,
    Interval { time, dt }: Interval,
    formulation: Formulation,
    watch: &mut Stopwatch,
    counters: &mut Counters,
) {
    component.set_forces(time + dt);
    if component.has_air() {
        component.evaluate_drag(time, dt);
        counters.drag_evaluations += (component.segments() * component.used) as u64;
        watch.mark(&mut counters.times.drag);
    }
    component.predict(time, dt, formulation);
    watch.mark(&mut counters.times.predict);
}

/// The residual to reach without a momentum residual, from the prediction's.
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
    counters.momentum_evaluations += if formulation.momentum() { segments } else { 0 };
    component.evaluate(formulation)
}

pub(crate) fn count_solve<T: Real>(
    component: &Component<T>,
    info: &LinearInfo,
    lanes: u64,
    iterative: bool,
    counters: &mut Counters,
) {
    counters.linear_iterations += info.iterations;
    counters.linear_failures += u64::from(info.status != LinearStatus::Solved);
    if !iterative {
        counters.branch_eliminations += lanes * component.system.topology.branches as u64;
    }
}

/// Velocities of a step that is accepted, in the lanes where `active` >= 0.
pub(crate) fn finish<T: Real>(
    component: &mut Component<T>,
    formulation: Formulation,
    active: T,
    counters: &mut Counters,
) {
    let mut watch = Stopwatch::start();
    component.update_velocities(formulation, active);
    watch.mark(&mut counters.times.predict);
}

/// Counts an attempt that no other follows, in one lane; its errors only where the poses that it led to are kept.
pub(crate) fn count_step<T: Real>(result: &Attempt<T>, lane: usize, is_kept: bool, counters: &mut Counters) {
    counters.steps += 1;
    counters.guesses_used += u64::from(result.start == Start::Guess);
    match result.status(lane) {
        Status::NonFinite => counters.non_finite += 1,
        status => {
            counters.not_converged += u64::from(status == Status::OutOfIterations);
            if !is_kept {
                return;
            }
            let residuals = &result.residuals;
            counters.worst_stretch = counters.worst_stretch.max(residuals.stretch.lane(lane));
            counters.worst_bend = counters.worst_bend.max(residuals.bend.lane(lane));
            counters.worst_momentum = counters.worst_momentum.max(residuals.momentum.lane(lane));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_remains_is_the_sum_of_a_geometric_series() {
        let found = [(0.5, f64::INFINITY), (0.1, 0.2), (0.1, 1.0), (0.0, 0.0)]
            .map(|(now, before)| remaining(now, convergence_rate(now, before)));
        assert_eq!(found, [0.5, 0.1, 0.1, 0.0]);
        assert!((remaining(0.3, convergence_rate(0.3, 0.4)) - 0.9).abs() < 1e-15);
        for (now, before) in [(0.2, 0.2), (0.3, 0.2), (0.1, 0.0)] {
            assert_eq!(remaining(now, convergence_rate(now, before)), f64::INFINITY);
        }
    }
}
