//! The impulses of all contacts: sweeps and Newton's method in turns, on one problem.
//!
//! A round is a sweep forwards, moves of force between twins (`twins.rs`), and a sweep backwards. Its change g of the
//! impulses is taken for the downhill gradient of a method of nonlinear conjugate gradients (after Silcowitz, Niebe and
//! Erleben 2010):
//!
//! ```text
//! gamma = g^T diag(W) g,   beta = gamma / gamma before,   z += beta p,   p = g + beta p
//! ```
//!
//! It begins anew where beta is above 1. What an extrapolation takes out of a friction cone is brought back into it, and
//! solves end with a sweep. Now and then Newton iterations on those that press take out what sweeps are slow at.

use super::newton::Newton;
use super::problem::{Problem, Row};
use super::twins::{self, Twins};
use crate::contact_params::ContactParams;
use crate::snapshot::Tape;

/// Memory of the solves.
#[derive(Default)]
pub(crate) struct Impulses {
    newton: Newton,
    twins: Vec<Twins>,
    /// Impulses at the start of a round.
    before: Vec<Row>,
    /// p.
    direction: Vec<Row>,
}

impl Impulses {
    /// Shows a tape what one solve leaves to the next.
    pub(crate) fn tape(&mut self, tape: &mut Tape<'_>) {
        self.newton.tape(tape);
    }

    /// Solves `problem` until no sweep changes an impulse by more than `tolerance` (as the length it moves its contact by,
    /// relative to the contact's scale) or as many sweeps as `params` allow are done; returns their number.
    pub(crate) fn solve(&mut self, problem: &mut Problem, tolerance: f64, params: &ContactParams) -> usize {
        let (mut sweeps, mut best) = (0, f64::INFINITY);
        // Sweeps between two tries of Newton's method; more where it does not help.
        let (few, most) = (params.sweeps_before_newton, params.most_sweeps);
        let mut round = few;
        twins::find(problem, &mut self.twins);
        let mut next = round;
        let mut gamma = None;
        loop {
            self.before.clear();
            self.before.extend(problem.unknowns().iter().map(|unknown| unknown.force));
            let mut change = problem.sweep(false);
            sweeps += 1;
            if change <= tolerance || sweeps >= most {
                break;
            }
            self.twins.iter().for_each(|twins| twins.transfer(problem));
            change = problem.sweep(true);
            sweeps += 1;
            if change <= tolerance || sweeps >= most {
                break;
            }
            if sweeps < next {
                gamma = Some(self.accelerate(problem, gamma));
                continue;
            }
            if self.newton.solve(problem, tolerance, params) {
                // Newton's impulses are in their cones but for the tolerance; a sweep takes them there.
                problem.sweep(false);
                sweeps += 1;
                break;
            }
            round = if change < 0.5 * best { few } else { 2 * round };
            best = best.min(change);
            next = sweeps + round;
            gamma = None;
        }
        sweeps
    }

    /// Extrapolates after a round; `last` is gamma of the round before, if this one goes on from it. Returns its own.
    fn accelerate(&mut self, problem: &mut Problem, last: Option<f64>) -> f64 {
        let mut gamma = 0.0;
        for (k, before) in self.before.iter().enumerate() {
            let (now, d) = (problem.unknowns()[k].force, problem.diagonal(k));
            gamma += (0..3).map(|i| (now[i] - before[i]).powi(2) * d[i][i]).sum::<f64>();
        }
        let beta = last.filter(|&last| gamma <= last && last > 0.0).map_or(0.0, |last| gamma / last);
        self.direction.resize(self.before.len(), [0.0; 3]);
        for (k, (before, direction)) in self.before.iter().zip(&mut self.direction).enumerate() {
            let (now, friction) = (problem.unknowns()[k].force, problem.unknowns()[k].friction);
            let further = if beta > 0.0 { direction.map(|x| beta * x) } else { [0.0; 3] };
            *direction = [0, 1, 2].map(|i| now[i] - before[i] + further[i]);
            if further != [0.0; 3] {
                let force = [(now[0] + further[0]).max(0.0), now[1] + further[1], now[2] + further[2]];
                problem.set_force(k, friction.within_rest(force));
            }
        }
        gamma
    }
}

#[cfg(test)]
mod tests;
