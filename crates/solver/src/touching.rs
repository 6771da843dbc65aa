//! Connected sets of segments that can touch: Algorithm 1 in step, so that contacts see all of them.

use std::cmp::Reverse;

use rayon::prelude::*;
use rod::{Body, Contacts, Model};

use crate::contact::{Shape, Stage};
use crate::counters::{Counters, Stopwatch};
use crate::linear::LinearInfo;
use crate::linear::solvers::SolverError;
use crate::simulation::PARALLEL_SEGMENTS;
use crate::step::{
    Attempt, Interval, NoGuess, Start, Status, StepParams, begin, count_solve, evaluate, may_go_on, solve, update,
};
use crate::system::Six;
use crate::unit::{Single, accept, finish};

/// Residual of the rods' own constraints that is always good enough, relative to the tolerance of contacts.
const RODS: f64 = 0.01;

/// An error so many times the least so far is not coming back.
const LOST: f64 = 1e4;

/// All connected sets of a model with contacts.
pub(crate) struct Touching {
    pub(crate) units: Vec<Single>,
    stage: Stage,
    /// How each set's step stands.
    attempts: Vec<Attempt<f64>>,
    /// Sets that take part in the iteration under way.
    takes_part: Vec<bool>,
    counters: Counters,
    pub(crate) status: Status,
    segments: usize,
}

impl Touching {
    /// Sets of `model`, whose contacts must not be empty.
    ///
    /// # Errors
    /// If a set's factor would be too large.
    pub(crate) fn new(model: &Model, mut units: Vec<Single>) -> Result<Self, SolverError> {
        debug_assert_ne!(model.contacts, Contacts::default());
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
            unit.component.pushes = vec![Six::zero(); bodies];
            unit.component.pushed = vec![Six::zero(); bodies];
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
        let stage = Stage::new(model, shapes, &units)?;
        let takes_part = vec![true; units.len()];
        let (attempts, counters) = (Vec::with_capacity(units.len()), Counters::default());
        let segments = model.segments.len();
        Ok(Self { units, stage, attempts, takes_part, counters, status: Status::Converged, segments })
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
            if let Some(guess) = &mut unit.guess {
                guess.observe_step(&unit.component);
                watch.mark(&mut unit.counters.times.guess);
            }
        }
    }

    fn advance_halved(&mut self, interval: Interval, halvings: u32, params: &StepParams) -> Status {
        let mut status = self.attempt(interval, params, true);
        let guessed = self.attempts.iter().any(|attempt| attempt.start != Start::Prediction);
        if guessed && status != Status::Converged {
            self.roll_back();
            status = self.attempt(interval, params, false);
        }
        if status != Status::Converged && halvings < params.max_halvings {
            self.roll_back();
            self.counters.retries += 1;
            let mut worst = Status::ConvergedInSubsteps;
            for half in interval.halves() {
                worst = worst.max(self.advance_halved(half, halvings + 1, params));
                if worst == Status::NonFinite {
                    break;
                }
            }
            return worst;
        }
        for (unit, attempt) in self.units.iter_mut().zip(&self.attempts) {
            accept(attempt, 0, &mut unit.counters);
        }
        if status == Status::NonFinite {
            self.roll_back();
        } else {
            let own = self.attempts.iter().map(|attempt| attempt.status(0)).max();
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
            unit.component.pushed.fill(Six::zero());
        }
        self.stage.roll_back();
    }

    /// One step over `interval`, without velocities.
    fn attempt(&mut self, interval: Interval, params: &StepParams, guessing: bool) -> Status {
        let parallel = self.units.len() > 1 && self.segments >= PARALLEL_SEGMENTS && rayon::current_num_threads() > 1;
        let Self { units, stage, attempts, takes_part, counters, .. } = self;
        let formulation = params.formulation;
        let first = |unit: &mut Single| {
            unit.component.pushed.fill(Six::zero());
            let Single { component, guess, counters, .. } = unit;
            match guess {
                Some(guess) if guessing => begin(component, interval, params, guess, counters),
                _ => begin(component, interval, params, &mut NoGuess, counters),
            }
        };
        attempts.clear();
        if parallel {
            units.par_iter_mut().map(first).collect_into_vec(attempts);
        } else {
            attempts.extend(units.iter_mut().map(first));
        }
        let mut watch = Stopwatch::start();
        let guessed = attempts.iter().any(|attempt| attempt.start != Start::Prediction);
        stage.begin(units, guessed, counters);
        let mut worst_contact = stage.observe(units, formulation, params.contact_tolerance, 0, counters);
        watch.mark(&mut counters.times.contact);
        let floor = RODS * params.contact_tolerance;
        let look = |(unit, attempt): (&mut Single, &mut Attempt<f64>)| {
            attempt.target = attempt.target.max(floor);
            if guessed {
                attempt.residuals = evaluate(&mut unit.component, formulation, &mut unit.counters);
            }
        };
        units.iter_mut().zip(&mut *attempts).for_each(look);
        takes_part.fill(true);
        let (mut before, mut best) = (f64::INFINITY, f64::INFINITY);
        for iteration in 0.. {
            let of = |attempt: &Attempt<f64>| {
                let ratio = attempt.residuals.worst() / attempt.target;
                if attempt.residuals.check.is_finite() { ratio } else { f64::NAN }
            };
            let own = attempts.iter().map(of).fold(0.0, max_or_nan);
            let now = max_or_nan(own, worst_contact / params.contact_tolerance);
            if now.is_nan() {
                return Status::NonFinite;
            }
            if now <= 1.0 {
                break;
            }
            best = best.min(now);
            if !may_go_on(iteration, now, before, params) || now > LOST * best {
                return Status::OutOfIterations;
            }
            before = now;
            let project = |((unit, attempt), takes_part): ((&mut Single, &Attempt<f64>), &bool)| {
                let Single { component, solver, guess, counters, .. } = unit;
                if !*takes_part && attempt.residuals.worst() <= attempt.target {
                    component.dlambda.fill(Six::zero());
                    return;
                }
                match guess {
                    Some(guess) => solve(component, iteration, 1, solver.as_mut(), guess, counters),
                    None => solve(component, iteration, 1, solver.as_mut(), &mut NoGuess, counters),
                }
            };
            if parallel {
                units.par_iter_mut().zip(&*attempts).zip(&*takes_part).for_each(project);
            } else {
                units.iter_mut().zip(&*attempts).zip(&*takes_part).for_each(project);
            }
            watch = Stopwatch::start();
            if iteration == 0 && !guessed && stage.is_far(units, formulation) {
                // The prediction knows nothing of joints; contacts are looked at where the rods take the segments, pressed as
                // they were in the step before.
                stage.press_as_before(units);
            } else if !stage.solve(units, formulation, (worst_contact, params.contact_tolerance), counters) {
                return Status::OutOfIterations;
            }
            takes_part.fill(false);
            for component in stage.pushed() {
                takes_part[component as usize] = true;
            }
            watch.mark(&mut counters.times.contact);
            let answer = |(unit, takes_part): (&mut Single, &bool)| {
                let Single { component, solver, counters, .. } = unit;
                if *takes_part {
                    let mut watch = Stopwatch::start();
                    component.answer_pushes();
                    let has_start = solver.uses_start();
                    let info = solver.solve(&component.system, has_start, &mut component.dlambda);
                    watch.mark(&mut counters.times.contact);
                    count_solve(component, &LinearInfo { start_dropped: false, ..info }, 1, has_start, counters);
                }
                update(component, formulation, 1.0, counters);
            };
            if parallel {
                units.par_iter_mut().zip(&*takes_part).for_each(answer);
            } else {
                units.iter_mut().zip(&*takes_part).for_each(answer);
            }
            watch = Stopwatch::start();
            worst_contact = stage.observe(units, formulation, params.contact_tolerance, iteration, counters);
            watch.mark(&mut counters.times.contact);
            let look = |(unit, attempt): (&mut Single, &mut Attempt<f64>)| {
                let mut watch = Stopwatch::start();
                attempt.residuals = evaluate(&mut unit.component, formulation, &mut unit.counters);
                watch.mark(&mut unit.counters.times.assemble);
            };
            if parallel {
                units.par_iter_mut().zip(&mut *attempts).for_each(look);
            } else {
                units.iter_mut().zip(&mut *attempts).for_each(look);
            }
        }
        let worst = attempts.iter().map(|attempt| attempt.status(0)).max();
        worst.unwrap_or(Status::Converged)
    }
}

/// The larger of two; not a number if either is not.
fn max_or_nan(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}
