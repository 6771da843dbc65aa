//! What is answered to a branched query.

use nalgebra::{UnitQuaternion, Vector3};

use super::query::{ARMS, BranchedQuery};
use super::star::{Junction, Star};
use super::start::Begin;
use crate::answer::{Answer, Equilibrium, Finish};
use crate::scaled::Scaled;

/// A stable equilibrium of a cable with three arms.
#[derive(Clone, Debug, PartialEq)]
pub struct BranchedEquilibrium {
    /// The junction's pose [m].
    pub junction: Junction,
    /// The arms, from their grips to the junction: shapes, what grip and junction give to each, and its energy.
    pub arms: [Equilibrium; ARMS],
    /// Energy of all arms [J], their weights from z = 0.
    pub energy: f64,
    /// The largest residual of an arm, or what is out of balance at the junction if that is larger: moments over B / L and
    /// forces over `N B / L^2`, both over one plus the largest force over `N B / L^2`.
    pub residual: f64,
}

/// The answer to a branched query.
pub type BranchedAnswer = Answer<BranchedEquilibrium>;

impl BranchedEquilibrium {
    /// That which a search has come to, with the turns of all arms' segments.
    pub(super) fn new(
        finish: &mut Finish,
        query: &BranchedQuery,
        star: &Star,
        begin: &Begin,
        turns: &[UnitQuaternion<f64>],
    ) -> Self {
        let junction = star.junction(query, &begin.junction);
        let [length, bending] = star.units;
        let segments = turns.len() / ARMS;
        let count = segments as f64;
        let arms = [0, 1, 2].map(|k| {
            let arm = query.arm(k, &junction);
            let own = arm.cable.bending[0].max(arm.cable.bending[1]) / arm.cable.length.powi(2);
            let force = begin.forces[k] * (bending / length.powi(2) / own);
            finish.equilibrium(&arm, &Scaled::new(&arm), &force, &turns[k * segments..(k + 1) * segments])
        });
        let sum = |of: fn(&Equilibrium) -> Vector3<f64>| arms.iter().map(of).sum::<Vector3<f64>>().norm();
        let force = sum(|arm| arm.grips[1].force) * length.powi(2) / bending / count;
        let moment = sum(|arm| arm.grips[1].moment) * length / bending;
        let largest = arms.iter().flat_map(|arm| &arm.grips).map(|grip| grip.force.norm()).fold(0.0, f64::max);
        let at_junction = force.max(moment) / (1.0 + largest * length.powi(2) / bending / count);
        let residual = arms.iter().map(|arm| arm.residual).fold(at_junction, f64::max);
        let energy = arms.iter().map(|arm| arm.energy).sum();
        Self { junction, arms, energy, residual }
    }
}
