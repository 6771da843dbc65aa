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

use component::{BodyColumns, Border, Component, Residuals, UNKNOWNS};
use jointed::linear::articulated::Side;
use kernels::Spatial;
use nalgebra::{DMatrix, DVector, Dyn, LU};

use super::Exact;
use crate::attempt::{Attempt, begin, evaluate, may_go_on};
use crate::counters::{Counters, Stopwatch};
use crate::formulation::Formulation;
use crate::start::{Start, StepGuess};
use crate::step::{Interval, StepParams};

/// Shares of a step that are tried.
const SHARES: [f64; 3] = [1.0, 0.5, 0.25];

/// Memory for the border.
#[derive(Default)]
pub(super) struct Bordered {
    borders: Vec<Border>,
    /// Answers of bodies and joints to each unknown.
    columns: Vec<(Vec<Spatial<f64>>, Vec<Spatial<f64>>)>,
    /// Those to what the rods miss.
    own: (Vec<Spatial<f64>>, Vec<Spatial<f64>>),
    /// Right-hand sides of bodies and joints.
    sides: (Vec<Spatial<f64>>, Vec<Spatial<f64>>),
    /// The factor of the border.
    factor: Option<LU<f64, Dyn, Dyn>>,
}

impl Bordered {
    /// Whether there are eyelets.
    pub(super) fn is_there(&self) -> bool {
        !self.borders.is_empty()
    }
}

impl Exact<f64> {
    /// Solves for a step from the last evaluation; returns whether it could.
    pub(super) fn find_bordered(&mut self, component: &mut Component<f64>, counters: &mut Counters) -> bool {
        let mut watch = Stopwatch::start();
        component.gather(&mut self.equations, 1.0);
        component.add_eyelets_curvature(&mut self.equations);
        watch.mark(&mut counters.times.assemble);
        let solved =
            self.elimination.solve(&self.equations) && self.factor_border(component) && self.solve_border(component);
        watch.mark(&mut counters.times.solve);
        solved
    }

    /// Makes the border of the eyelets after a solve of the rods' own equations, whose solution stays; returns whether it could.
    fn factor_border(&mut self, component: &Component<f64>) -> bool {
        let Self { equations, elimination, bordered, .. } = self;
        let Bordered { borders, columns, own, sides, factor } = bordered;
        let count = component.eyelet_count();
        borders.resize_with(count, Border::default);
        borders.iter_mut().enumerate().for_each(|(k, border)| component.border(k, border));
        own.0.clone_from(&elimination.corrections);
        own.1.clone_from(&elimination.multipliers);
        sides.0.clear();
        sides.0.extend(equations.bodies.iter().map(|body| body.defect));
        sides.1.clear();
        sides.1.extend(equations.joints.iter().map(|joint| joint.rhs));
        equations.bodies.iter_mut().for_each(|body| body.defect = Spatial::zero());
        equations.joints.iter_mut().for_each(|joint| joint.rhs = Spatial::zero());
        columns.resize_with(count * UNKNOWNS, Default::default);
        let mut is_of_tree = true;
        for (k, (corrections, multipliers)) in columns.iter_mut().enumerate() {
            let border = &borders[k / UNKNOWNS];
            for own in &border.bodies {
                let defect = &mut equations.bodies[own.body].defect;
                *defect = defect.plus(own.columns[k % UNKNOWNS], 1.0);
            }
            is_of_tree &= elimination.solve_again(equations);
            corrections.clone_from(&elimination.corrections);
            multipliers.clone_from(&elimination.multipliers);
            border.bodies.iter().for_each(|own| equations.bodies[own.body].defect = Spatial::zero());
        }
        for (body, side) in equations.bodies.iter_mut().zip(&sides.0) {
            body.defect = *side;
        }
        for (joint, side) in equations.joints.iter_mut().zip(&sides.1) {
            joint.rhs = *side;
        }
        let size = count * UNKNOWNS;
        let matrix = DMatrix::from_fn(size, size, |row, column| {
            let is_own = row / UNKNOWNS == column / UNKNOWNS;
            let own = if is_own { borders[row / UNKNOWNS].own[row % UNKNOWNS][column % UNKNOWNS] } else { 0.0 };
            own + along(&borders[row / UNKNOWNS], row, &columns[column].0)
        });
        elimination.corrections.clone_from(&own.0);
        elimination.multipliers.clone_from(&own.1);
        *factor = is_of_tree.then(|| matrix.lu());
        is_of_tree
    }

    /// Takes the eyelets into the last solution of the rods' own equations; returns whether it could.
    pub(super) fn solve_border(&mut self, component: &mut Component<f64>) -> bool {
        let Self { elimination, bordered, dp, .. } = self;
        let Bordered { borders, columns, factor, .. } = bordered;
        let size = borders.len() * UNKNOWNS;
        let missed = DVector::from_fn(size, |row, _| {
            let border = &borders[row / UNKNOWNS];
            border.missed[row % UNKNOWNS] - along(border, row, &elimination.corrections)
        });
        let solution = factor.as_ref().and_then(|factor| factor.solve(&missed));
        let Some(solution) = solution.filter(|solution| solution.iter().all(|x| x.is_finite())) else {
            return false;
        };
        for (share, (corrections, multipliers)) in solution.iter().zip(&*columns) {
            let add = |to: &mut [Spatial<f64>], from: &[Spatial<f64>]| {
                to.iter_mut().zip(from).for_each(|(to, from)| *to = to.plus(*from, *share));
            };
            add(&mut elimination.corrections, corrections);
            add(&mut elimination.multipliers, multipliers);
        }
        component.take_solution(elimination, dp, 1.0);
        component.take_eyelets_solution(solution.as_slice());
        true
    }
}

impl Exact<f64> {
    /// What the eyelets change in the work that unit forces of the `sides` do on each other's answers. Friction in eyelets is left out, for
    /// which the operator would not be symmetric.
    pub(super) fn couple_through_eyelets(&self, sides: &[Side], mut block: impl FnMut(usize, usize, [[f64; 3]; 3])) {
        let Bordered { borders, columns, .. } = &self.bordered;
        let size = borders.len() * UNKNOWNS;
        // Of one that sticks the place is no unknown.
        let is_free = |k: usize| k % UNKNOWNS < 3 || borders[k / UNKNOWNS].slides();
        let matrix = DMatrix::from_fn(size, size, |row, column| {
            if !(is_free(row) && is_free(column)) {
                return f64::from(u8::from(row == column));
            }
            let border = &borders[row / UNKNOWNS];
            let (r, c) = (row % UNKNOWNS, column % UNKNOWNS);
            let own = match row / UNKNOWNS == column / UNKNOWNS {
                true if r < 3 => border.own[r][c],
                true => border.own[c.min(r)][c.max(r)],
                false => 0.0,
            };
            let of = |own: &BodyColumns| own.columns[r].dot(columns[column].0[own.body]);
            own + border.bodies.iter().map(of).sum::<f64>()
        });
        let answer = |side: &Side, c: usize, k: usize| {
            if is_free(k) { side.forces[c].dot(columns[k].0[side.body as usize]) } else { 0.0 }
        };
        let answers = DMatrix::from_fn(3 * sides.len(), size, |row, k| answer(&sides[row / 3], row % 3, k));
        let Some(solved) = matrix.lu().solve(&answers.transpose()) else { return };
        let less = answers * solved;
        for t in 0..sides.len() {
            for s in 0..=t {
                block(s, t, [0, 1, 2].map(|r| [0, 1, 2].map(|c| -less[(3 * s + r, 3 * t + c)])));
            }
        }
    }
}

/// What the bodies' corrections do to a row of the border.
fn along(border: &Border, row: usize, corrections: &[Spatial<f64>]) -> f64 {
    let of = |own: &BodyColumns| {
        let row = if row % UNKNOWNS == 3 { own.row } else { own.columns[row % UNKNOWNS] };
        row.dot(corrections[own.body])
    };
    border.bodies.iter().map(of).sum()
}

/// What the state misses, eyelets included.
pub(crate) fn evaluate_sliding(component: &mut Component<f64>, counters: &mut Counters) -> Residuals<f64> {
    let mut residuals = evaluate(component, Formulation::Newton, counters);
    let gap = component.eyelet_gap();
    residuals.stretch = residuals.stretch.max(gap);
    residuals.check += gap;
    residuals
}

impl Exact<f64> {
    /// Begins to slide in an attempt that has begun. From a prediction, where joints transmit nothing yet, it takes the forces of a first solve
    /// and leaves the poses: without the stiffness that tension gives, eyelets would turn light segments about.
    pub(crate) fn begin_sliding(
        &mut self,
        component: &mut Component<f64>,
        attempt: &mut Attempt<f64>,
        counters: &mut Counters,
    ) {
        component.begin_sliding(attempt.start != Start::Prediction);
        attempt.residuals = evaluate_sliding(component, counters);
        if component.has_multipliers(0) || !self.find_bordered(component, counters) {
            return;
        }
        self.dp.fill(Spatial::zero());
        self.poses.clone_from(&component.poses);
        self.lambda.clone_from(&component.lambda);
        component.go_on_from((&self.poses, &self.lambda), &self.dp, 1.0, 1.0);
        component.take_eyelets_forces();
        count(component, counters);
        attempt.residuals = evaluate_sliding(component, counters);
    }
}

/// Counts a solve.
fn count(component: &mut Component<f64>, counters: &mut Counters) {
    component.solves += 1;
    counters.iterations += 1;
    counters.segment_iterations += component.segments() as u64;
    counters.branch_eliminations += component.system.topology.branches as u64;
}

/// [`crate::attempt::attempt`] for a set whose rods run through eyelets.
pub(crate) fn attempt_sliding(
    component: &mut Component<f64>,
    interval: Interval,
    params: &StepParams,
    exact: &mut Exact<f64>,
    guess: &mut dyn StepGuess<f64>,
    counters: &mut Counters,
) -> Attempt<f64> {
    component.is_apart = true;
    let mut attempt = begin(component, interval, params, guess, counters);
    exact.begin_sliding(component, &mut attempt, counters);
    let mut before = attempt.error;
    for iteration in 0..params.max_iterations.saturating_mul(2) {
        let now = attempt.error;
        let is_due = now > attempt.target && may_go_on(iteration, now, before, params);
        if !is_due || !attempt.residuals.check.is_finite() {
            break;
        }
        before = now;
        if !exact.find_bordered(component, counters) {
            attempt.error = f64::INFINITY;
            break;
        }
        let worst = attempt.residuals.worst();
        exact.poses.clone_from(&component.poses);
        exact.lambda.clone_from(&component.lambda);
        let mut taken = 0.0;
        let mut found = attempt.residuals;
        // Where no share leaves less, the whole step is taken: residuals of stiff joints need not fall at first.
        for share in SHARES.into_iter().chain([1.0]) {
            let mut watch = Stopwatch::start();
            component.go_on_from((&exact.poses, &exact.lambda), &exact.dp, share, 1.0);
            component.move_eyelets(share - taken);
            taken = share;
            watch.mark(&mut counters.times.update);
            found = evaluate_sliding(component, counters);
            watch.mark(&mut counters.times.assemble);
            if found.worst() < worst {
                break;
            }
        }
        count(component, counters);
        let correction = component.correction.max(component.eyelet_correction());
        attempt.take(found, correction, 1.0);
        if component.choose_slip() {
            (attempt.error, attempt.correction) = (f64::INFINITY, f64::INFINITY);
        }
    }
    component.is_apart = false;
    attempt
}
