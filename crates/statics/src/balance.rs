//! The balance of forces of a connected set, and Newton's step on it with the tangent as it is.

use component::{BodyPose, Component};
use jointed::tangent::Equations;
use jointed::tangent::elimination::Elimination;
use kernels::Spatial;
use kernels::math::{Sym3, Vec3};

use super::newton::INERTIA;

/// What is more than rounding errors, as a share of the scale of forces.
const NUDGE: f64 = 1e-7;

/// What forces may lack of balance, as a share of them, and gaps of the whole length, and still be rounding errors.
const ROUNDING: f64 = 1e-10;

/// Poses, forces and a time [s].
#[derive(Clone, Debug)]
pub(super) struct Place {
    pub(super) poses: Vec<BodyPose<f64>>,
    pub(super) lambda: Vec<Spatial<f64>>,
    pub(super) time: f64,
}

/// How the bodies, forces and the time change.
#[derive(Clone, Debug)]
pub(super) struct Direction {
    pub(super) dp: Vec<Spatial<f64>>,
    pub(super) dlambda: Vec<Spatial<f64>>,
    pub(super) time: f64,
}

impl Direction {
    pub(super) fn scaled(mut self, by: f64) -> Self {
        self.dp.iter_mut().chain(&mut self.dlambda).for_each(|x| *x = Spatial::zero().plus(*x, by));
        self.time *= by;
        self
    }

    pub(super) fn plus(mut self, other: &Self, share: f64) -> Self {
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

    /// The place a share of the way to another one, and that way.
    pub(super) fn towards(&self, other: &Place, share: f64) -> (Self, Direction) {
        let mut way = self.to(other);
        way.dlambda = self.lambda.iter().zip(&other.lambda).map(|(&own, &other)| other.plus(own, -1.0)).collect();
        (self.moved(&way, share), way)
    }

    /// The way to another place, as far as poses and time go.
    pub(super) fn to(&self, other: &Place) -> Direction {
        let between = |(a, b): (&BodyPose<f64>, &BodyPose<f64>)| Spatial {
            linear: b.x - a.x,
            angular: (b.q * a.q.conj()).upper().v * 2.0,
        };
        let dp = self.poses.iter().zip(&other.poses).map(between).collect();
        Direction { dp, dlambda: Vec::new(), time: other.time - self.time }
    }
}

/// A connected set, and memory for its equations.
pub(super) struct Balance {
    pub(super) component: Component<f64>,
    pub(super) elimination: Elimination,
    pub(super) equations: Equations,
    lengths: Vec<f64>,
    pub(super) total: f64,
    inertia: f64,
    weights: Vec<Spatial<f64>>,
    /// The time that counts as much as a turn by 1 rad [s].
    pub(super) span: f64,
}

impl Balance {
    pub(super) fn new(mut component: Component<f64>, elimination: Elimination, span: f64) -> Self {
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
            span,
        }
    }

    /// Where the component stands.
    pub(super) fn place(&self, time: f64) -> Place {
        Place { poses: self.component.poses.clone(), lambda: self.component.lambda.clone(), time }
    }

    /// Puts the component to a place at a time [s].
    pub(super) fn stand(&mut self, place: &Place, time: f64) {
        self.component.go_back_to(&place.poses, &place.lambda, 0.0);
        self.component.go_to(time);
    }

    /// Product of two directions: shifts over the whole length and turns, as the mean over the segments, and times.
    pub(super) fn dot(&self, a: &Direction, b: &Direction) -> f64 {
        let squared = self.total * self.total;
        let of = |(a, b): (&Spatial<f64>, &Spatial<f64>)| a.linear.dot(b.linear) / squared + a.angular.dot(b.angular);
        let count = self.lengths.len();
        let bodies: f64 = a.dp[..count].iter().zip(&b.dp).map(of).sum();
        bodies / count as f64 + a.time * b.time / (self.span * self.span)
    }

    /// Distance of two places.
    pub(super) fn distance(&self, a: &Place, b: &Place) -> f64 {
        let way = a.to(b);
        self.dot(&way, &way).sqrt()
    }

    /// The largest shift over the whole length, turn [rad] and time over its unit.
    pub(super) fn size(&self, change: &Direction) -> f64 {
        let larger = |x: f64, y: f64| if x.is_nan() || x >= y { x } else { y };
        let of =
            |x: &Spatial<f64>| larger(x.linear.norm_squared().sqrt() / self.total, x.angular.norm_squared().sqrt());
        change.dp.iter().map(of).fold((change.time / self.span).abs(), larger)
    }

    /// Gathers the equations of a place at a time [s].
    pub(super) fn evaluate(&mut self, place: &Place, time: f64) {
        self.stand(place, time);
        self.component.weigh(&mut self.weights, false);
        self.component.evaluate_equilibrium(&self.weights);
        self.component.gather(&mut self.equations, self.inertia);
    }

    /// Newton's step from a place, and the directions in which the energy curves down there. Turns are a little stiffer than they are,
    /// by `nudge` times what is more than rounding errors, so that motion which nothing resists is no matter of chance.
    pub(super) fn step(&mut self, place: &Place, nudge: f64) -> Option<(Direction, usize)> {
        self.evaluate(place, place.time);
        let nudge = nudge * NUDGE * self.scale();
        for (body, length) in self.equations.bodies.iter_mut().zip(&self.lengths) {
            body.turning += Sym3::identity(nudge * length);
        }
        let unstable = self.elimination.solve_as_it_is(&self.equations)?;
        Some((self.solution(0.0), unstable))
    }

    /// Whether all forces are in balance and all joints closed at the place evaluated last, but for rounding errors.
    pub(super) fn is_at_rest(&self) -> bool {
        let Self { equations, component, lengths, total, .. } = self;
        let sizes = component.lambda.iter().map(|lambda| lambda.linear.norm_squared().sqrt());
        let force = sizes.fold(self.scale(), f64::max);
        let bodies = equations.bodies.iter().zip(lengths).filter(|(body, _)| !body.is_held());
        let norm = |x: Vec3<f64>| x.norm_squared().sqrt();
        let balanced = bodies.map(|(body, length)| norm(body.defect.linear) + norm(body.defect.angular) / length);
        let closed = equations.joints.iter().map(|joint| norm(joint.rhs.linear) / total + norm(joint.rhs.angular));
        let larger = |x: f64, y: f64| if x.is_nan() || x >= y { x } else { y };
        balanced.fold(0.0, larger) <= ROUNDING * force && closed.fold(0.0, larger) <= ROUNDING
    }

    /// The scale of forces [N]: that of bending, B / L^2 of the softest joint, and the sum of the weights.
    fn scale(&self) -> f64 {
        let bending = self.equations.joints.iter().map(|joint| {
            let compliance = joint.compliance[1].trace() / 3.0;
            joint.length / (compliance * self.total * self.total)
        });
        let softest = bending.filter(|bending| bending.is_finite()).fold(f64::INFINITY, f64::min);
        let weight: f64 = self.weights.iter().map(|force| force.linear.norm_squared().sqrt()).sum();
        weight + if softest.is_finite() { softest } else { 0.0 }
    }

    /// What the elimination has found last.
    pub(super) fn solution(&mut self, time: f64) -> Direction {
        let mut dp = vec![Spatial::zero(); self.component.poses.len()];
        self.component.take_solution(&self.elimination, &mut dp, 0.0);
        Direction { dp, dlambda: self.component.dlambda.clone(), time }
    }
}
