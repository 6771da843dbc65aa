//! Damping ratios of modes, to first order in what damps.
//!
//! A mode of the modal mass 1 that swings with `omega` loses `phi . D phi` times its velocity, so that its damping ratio is
//! `phi . D phi / (2 omega)`. Of the surroundings D is the mass matrix times their rates. Inner damping resists the rate of a
//! strain C by `tau / alpha`; the strain of a shape is what the joints transmit times their compliance: taken as a difference
//! of shifts, the strain of stiff rows would be rounding.

use component::Members;
use kernels::Spatial;
use nalgebra::{Matrix3, Vector3, Vector6};
use rod::{InnerDamping, Model};

use super::Problem;
use super::krylov::{Masses, Pair, times};

/// `x . M x` of a body whose inertia is that of its shifts and turns.
fn moving((mass, inertia): &(f64, Matrix3<f64>), x: &Vector6<f64>, [linear, angular]: [f64; 2]) -> f64 {
    let turn: Vector3<f64> = x.fixed_rows::<3>(3).into();
    linear * mass * x.fixed_rows::<3>(0).norm_squared() + angular * turn.dot(&(inertia * turn))
}

impl Problem {
    /// Of a mode of bodies with these masses, with the angular frequency's square `squared` [rad^2/s^2].
    pub(super) fn damping_ratio(
        &mut self,
        model: &Model,
        members: &Members,
        masses: &Masses,
        squared: f64,
        pair: &Pair,
    ) -> f64 {
        if squared <= 0.0 {
            return 0.0;
        }
        let rates = [model.damping.linear, model.damping.angular];
        let bodies = masses.iter().zip(&pair.vector);
        let outer: f64 = bodies.filter_map(|(mass, x)| Some(moving(mass.as_ref()?, x, rates))).sum();
        let damped: Vec<InnerDamping> = members.joints.iter().map(|&j| model.joints[j].inner_damping).collect();
        let inner =
            if damped.iter().all(|own| *own == InnerDamping::NONE) { 0.0 } else { self.lost(&damped, masses, pair) };
        (outer + inner) / (2.0 * squared.sqrt())
    }

    /// `C . (tau / alpha) C` over all joints.
    fn lost(&mut self, damped: &[InnerDamping], masses: &Masses, pair: &Pair) -> f64 {
        let (_, multipliers) = self.solved(&times(masses, &pair.vector));
        let system = &self.component.system;
        let mut lost = 0.0;
        for (j, (InnerDamping { bending, twist, stretch }, x)) in damped.iter().zip(&multipliers).enumerate() {
            let world = Spatial::from_array((*x).into());
            let rows = system.joints[j].multipliers_from_world(world, system.frame(j));
            let strain = system.stretch_compliance(j).apply(world.linear);
            lost += stretch * strain.dot(world.linear);
            let of_rows = system.bend_twist_compliance(j).0.into_iter().zip(rows.angular.0);
            lost += of_rows.zip([bending, bending, twist]).map(|((alpha, x), time)| time * alpha * x * x).sum::<f64>();
        }
        // The multipliers are those of `theta phi`, times h^2, and so are the inverses of the compliances.
        lost / (self.component.dt() * pair.value).powi(2)
    }
}
