//! Viscoelastic bending and twist: the generalised Maxwell model.
//!
//! The joint's stiffness C is that of a fast strain. Branch j carries the share g_j of it and relaxes with the time t_j:
//!
//! ```text
//! M = (1 - sum g_j) C k + sum h_j      h_j' + h_j / t_j = g_j C k'
//! ```
//!
//! The step is exact for a strain that goes at a constant rate (Taylor, Pister and Goudreau 1970; Simo and Hughes 1998, section 10.3):
//! `h_j <- exp(-x) h_j + (1 - exp(-x)) / x g_j C dk` with x = dt / t_j, stable for steps of any length.

use nalgebra::{Matrix3, Vector3};

use super::variables::{Answer, InternalVariables};

/// A spring and a dashpot in series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaxwellBranch {
    /// Share of the joint's stiffness that relaxes.
    pub share: f64,
    /// Relaxation time [s].
    pub time: f64,
}

impl MaxwellBranch {
    /// What is left of a moment after a step of `dt` [s], and the mean of that over the step.
    fn decay(&self, dt: f64) -> [f64; 2] {
        let x = dt / self.time;
        [(-x).exp(), if x > 1e-8 { -(-x).exp_m1() / x } else { 1.0 - 0.5 * x }]
    }
}

pub(super) fn mistake(branches: &[MaxwellBranch]) -> Option<(&'static str, f64, &'static str)> {
    for MaxwellBranch { share, time } in branches {
        if !(share.is_finite() && *share > 0.0) {
            return Some(("share of a branch", *share, "finite and > 0"));
        }
        if !(time.is_finite() && *time > 0.0) {
            return Some(("relaxation time of a branch", *time, "finite and > 0"));
        }
    }
    let sum = shares(branches);
    (sum >= 1.0).then_some(("sum of the shares of branches", sum, "less than 1"))
}

fn shares(branches: &[MaxwellBranch]) -> f64 {
    branches.iter().map(|branch| branch.share).sum()
}

/// See [`super::JointLaw::relaxing`].
pub(super) fn relaxing(branches: &[MaxwellBranch], omega: f64) -> f64 {
    branches.iter().map(|MaxwellBranch { share, time }| share * time / (1.0 + (omega * time).powi(2))).sum()
}

/// Branches with their moments.
fn with_moments<'a>(
    branches: &'a [MaxwellBranch],
    at: &'a InternalVariables,
) -> impl Iterator<Item = (&'a MaxwellBranch, Vector3<f64>)> {
    branches.iter().enumerate().map(|(j, branch)| (branch, at.parts.get(j).copied().unwrap_or_default()))
}

pub(super) fn answer(
    branches: &[MaxwellBranch],
    stiffness: &Vector3<f64>,
    strain: &Vector3<f64>,
    at: &InternalVariables,
    dt: f64,
) -> Answer {
    let lasting = 1.0 - shares(branches);
    let (mut moment, mut tangent) = (stiffness.component_mul(strain) * lasting, lasting);
    let by = stiffness.component_mul(&(strain - at.strain));
    for (branch, before) in with_moments(branches, at) {
        let [left, mean] = branch.decay(dt);
        moment += before * left + by * (branch.share * mean);
        tangent += branch.share * mean;
    }
    Answer { moment, tangent: Matrix3::from_diagonal(&(stiffness * tangent)) }
}

/// What the dashpots take is the work on a branch, `dk . (h_end + (h_0 - h_end) (1 - exp(-x)) / x)` with `h_end = g C dk / x`, less what its spring gains.
pub(super) fn advance(
    branches: &[MaxwellBranch],
    stiffness: &Vector3<f64>,
    strain: &Vector3<f64>,
    at: &mut InternalVariables,
    dt: f64,
) {
    let by = strain - at.strain;
    let elastic = stiffness.component_mul(&by);
    let compliance = stiffness.map(|own| 1.0 / own);
    for (branch, moment) in branches.iter().zip(&mut at.parts) {
        let [left, mean] = branch.decay(dt);
        let before = *moment;
        *moment = before * left + elastic * (branch.share * mean);
        let end = elastic * (branch.share * branch.time / dt);
        let work = by.dot(&(end + (before - end) * mean));
        let energy = |h: &Vector3<f64>| 0.5 * compliance.component_mul(h).dot(h) / branch.share;
        at.dissipated += work - energy(moment) + energy(&before);
    }
}

pub(super) fn stored(
    branches: &[MaxwellBranch],
    stiffness: &Vector3<f64>,
    strain: &Vector3<f64>,
    at: &InternalVariables,
) -> f64 {
    let square = |x: &Vector3<f64>| 0.5 * stiffness.component_mul(x).dot(x);
    let by = stiffness.component_mul(&(strain - at.strain));
    let compliance = stiffness.map(|own| 1.0 / own);
    let of_branches = with_moments(branches, at).map(|(branch, before)| {
        let moment = before + by * branch.share;
        0.5 * compliance.component_mul(&moment).dot(&moment) / branch.share
    });
    square(strain) * (1.0 - shares(branches)) + of_branches.sum::<f64>()
}
