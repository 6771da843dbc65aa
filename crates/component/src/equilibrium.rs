//! Equilibrium: the equations of a step of one second without velocities and without inertia, so that multipliers are forces.

use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::Vec3;

use super::Component;
use crate::Residuals;
use crate::formulation::Formulation;

impl Component<f64> {
    /// Whether a torque of a load turns a segment, or a load turns with its segment: neither is the gradient of an energy.
    pub fn has_torques(&self) -> bool {
        self.loads.iter().any(|load| load.torque != Vec3::zero() || load.own.is_some())
    }

    /// The size of the sum of weights and loads, and the sum of their sizes [N].
    pub fn resultant(&self) -> [f64; 2] {
        let weights = self.bodies[..self.segments].iter().filter(|body| body.free != 0.0);
        let weights = weights.map(|body| self.gravity * (1.0 / body.inverse_mass));
        let (mut sum, mut size) = (Vec3::zero(), 0.0);
        let loads = self.loads.iter().map(|load| load.in_world(&self.poses[load.body].q)[0]);
        for force in weights.chain(loads) {
            sum += force;
            size += force.norm_squared().sqrt();
        }
        [sum.norm_squared().sqrt(), size]
    }

    /// Length of a segment [m].
    pub fn length(&self, segment: usize) -> f64 {
        self.bodies[segment].length
    }

    /// Whether what is held, a load or gravity changes over time.
    pub fn changes(&self) -> bool {
        self.has_motions() || !self.changing.is_empty()
    }

    /// Makes what is held, loads and gravity those of `time` [s].
    pub fn go_to(&mut self, time: f64) {
        self.place_moved(time);
        self.set_forces(time);
    }

    /// Prepares for [`Component::evaluate_equilibrium`]; multipliers begin with zero, poses stay.
    pub fn begin_equilibrium(&mut self) {
        let poses = self.poses.clone();
        self.predict(0.0, 1.0, Formulation::Xpbd);
        self.poses.copy_from_slice(&poses);
        self.last_effective = self.effective;
        self.pushed = vec![Spatial::zero(); poses.len()];
    }

    /// Makes what joints transmit these multipliers, those of a step of one second.
    pub fn transmit(&mut self, forces: &[Spatial<f64>]) {
        self.lambda.copy_from_slice(forces);
        self.last_effective = 1.0;
    }

    /// Evaluates constraints and the balance of all forces and torques, of which `forces` are weight and drag. A step begins
    /// here: [`Component::movement`] is counted from the current poses.
    pub fn evaluate_equilibrium(&mut self, forces: &[Spatial<f64>]) -> Residuals<f64> {
        self.pushed.copy_from_slice(forces);
        // Their torques are gathered with the axes of the evaluation.
        for load in &mut self.loads {
            load.begin(&self.poses[load.body].q);
            self.pushed[load.body].linear += load.force;
        }
        self.predicted.copy_from_slice(&self.poses);
        self.start.copy_from_slice(&self.poses);
        self.pulls_hold = false;
        self.evaluate(Formulation::Newton)
    }
}

impl<T: Real> Component<T> {
    /// Gathers weight [N], one entry a body, and with `drag` also that at the current poses [N, N m].
    pub fn weigh(&mut self, forces: &mut Vec<Spatial<T>>, drag: bool) {
        if drag {
            self.evaluate_drag(0.0, 1.0);
        }
        forces.clear();
        forces.resize(self.poses.len(), Spatial::zero());
        for (i, force) in forces[..self.segments].iter_mut().enumerate() {
            let constants = &self.bodies[i];
            if constants.free == T::zero() {
                continue;
            }
            let mut change = Spatial { linear: self.gravity, angular: Vec3::zero() };
            if let Some(drag) = self.drag.as_ref().filter(|_| drag) {
                // The mass is that with what drag adds to it, which the impulse makes up for.
                change.linear += drag.impulses[i].linear;
                change.angular = self.poses[i].q.rotate(drag.impulses[i].angular);
            }
            *force =
                Spatial { linear: change.linear * (T::splat(1.0) / constants.inverse_mass), angular: change.angular };
        }
    }
}
