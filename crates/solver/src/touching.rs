//! Connected sets of segments that can touch: Algorithm 1 in step, so that contacts see all of them.

use std::cmp::Reverse;

use rayon::prelude::*;
use rod::{Body, Model};

use crate::contact::{PairFilter, Shape, Stage, TooManyContacts};
use crate::counters::{Counters, Stopwatch};
use crate::formulation::{ContactProjection, Formulation};
use crate::kernel::Spatial;
use crate::linear::LinearInfo;
use crate::linear::solvers::SolverError;
use crate::simulation::PARALLEL_SEGMENTS;
use crate::step::{
    Attempt, Interval, NoGuess, Start, Status, StepParams, begin, count_solve, evaluate, may_go_on, solve, update,
};
use crate::unit::{Line9, Single, accept, finish};

/// How the step of a connected set stands.
struct Turn {
    attempt: Attempt<f64>,
    /// Whether contacts pushed it in the last iteration, so that it takes part in the next.
    takes_part: bool,
}

/// All connected sets of a model with contacts.
pub(crate) struct Touching {
    pub(crate) units: Vec<Single>,
    stage: Stage,
    turns: Vec<Turn>,
    counters: Counters,
    pub(crate) status: Status,
    segments: usize,
}

impl Touching {
    /// Sets of `model`, whose contacts must not be empty.
    ///
    /// # Errors
    /// If a set's factor would be too large.
    pub(crate) fn new(
        model: &Model,
        mut units: Vec<Single>,
        filter: PairFilter,
        params: &StepParams,
    ) -> Result<Self, SolverError> {
        let nothing = Shape { component: 0, body: 0, half: 0.0, radius: 0.0, free: false, ends: [true; 2] };
        let mut shapes = vec![nothing; model.segments.len()];
        for (component, unit) in units.iter_mut().enumerate() {
            for (body, &index) in unit.members.segments.iter().enumerate() {
                let segment = &model.segments[index];
                shapes[index] = Shape {
                    component: component as u32,
                    body: body as u32,
                    half: 0.5 * segment.length,
                    radius: segment.radius,
                    free: !segment.fixed,
                    ends: [true; 2],
                };
            }
            let bodies = unit.component.poses.len();
            unit.component.pushes = vec![Spatial::zero(); bodies];
            unit.component.pushed = vec![Spatial::zero(); bodies];
        }
        for joint in &model.joints {
            // The thicker of two ends that meet stands for both.
            if let (Body::Segment(a), Body::Segment(b)) = (joint.a, joint.b)
                && let (Some(end_a), Some(end_b)) = (shapes[a].end_at(joint.offset_a), shapes[b].end_at(joint.offset_b))
            {
                let first = (shapes[a].radius, Reverse(a)) > (shapes[b].radius, Reverse(b));
                let (other, end) = if first { (b, end_b) } else { (a, end_a) };
                shapes[other].ends[end] = false;
            }
        }
        let stage = Stage::new(model, shapes, filter, &units, params)?;
        let (turns, counters) = (Vec::with_capacity(units.len()), Counters::default());
        let segments = model.segments.len();
        Ok(Self { units, stage, turns, counters, status: Status::Converged, segments })
    }

    /// The counters of all sets and of their contacts.
    pub(crate) fn counters(&self) -> Counters {
        let mut sum = self.counters;
        for unit in &self.units {
            sum += unit.counters;
        }
        sum
    }

    /// Advances over `interval`.
    pub(crate) fn advance(&mut self, interval: Interval, params: &StepParams) {
        self.status = self.advance_halved(interval, 0, params);
        for unit in &mut self.units {
            let mut watch = Stopwatch::start();
            if let Line9::Solved { guess: Some(guess), .. } = &mut unit.line9 {
                guess.observe_step(&unit.component);
                watch.mark(&mut unit.counters.times.guess);
            }
        }
    }

    fn advance_halved(&mut self, interval: Interval, halvings: u32, params: &StepParams) -> Status {
        let mut status = self.attempt(interval, params, true);
        if self.is_guessed() && status != Status::Converged {
            self.roll_back();
            status = self.attempt(interval, params, false);
        }
        if status.may_be_halved() && halvings < params.max_halvings {
            self.roll_back();
            self.counters.retries += 1;
            let mut worst = Status::ConvergedInSubsteps;
            for half in interval.halves() {
                worst = worst.max(self.advance_halved(half, halvings + 1, params));
                if worst >= Status::TooManyContacts {
                    break;
                }
            }
            return worst;
        }
        for (unit, turn) in self.units.iter_mut().zip(&self.turns) {
            accept(&turn.attempt, 0, &mut unit.counters);
        }
        if status >= Status::TooManyContacts {
            self.counters.not_converged += u64::from(status == Status::TooManyContacts);
            self.roll_back();
        } else {
            let own = self.turns.iter().map(|turn| turn.attempt.status(0)).max();
            self.counters.not_converged += u64::from(status != Status::Converged && own == Some(Status::Converged));
            for unit in &mut self.units {
                finish(&mut unit.component, params.formulation, 1.0, &mut unit.counters);
            }
            self.counters.worst_contact = self.counters.worst_contact.max(self.stage.worst());
            self.counters.deepest_penetration = self.counters.deepest_penetration.max(self.stage.deepest());
        }
        status
    }

    fn roll_back(&mut self) {
        for unit in &mut self.units {
            unit.component.roll_back();
            unit.component.pushed.fill(Spatial::zero());
        }
        self.stage.roll_back();
    }

    /// One step over `interval`, without velocities.
    fn attempt(&mut self, interval: Interval, params: &StepParams, guessing: bool) -> Status {
        self.begin(interval, params, guessing);
        let guessed = self.is_guessed();
        self.with_stage(|stage, units, counters| stage.begin(units, guessed, counters));
        let mut contact = self.observe(params, 0);
        self.each(|unit, turn| {
            turn.attempt.target = turn.attempt.target.max(params.contact.rods_share * params.contact_tolerance);
            turn.takes_part = true;
            if guessed {
                // Contacts press from the start.
                turn.attempt.residuals = evaluate(&mut unit.component, params.formulation, &mut unit.counters);
            }
        });
        let (mut before, mut best) = (f64::INFINITY, f64::INFINITY);
        for iteration in 0.. {
            let now = max_or_nan(self.error(), contact / params.contact_tolerance);
            if now.is_nan() {
                return Status::NonFinite;
            }
            if now <= 1.0 {
                break;
            }
            best = best.min(now);
            if !may_go_on(iteration, now, before, params) || now > params.contact.lost * best {
                return Status::OutOfIterations;
            }
            before = now;
            let solved = match params.contact_projection {
                ContactProjection::Coupled => self.couple(iteration, contact, guessed, params),
                ContactProjection::Alternating => self.alternate(iteration, contact, params),
            };
            if solved == Err(TooManyContacts) {
                return Status::TooManyContacts;
            }
            contact = self.observe(params, iteration);
            self.each(|unit, turn| {
                let mut watch = Stopwatch::start();
                turn.attempt.residuals = evaluate(&mut unit.component, params.formulation, &mut unit.counters);
                watch.mark(&mut unit.counters.times.assemble);
            });
        }
        self.turns.iter().map(|turn| turn.attempt.status(0)).max().unwrap_or(Status::Converged)
    }

    /// Prediction, guesses for the step's start, first evaluation.
    fn begin(&mut self, interval: Interval, params: &StepParams, guessing: bool) {
        let first = |unit: &mut Single| {
            unit.component.pushed.fill(Spatial::zero());
            let Single { component, line9, counters, .. } = unit;
            let attempt = match line9 {
                Line9::Solved { guess: Some(guess), .. } if guessing => {
                    begin(component, interval, params, guess, counters)
                }
                _ => begin(component, interval, params, &mut NoGuess, counters),
            };
            Turn { attempt, takes_part: true }
        };
        self.turns.clear();
        if self.is_parallel() {
            self.units.par_iter_mut().map(first).collect_into_vec(&mut self.turns);
        } else {
            self.turns.extend(self.units.iter_mut().map(first));
        }
    }

    /// An outer iteration in which contacts see how the rods answer them: the rods' solution, the contacts' impulses with
    /// the rods' answer to them, and the solution with both.
    fn couple(
        &mut self,
        iteration: usize,
        contact: f64,
        guessed: bool,
        params: &StepParams,
    ) -> Result<(), TooManyContacts> {
        let formulation = params.formulation;
        self.project(iteration, formulation);
        let solved = self.with_stage(|stage, units, counters| {
            stage.keep_corrections(units, formulation);
            if iteration == 0 && !guessed && stage.is_far() {
                // The prediction knows nothing of joints; contacts are looked at where the rods take the segments, pressed as
                // they were in the step before.
                stage.press_as_before(units);
                return Ok(());
            }
            stage.solve(units, formulation, (contact, params.contact_tolerance), counters)
        });
        self.mark_pushed();
        self.each(|unit, turn| {
            let Single { component, line9, counters, .. } = unit;
            if let (true, Line9::Solved { solver, .. }) = (turn.takes_part, line9) {
                let mut watch = Stopwatch::start();
                component.answer_pushes();
                let has_start = solver.uses_start();
                let info = solver.solve(&component.system, has_start, &mut component.dlambda);
                watch.mark(&mut counters.times.contact);
                count_solve(component, &LinearInfo { start_dropped: false, ..info }, 1, has_start, counters);
            }
            update(component, formulation, 1.0, counters);
        });
        solved
    }

    /// An outer iteration as in Algorithm 1: the rods, then (line 11) the contacts with the bodies' own masses alone.
    fn alternate(&mut self, iteration: usize, contact: f64, params: &StepParams) -> Result<(), TooManyContacts> {
        let formulation = params.formulation;
        self.project(iteration, formulation);
        self.each(|unit, _| {
            if let Line9::Solved { .. } = unit.line9 {
                update(&mut unit.component, formulation, 1.0, &mut unit.counters);
            }
            unit.component.dlambda.fill(Spatial::zero());
        });
        self.observe(params, iteration);
        let solved = self.with_stage(|stage, units, counters| {
            stage.keep_corrections(units, Formulation::Xpbd);
            stage.solve(units, Formulation::Xpbd, (contact, params.contact_tolerance), counters)
        });
        self.mark_pushed();
        self.each(|unit, turn| {
            if turn.takes_part {
                unit.component.push();
            }
        });
        solved
    }

    /// The rods' own linear solves, of those that have not converged or that contacts have pushed; predictions in their
    /// place move the rods at once.
    fn project(&mut self, iteration: usize, formulation: Formulation) {
        self.each(|unit, turn| {
            let Single { component, line9, counters, .. } = unit;
            if !turn.takes_part && turn.attempt.residuals.worst() <= turn.attempt.target {
                component.dlambda.fill(Spatial::zero());
                return;
            }
            match line9 {
                Line9::Solved { solver, guess: Some(guess) } => {
                    solve(component, iteration, 1, solver.as_mut(), guess, counters);
                }
                Line9::Solved { solver, guess: None } => {
                    solve(component, iteration, 1, solver.as_mut(), &mut NoGuess, counters);
                }
                Line9::Predicted(predictor) => predictor.project(component, iteration, formulation, counters),
            }
        });
    }

    /// Evaluates the contacts; returns their largest error.
    fn observe(&mut self, params: &StepParams, iteration: usize) -> f64 {
        self.with_stage(|stage, units, counters| {
            stage.observe(units, params.formulation, params.contact_tolerance, iteration, counters)
        })
    }

    /// The rods' largest error, in units of what is good enough; not a number if any is not.
    fn error(&self) -> f64 {
        let of = |turn: &Turn| {
            let residuals = &turn.attempt.residuals;
            if residuals.check.is_finite() { residuals.worst() / turn.attempt.target } else { f64::NAN }
        };
        self.turns.iter().map(of).fold(0.0, max_or_nan)
    }

    fn mark_pushed(&mut self) {
        for turn in &mut self.turns {
            turn.takes_part = false;
        }
        for component in self.stage.pushed() {
            self.turns[component as usize].takes_part = true;
        }
    }

    /// Works on the contacts, on the clock of their stage.
    fn with_stage<R>(&mut self, work: impl FnOnce(&mut Stage, &mut [Single], &mut Counters) -> R) -> R {
        let mut watch = Stopwatch::start();
        let result = work(&mut self.stage, &mut self.units, &mut self.counters);
        watch.mark(&mut self.counters.times.contact);
        result
    }

    /// Whether any set's step began at a guess.
    fn is_guessed(&self) -> bool {
        self.turns.iter().any(|turn| turn.attempt.start != Start::Prediction)
    }

    /// Whether sets are worked on side by side on several threads.
    pub(crate) fn is_parallel(&self) -> bool {
        self.units.len() > 1 && self.segments >= PARALLEL_SEGMENTS && rayon::current_num_threads() > 1
    }

    /// Works on all sets, side by side where there is enough to share.
    fn each(&mut self, work: impl Fn(&mut Single, &mut Turn) + Send + Sync) {
        if self.is_parallel() {
            self.units.par_iter_mut().zip(&mut self.turns).for_each(|(unit, turn)| work(unit, turn));
        } else {
            self.units.iter_mut().zip(&mut self.turns).for_each(|(unit, turn)| work(unit, turn));
        }
    }
}

/// The larger of two; not a number if either is not.
fn max_or_nan(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}
