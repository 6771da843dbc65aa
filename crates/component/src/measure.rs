//! How far corrections move the surfaces of bodies: the measure of error of formulation `newton`.
//!
//! A correction (dx, dphi) moves the ends of a segment of length l, radius r and axis d by dx and `dphi x d l / 2`, and its
//! surface about the axis by `r (dphi . d)`: the root of the sum of their squares is the way of its surface. Its unit is the body's radius
//! where bodies can touch, its length elsewhere. A step's tolerance is a share of it, or g dt^2, by which gravity moves a body in a step,
//! where that is less: contacts are measured so, too (`contact/island_contacts/observe.rs`).

use kernels::Spatial;
use kernels::lane::Real;

use super::Component;

/// What may be missing in the balance of forces on a segment, of the largest force that its set transmits. Without a bound a rod that is pressed along its
/// axis ends its step far from equilibrium: the stiffness of that force makes corrections small. It costs no iterations in 21 builtin scenes
/// (docs/decisions/stopping.md).
pub const OF_TRANSMITTED: f64 = 1e-4;
/// And what moves the segment, if it were free, by so many times the way that its surface may be off.
const FREE_MOTION: f64 = 100.0;

impl<T: Real> Component<T> {
    /// Begins to measure a step that is predicted, for this tolerance.
    pub fn begin_measure(&mut self, tolerance: f64) {
        let fall = self.gravity.norm_squared().sqrt() * T::splat(self.dt * self.dt);
        let infinite = T::splat(f64::INFINITY);
        self.longest_unit = (-fall).select(infinite, fall) * T::splat(1.0 / tolerance);
        self.correction = infinite;
    }

    /// Whether the first lane's guess leads a surface further than its length from the prediction, so that another solution may be next to it.
    pub fn leads_away(&self) -> bool {
        let of = |i: usize| {
            let (pose, predicted) = (&self.poses[i], &self.predicted[i]);
            let (shift, turn) = (pose.x - predicted.x, (pose.q * predicted.q.conj()).upper().v);
            let square = self.bodies[i].length.lane(0).powi(2);
            shift.norm_squared().lane(0) + turn.norm_squared().lane(0) * square <= square
        };
        !(0..self.segments).all(of)
    }

    /// Square of the way by which a correction moves a body's surface \[units^2\].
    #[inline(always)]
    pub(super) fn motion(&self, i: usize, dp: Spatial<T>) -> T {
        let (body, unit) = (&self.bodies[i], self.unit(i));
        let spin = self.system.bodies[i].axis.dot(dp.angular);
        let spin = spin * spin;
        let tilt = (dp.angular.norm_squared() - spin) * T::splat(0.25);
        let way = dp.linear.norm_squared() + tilt * body.length * body.length + spin * body.radius * body.radius;
        way / (unit * unit)
    }

    /// The largest force that is missing in the balance of a segment at the last evaluation, with momentum, in units of what may be missing where surfaces may
    /// be off by `target` units: `OF_TRANSMITTED` of the largest force that the set transmits, and what moves the segment, if it were free, by
    /// `FREE_MOTION` times that way.
    pub fn missing_balance(&self, target: T) -> T {
        T::dispatch(
            #[inline(always)]
            || {
                let forces = self.lambda.iter().map(|lambda| lambda.linear.norm_squared());
                let of_eyelets = T::splat(self.eyelets.largest_force());
                let largest = forces.fold(T::zero(), T::max).sqrt().max(of_eyelets) * T::splat(OF_TRANSMITTED);
                let of = |i: usize| {
                    let motion = target * self.unit(i) * T::splat(FREE_MOTION);
                    let allowed = motion + largest * self.bodies[i].inverse_mass;
                    self.momentum[i].linear.norm_squared() / (allowed * allowed)
                };
                (0..self.segments).map(of).fold(T::zero(), T::max).sqrt()
            },
        )
    }

    /// A body's unit [m].
    #[inline(always)]
    fn unit(&self, i: usize) -> T {
        let body = &self.bodies[i];
        let own = if self.pushed.is_empty() { body.length } else { body.radius };
        (self.longest_unit - own).select(own, self.longest_unit)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use kernels::math::Vec3;
    use nalgebra::Vector3;
    use rod::{Assembly, Material, RodSpec, shape};

    use super::*;
    use crate::formulation::Formulation;
    use crate::split;

    #[test]
    fn what_counts_is_the_way_of_the_surface() {
        let (length, radius, gravity, dt) = (0.1, 1e-3, 10.0, 0.01);
        let mut assembly = Assembly::new(Vector3::z() * -gravity);
        let material = Material { youngs_modulus: 2e11, torsion_modulus: 8e10, density: 8000.0 };
        assembly.rod(&RodSpec::new(shape::straight(Vector3::zeros(), Vector3::x(), length, 1), radius, material));
        let (model, state) = assembly.finish();
        let (members, topology) = split(&model).remove(0);
        let mut component = Component::new(&model, &state, Arc::new(topology), &[&members]);
        component.predict(0.0, dt, Formulation::Newton);
        component.evaluate(Formulation::Newton);
        let (none, small) = (Vec3::zero(), 1e-4);
        let along = |x: f64, y: f64| Vec3([x, y, 0.0]);
        let shift = Spatial { linear: along(0.0, small), angular: none };
        // A spin moves the surface by the radius times the angle, a tilt the ends by half the length times it.
        let turn = |x: f64, y: f64| Spatial { linear: none, angular: along(x, y) };
        let ways = [(shift, small), (turn(small, 0.0), small * radius), (turn(0.0, small), 0.5 * small * length)];
        // Gravity moves a body by 1 mm in the step: of a tolerance of 1e-3 that is ten lengths, of 0.1 a tenth of one.
        for (tolerance, touches, unit) in [(1e-3, false, length), (1e-3, true, radius), (0.1, false, 0.1 * length)] {
            component.pushed = vec![shift; usize::from(touches)];
            component.begin_measure(tolerance);
            for (dp, way) in ways {
                let found = component.motion(0, dp).sqrt() * unit;
                assert!((found - way).abs() < 1e-9 * way, "{found} {way}, tolerance {tolerance}, touches {touches}");
            }
        }
    }
}
