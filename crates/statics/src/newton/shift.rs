//! By how much turns are made stiffer than they are, as by a tension.

use component::Component;
use jointed::tangent::Equations;
use kernels::Spatial;

/// Less than this, over the scale of forces, is none.
const LEAST: f64 = 1e-7;
/// The largest that the least becomes.
const MOST_LEAST: f64 = 1e-6;
/// The first that is tried where it does not go without. A tension as large as the largest force would outdo any push.
const FIRST: f64 = 0.25;
/// The share of bending in the scale.
const BENDING: f64 = 10.0;
/// Growth from one trial to the next.
const GROWTH: f64 = 8.0;
/// By what the next step begins with less: at first, and at least after one that had to be made stiffer.
const DOWN: f64 = 4.0;
const SLOWEST: f64 = 2.0;
/// By how much faster that goes after each step that went well at once.
const FASTER: f64 = 2.0;

/// A force [N]: times its length it is added to the turning stiffness of a segment.
///
/// A step tries a smaller one than the last took, the smaller the more often that went well.
pub(super) struct Shift {
    /// The scale: the weights' sum and ten times the force of bending, B / L^2 of the softest joint; later the largest force
    /// in the joints so far, moments over the total length included, where that is more.
    scale: f64,
    total: f64,
    /// The least, over the scale: none, or more than rounding errors where there is motion that nothing resists.
    least: f64,
    /// Over the scale, the one that the last step took and the one that is tried now.
    last: f64,
    tried: f64,
    /// By what the next is smaller.
    down: f64,
    rejected: usize,
}

impl Shift {
    /// Where the search begins, in these forces of air and weight, one entry a body; the equations are filled.
    pub(super) fn new(
        component: &mut Component<f64>,
        equations: &mut Equations,
        forces: &[Spatial<f64>],
        is_held: bool,
    ) -> Self {
        let total: f64 = (0..component.segments()).map(|i| component.length(i)).sum();
        component.evaluate_equilibrium(forces);
        component.gather(equations, 1.0);
        let bending = equations.joints.iter().map(|joint| {
            let compliance = joint.compliance[1].trace() / 3.0;
            joint.length / (compliance * total * total)
        });
        let least = if is_held { 0.0 } else { LEAST };
        let softest = bending.fold(f64::INFINITY, f64::min);
        let bending = if softest.is_finite() { BENDING * softest } else { 0.0 };
        let weight: f64 = forces.iter().map(|force| force.linear.norm_squared().sqrt()).sum();
        let scale = bending + weight;
        Self { scale: scale.max(f64::MIN_POSITIVE), total, least, last: least, tried: least, down: DOWN, rejected: 0 }
    }

    /// The one to try first.
    pub(super) fn begin(&mut self, component: &Component<f64>) {
        for lambda in &component.lambda {
            let moment = lambda.angular.norm_squared().sqrt() / self.total;
            self.scale = self.scale.max(lambda.linear.norm_squared().sqrt()).max(moment);
        }
        let next = self.last / self.down;
        self.tried = if next > LEAST { next } else { self.least };
        self.rejected = 0;
    }

    /// The next to try.
    pub(super) fn grow(&mut self) {
        self.rejected += 1;
        self.tried = if self.tried < self.last { self.last } else { (GROWTH * self.tried).max(FIRST) };
    }

    /// The one that is tried is taken; the next begins with more where the step was far too large.
    pub(super) fn taken(&mut self, is_far: bool) {
        if !is_far {
            self.down = if self.rejected == 0 { self.down * FASTER } else { self.down.sqrt().max(SLOWEST) };
        }
        self.last = if is_far { FIRST.max(self.tried) * self.down } else { self.tried };
    }

    /// Makes the least larger.
    pub(super) fn steady(&mut self) {
        self.least = (10.0 * self.least).clamp(LEAST, MOST_LEAST);
    }

    /// Begins with the least again.
    pub(super) fn forget(&mut self) {
        self.last = self.least;
    }

    pub(super) fn is_least(&self) -> bool {
        self.tried <= self.least
    }

    /// [N]
    pub(super) fn force(&self) -> f64 {
        self.tried * self.scale
    }
}
