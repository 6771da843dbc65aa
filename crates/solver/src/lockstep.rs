//! Connected sets of segments that can touch: Algorithm 1 in lockstep, so that contacts see all of them.

use std::cmp::Reverse;

use nalgebra::Vector3;
use rayon::prelude::*;
use rod::{Body, Carried, Model};

use crate::attempt::{begin, count_solve, count_step, evaluate, finish, may_go_on, solve, update};
use crate::component::{Change, Members};
use crate::connected_set::{ConnectedSet, Projector};
use crate::contact::{ContactForce, PairFilter, Shape, Stage, TooManyContacts};
use crate::counters::{Counters, Stopwatch};
use crate::derivative::Substep;
use crate::formulation::{ContactProjection, Formulation};
use crate::kernel::Spatial;
use crate::kernel::dispatch::vectorized;
use crate::limits::PARALLEL_SEGMENTS;
use crate::linear::solvers::{SolverError, SolverKind};
use crate::retry::{self, Steps};
use crate::snapshot::Tape;
use crate::start::NoGuess;
use crate::step::{Interval, Status, StepParams};

/// All connected sets of a model with contacts.
pub(crate) struct Lockstep {
    pub(crate) sets: Vec<ConnectedSet>,
    stage: Stage,
    counters: Counters,
    segments: usize,
    /// All of them as one set, and the steps that were accepted since they were last taken, where derivatives ask for them.
    pub(crate) substeps: Option<(Members, Vec<Substep>)>,
}

impl Lockstep {
    /// Sets of `model`, whose contacts must not be empty.
    ///
    /// # Errors
    /// If a set's factor would be too large.
    pub(crate) fn new(
        model: &Model,
        mut sets: Vec<ConnectedSet>,
        filter: PairFilter,
        params: &StepParams,
    ) -> Result<Self, SolverError> {
        let nothing = Shape { component: 0, body: 0, half: 0.0, radius: 0.0, free: false, ends: [true; 2] };
        let mut shapes = vec![nothing; model.segments.len()];
        for (component, set) in sets.iter_mut().enumerate() {
            for (body, &index) in set.members.segments.iter().enumerate() {
                let segment = &model.segments[index];
                let capsule = segment.capsule();
                // What touches nothing has no ends, and a filter keeps it from all others. A sphere has one.
                let (half, mut radius) = capsule.unwrap_or((0.0, segment.radius));
                if let Some(mesh) = segment.surface() {
                    // The ball around it.
                    radius = mesh.positions.iter().map(|place| place.norm()).fold(0.0, f64::max);
                }
                shapes[index] = Shape {
                    component: component as u32,
                    body: body as u32,
                    half,
                    radius,
                    free: !segment.fixed,
                    ends: [capsule.is_some(), half > 0.0],
                };
            }
            let bodies = set.component.poses.len();
            set.component.pushes = vec![Spatial::zero(); bodies];
            set.component.pushed = vec![Spatial::zero(); bodies];
        }
        for joint in &model.joints {
            // The thicker of two ends that meet stands for both.
            if let (Body::Segment(a), Body::Segment(b)) = (joint.a, joint.b)
                && joint.mount.is_none()
                && let (Some(end_a), Some(end_b)) = (shapes[a].end_at(joint.offset_a), shapes[b].end_at(joint.offset_b))
            {
                let first = (shapes[a].radius, Reverse(a)) > (shapes[b].radius, Reverse(b));
                let (other, end) = if first { (b, end_b) } else { (a, end_a) };
                shapes[other].ends[end] = false;
            }
        }
        let stage = Stage::new(model, shapes, filter, &sets, params)?;
        let segments = model.segments.len();
        Ok(Self { sets, stage, counters: Counters::default(), segments, substeps: None })
    }

    /// The counters of all sets and of their contacts.
    pub(crate) fn counters(&self) -> Counters {
        let mut sum = self.counters;
        for set in &self.sets {
            sum += set.counters;
        }
        sum
    }

    /// Lets a motion drive an obstacle from the next step on; returns whether there is such an obstacle.
    pub(crate) fn drive_obstacle(&mut self, index: usize, motion: &Carried) -> bool {
        self.stage.drive_obstacle(index, motion)
    }

    /// Shows all sets and the contacts that press to a tape.
    pub(crate) fn tape(&mut self, tape: &mut Tape<'_>) {
        self.sets.iter_mut().for_each(|set| set.tape(tape));
        self.stage.tape(tape);
    }

    /// Changes gravity [m/s^2], which says how fast bodies must meet to bounce.
    pub(crate) fn set_gravity(&mut self, gravity: &Vector3<f64>) {
        self.sets.iter_mut().for_each(|set| set.component.set_gravity(gravity));
        self.stage.set_gravity(gravity);
    }

    /// What presses on what at the end of the last step.
    pub(crate) fn contact_forces(&self) -> impl Iterator<Item = ContactForce> {
        self.stage.forces(&self.sets)
    }

    /// Holds a body of the model, drives it or lets it go, if it is one of these: returns whether it is. Contacts stay as
    /// they are, with their impulses.
    ///
    /// # Errors
    /// If the factor of its set would be too large.
    pub(crate) fn change(&mut self, body: Body, change: Change<'_>, solver: SolverKind) -> Result<bool, SolverError> {
        for (component, set) in self.sets.iter_mut().enumerate() {
            if set.change(body, change, solver)? {
                if let Body::Segment(i) = body {
                    self.stage.set_free(i, matches!(change, Change::LetGo));
                    self.stage.renew_response(component, set)?;
                }
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Advances over `interval`.
    pub(crate) fn advance(&mut self, interval: Interval, params: &StepParams) -> Status {
        let status = retry::advance(self, interval, 0, params);
        for set in &mut self.sets {
            set.status = status;
            set.observe_step();
        }
        status
    }

    /// Prediction, guesses for the step's start, first evaluation.
    fn begin(&mut self, interval: Interval, params: &StepParams, guessing: bool) {
        // An impulse between two sets is the same for both: both take steps of one kind.
        let held_back = !self.sets.iter().all(|set| set.component.can_go_on());
        self.each(|set| {
            set.component.hold_back(held_back);
            set.component.pushed.fill(Spatial::zero());
            let ConnectedSet { component, projector, counters, .. } = set;
            set.attempt = match projector {
                Projector::Solve { guess: Some(guess), .. } if guessing => {
                    begin(component, interval, params, guess, counters)
                }
                _ => begin(component, interval, params, &mut NoGuess, counters),
            };
            set.takes_part = true;
        });
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
        let solved = self.with_stage(|stage, sets, counters| {
            stage.keep_corrections(sets, formulation);
            if iteration == 0 && !guessed && stage.is_far() {
                // The prediction knows nothing of joints; contacts are looked at where the rods take the segments, pressed as
                // they were in the step before.
                stage.press_as_before(sets);
                return Ok(());
            }
            stage.solve(sets, formulation, (contact, params.contact_tolerance), counters)
        });
        self.mark_pushed();
        self.each(|set| {
            let ConnectedSet { component, projector, counters, .. } = set;
            if let (true, Projector::Solve { solver, .. }) = (set.takes_part, projector) {
                let mut watch = Stopwatch::start();
                vectorized(
                    #[inline(always)]
                    || component.answer_pushes(),
                );
                let has_start = solver.uses_start();
                let info = solver.solve(&component.system, has_start, &mut component.dlambda);
                component.drop_free();
                watch.mark(&mut counters.times.contact);
                count_solve(component, &info, 1, has_start, counters);
            }
            update(component, formulation, 1.0, counters);
        });
        solved
    }

    /// An outer iteration as in Algorithm 1: the rods, then (line 11) the contacts with the bodies' own masses alone.
    fn alternate(&mut self, iteration: usize, contact: f64, params: &StepParams) -> Result<(), TooManyContacts> {
        let formulation = params.formulation;
        self.project(iteration, formulation);
        self.each(|set| {
            if let Projector::Solve { .. } = set.projector {
                update(&mut set.component, formulation, 1.0, &mut set.counters);
            }
            set.component.dlambda.fill(Spatial::zero());
        });
        self.observe(params, iteration);
        let solved = self.with_stage(|stage, sets, counters| {
            stage.keep_corrections(sets, Formulation::Xpbd);
            stage.solve(sets, Formulation::Xpbd, (contact, params.contact_tolerance), counters)
        });
        self.mark_pushed();
        self.each(|set| {
            if set.takes_part {
                set.component.push();
            }
        });
        solved
    }

    /// The rods' own linear solves, of those that have not converged or that contacts have pushed; predictions in their
    /// place move the rods at once.
    fn project(&mut self, iteration: usize, formulation: Formulation) {
        self.each(|set| {
            let ConnectedSet { component, projector, counters, .. } = set;
            if !set.takes_part && set.attempt.residuals.worst() <= set.attempt.target {
                component.rest(formulation);
                return;
            }
            match projector {
                Projector::Solve { solver, guess: Some(guess) } => {
                    solve(component, iteration, 1, solver.as_mut(), guess, counters);
                }
                Projector::Solve { solver, guess: None } => {
                    solve(component, iteration, 1, solver.as_mut(), &mut NoGuess, counters);
                }
                Projector::Predict(predictor) => predictor.project(component, iteration, formulation, counters),
            }
        });
    }

    /// Evaluates the contacts; returns their largest error.
    fn observe(&mut self, params: &StepParams, iteration: usize) -> f64 {
        self.with_stage(|stage, sets, counters| {
            stage.observe(sets, params.formulation, params.contact_tolerance, iteration, counters)
        })
    }

    /// The rods' largest error, in units of what is good enough; not a number if any is not.
    fn error(&self) -> f64 {
        let of = |set: &ConnectedSet| {
            let residuals = &set.attempt.residuals;
            if residuals.check.is_finite() { residuals.worst() / set.attempt.target } else { f64::NAN }
        };
        self.sets.iter().map(of).fold(0.0, max_or_nan)
    }

    /// How a step ended whose last attempt ended so: with joints apart where they gape. Sets that the smallest substep does not
    /// bring together stay where they are, without what presses.
    fn ended(&mut self, status: Status, params: &StepParams) -> Status {
        let mut stays = false;
        for set in self.sets.iter_mut().filter(|set| may_stay(status, params) && set.is_torn()) {
            set.component.stay();
            stays = true;
        }
        if stays {
            self.stage.roll_back();
            return Status::Apart;
        }
        self.sets.iter().map(|set| set.ended(status)).max().unwrap_or(status)
    }

    fn mark_pushed(&mut self) {
        for set in &mut self.sets {
            set.takes_part = false;
        }
        for component in self.stage.pushed() {
            self.sets[component as usize].takes_part = true;
        }
    }

    /// Works on the contacts, on the clock of their stage.
    fn with_stage<R>(&mut self, work: impl FnOnce(&mut Stage, &mut [ConnectedSet], &mut Counters) -> R) -> R {
        let mut watch = Stopwatch::start();
        let result = work(&mut self.stage, &mut self.sets, &mut self.counters);
        watch.mark(&mut self.counters.times.contact);
        result
    }

    /// Whether sets are worked on side by side on several threads.
    pub(crate) fn is_parallel(&self) -> bool {
        self.sets.len() > 1 && self.segments >= PARALLEL_SEGMENTS && rayon::current_num_threads() > 1
    }

    /// Works on all sets, side by side where there is enough to share.
    fn each(&mut self, work: impl Fn(&mut ConnectedSet) + Send + Sync) {
        if self.is_parallel() {
            self.sets.par_iter_mut().for_each(work);
        } else {
            self.sets.iter_mut().for_each(work);
        }
    }
}

impl Steps for Lockstep {
    fn attempt(&mut self, interval: Interval, params: &StepParams, guessing: bool) -> Status {
        self.begin(interval, params, guessing);
        let guessed = self.is_guessed();
        self.with_stage(|stage, sets, counters| stage.begin(sets, interval, guessed, counters));
        let mut contact = self.observe(params, 0);
        self.each(|set| {
            set.attempt.target = set.attempt.target.max(params.contact.rods_share * params.contact_tolerance);
            set.takes_part = true;
            if guessed {
                // Contacts press from the start.
                set.attempt.residuals = evaluate(&mut set.component, params.formulation, &mut set.counters);
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
                // Where errors have grown, bodies are piled up that no solution brings together: a shorter step helps.
                return if now > best { Status::OutOfIterations } else { Status::TooManyContacts };
            }
            contact = self.observe(params, iteration);
            self.each(|set| {
                let mut watch = Stopwatch::start();
                set.attempt.residuals = evaluate(&mut set.component, params.formulation, &mut set.counters);
                watch.mark(&mut set.counters.times.assemble);
            });
        }
        let own = self.sets.iter().map(|set| set.attempt.status(0)).max().unwrap_or(Status::Converged);
        if self.stage.turns_too_far() { own.max(Status::OutOfIterations) } else { own }
    }

    fn is_guessed(&self) -> bool {
        self.sets.iter().any(ConnectedSet::is_guessed)
    }

    fn is_hopeless(&self) -> bool {
        self.sets.iter().any(|set| set.is_torn() && set.component.begins_apart())
    }

    fn roll_back(&mut self) {
        for set in &mut self.sets {
            set.component.roll_back();
            set.component.pushed.fill(Spatial::zero());
        }
        self.stage.roll_back();
    }

    fn accept(&mut self, status: Status, params: &StepParams) -> Status {
        for set in &mut self.sets {
            let is_kept = !(status.is_stuck() || may_stay(status, params) && set.is_torn());
            count_step(&set.attempt, 0, is_kept, &mut set.counters);
        }
        // Contacts alone may be what has not converged.
        let own = self.sets.iter().map(|set| set.attempt.status(0)).max();
        let not_converged = matches!(status, Status::OutOfIterations | Status::TooManyContacts);
        self.counters.not_converged += u64::from(not_converged && own == Some(Status::Converged));
        if status.is_stuck() {
            self.roll_back();
            return status;
        }
        let status = self.ended(status, params);
        let begins_anew = self.stage.end_step() || status != Status::Converged;
        if let Some((whole, substeps)) = &mut self.substeps {
            let touching = self.stage.slopes(&mut self.sets, params.contact_tolerance);
            substeps.extend(Substep::of_all(&self.sets, whole, touching, begins_anew));
        }
        for set in &mut self.sets {
            finish(&mut set.component, params.formulation, 1.0, &mut set.counters);
            if begins_anew {
                set.component.begin_anew(1.0);
            }
        }
        self.counters.worst_contact = self.counters.worst_contact.max(self.stage.worst());
        self.counters.deepest_penetration = self.counters.deepest_penetration.max(self.stage.deepest());
        status
    }

    fn counters_mut(&mut self) -> &mut Counters {
        &mut self.counters
    }

    fn count_dropped(&mut self) {
        self.sets.iter_mut().for_each(ConnectedSet::count_dropped);
    }
}

/// Whether sets whose joints gape stay where they were at the end of a step that ended so.
fn may_stay(status: Status, params: &StepParams) -> bool {
    status == Status::OutOfIterations && params.max_halvings > 0
}

/// The larger of two; not a number if either is not.
fn max_or_nan(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}
