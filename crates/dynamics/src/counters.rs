//! What was done and how long it took: every stage of every step is counted.

use std::ops::AddAssign;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

/// Wall time of each stage, summed over the threads that ran it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageTimes {
    /// Wind and drag.
    pub drag: Duration,
    /// Prediction (lines 1 to 5 of Algorithm 1) and the velocities' update (lines 16 to 19).
    pub predict: Duration,
    /// Initial guesses, what they learn from each solution included.
    pub guess: Duration,
    /// Constraints, residuals, Jacobians, mass matrices.
    pub assemble: Duration,
    /// Linear solves: blocks, factor or preconditioner, substitution or iterations.
    pub solve: Duration,
    /// Multipliers' and poses' update.
    pub update: Duration,
    /// Contacts: search, gaps and slips, their complementarity problem, and the rods' answer to it.
    pub contact: Duration,
}

impl StageTimes {
    /// Each stage by name, in the order of a step.
    pub fn by_name(&self) -> [(&'static str, Duration); 7] {
        [
            ("drag", self.drag),
            ("predict", self.predict),
            ("guess", self.guess),
            ("assemble", self.assemble),
            ("linear solve", self.solve),
            ("update", self.update),
            ("contact", self.contact),
        ]
    }

    /// Sum of all stages.
    pub fn total(&self) -> Duration {
        self.by_name().into_iter().map(|(_, time)| time).sum()
    }
}

/// Counters of a simulation. In files stand the counts alone: how often something was done, over all steps and connected
/// sets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Counters {
    /// Steps of a connected set of segments, substeps counted each.
    pub steps: u64,
    /// Steps that did not converge and were done again as two of half the length.
    pub retries: u64,
    /// Steps accepted though they did not converge, after the smallest substep.
    pub not_converged: u64,
    /// Steps whose numbers were not finite, after the smallest substep; the segments were left where they were.
    pub non_finite: u64,
    /// Outer iterations (linear solves), taken-back steps included.
    #[serde(rename = "outer_iterations")]
    pub iterations: u64,
    /// Outer iterations times segments.
    pub segment_iterations: u64,
    /// Iterations of the linear solver.
    pub linear_iterations: u64,
    /// Linear solves that ended before their tolerance.
    pub linear_failures: u64,
    /// Guesses used as a start.
    pub guesses_used: u64,
    /// Guesses dropped: not finite, so large that their rounding errors would show in the solution, or for a whole step
    /// and further from the solution than the prediction, or such that the step did not converge.
    pub guesses_dropped: u64,
    /// Applications of a load to a segment.
    pub load_evaluations: u64,
    /// Dampings of a segment's velocity.
    pub damping_evaluations: u64,
    /// Drags on a segment.
    pub drag_evaluations: u64,
    /// Eliminations of a segment with three or more joints.
    pub branch_eliminations: u64,
    /// Momentum residuals of a segment.
    pub momentum_evaluations: u64,
    /// Searches for possible contacts.
    pub contact_searches: u64,
    /// Possible contacts found, summed over searches.
    pub contact_candidates: u64,
    /// Evaluations of a possible contact.
    pub contact_evaluations: u64,
    /// Possible contacts that were not evaluated, summed over evaluations of the others: their segments cannot touch yet.
    pub contacts_left_out: u64,
    /// Contacts in complementarity problems, summed over outer iterations.
    pub contact_solves: u64,
    /// Sweeps over complementarity problems.
    pub contact_sweeps: u64,
    /// Worst error of a contact of an accepted step, relative to the smaller radius.
    #[serde(skip)]
    pub worst_contact: f64,
    /// Deepest penetration after an accepted step, relative to the smaller radius.
    #[serde(skip)]
    pub deepest_penetration: f64,
    /// Worst stretch-shear residual of an accepted step, `|C_s + alpha~ lambda_s| / l`.
    #[serde(skip)]
    pub worst_stretch: f64,
    /// Worst bend-twist residual of an accepted step, `|C_b + alpha~ lambda_b| l` [rad].
    #[serde(skip)]
    pub worst_bend: f64,
    /// Worst momentum residual of an accepted step.
    #[serde(skip)]
    pub worst_momentum: f64,
    /// Wall time per stage.
    #[serde(skip)]
    pub times: StageTimes,
}

impl Counters {
    /// Counts a search that has found so many possible contacts.
    pub(crate) fn count_search(&mut self, found: usize) {
        self.contact_searches += 1;
        self.contact_candidates += found as u64;
    }
}

impl AddAssign for Counters {
    fn add_assign(&mut self, o: Self) {
        self.steps += o.steps;
        self.retries += o.retries;
        self.not_converged += o.not_converged;
        self.non_finite += o.non_finite;
        self.iterations += o.iterations;
        self.segment_iterations += o.segment_iterations;
        self.linear_iterations += o.linear_iterations;
        self.linear_failures += o.linear_failures;
        self.guesses_used += o.guesses_used;
        self.guesses_dropped += o.guesses_dropped;
        self.load_evaluations += o.load_evaluations;
        self.damping_evaluations += o.damping_evaluations;
        self.drag_evaluations += o.drag_evaluations;
        self.branch_eliminations += o.branch_eliminations;
        self.momentum_evaluations += o.momentum_evaluations;
        self.contact_searches += o.contact_searches;
        self.contact_candidates += o.contact_candidates;
        self.contact_evaluations += o.contact_evaluations;
        self.contacts_left_out += o.contacts_left_out;
        self.contact_solves += o.contact_solves;
        self.contact_sweeps += o.contact_sweeps;
        self.worst_contact = self.worst_contact.max(o.worst_contact);
        self.deepest_penetration = self.deepest_penetration.max(o.deepest_penetration);
        self.worst_stretch = self.worst_stretch.max(o.worst_stretch);
        self.worst_bend = self.worst_bend.max(o.worst_bend);
        self.worst_momentum = self.worst_momentum.max(o.worst_momentum);
        self.times.drag += o.times.drag;
        self.times.predict += o.times.predict;
        self.times.guess += o.times.guess;
        self.times.assemble += o.times.assemble;
        self.times.solve += o.times.solve;
        self.times.update += o.times.update;
        self.times.contact += o.times.contact;
    }
}

/// Attributes the time since the last mark to a stage.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stopwatch(Instant);

impl Stopwatch {
    pub(crate) fn start() -> Self {
        Self(Instant::now())
    }

    pub(crate) fn mark(&mut self, stage: &mut Duration) {
        let now = Instant::now();
        *stage += now - self.0;
        self.0 = now;
    }
}
