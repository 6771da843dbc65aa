//! The impulses of all contacts: sweeps and Newton's method in turns, on one problem.
//!
//! Sweeps find out who presses and who slides; in between, Newton iterations on those take out what sweeps are slow at.

use super::newton::Newton;
use super::problem::Problem;
use crate::contact_params::ContactParams;

/// Solves `problem` until no sweep changes an impulse by more than `tolerance` (as the length it moves its contact by,
/// relative to the contact's scale) or as many sweeps as `params` allow are done; returns their number.
pub(crate) fn solve(problem: &mut Problem, newton: &mut Newton, tolerance: f64, params: &ContactParams) -> usize {
    let (mut sweeps, mut best) = (0, f64::INFINITY);
    // Sweeps between two tries of Newton's method; more where it does not help.
    let (few, most) = (params.sweeps_before_newton, params.most_sweeps);
    let mut round = few;
    while sweeps < most {
        let mut change = f64::INFINITY;
        for _ in 0..round.min(most - sweeps) {
            change = problem.sweep(sweeps % 2 == 1);
            sweeps += 1;
            if change <= tolerance {
                break;
            }
        }
        if change <= tolerance || newton.solve(problem, tolerance, params) {
            break;
        }
        round = if change < 0.5 * best { few } else { 2 * round };
        best = best.min(change);
    }
    sweeps
}

#[cfg(test)]
mod tests;
