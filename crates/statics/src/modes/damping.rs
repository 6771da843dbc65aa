//! Damping ratios of modes, to first order in what damps.
//!
//! A mode of the modal mass 1 that swings with `omega` loses `phi . D phi` times its velocity, so that its damping ratio is
//! `phi . D phi / (2 omega)`. Of the surroundings D is the mass matrix times their rates. Inner damping resists the rate of a
//! strain C by `tau / alpha`; the strain of a shape is what the joints transmit times their compliance: taken as a difference
//! of shifts, the strain of stiff rows would be rounding. A viscoelastic joint takes what inner damping of its
//! [`rod::JointLaw::relaxing`] would.

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

/// What resists the rate of a joint's strains.
struct Damped {
    /// Relaxation times [s].
    times: InnerDamping,
    /// Of a joint with a law: the elastic compliances of bending and twist to which they belong.
    elastic: Option<Vector3<f64>>,
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
        let damped = |j: usize| {
            let law = model.laws.binary_search_by_key(&j, |own| own.joint).ok().map(|k| &model.laws[k].law);
            let InnerDamping { bending, twist, stretch } = model.joints[j].inner_damping;
            let more = law.map_or(0.0, |law| law.relaxing(squared.sqrt()));
            let times = InnerDamping { bending: bending + more, twist: twist + more, stretch };
            Damped { times, elastic: law.map(|_| model.joints[j].bend_twist_compliance()) }
        };
        let damped: Vec<Damped> = members.joints.iter().map(|&j| damped(j)).collect();
        let inner = match damped.iter().all(|own| own.times == InnerDamping::NONE) {
            true => 0.0,
            false => self.lost(&damped, masses, pair),
        };
        (outer + inner) / (2.0 * squared.sqrt())
    }

    /// `C . (tau / alpha) C` over all joints.
    fn lost(&mut self, damped: &[Damped], masses: &Masses, pair: &Pair) -> f64 {
        let (_, multipliers) = self.solved(&times(masses, &pair.vector));
        let system = &self.component.system;
        let per = self.component.dt().powi(-2);
        let mut lost = 0.0;
        for (j, (Damped { times, elastic }, x)) in damped.iter().zip(&multipliers).enumerate() {
            let InnerDamping { bending, twist, stretch } = times;
            let world = Spatial::from_array((*x).into());
            let rows = system.joints[j].multipliers_from_world(world, system.frame(j));
            let strain = system.stretch_compliance(j).apply(world.linear);
            lost += stretch * strain.dot(world.linear);
            let diagonal = system.bend_twist_compliance(j).0;
            let rows = rows.angular.0;
            let times = [bending, bending, twist];
            if let Some(elastic) = elastic {
                // The strain is the law's, what resists its rate has the elastic stiffness.
                let [xy, xz, yz] = system.bend_couplings.get(j).map_or([0.0; 3], |couplings| couplings.0);
                let [[x, y, z], [xx, yy, zz]] = [rows, diagonal];
                let strain = [xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z];
                let of_rows = strain.into_iter().zip(elastic).zip(times);
                lost += of_rows.map(|((strain, alpha), time)| time * strain * strain / (alpha * per)).sum::<f64>();
                continue;
            }
            let of_rows = diagonal.into_iter().zip(rows);
            lost += of_rows.zip(times).map(|((alpha, x), time)| time * alpha * x * x).sum::<f64>();
        }
        // The multipliers are those of `theta phi`, times h^2, and so are the inverses of the compliances.
        lost / (self.component.dt() * pair.value).powi(2)
    }
}
