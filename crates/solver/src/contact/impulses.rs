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
use super::operator::{Chunk, Row};
use super::problem::Problem;
use super::twins::{self, Twins};
use crate::contact_params::ContactParams;
use crate::kernel::dispatch::vectorized;
use crate::kernel::lane::Real;

/// Memory of the solves.
#[derive(Default)]
pub(crate) struct Impulses {
    newton: Newton,
    twins: Vec<Twins>,
    /// Impulses at the start of a round.
    before: Vec<Row>,
    /// p.
    direction: Vec<Row>,
    /// `W dz` at the start of a round, and `W p`.
    moved_before: Vec<Chunk>,
    moved_along: Vec<Chunk>,
}

impl Impulses {
    /// Begins a step: what one solve leaves to the next ends with it.
    pub(crate) fn begin(&mut self) {
        self.newton.begin();
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
            self.moved_before.clone_from(problem.operator.all_moved());
            let mut change = problem.sweep(false);
            sweeps += 1;
            if change <= tolerance || sweeps >= most {
                break;
            }
            twins::transfer(&self.twins, problem);
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
        let Self { before, direction, moved_before, moved_along, .. } = self;
        direction.resize(before.len(), [0.0; 3]);
        moved_along.resize(moved_before.len(), Chunk::zero());
        if beta == 0.0 {
            direction.fill([0.0; 3]);
            moved_along.fill(Chunk::zero());
        }
        vectorized(
            #[inline(always)]
            || {
                // What answers to the impulses goes further with them.
                let by = Chunk::splat(beta);
                let all = problem.operator.all_moved().iter_mut();
                for (moved, (before, along)) in all.zip(moved_before.iter().zip(moved_along.iter_mut())) {
                    let further = *along * by;
                    *along = *moved - *before + further;
                    *moved += further;
                }
                for (k, (before, direction)) in before.iter().zip(direction.iter_mut()).enumerate() {
                    let (now, friction) = (problem.unknowns()[k].force, problem.unknowns()[k].friction);
                    let further = direction.map(|x| beta * x);
                    *direction = [0, 1, 2].map(|i| now[i] - before[i] + further[i]);
                    if further != [0.0; 3] {
                        let known = [now[0] + further[0], now[1] + further[1], now[2] + further[2]];
                        let force = friction.within_rest([known[0].max(0.0), known[1], known[2]]);
                        problem.set_force_from(k, force, known);
                    }
                }
            },
        );
        gamma
    }
}

#[cfg(test)]
mod tests;
