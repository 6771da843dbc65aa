//! How often a simulation did what, as data.

use serde::{Deserialize, Serialize};
use solver::counters::Counters;

/// How often something was done, over all steps and connected sets; what the scene or the settings lack stays zero. The
/// counts are those of [`Counters`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "the same names as in Counters, where they are explained")]
pub struct Work {
    pub steps: u64,
    pub retries: u64,
    pub not_converged: u64,
    pub non_finite: u64,
    pub outer_iterations: u64,
    pub segment_iterations: u64,
    pub linear_iterations: u64,
    pub linear_failures: u64,
    pub guesses_used: u64,
    pub guesses_dropped: u64,
    pub load_evaluations: u64,
    pub damping_evaluations: u64,
    pub drag_evaluations: u64,
    pub branch_eliminations: u64,
    pub geometric_evaluations: u64,
    pub momentum_evaluations: u64,
    pub contact_searches: u64,
    pub contact_candidates: u64,
    pub contact_evaluations: u64,
    pub contact_solves: u64,
    pub contact_sweeps: u64,
}

impl From<&Counters> for Work {
    fn from(counters: &Counters) -> Self {
        Self {
            steps: counters.steps,
            retries: counters.retries,
            not_converged: counters.not_converged,
            non_finite: counters.non_finite,
            outer_iterations: counters.iterations,
            segment_iterations: counters.segment_iterations,
            linear_iterations: counters.linear_iterations,
            linear_failures: counters.linear_failures,
            guesses_used: counters.guesses_used,
            guesses_dropped: counters.guesses_dropped,
            load_evaluations: counters.load_evaluations,
            damping_evaluations: counters.damping_evaluations,
            drag_evaluations: counters.drag_evaluations,
            branch_eliminations: counters.branch_eliminations,
            geometric_evaluations: counters.geometric_evaluations,
            momentum_evaluations: counters.momentum_evaluations,
            contact_searches: counters.contact_searches,
            contact_candidates: counters.contact_candidates,
            contact_evaluations: counters.contact_evaluations,
            contact_solves: counters.contact_solves,
            contact_sweeps: counters.contact_sweeps,
        }
    }
}
