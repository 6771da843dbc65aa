//! An attempt at a step of rods that run through eyelets: Newton's method with the exact tangent and a border.
//!
//! With K the rods' own matrix ([`jointed::tangent`]), the unknowns y of all eyelets (forces and places) and their columns B and rows R
//! on bodies, an iteration solves
//!
//! ```text
//! [ K  -B ] [ dp ]   [ -g     ]
//! [ R   D ] [ dy ] = [ missed ]      (R K^-1 B + D) dy = missed + R K^-1 g
//! ```
//!
//! The factor of K serves all columns. The border is small, dense, and not symmetric where there is friction. All else is as in
//! [`super`].

use component::{Border, Component, Residuals};
use jointed::linear::LinearInfo;
use jointed::linear::articulated::Side;
use kernels::Spatial;

use super::bordered::{Bordered, add_column, along, along_column, give_sides, solve_dense, take_bodies, take_sides};
use super::{Exact, SHARES};
use crate::attempt::{Attempt, begin, count_iteration, evaluate, may_go_on};
use crate::counters::{Counters, Stopwatch};
use crate::formulation::Formulation;
use crate::start::StepGuess;
use crate::step::{Interval, StepParams};

impl Exact<f64> {
    /// Solves for a step from the last evaluation; returns whether it could.
    pub(super) fn find_bordered(&mut self, component: &mut Component<f64>, counters: &mut Counters) -> bool {
        let mut watch = Stopwatch::start();
        component.gather(&mut self.equations, 1.0);
        component.add_eyelets_curvature(&mut self.equations);
        watch.mark(&mut counters.times.assemble);
        let solved = self.elimination.solve(&self.equations)
            && self.elimination.is_of_tree()
            && self.factor_border(component)
            && self.solve_border(component);
        watch.mark(&mut counters.times.solve);
        solved
    }

    /// Makes the border of the eyelets after a solve of the rods' own equations, whose corrections stay; returns whether it could.
    fn factor_border(&mut self, component: &Component<f64>) -> bool {
        let Self { equations, elimination, bordered, .. } = self;
        let Bordered { borders, unknowns, columns, own, sides, matrix, .. } = bordered;
        borders.resize_with(component.border_count(), Border::default);
        unknowns.clear();
        for (k, border) in borders.iter_mut().enumerate() {
            component.border(k, border);
            unknowns.extend((0..border.unknowns()).map(|own| (k, own)));
        }
        own.clone_from(&elimination.corrections);
        take_sides(equations, sides);
        columns.resize_with(columns.len().max(unknowns.len()), Default::default);
        let mut solved = true;
        for (corrections, &(k, unknown)) in columns.iter_mut().zip(unknowns.iter()) {
            let border = &borders[k];
            add_column(border, unknown, 1.0, equations);
            solved &= elimination.solve_again(equations);
            corrections.clone_from(&elimination.corrections);
            border.bodies.iter().for_each(|&body| equations.bodies[body].defect = Spatial::zero());
        }
        give_sides(equations, sides);
        matrix.clear();
        for &(k, row) in unknowns.iter() {
            let border = &borders[k];
            matrix.extend(unknowns.iter().zip(columns.iter()).map(|(&(other, column), answer)| {
                let own = if k == other { border.own[row * border.unknowns() + column] } else { 0.0 };
                own + along(border, row, answer)
            }));
        }
        elimination.corrections.clone_from(own);
        solved
    }

    /// Takes the eyelets into the last solution of the rods' own equations, for their right-hand sides as they are; returns whether it could.
    pub(super) fn solve_border(&mut self, component: &mut Component<f64>) -> bool {
        let Self { equations, elimination, bordered, dp, .. } = self;
        let Bordered { borders, unknowns, sides, matrix, solution, scratch, .. } = bordered;
        solution.clear();
        solution.extend(
            unknowns.iter().map(|&(k, row)| borders[k].missed[row] - along(&borders[k], row, &elimination.corrections)),
        );
        scratch.clone_from(matrix);
        if !solve_dense(scratch, solution, 1) {
            return false;
        }
        take_bodies(equations, &mut sides.0);
        for (&(k, unknown), &share) in unknowns.iter().zip(solution.iter()) {
            add_column(&borders[k], unknown, share, equations);
        }
        elimination.solve_again(equations);
        equations.bodies.iter_mut().zip(&sides.0).for_each(|(body, side)| body.defect = *side);
        component.take_solution(elimination, dp, 1.0);
        component.take_eyelets_solution(solution);
        true
    }
}

impl Exact<f64> {
    /// What the eyelets change in the work that unit forces of the `sides` do on each other's answers. Friction and drives in eyelets are left
    /// out: with friction the operator would not be symmetric, and of a rod that sticks a contact would not know that it slides under more force.
    pub(super) fn couple_through_eyelets(
        &mut self,
        sides: &[Side],
        mut block: impl FnMut(usize, usize, [[f64; 3]; 3]),
    ) {
        let Bordered { borders, unknowns, columns, answers, solution, scratch, .. } = &mut self.bordered;
        let (size, forces) = (unknowns.len(), 3 * sides.len());
        let is_seen = |k: usize| {
            let (border, own) = unknowns[k];
            own + borders[border].unseen < borders[border].unknowns()
        };
        let entry = |row: usize, column: usize| {
            if !(is_seen(row) && is_seen(column)) {
                return if row == column { 1.0 } else { 0.0 };
            }
            let ((k, r), (other, c)) = (unknowns[row], unknowns[column]);
            let own = if k == other { borders[k].seen[r * borders[k].unknowns() + c] } else { 0.0 };
            own + along_column(&borders[k], r, &columns[column])
        };
        let answer = |force: usize, k: usize| {
            let side = &sides[force / 3];
            if is_seen(k) { side.forces[force % 3].dot(columns[k][side.body as usize]) } else { 0.0 }
        };
        scratch.clear();
        scratch.extend((0..size * size).map(|k| entry(k / size, k % size)));
        answers.clear();
        answers.extend((0..size * forces).map(|k| answer(k % forces, k / forces)));
        solution.clone_from(answers);
        if !solve_dense(scratch, solution, forces) {
            return;
        }
        let less =
            |r: usize, c: usize| (0..size).map(|k| answers[k * forces + r] * solution[k * forces + c]).sum::<f64>();
        for t in 0..sides.len() {
            for s in 0..=t {
                block(s, t, [0, 1, 2].map(|r| [0, 1, 2].map(|c| -less(3 * s + r, 3 * t + c))));
            }
        }
    }
}

/// Takes what eyelets miss into the residuals.
fn with_gap(component: &Component<f64>, residuals: &mut Residuals<f64>) {
    let gap = component.eyelet_gap();
    residuals.stretch = residuals.stretch.max(gap);
    residuals.check += gap;
}

impl Exact<f64> {
    /// What the state misses, eyelets included.
    pub(crate) fn evaluate_sliding(component: &mut Component<f64>, counters: &mut Counters) -> Residuals<f64> {
        let mut residuals = evaluate(component, Formulation::Newton, counters);
        with_gap(component, &mut residuals);
        residuals
    }

    /// Judges an attempt after an iteration: it is not at its end where an eyelet begins to stick or to slide.
    pub(crate) fn judge_sliding(component: &mut Component<f64>, attempt: &mut Attempt<f64>) {
        attempt.judge_residuals(component, Formulation::Newton);
        if component.choose_slip() {
            attempt.error = f64::INFINITY;
        }
    }

    /// Takes eyelets into an attempt that has begun. From a prediction, where joints transmit nothing yet, it takes the forces of a first solve
    /// and leaves the poses: without the stiffness that tension gives, eyelets would turn light segments about.
    pub(crate) fn begin_sliding(
        &mut self,
        component: &mut Component<f64>,
        attempt: &mut Attempt<f64>,
        counters: &mut Counters,
    ) {
        with_gap(component, &mut attempt.residuals);
        if component.has_multipliers(0) || !self.find_bordered(component, counters) {
            return;
        }
        self.dp.fill(Spatial::zero());
        self.poses.clone_from(&component.poses);
        self.lambda.clone_from(&component.lambda);
        component.go_on_from((&self.poses, &self.lambda), &self.dp, 1.0, 1.0);
        component.take_eyelets_forces();
        count_iteration(component, &LinearInfo::default(), 1, false, counters);
        attempt.residuals = Self::evaluate_sliding(component, counters);
    }
}

impl Exact<f64> {
    /// [`crate::attempt::attempt`] for a set whose rods run through eyelets.
    pub(crate) fn attempt_sliding(
        &mut self,
        component: &mut Component<f64>,
        interval: Interval,
        params: &StepParams,
        guess: &mut dyn StepGuess<f64>,
        counters: &mut Counters,
    ) -> Attempt<f64> {
        component.is_apart = true;
        let mut attempt = begin(component, interval, params, guess, counters);
        self.begin_sliding(component, &mut attempt, counters);
        let mut before = attempt.error;
        for iteration in 0..params.max_iterations.saturating_mul(2) {
            let now = attempt.error;
            let is_due = now > attempt.target && may_go_on(iteration, now, before, params);
            if !is_due || !attempt.residuals.check.is_finite() {
                break;
            }
            before = now;
            if !self.find_bordered(component, counters) {
                attempt.error = f64::INFINITY;
                break;
            }
            let worst = attempt.residuals.worst();
            self.poses.clone_from(&component.poses);
            self.lambda.clone_from(&component.lambda);
            let mut taken = 0.0;
            let mut found = attempt.residuals;
            // Where no share leaves less, the whole step is taken: residuals of stiff joints need not fall at first.
            for share in SHARES.into_iter().chain([1.0]) {
                let mut watch = Stopwatch::start();
                component.go_on_from((&self.poses, &self.lambda), &self.dp, share, 1.0);
                component.move_eyelets(share - taken);
                taken = share;
                watch.mark(&mut counters.times.update);
                found = Self::evaluate_sliding(component, counters);
                watch.mark(&mut counters.times.assemble);
                if found.worst() < worst {
                    break;
                }
            }
            count_iteration(component, &LinearInfo::default(), 1, false, counters);
            let correction = component.correction.max(component.eyelet_correction());
            attempt.take(found, correction, 1.0);
            Self::judge_sliding(component, &mut attempt);
        }
        component.is_apart = false;
        attempt
    }
}
