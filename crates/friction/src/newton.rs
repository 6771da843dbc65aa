//! Newton's method on the contacts that press, for where sweeps alone come near the solution too slowly: taut ropes around
//! a drum, tight knots.
//!
//! The equations are those of Alart and Curnier (1991), `z = project(z - w / compliance)` with the cone at the current
//! normal impulse: semi-smooth, so that the derivative of whichever branch holds serves. A line search on the sum of their
//! squares accepts a step only where it lowers that sum.

use kernels::dispatch::vectorized;

use super::cone::{length, natural_residual};
use super::delassus::{Chunk, Row};
use super::lu::Factor;
use super::problem::Problem;
use crate::params::SolverParams;

/// Memory of the method.
pub(crate) struct Newton {
    /// Contacts that press, and the index of each among them.
    pressing: Vec<u32>,
    place: Vec<u32>,
    /// Gaps and slips of all contacts.
    w: Vec<Row>,
    /// Impulses at the start of an iteration, and the step from there.
    before: Vec<Row>,
    moved_before: Vec<Chunk>,
    step: Vec<Row>,
    /// Row by row.
    matrix: Vec<f64>,
    /// A contact's rows of W as they enter its equations, of one group.
    products: Vec<f64>,
    rhs: Vec<f64>,
    factor: Factor,
    /// 0 before the first iteration.
    damping: f64,
}

/// What a try came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tried {
    /// Errors are within the tolerance.
    Solved,
    /// They are a tenth of what they were.
    Helped,
    /// They are more, or no contact presses, or too many do.
    InVain,
}

/// What a try that helps leaves of the sum of squares.
const HELPFUL: f64 = 0.01;

/// By how much a step must lower the sum of squares, relative to it and to the part of the step taken.
const SUFFICIENT: f64 = 0.1;

impl Default for Newton {
    fn default() -> Self {
        Self {
            pressing: Vec::new(),
            place: Vec::new(),
            w: Vec::new(),
            before: Vec::new(),
            moved_before: Vec::new(),
            step: Vec::new(),
            matrix: Vec::new(),
            products: Vec::new(),
            rhs: Vec::new(),
            factor: Factor::default(),
            damping: 0.0,
        }
    }
}

/// Errors of all contacts, relative to their scales: the sum of squares and the largest.
#[derive(Clone, Copy)]
struct Merit {
    squares: f64,
    largest: f64,
}

impl Newton {
    /// Begins a step: the damping of one solve is a start for the next within it.
    pub(crate) fn begin(&mut self) {
        self.damping = 0.0;
    }

    /// Improves the problem's impulses as long as an iteration helps, until they are within `tolerance`.
    pub(crate) fn solve(&mut self, problem: &mut Problem, tolerance: f64, params: &SolverParams) -> Tried {
        if self.damping == 0.0 {
            self.damping = params.initial_newton_damping;
        }
        problem.refresh();
        let mut now = self.measure(problem);
        let first = now.squares;
        for _ in 0..params.max_newton_iterations {
            if now.largest <= tolerance || !self.find_step(problem, params.max_newton_unknowns) {
                break;
            }
            self.before.clear();
            self.before.extend(problem.unknowns().iter().map(|unknown| unknown.force));
            self.moved_before.clear();
            self.moved_before.extend_from_slice(problem.all_moved());
            let mut part = 1.0;
            let mut next = None;
            for _ in 0..params.max_newton_halvings {
                // From where they were each time: a long step that is not taken leaves no rounding errors.
                problem.restore(&self.before, &self.moved_before);
                let (before, step) = (&self.before, &self.step);
                problem.set_forces(
                    #[inline(always)]
                    |k, _| {
                        let [n, x, y] = [0, 1, 2].map(|r| before[k][r] + part * step[k][r]);
                        [n.max(0.0), x, y]
                    },
                );
                let merit = self.measure(problem);
                if merit.squares < (1.0 - SUFFICIENT * part) * now.squares {
                    next = Some(merit);
                    break;
                }
                part *= 0.5;
            }
            let Some(merit) = next else {
                self.damping *= params.newton_damping_increase;
                problem.restore(&self.before, &self.moved_before);
                if self.damping > params.max_newton_damping {
                    self.damping = params.max_newton_damping;
                    break;
                }
                now = self.measure(problem);
                continue;
            };
            if part == 1.0 {
                self.damping = (self.damping * params.newton_damping_decrease).max(params.min_newton_damping);
            }
            now = merit;
        }
        match now.largest <= tolerance {
            true => Tried::Solved,
            false if now.squares < HELPFUL * first => Tried::Helped,
            false => Tried::InVain,
        }
    }

    fn measure(&mut self, problem: &Problem) -> Merit {
        self.w.clear();
        let mut merit = Merit { squares: 0.0, largest: 0.0 };
        for k in 0..problem.unknowns().len() {
            let w = problem.gap_and_slip(k);
            let unknown = problem.unknowns()[k];
            let [normal, across] = natural_residual(problem.compliance(k), unknown.force, w, unknown.friction);
            let [normal, across] = [normal / unknown.scale, across / unknown.scale];
            merit.squares += normal * normal + across * across;
            merit.largest = merit.largest.max(normal).max(across);
            self.w.push(w);
        }
        merit
    }

    /// The step of Newton's method. Returns whether there is one: not if no contact presses, if those that do have more than
    /// `most` unknowns, or if the result is not finite.
    fn find_step(&mut self, problem: &Problem, most: usize) -> bool {
        self.pressing.clear();
        self.place.clear();
        self.step.clear();
        for (k, unknown) in problem.unknowns().iter().enumerate() {
            let [normal, _] = problem.compliance(k);
            let pressed = unknown.force[0] - self.w[k][0] / normal;
            let presses = normal > 0.0 && pressed > 0.0;
            self.place.push(if presses { self.pressing.len() as u32 } else { u32::MAX });
            // Contacts that do not press lose their impulse.
            self.step.push(if presses { [0.0; 3] } else { unknown.force.map(|x| -x) });
            if presses {
                self.pressing.push(k as u32);
            }
        }
        let size = 3 * self.pressing.len();
        if size == 0 || size > most {
            return false;
        }
        vectorized(
            #[inline(always)]
            || self.linearise(problem, size),
        );
        self.factor.solve(&mut self.matrix, &mut self.rhs);
        for (step, &k) in self.rhs.chunks_exact(3).zip(&self.pressing) {
            self.step[k as usize].copy_from_slice(step);
        }
        self.rhs.iter().all(|x| x.is_finite())
    }

    /// Fills matrix (row by row) and right-hand side.
    #[inline(always)]
    fn linearise(&mut self, problem: &Problem, size: usize) {
        let Self { pressing, place, w, step, matrix, rhs, products, damping, .. } = self;
        matrix.clear();
        matrix.resize(size * size, 0.0);
        rhs.clear();
        rhs.resize(size, 0.0);
        let equations = matrix.chunks_exact_mut(3 * size).zip(rhs.chunks_exact_mut(3));
        for (i, (&k, (matrix, rhs))) in pressing.iter().zip(equations).enumerate() {
            let rows = Rows::new(problem, k as usize, w[k as usize], *damping);
            rhs.copy_from_slice(&rows.rhs);
            problem.operator.each_product(
                k as usize,
                &rows.through,
                products,
                #[inline(always)]
                |other, block| match place[other] {
                    u32::MAX => {
                        for (rhs, row) in rhs.iter_mut().zip(&block) {
                            *rhs -= row[0] * step[other][0] + row[1] * step[other][1] + row[2] * step[other][2];
                        }
                    }
                    j => {
                        for (row, own) in matrix.chunks_exact_mut(size).zip(&block) {
                            add(row, j as usize, own);
                        }
                    }
                },
            );
            for (row, own) in matrix.chunks_exact_mut(size).zip(&rows.own) {
                add(row, i, own);
            }
        }
    }
}

/// Adds three numbers to those of a row.
#[inline(always)]
fn add(row: &mut [f64], index: usize, by: &Row) {
    for (sum, x) in row[3 * index..3 * index + 3].iter_mut().zip(by) {
        *sum += x;
    }
}

/// A contact's three equations: `own` times its own step plus `through` times W times all steps is `rhs`.
struct Rows {
    own: [Row; 3],
    through: [Row; 3],
    rhs: Row,
}

impl Rows {
    fn new(problem: &Problem, k: usize, w: Row, damping: f64) -> Self {
        let (z, friction) = (problem.unknowns()[k].force, problem.unknowns()[k].friction);
        let [normal, across] = problem.compliance(k);
        let mut rows = Rows { own: [[0.0; 3]; 3], through: [[0.0; 3]; 3], rhs: [-w[0], 0.0, 0.0] };
        let pressed = z[0] - w[0] / normal;
        rows.through[0][0] = 1.0;
        rows.own[0][0] = damping * normal;
        if !friction.exists(f64::INFINITY) || across <= 0.0 {
            rows.own[1][1] = normal;
            rows.own[2][2] = normal;
            return rows;
        }
        // The normal impulse at which the cone is taken is the one that the contact itself would answer with.
        let q = [z[1] - w[1] / across, z[2] - w[2] / across];
        let length = length(q);
        if length <= friction.most(pressed) {
            rows.through = [rows.through[0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            rows.own[1][1] = damping * across;
            rows.own[2][2] = damping * across;
            rows.rhs = [rows.rhs[0], -w[1], -w[2]];
            return rows;
        }
        let d = [q[0] / length, q[1] / length];
        let radius = friction.most(pressed).min(length);
        for a in 0..2 {
            for b in 0..2 {
                let unit = if a == b { 1.0 } else { 0.0 };
                let turning = radius / length * (unit - d[a] * d[b]);
                rows.own[1 + a][1 + b] = across * (unit - turning + damping * unit);
                rows.through[1 + a][1 + b] = turning;
            }
            // The cone follows the normal impulse and the gap.
            rows.own[1 + a][0] = -across * friction.0 * d[a];
            rows.through[1 + a][0] = across / normal * friction.0 * d[a];
            rows.rhs[1 + a] = -across * (z[1 + a] - radius * d[a]);
        }
        rows
    }
}
