//! One step along a path of equilibria: prediction along the path, and Newton's method back to it.

use nalgebra::{Matrix3, Vector3};

use super::PathParams;
use crate::component::{BodyPose, Component};
use crate::kernel::Spatial;
use crate::statics::newton::{INERTIA, shift};
use crate::tangent::Equations;
use crate::tangent::elimination::Elimination;

/// Most iterations of a step.
const ITERATIONS: usize = 12;
/// Largest shift [lengths of the rods] and turn [rad] of an iteration.
const LARGEST: f64 = 0.5;
/// Where corrections this small do not shrink, they are rounding errors.
const ROUNDING: f64 = 1e-6;
/// Half the time over which rates are taken, as a share of the path's.
const RATE: f64 = 1e-5;

/// Poses, forces and a time [s].
#[derive(Clone, Debug)]
pub(super) struct Place {
    poses: Vec<BodyPose<f64>>,
    lambda: Vec<Spatial<f64>>,
    pub(super) time: f64,
}

/// How the bodies, forces and the time change along a path.
#[derive(Clone, Debug)]
pub(super) struct Direction {
    dp: Vec<Spatial<f64>>,
    dlambda: Vec<Spatial<f64>>,
    pub(super) time: f64,
}

impl Direction {
    fn scaled(mut self, by: f64) -> Self {
        self.dp.iter_mut().chain(&mut self.dlambda).for_each(|x| *x = Spatial::zero().plus(*x, by));
        self.time *= by;
        self
    }

    fn plus(mut self, other: &Self, share: f64) -> Self {
        for (own, &x) in self.dp.iter_mut().zip(&other.dp).chain(self.dlambda.iter_mut().zip(&other.dlambda)) {
            *own = own.plus(x, share);
        }
        self.time += other.time * share;
        self
    }
}

impl Place {
    /// The place so far along a direction.
    pub(super) fn moved(&self, along: &Direction, share: f64) -> Self {
        let pose = |(from, dp): (&BodyPose<f64>, &Spatial<f64>)| BodyPose {
            x: from.x + dp.linear * share,
            q: from.q.turned(dp.angular * share),
        };
        Self {
            poses: self.poses.iter().zip(&along.dp).map(pose).collect(),
            lambda: self.lambda.iter().zip(&along.dlambda).map(|(own, &x)| own.plus(x, share)).collect(),
            time: self.time + along.time * share,
        }
    }
}

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
    pub(super) component: Component<f64>,
    elimination: Elimination,
    equations: Equations,
    lengths: Vec<f64>,
    total: f64,
    inertia: f64,
    weights: Vec<Spatial<f64>>,
    /// Time of the whole path [s].
    span: f64,
    tolerance: f64,
    /// Linear solves so far.
    pub(super) solves: usize,
}

impl Tracer {
    pub(super) fn new(mut component: Component<f64>, elimination: Elimination, params: &PathParams) -> Self {
        let lengths: Vec<f64> = (0..component.segments()).map(|i| component.length(i)).collect();
        let is_held = component.system.topology.fixed.contains(&true);
        component.begin_equilibrium();
        Self {
            component,
            elimination,
            equations: Equations::default(),
            total: lengths.iter().sum(),
            lengths,
            inertia: INERTIA[usize::from(!is_held)],
            weights: Vec::new(),
            span: params.until,
            tolerance: params.rest.tolerance,
            solves: 0,
        }
    }

    /// Where the component stands.
    pub(super) fn place(&self, time: f64) -> Place {
        Place { poses: self.component.poses.clone(), lambda: self.component.lambda.clone(), time }
    }

    /// Puts the component to where an equilibrium is.
    pub(super) fn show(&mut self, found: &Found) {
        self.stand(&found.place, found.place.time);
    }

    fn stand(&mut self, place: &Place, time: f64) {
        self.component.go_back_to(&place.poses, &place.lambda);
        self.component.go_to(time);
    }

    /// Product of two directions.
    fn dot(&self, a: &Direction, b: &Direction) -> f64 {
        let squared = self.total * self.total;
        let of = |(a, b): (&Spatial<f64>, &Spatial<f64>)| a.linear.dot(b.linear) / squared + a.angular.dot(b.angular);
        let count = self.lengths.len();
        let bodies: f64 = a.dp[..count].iter().zip(&b.dp).map(of).sum();
        bodies / count as f64 + a.time * b.time / (self.span * self.span)
    }

    /// Cosine of the angle between two directions.
    pub(super) fn cosine(&self, a: &Direction, b: &Direction) -> f64 {
        self.dot(a, b)
    }

    /// Distance of two places.
    pub(super) fn distance(&self, a: &Place, b: &Place) -> f64 {
        let between = |(a, b): (&BodyPose<f64>, &BodyPose<f64>)| Spatial {
            linear: b.x - a.x,
            angular: (b.q * a.q.conj()).upper().v * 2.0,
        };
        let way = Direction {
            dp: a.poses.iter().zip(&b.poses).map(between).collect(),
            dlambda: Vec::new(),
            time: b.time - a.time,
        };
        self.dot(&way, &way).sqrt()
    }

    /// The equilibrium a `step` along the path from another one.
    pub(super) fn go(&mut self, from: &Found, step: f64, stretch: [f64; 2]) -> Option<Found> {
        self.correct(from.place.moved(&from.direction, step), stretch, Some(&from.direction), 1.0)
    }

    /// The equilibrium near a place, at its time; the path goes on from there in this direction of time.
    pub(super) fn hold(&mut self, place: Place, stretch: [f64; 2], sign: f64) -> Option<Found> {
        self.correct(place, stretch, None, sign)
    }

    /// Newton's method, across a direction or at a time. `None` where it does not come to rest close by.
    fn correct(
        &mut self,
        mut place: Place,
        stretch: [f64; 2],
        across: Option<&Direction>,
        sign: f64,
    ) -> Option<Found> {
        let mut before = f64::INFINITY;
        for iterations in 1..=ITERATIONS {
            let (own, rate, unstable) = self.solve(&place, stretch)?;
            let time = across.map_or(0.0, |along| -self.dot(along, &own) / self.dot(along, &rate));
            let change = own.plus(&rate, time);
            let size = self.size(&change);
            if !(size <= LARGEST) {
                return None;
            }
            place = place.moved(&change, 1.0);
            let is_rounding = iterations > 2 && size < ROUNDING && size > 0.5 * before;
            if size <= self.tolerance || is_rounding {
                let length = self.dot(&rate, &rate).sqrt();
                let towards = across.map_or(sign, |along| self.dot(along, &rate));
                let direction = rate.scaled(towards.signum() / length);
                return Some(Found { place, direction, unstable, iterations });
            }
            before = size;
        }
        None
    }

    /// The largest shift over the whole length, turn [rad] and time over the path's.
    fn size(&self, change: &Direction) -> f64 {
        let larger = |x: f64, y: f64| if x.is_nan() || x >= y { x } else { y };
        let of = |x: &Spatial<f64>| {
            larger(x.linear.norm_squared().sqrt() / self.total, x.angular.norm_squared().sqrt())
        };
        change.dp.iter().map(of).fold((change.time / self.span).abs(), larger)
    }

    /// Newton's step at a place and its time, by how much the equilibrium changes in a second, and the directions in which
    /// the energy curves down.
    fn solve(&mut self, place: &Place, [begin, end]: [f64; 2]) -> Option<(Direction, Direction, usize)> {
        let half = RATE * self.span;
        let mut ends = [place.time - half, place.time + half];
        if (begin..=end).contains(&place.time) {
            ends = [ends[0].max(begin), ends[1].min(end)];
        }
        let [behind, ahead] = ends.map(|time| {
            self.evaluate(place, time);
            let bodies: Vec<[Vector3<f64>; 2]> = self.equations.bodies.iter().map(|body| body.defect).collect();
            let joints: Vec<[Vector3<f64>; 2]> = self.equations.joints.iter().map(|joint| joint.rhs).collect();
            (bodies, joints)
        });
        self.evaluate(place, place.time);
        let nudge = shift::LEAST * shift::scale(&self.equations, self.total, &self.weights);
        for (body, length) in self.equations.bodies.iter_mut().zip(&self.lengths) {
            body.turning += Matrix3::identity() * (nudge * length);
        }
        let unstable = self.elimination.solve_as_it_is(&self.equations)?;
        let own = self.solution(0.0);
        let per_second = 1.0 / (ends[1] - ends[0]);
        let rate = |[a, b]: [&[Vector3<f64>; 2]; 2]| [0, 1].map(|part| (b[part] - a[part]) * per_second);
        for (body, ends) in self.equations.bodies.iter_mut().zip(behind.0.iter().zip(&ahead.0)) {
            body.defect = rate(ends.into());
        }
        for (joint, ends) in self.equations.joints.iter_mut().zip(behind.1.iter().zip(&ahead.1)) {
            joint.rhs = rate(ends.into());
        }
        self.elimination.solve_as_it_is(&self.equations)?;
        let rate = self.solution(1.0);
        self.solves += 2;
        Some((own, rate, unstable))
    }

    /// Gathers the equations of a place at a time.
    fn evaluate(&mut self, place: &Place, time: f64) {
        self.stand(place, time);
        self.component.weigh(&mut self.weights, false);
        self.component.evaluate_equilibrium(&self.weights);
        self.component.gather(&mut self.equations, self.inertia);
    }

    fn solution(&mut self, time: f64) -> Direction {
        let mut dp = Vec::new();
        self.component.take_solution(&self.elimination, &mut dp);
        Direction { dp, dlambda: self.component.dlambda.clone(), time }
    }
}
