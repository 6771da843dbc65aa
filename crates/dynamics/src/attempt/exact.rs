//! Outer iterations with the exact tangent: Newton's method on the equations of a step.
//!
//! An iteration tries the whole step of [`jointed::tangent`], then halves of it, and takes the first that leaves less of the
//! residual. What the tangent leaves out of a step is put right by a second solve with the same factor (deferred correction),
//! where it would be felt. The last iteration takes the factor of the one before, where that is enough (Shamanskii 1967). Where none does, and where joints transmit nothing yet, the iteration is that of the positive matrix.
//!
//! Where bodies can touch, an iteration has more parts (`exact/touching.rs`).

mod bordered;
mod sliding;
mod touching;

use component::{BodyPose, Component, Residuals};
use jointed::linear::LinearSolver;
use jointed::linear::articulated::Articulated;
use jointed::tangent::Equations;
use jointed::tangent::elimination::Elimination;
use jointed::topology::Topology;
use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::Vec3;

use super::{Attempt, TangentChoice, begin, evaluate, may_go_on, solve, update};
use crate::counters::{Counters, Stopwatch};
use crate::formulation::Formulation;
use crate::start::StepGuess;
use crate::step::{Interval, StepParams};

use bordered::Bordered;

/// What the tangent leaves out is put right where it would leave more than this share of the square of the residual: Newton's
/// method itself leaves about as much.
const OF_SQUARE: f64 = 0.1;
/// An iteration takes the factor of the one before where that leaves less than the target: this many times the product of the
/// residuals before both.
const OF_PRODUCT: f64 = 0.2;
/// Shares of a step that are tried.
const SHARES: [f64; 3] = [1.0, 0.5, 0.25];

/// Lanes, one bit each.
type Lanes = u64;

/// A number that is not negative in these lanes, and negative in others.
fn mask<T: Real>(lanes: Lanes) -> T {
    let mut mask = T::splat(-1.0);
    (0..T::LANES).filter(|lane| lanes >> lane & 1 == 1).for_each(|lane| mask.set_lane(lane, 1.0));
    mask
}

/// The lanes of T among `of` in which something holds.
fn lanes<T: Real>(of: Lanes, holds: impl Fn(usize) -> bool) -> Lanes {
    (0..T::LANES).filter(|&lane| of >> lane & 1 == 1 && holds(lane)).map(|lane| 1 << lane).sum()
}

/// What only sets that contacts can push need.
#[derive(Default)]
struct Touching {
    /// Whether the iteration under way takes the exact tangent.
    is_taken: bool,
    /// Whether none does any more in the attempt under way.
    is_given_up: bool,
    /// How the bodies answer forces, along the tree that the elimination goes by; made when it is first asked for.
    transfers: Option<Box<Articulated>>,
}

/// Memory for steps with the exact tangent, of one connected set or of alike ones in lanes.
pub(crate) struct Exact<T> {
    equations: Equations<T>,
    elimination: Elimination<T>,
    /// The residual that the factor was made for, as long as a further iteration may take it; infinite where none may.
    factored_at: T,
    /// One entry a body: what the tangent leaves out.
    left_out: Vec<Vec3<T>>,
    dp: Vec<Spatial<T>>,
    poses: Vec<BodyPose<T>>,
    lambda: Vec<Spatial<T>>,
    touching: Touching,
    bordered: Bordered,
}

impl<T: Real> Exact<T> {
    /// Memory for sets of this connectivity; `None` where it has too many loops.
    pub(crate) fn new(topology: &Topology) -> Option<Box<Self>> {
        let (bodies, joints) = (topology.bodies(), topology.joints.len());
        Some(Box::new(Self {
            equations: Equations {
                bodies: Vec::with_capacity(bodies),
                joints: Vec::with_capacity(joints),
                ..Equations::default()
            },
            elimination: Elimination::new(topology)?,
            factored_at: T::splat(f64::INFINITY),
            left_out: Vec::with_capacity(bodies),
            dp: vec![Spatial::zero(); bodies],
            poses: Vec::with_capacity(bodies),
            lambda: Vec::with_capacity(joints),
            touching: Touching::default(),
            bordered: Bordered::default(),
        }))
    }

    /// The step from the last evaluation, which left `now`, in the lanes `of` which it is asked; returns the lanes in which there
    /// is one.
    fn find(
        &mut self,
        component: &mut Component<T>,
        of: Lanes,
        (now, target): (T, T),
        counters: &mut Counters,
    ) -> Lanes {
        let mut watch = Stopwatch::start();
        let Self { equations, elimination, factored_at, left_out, dp, .. } = self;
        let leaves = |lane: usize| OF_PRODUCT * factored_at.lane(lane) * now.lane(lane) <= target.lane(lane);
        let mut again = lanes::<T>(of, leaves);
        if again != 0 {
            component.gather_right_hand_sides(equations);
            watch.mark(&mut counters.times.assemble);
            match elimination.solve_again(equations) {
                true => component.take_solution(elimination, dp, mask(again)),
                false => again = 0,
            }
            watch.mark(&mut counters.times.solve);
        }
        let mut anew = of & !again;
        if anew != 0 {
            component.gather(equations, 1.0);
            watch.mark(&mut counters.times.assemble);
            let solved = elimination.solve_lanes(equations);
            anew = lanes::<T>(anew, |lane| solved.lane(lane) >= 0.0);
            let left = component.left_out(equations, &elimination.corrections, left_out);
            let least = |lane: usize| target.lane(lane).max(OF_SQUARE * now.lane(lane) * now.lane(lane));
            let felt = lanes::<T>(anew, |lane| left.lane(lane) > least(lane));
            if felt != anew {
                component.take_solution(elimination, dp, mask(anew & !felt));
            }
            if felt != 0 {
                for (body, left_out) in equations.bodies.iter_mut().zip(left_out) {
                    body.defect.angular += *left_out;
                }
                elimination.solve_again(equations);
                component.take_solution(elimination, dp, mask(felt));
            }
            watch.mark(&mut counters.times.solve);
        }
        for lane in 0..T::LANES {
            let is_whole = anew >> lane & 1 == 1 && elimination.mended.lane(lane) == 0.0;
            factored_at.set_lane(lane, if is_whole { now.lane(lane) } else { f64::INFINITY });
        }
        again | anew
    }

    /// One iteration from the last evaluation, which left `residuals`, towards a `target`, in the lanes `of` which it is asked.
    /// Returns the residuals after it, and the lanes in which the tangent was of use; in the others nothing has changed.
    fn iterate(
        &mut self,
        component: &mut Component<T>,
        (residuals, target): (&Residuals<T>, T),
        of: Lanes,
        counters: &mut Counters,
    ) -> (Residuals<T>, Lanes) {
        let of = lanes::<T>(of, |lane| component.has_multipliers(lane));
        let now = residuals.worst();
        let solved = if of == 0 { 0 } else { self.find(component, of, (now, target), counters) };
        if solved == 0 {
            return (*residuals, 0);
        }
        let mut watch = Stopwatch::start();
        let Self { factored_at, dp, poses, lambda, .. } = self;
        poses.clone_from(&component.poses);
        lambda.clone_from(&component.lambda);
        let mut waiting = solved;
        let mut found = *residuals;
        for share in SHARES {
            component.go_on_from((poses, lambda), dp, T::splat(share), mask(waiting));
            watch.mark(&mut counters.times.update);
            found = evaluate(component, Formulation::Newton, counters);
            watch.mark(&mut counters.times.assemble);
            let less = |lane: usize| found.worst().lane(lane) < now.lane(lane) && found.check.lane(lane).is_finite();
            let done = lanes::<T>(waiting, less);
            waiting &= !done;
            if share < 1.0 {
                *factored_at = mask::<T>(done).select(T::splat(f64::INFINITY), *factored_at);
            }
            if waiting == 0 {
                break;
            }
        }
        if waiting != 0 {
            component.go_back_to(poses, lambda, mask(waiting));
            found = evaluate(component, Formulation::Newton, counters);
            watch.mark(&mut counters.times.assemble);
        }
        let useful = solved & !waiting;
        let count = u64::from(useful.count_ones());
        component.solves += count.min(1);
        counters.iterations += count;
        counters.segment_iterations += count * component.segments() as u64;
        counters.branch_eliminations += count * component.system.topology.branches as u64;
        (found, useful)
    }
}

/// [`super::attempt`] with the exact tangent, for formulation `newton`; `solver` solves with the positive matrix, where the
/// tangent is of no use and where the choices, one a lane, are left to work that says so. Without choices all iterations take
/// the tangent.
pub(crate) fn attempt_exactly<T: Real>(
    component: &mut Component<T>,
    interval: Interval,
    params: &StepParams,
    (exact, tangents, solver): (&mut Exact<T>, &mut [TangentChoice], &mut dyn LinearSolver<T>),
    guess: &mut dyn StepGuess<T>,
    counters: &mut Counters,
) -> Attempt<T> {
    exact.factored_at = T::splat(f64::INFINITY);
    // The exact tangent takes bodies and joints together.
    component.is_apart = true;
    let mut attempt = begin(component, interval, params, guess, counters);
    let all = lanes::<T>(Lanes::MAX, |lane| lane < component.used);
    let mut before = attempt.error;
    for iteration in 0..params.max_iterations.saturating_mul(2) {
        let now = attempt.error;
        let due = lanes::<T>(all, |lane| {
            now.lane(lane) > attempt.target.lane(lane)
                && may_go_on(iteration, now.lane(lane), before.lane(lane), params)
                && attempt.residuals.check.lane(lane).is_finite()
        });
        if due == 0 {
            break;
        }
        before = now;
        let asked = lanes::<T>(due, |lane| tangents.get(lane).is_none_or(TangentChoice::is_exact));
        let (found, useful) = exact.iterate(component, (&attempt.residuals, attempt.target), asked, counters);
        attempt.take(found, component.correction, mask(useful));
        attempt.judge_residuals(component, params.formulation);
        for (lane, tangents) in tangents.iter_mut().enumerate().filter(|(lane, _)| due >> lane & 1 == 1) {
            tangents.count(useful >> lane & 1 == 1);
        }
        let others = due & !useful;
        if others != 0 {
            T::dispatch(
                #[inline(always)]
                || component.bring_momentum_in(),
            );
            solve(component, iteration, u64::from(others.count_ones()), solver, guess, counters);
            update(component, params.formulation, mask(others), counters);
            let mut watch = Stopwatch::start();
            let residuals = evaluate(component, params.formulation, counters);
            watch.mark(&mut counters.times.assemble);
            attempt.take(residuals, component.correction, mask(others));
            attempt.judge_residuals(component, params.formulation);
        }
    }
    component.is_apart = false;
    attempt
}
