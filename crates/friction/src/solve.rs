//! The impulses of all contacts: rounds of sweeps and Newton's method in turns, on one problem.
//!
//! A round (`gauss_seidel.rs`) is a sweep forwards, at first moves of force within redundant pairs (`redundant_pairs.rs`), and a sweep backwards; rounds are
//! accelerated (`anderson.rs`). What an extrapolation takes out of a friction cone is brought back into it, and solves end with a sweep.
//! Now and then Newton iterations on those that press take out what sweeps are slow at.

use super::gauss_seidel::{End, GaussSeidel, Goal};
use super::newton::{Newton, Tried};
use super::problem::Problem;
use crate::params::SolverParams;

/// Memory of the solves.
#[derive(Default)]
pub struct ContactSolver {
    newton: Newton,
    rounds: GaussSeidel,
}

impl ContactSolver {
    /// Begins a step: what one solve leaves to the next ends with it.
    pub fn begin(&mut self) {
        self.newton.begin();
    }

    /// Solves `problem` until no sweep changes an impulse by more than `tolerance` (as the length it moves its contact by,
    /// relative to the contact's scale), the natural residual is no larger, or as many sweeps as `params` allow are done;
    /// returns their number.
    pub fn solve(&mut self, problem: &mut Problem, tolerance: f64, params: &SolverParams) -> usize {
        // Sweeps between two tries of Newton's method; more where it does not help.
        let few = params.sweeps_before_newton.max(3 * problem.unknowns().len() / params.unknowns_a_sweep);
        let (mut round, mut best) = (few, f64::INFINITY);
        let mut goal = Goal { tolerance, pause: few, most: params.max_sweeps };
        self.rounds.begin(problem);
        while let End::Pause { change } = self.rounds.go(problem, goal) {
            round = match self.newton.solve(problem, tolerance, params) {
                Tried::Solved => {
                    // Newton's impulses are in their cones but for the tolerance; a sweep takes them there.
                    problem.sweep(false);
                    return self.rounds.sweeps() + 1;
                }
                Tried::Helped => few,
                // Sweeps get on by themselves, and may have found which contacts press.
                Tried::InVain if change < 0.5 * best => few.max(round / 2),
                Tried::InVain => 2 * round,
            };
            best = best.min(change);
            goal.pause = self.rounds.sweeps() + round;
        }
        self.rounds.sweeps()
    }
}

#[cfg(test)]
mod tests;
