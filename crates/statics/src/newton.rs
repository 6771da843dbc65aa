//! Newton's method on the equations of equilibrium, with the exact tangent ([`jointed::tangent`]).
//!
//! Multipliers are forces, and of the inertia next to nothing is left. At a minimum of the energy the elimination finds the
//! right signs of the tangent's eigenvalues. Elsewhere the turns are made stiffer until it does, as a tension in the rods
//! would make them ([`Shift`]): steps go down in energy, and turns are limited. A small step along which
//! the energy curves down goes on that far, and so an unstable equilibrium is left at once.

mod shift;
mod wind;

use component::{BodyPose, Component, Residuals};
use jointed::tangent::Equations;
use jointed::tangent::elimination::Elimination;
use jointed::topology::Topology;
use kernels::Spatial;
use kernels::math::{Sym3, Vec3};
use shift::Shift;
use wind::Wind;

use super::contact::Contacts;
use super::params::StaticParams;
use super::report::StaticReport;

/// Share of the inertia that is left [1/s^2]: what moves by e in 10^4 s counts as at rest. Where nothing is held, whatever moves
/// a set as a whole meets no other resistance; then it is more than rounding errors.
pub(super) const INERTIA: [f64; 2] = [1e-8, 1e-5];
/// Largest turn of a segment in one step, and of one segment against its neighbour [rad]: whole turns must not be lost.
const LARGEST_TURN: f64 = 2.0;
const LARGEST_BEND: f64 = 1.0;
/// A step that asks for this many times as much is not taken; a shorter one is scaled down.
const FAR: f64 = 8.0;
/// Turns up to this many [rad], and up to this many of the largest, are rounding errors.
pub(super) const ROUNDING: f64 = 1e-13;
/// Where steps this small do not shrink, what nothing resists drifts by rounding errors [segment lengths, rad].
const DRIFT: f64 = 1e-6;
/// Gap by which a step that is lengthened may miss [segment lengths].
const GAP: f64 = 0.1;
/// Solves after which the method is given up.
const MOST_SOLVES: usize = 120;
/// The same with contacts, of which each step may choose others.
const MOST_WITH_CONTACTS: usize = 1000;
/// Solves of a step in which others press.
const MOST_CHOICES: usize = 12;
/// Unstable equilibria that are left before the method is given up.
const MOST_PUSHES: usize = 3;
/// Turn by which an unstable equilibrium is left [rad].
const PUSH: f64 = 1e-3;

/// Whether the method fits: one loop at most, and no torques that are fixed in space, which have no energy.
pub(super) fn fits(component: &Component<f64>, topology: &Topology) -> Option<Elimination> {
    if component.has_torques() { None } else { Elimination::new(topology) }
}

/// Descends to an equilibrium; the report has not converged where none was found.
///
/// Contacts begin with the forces that they have.
pub(super) fn descend(
    component: &mut Component<f64>,
    elimination: Elimination,
    contacts: &mut Contacts,
    params: &StaticParams,
) -> StaticReport {
    let topology = component.system.topology.clone();
    let is_held = topology.fixed.contains(&true);
    let mut descent = Descent {
        elimination,
        equations: Equations::default(),
        lengths: (0..component.segments()).map(|i| component.length(i)).collect(),
        inertia: INERTIA[usize::from(!is_held)],
        dp: vec![Spatial::zero(); component.poses.len()],
        poses: Vec::new(),
        lambda: Vec::new(),
        report: StaticReport::default(),
        limit: params.max_steps.min(if contacts.is_empty() { MOST_SOLVES } else { MOST_WITH_CONTACTS }),
    };
    component.begin_equilibrium();
    let mut wind = Wind::new(component);
    let mut shift = Shift::new(component, &mut descent.equations, &wind.forces, is_held);
    let (mut pushes, mut loop_begin) = (0, 0);
    while descent.report.steps < descent.limit {
        // The first solve is without drag.
        let waits =
            component.has_air() && (descent.report.steps == 0 || wind.follow(component, descent.report.movement));
        if descent.report.steps == 0 || (component.has_air() && !waits) {
            descent.report.loops += 1;
            loop_begin = descent.report.steps;
        }
        let residuals = component.evaluate_equilibrium(&wind.forces);
        contacts.evaluate(component);
        let are_placed = contacts.are_placed();
        let Some(tried) = descent.solve(component, contacts, &residuals, &mut shift) else { break };
        let (before, change_before) = (descent.report.movement, contacts.change);
        contacts.take(&descent.elimination);
        let farthest = contacts.farthest(&descent.elimination);
        let size = if farthest < 1.0 { tried.size.max(1.0 / farthest) } else { tried.size };
        let longest = if shift.is_least() { 1.0 } else { farthest.min(GAP / residuals.stretch).max(1.0) };
        descent.step(component, &topology, size, longest);
        let report = &mut descent.report;
        report.most_in_loop = report.most_in_loop.max(report.steps - loop_begin);
        if report.movement > 0.9 * before && report.movement.max(before) < DRIFT {
            shift.steady();
        }
        if report.movement.is_nan() {
            break;
        }
        let shortest = descent.lengths.iter().copied().fold(f64::INFINITY, f64::min);
        // A contact beside what holds the rod closes slowly, and bears what the grip would bear.
        let is_closing = contacts.change < 0.9 * change_before || contacts.change > contacts.negligible;
        let is_open = contacts.change > params.tolerance * shortest && is_closing;
        if report.movement > params.tolerance || is_open || waits || !are_placed || farthest < 1.0 {
            continue;
        }
        if shift.is_least() {
            (report.converged, report.stable) = (true, Some(true));
            break;
        }
        if tried.is_saddle && !params.leave_unstable {
            (report.converged, report.stable) = (true, Some(false));
            break;
        }
        if tried.is_saddle {
            if pushes == MOST_PUSHES {
                // In balance, and led back to it: what a rod that may spin about itself does, whose energy does not change.
                report.converged = !contacts.is_empty();
                break;
            }
            pushes += 1;
            descent.push(component);
        }
        shift.forget();
    }
    descent.report
}

/// A solve that is taken.
struct Tried {
    /// Its largest turn, over what is allowed.
    size: f64,
    /// Whether the signs were wrong with the least shift.
    is_saddle: bool,
}

/// Memory of a descent, and what it has come to.
struct Descent {
    elimination: Elimination,
    equations: Equations,
    /// Of the segments [m].
    lengths: Vec<f64>,
    /// Share of the inertia [1/s^2].
    inertia: f64,
    dp: Vec<Spatial<f64>>,
    poses: Vec<BodyPose<f64>>,
    lambda: Vec<Spatial<f64>>,
    report: StaticReport,
    /// Most solves.
    limit: usize,
}

impl Descent {
    /// Solves with growing shifts until the signs are right and the turns not far too large; `None` where numbers are not
    /// finite.
    fn solve(
        &mut self,
        component: &Component<f64>,
        contacts: &mut Contacts,
        residuals: &Residuals<f64>,
        shift: &mut Shift,
    ) -> Option<Tried> {
        if !residuals.check.is_finite() {
            return None;
        }
        // Multipliers that are zero know of no tension yet, and the first turns are far too large.
        let is_first = self.report.steps == 0;
        let mut is_saddle = false;
        shift.begin(component);
        loop {
            for _ in 0..MOST_CHOICES {
                self.report.steps += 1;
                component.gather(&mut self.equations, self.inertia);
                for (body, length) in self.equations.bodies.iter_mut().zip(&self.lengths) {
                    body.turning += Sym3::identity(shift.force() * length);
                }
                contacts.add(&mut self.equations);
                if !self.elimination.solve(&self.equations) {
                    return None;
                }
                if !contacts.choose(&self.elimination) {
                    break;
                }
            }
            let is_right = self.elimination.mended == 0.0;
            is_saddle |= !is_right && shift.is_least();
            let size = self.size(&component.system.topology);
            if (is_right && (size <= FAR || is_first)) || self.report.steps >= self.limit {
                shift.taken(size > FAR);
                return Some(Tried { size, is_saddle });
            }
            shift.grow();
        }
    }

    /// The largest turn of the last solve, over what is allowed.
    fn size(&self, topology: &Topology) -> f64 {
        let turn = |body: usize| self.elimination.corrections[body].angular;
        let own = (0..self.lengths.len()).map(|body| turn(body).norm_squared()).fold(0.0, f64::max).sqrt();
        let ends = topology.joints.iter().map(|ends| ends.map(|body| body as usize));
        let bend = ends.map(|[a, b]| (turn(a) - turn(b)).norm_squared()).fold(0.0, f64::max).sqrt();
        (own / LARGEST_TURN).max(bend / LARGEST_BEND)
    }

    /// Goes as far as the turns allow, and beyond the step where the energy curves down, but at most `longest` times as far.
    fn step(&mut self, component: &mut Component<f64>, topology: &Topology, size: f64, longest: f64) {
        let mut share = size.recip().min(1.0);
        if longest > 1.0 && (ROUNDING..1.0).contains(&size) && self.curvature(component, topology) < 0.0 {
            share = size.recip().min(longest);
        }
        component.take_solution(&self.elimination, &mut self.dp, 0.0);
        // Forces follow from the balance whatever the share of the step; moments are those of the bending.
        component.dlambda.iter_mut().for_each(|change| change.angular = change.angular * share.min(1.0));
        self.go_on(component, share);
        self.report.movement = movement(component);
    }

    fn go_on(&mut self, component: &mut Component<f64>, share: f64) {
        self.dp.iter_mut().for_each(|dp| *dp = Spatial::zero().plus(*dp, share));
        self.poses.clone_from(&component.poses);
        self.lambda.clone_from(&component.lambda);
        component.go_on_from((&self.poses, &self.lambda), &self.dp, 1.0, 0.0);
    }

    /// Second derivative of the energy along the step, without shift and inertia.
    fn curvature(&mut self, component: &Component<f64>, topology: &Topology) -> f64 {
        let Self { elimination, equations, .. } = self;
        component.gather(equations, 0.0);
        let turn = |body: usize| elimination.corrections[body].angular;
        let bodies = equations.bodies.iter().enumerate().filter(|(_, body)| !body.is_held());
        let own: f64 = bodies.map(|(i, body)| turn(i).dot(body.turning.apply(turn(i)))).sum();
        let joint = |(joint, &[a, b]): (&jointed::tangent::JointEquation, &[u32; 2])| {
            2.0 * turn(a as usize).dot(joint.coupling.apply(turn(b as usize)))
        };
        let coupled: f64 = equations.joints.iter().zip(&topology.joints).map(joint).sum();
        let strain: f64 = equations
            .joints
            .iter()
            .zip(&elimination.multipliers)
            .map(|(joint, change)| {
                let [stretch, bend] = joint.compliance;
                change.linear.dot(stretch.apply(change.linear)) + change.angular.dot(bend.apply(change.angular))
            })
            .sum();
        own + coupled + strain
    }

    /// Turns the segments a little, in long waves.
    fn push(&mut self, component: &mut Component<f64>) {
        let count = self.dp.len() as f64;
        for (k, dp) in self.dp.iter_mut().enumerate() {
            let place = (k as f64 + 1.0) / count;
            let axis = Vec3([(1.3 * place).sin(), (2.3 * place).sin(), (4.1 * place).sin()]);
            *dp = Spatial { linear: Vec3::zero(), angular: axis * PUSH };
        }
        component.dlambda.fill(Spatial::zero());
        self.go_on(component, 1.0);
    }
}

/// Largest movement since the step began: shifts in segment lengths, turns in rad. What is not a number stays.
fn movement(component: &Component<f64>) -> f64 {
    let larger = |x: f64, y: f64| if x.is_nan() || x >= y { x } else { y };
    let sizes = (0..component.segments()).map(|body| component.movement(body));
    sizes.fold(0.0, |most, size| larger(larger(size.linear.norm_squared(), size.angular.norm_squared()), most)).sqrt()
}
