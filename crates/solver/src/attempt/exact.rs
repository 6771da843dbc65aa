//! Outer iterations with the exact tangent: Newton's method on the equations of a step.
//!
//! An iteration tries the whole step of [`crate::tangent`], then halves of it, and takes the first that leaves less of the
//! residual. What the tangent leaves out of a step is put right by a second solve with the same factor (deferred correction),
//! where it would be felt. The last iteration takes the factor of the one before, where that is enough (Shamanskii 1967). Where none does, and where joints transmit nothing yet, the iteration is that of the positive matrix.

use nalgebra::Vector3;

use super::{Attempt, TangentChoice, begin, evaluate, may_go_on, solve, update};
use crate::component::{BodyPose, Component, Residuals};
use crate::counters::{Counters, Stopwatch};
use crate::formulation::Formulation;
use crate::kernel::Spatial;
use crate::kernel::dispatch::vectorized;
use crate::kernel::math::Vec3;
use crate::linear::LinearSolver;
use crate::start::StepGuess;
use crate::step::{Interval, StepParams};
use crate::tangent::Equations;
use crate::tangent::elimination::Elimination;
use crate::topology::Topology;

/// What the tangent leaves out is put right where it would leave more than this share of the square of the residual: Newton's
/// method itself leaves about as much.
const OF_SQUARE: f64 = 0.1;
/// An iteration takes the factor of the one before where that leaves less than the target: this many times the product of the
/// residuals before both.
const OF_PRODUCT: f64 = 0.2;
/// Shares of a step that are tried.
const SHARES: [f64; 3] = [1.0, 0.5, 0.25];

/// Memory for steps with the exact tangent.
#[derive(Clone, Debug)]
pub(crate) struct Exact {
    equations: Equations,
    elimination: Elimination,
    /// The residual that the factor was made for, as long as a further iteration may take it; infinite where none may.
    factored_at: f64,
    /// One entry a body: what the tangent leaves out.
    left_out: Vec<Vec3<f64>>,
    dp: Vec<Spatial<f64>>,
    poses: Vec<BodyPose<f64>>,
    lambda: Vec<Spatial<f64>>,
}

impl Exact {
    /// Memory for sets of this connectivity; `None` where it has too many loops.
    pub(crate) fn new(topology: &Topology) -> Option<Box<Self>> {
        let (bodies, joints) = (topology.bodies(), topology.joints.len());
        Some(Box::new(Self {
            equations: Equations {
                bodies: Vec::with_capacity(bodies),
                joints: Vec::with_capacity(joints),
                rows: Vec::new(),
            },
            elimination: Elimination::new(topology)?,
            factored_at: f64::INFINITY,
            left_out: Vec::with_capacity(bodies),
            dp: Vec::with_capacity(bodies),
            poses: Vec::with_capacity(bodies),
            lambda: Vec::with_capacity(joints),
        }))
    }

    /// One iteration from the last evaluation, which left `residuals`, towards a `target`. Returns those after it; `None` where
    /// the tangent is of no use, and then nothing has changed.
    fn iterate(
        &mut self,
        component: &mut Component<f64>,
        residuals: &Residuals<f64>,
        target: f64,
        counters: &mut Counters,
    ) -> Option<Residuals<f64>> {
        if !component.has_multipliers() {
            return None;
        }
        let mut watch = Stopwatch::start();
        let Self { equations, elimination, factored_at, left_out, dp, poses, lambda } = self;
        let now = residuals.worst();
        let is_again = OF_PRODUCT * *factored_at * now <= target && {
            component.gather_right_hand_sides(equations);
            watch.mark(&mut counters.times.assemble);
            elimination.solve_again(equations)
        };
        let is_solved = is_again || {
            component.gather(equations, 1.0);
            watch.mark(&mut counters.times.assemble);
            elimination.solve(equations)
        };
        *factored_at = if is_again || elimination.mended > 0 { f64::INFINITY } else { now };
        if is_solved
            && !is_again
            && component.left_out(equations, &elimination.corrections, left_out) > target.max(OF_SQUARE * now * now)
        {
            for (body, left_out) in equations.bodies.iter_mut().zip(left_out) {
                body.defect[1] += Vector3::from(left_out.0);
            }
            elimination.solve_again(equations);
        }
        watch.mark(&mut counters.times.solve);
        if !is_solved {
            return None;
        }
        component.take_solution(elimination, dp);
        poses.clone_from(&component.poses);
        lambda.clone_from(&component.lambda);
        for share in SHARES {
            component.go_on_from(poses, lambda, dp, share);
            watch.mark(&mut counters.times.update);
            let found = evaluate(component, Formulation::Newton, counters);
            watch.mark(&mut counters.times.assemble);
            if found.check.is_finite() && found.worst() < residuals.worst() {
                *factored_at = if share < 1.0 { f64::INFINITY } else { *factored_at };
                component.solves += 1;
                counters.iterations += 1;
                counters.segment_iterations += component.segments() as u64;
                counters.branch_eliminations += component.system.topology.branches as u64;
                return Some(found);
            }
        }
        component.go_back_to(poses, lambda);
        evaluate(component, Formulation::Newton, counters);
        watch.mark(&mut counters.times.assemble);
        None
    }
}

/// [`super::attempt`] with the exact tangent, for formulation `newton`; `solver` solves with the positive matrix, where the
/// tangent is of no use and where the choice is left to work that says so.
pub(crate) fn attempt_exactly(
    component: &mut Component<f64>,
    interval: Interval,
    params: &StepParams,
    (exact, mut tangents, solver): (&mut Exact, Option<&mut TangentChoice>, &mut dyn LinearSolver),
    guess: &mut dyn StepGuess<f64>,
    counters: &mut Counters,
) -> Attempt<f64> {
    exact.factored_at = f64::INFINITY;
    // The exact tangent takes bodies and joints together.
    component.is_apart = true;
    let mut attempt = begin(component, interval, params, guess, counters);
    let mut before = attempt.residuals.worst();
    for iteration in 0..params.max_iterations.saturating_mul(2) {
        let now = attempt.residuals.worst();
        let is_due = now > attempt.target && may_go_on(iteration, now, before, params);
        if !is_due || !attempt.residuals.check.is_finite() {
            break;
        }
        before = now;
        let is_exact = tangents.as_ref().is_none_or(|tangents| tangents.is_exact());
        let found =
            if is_exact { exact.iterate(component, &attempt.residuals, attempt.target, counters) } else { None };
        if let Some(tangents) = &mut tangents {
            tangents.count(found.is_some());
        }
        attempt.residuals = found.unwrap_or_else(|| {
            vectorized(
                #[inline(always)]
                || component.bring_momentum_in(),
            );
            solve(component, iteration, 1, solver, guess, counters);
            update(component, params.formulation, 1.0, counters);
            let mut watch = Stopwatch::start();
            let residuals = evaluate(component, params.formulation, counters);
            watch.mark(&mut counters.times.assemble);
            residuals
        });
    }
    component.is_apart = false;
    attempt
}
