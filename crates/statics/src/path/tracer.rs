//! One step along a path of equilibria: prediction along the path, and Newton's method back to it.

use component::Component;
use jointed::tangent::elimination::Elimination;
use kernels::Spatial;

use super::params::PathParams;
use crate::balance::{Balance, Direction, Place};

/// Most iterations of a step.
const ITERATIONS: usize = 12;
/// Largest shift [lengths of the rods] and turn [rad] of an iteration.
const LARGEST: f64 = 0.5;
/// Corrections this small that do not shrink where forces are in balance are a drift that next to nothing resists.
const DRIFT: f64 = 1e-3;
/// Half the time over which rates are taken, as a share of the path's.
const RATE: f64 = 1e-5;

/// An equilibrium of the path.
#[derive(Clone, Debug)]
pub(super) struct Found {
    pub(super) place: Place,
    /// Of length 1, on along the path.
    pub(super) direction: Direction,
    pub(super) unstable: usize,
    pub(super) iterations: usize,
}

/// Memory to follow a path with.
pub(super) struct Tracer {
    pub(super) balance: Balance,
    tolerance: f64,
    /// Linear solves so far.
    pub(super) solves: usize,
}

impl Tracer {
    pub(super) fn new(component: Component<f64>, elimination: Elimination, params: &PathParams) -> Self {
        let balance = Balance::new(component, elimination, params.until);
        Self { balance, tolerance: params.rest.tolerance, solves: 0 }
    }

    /// The equilibrium a `step` along the path from another one.
    pub(super) fn go(&mut self, from: &Found, step: f64, stretch: [f64; 2]) -> Option<Found> {
        self.correct(from.place.moved(&from.direction, step), stretch, Some(&from.direction), 1.0)
    }

    /// The equilibrium half-way between two others of the path.
    pub(super) fn between(&mut self, a: &Found, b: &Found, stretch: [f64; 2]) -> Option<Found> {
        let (place, way) = a.place.towards(&b.place, 0.5);
        let length = self.balance.dot(&way, &way).sqrt();
        self.correct(place, stretch, Some(&way.scaled(1.0 / length)), 1.0)
    }

    /// The equilibrium near a place, at its time; the path goes on from there in this direction of time.
    pub(super) fn hold(&mut self, place: Place, stretch: [f64; 2], sign: f64) -> Option<Found> {
        self.correct(place, stretch, None, sign)
    }

    /// Newton's method, across a direction or at a time. `None` where it does not come to rest close by.
    fn correct(&mut self, mut place: Place, stretch: [f64; 2], across: Option<&Direction>, sign: f64) -> Option<Found> {
        let mut before = f64::INFINITY;
        for iterations in 1..=ITERATIONS {
            let (own, rate, unstable, is_at_rest) = self.solve(&place, stretch)?;
            let Self { balance, .. } = self;
            let time = across.map_or(0.0, |along| -balance.dot(along, &own) / balance.dot(along, &rate));
            let change = own.plus(&rate, time);
            let size = balance.size(&change);
            if size.is_nan() || size > LARGEST {
                return None;
            }
            let drifts = is_at_rest && size < DRIFT && size > 0.5 * before;
            if !drifts {
                place = place.moved(&change, 1.0);
            }
            if size <= self.tolerance || drifts {
                let length = balance.dot(&rate, &rate).sqrt();
                let towards = across.map_or(sign, |along| balance.dot(along, &rate));
                let direction = rate.scaled(towards.signum() / length);
                return Some(Found { place, direction, unstable, iterations });
            }
            before = size;
        }
        None
    }

    /// Newton's step at a place and its time, by how much the equilibrium changes in a second, and the directions in which
    /// the energy curves down; and whether the place is at rest.
    fn solve(&mut self, place: &Place, [begin, end]: [f64; 2]) -> Option<(Direction, Direction, usize, bool)> {
        let Self { balance, .. } = self;
        let half = RATE * balance.span;
        let mut ends = [place.time - half, place.time + half];
        if (begin..=end).contains(&place.time) {
            ends = [ends[0].max(begin), ends[1].min(end)];
        }
        let [behind, ahead] = ends.map(|time| {
            balance.evaluate(place, time);
            let bodies: Vec<Spatial<f64>> = balance.equations.bodies.iter().map(|body| body.defect).collect();
            let joints: Vec<Spatial<f64>> = balance.equations.joints.iter().map(|joint| joint.rhs).collect();
            (bodies, joints)
        });
        let (own, unstable) = balance.step(place, 1.0)?;
        let is_at_rest = balance.is_at_rest();
        let per_second = 1.0 / (ends[1] - ends[0]);
        let rate = |[a, b]: [&Spatial<f64>; 2]| Spatial::zero().plus(b.plus(*a, -1.0), per_second);
        for (body, ends) in balance.equations.bodies.iter_mut().zip(behind.0.iter().zip(&ahead.0)) {
            body.defect = rate(ends.into());
        }
        for (joint, ends) in balance.equations.joints.iter_mut().zip(behind.1.iter().zip(&ahead.1)) {
            joint.rhs = rate(ends.into());
        }
        balance.elimination.solve_as_it_is(&balance.equations)?;
        let rate = balance.solution(1.0);
        self.solves += 2;
        Some((own, rate, unstable, is_at_rest))
    }
}
