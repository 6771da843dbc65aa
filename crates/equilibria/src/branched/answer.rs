//! What is answered to a branched query.

use nalgebra::{UnitQuaternion, Vector3};

use super::descent::Job;
use super::query::{ARMS, BranchedQuery};
use super::star::{Junction, Star};
use crate::answer::{Equilibrium, Finish};
use crate::scaled::{Cut, Scaled};

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
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BranchedAnswer {
    /// Equilibria, the lowest first: one, or all that were found.
    pub equilibria: Vec<BranchedEquilibrium>,
    /// Linear solves of all searches on the arms' own segments.
    pub solves: u32,
    /// Those on coarse levels.
    pub coarse_solves: u32,
}

/// Makes equilibria of turns.
pub(crate) struct Finisher {
    finish: Finish,
    segments: usize,
}

impl Finisher {
    pub(crate) fn new(cut: &Cut) -> Self {
        Self { finish: Finish::new(cut), segments: cut.segments }
    }

    pub(crate) fn equilibrium(
        &mut self,
        query: &BranchedQuery,
        star: &Star,
        job: &Job,
        turns: &[UnitQuaternion<f64>],
    ) -> BranchedEquilibrium {
        let junction = star.junction(query, &job.junction);
        let [length, bending] = star.units;
        let count = self.segments as f64;
        let arms = [0, 1, 2].map(|k| {
            let arm = query.arm(k, &junction);
            let scaled = Scaled::new(&arm);
            let own = arm.cable.bending[0].max(arm.cable.bending[1]) / arm.cable.length.powi(2);
            let force = job.forces[k] * (bending / length.powi(2) / own);
            let job = crate::descent::Job { force, ..crate::descent::Job::new(0) };
            self.finish.equilibrium(&arm, &scaled, &job, &turns[k * self.segments..(k + 1) * self.segments])
        });
        let sum = |of: fn(&Equilibrium) -> Vector3<f64>| arms.iter().map(of).sum::<Vector3<f64>>().norm();
        let force = sum(|arm| arm.grips[1].force) * length.powi(2) / bending / count;
        let moment = sum(|arm| arm.grips[1].moment) * length / bending;
        let largest = arms.iter().flat_map(|arm| &arm.grips).map(|grip| grip.force.norm()).fold(0.0, f64::max);
        let at_junction = force.max(moment) / (1.0 + largest * length.powi(2) / bending / count);
        let residual = arms.iter().map(|arm| arm.residual).fold(at_junction, f64::max);
        let energy = arms.iter().map(|arm| arm.energy).sum();
        BranchedEquilibrium { junction, arms, energy, residual }
    }
}
