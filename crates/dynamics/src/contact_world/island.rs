//! One island: connected sets that may touch each other in a step, through the outer iterations of Algorithm 1 in step.

use component::Members;
use component::snapshot::Snapshot;
use kernels::Spatial;
use kernels::math::Sym3;
use kernels::parallel;

use crate::attempt::{
    Exact, TangentChoice, begin, convergence_rate, count_solve, count_step, evaluate, finish, may_go_on, solve, update,
};
use crate::connected_set::{ConnectedSet, Projector};
use crate::counters::{Counters, Stopwatch};
use crate::formulation::{ContactProjection, Formulation};
use crate::islands::{IslandContacts, Sets, Shared, TooManyContacts};
use crate::limits::segments_grain;
use crate::start::NoGuess;
use crate::step::{Interval, Status, StepParams};
use crate::step_control::{self, Steps};
use crate::substep::Substep;

/// Error of contacts \[radii\] at which an attempt is given up before it is solved for thousands of contacts of bodies that have been flung into each
/// other. Without it one in eight heaps of 20 cables takes ten times as long (seed 4: 5.8 s for 0.5 s).
const DIVERGED: f64 = 1e3;

/// What an island keeps besides its sets, and hands on to another one in the next step.
#[derive(Default)]
pub(super) struct IslandWorkspace {
    pub(super) counters: Counters,
    /// Whether the sets' predictions are made and their contacts found.
    pub(super) is_begun: bool,
    /// How the step ended.
    pub(super) status: Option<Status>,
    /// Whether it becomes a part of another island.
    pub(super) joins: bool,
    /// Whether the step is still to be accepted, which it is once no other island has met this one.
    pub(super) is_open: bool,
    /// The sets at the start of a step that is done in parts.
    pub(super) start: Snapshot,
    /// The steps that were accepted, where derivatives ask for them.
    pub(super) substeps: Vec<Substep>,
    pub(super) segments: usize,
    /// The step that is done in parts, if it is, and the end of the last one tried [s].
    whole: Option<Interval>,
    end: f64,
}

/// An island in a step.
pub(super) struct Island<'a> {
    pub(super) shared: &'a Shared,
    pub(super) sets: Sets<'a>,
    pub(super) stage: &'a mut IslandContacts,
    pub(super) workspace: &'a mut IslandWorkspace,
    /// All segments as one set, where derivatives ask for steps.
    pub(super) whole: Option<&'a Members>,
}

impl Island<'_> {
    /// Steps over `interval`. A step that is done as a whole is still to be accepted.
    pub(super) fn advance(&mut self, interval: Interval, params: &StepParams) {
        let whole = step_control::advance_whole(self, interval, 0, params);
        self.workspace.is_open = whole.is_some();
        self.workspace.whole = if self.workspace.is_open { None } else { Some(interval) };
        let status = whole.unwrap_or_else(|| {
            let Self { sets, workspace, .. } = &mut *self;
            workspace.start.write(|visitor| sets.iter_mut().for_each(|set| set.visit_state(visitor)));
            step_control::advance_parts(self, interval, 0, params)
        });
        self.workspace.status = Some(status);
    }

    /// Accepts a step that was done as a whole.
    pub(super) fn close(&mut self, params: &StepParams) {
        if let Some(status) = self.workspace.status
            && std::mem::take(&mut self.workspace.is_open)
        {
            let status = self.accept(status, params);
            self.workspace.status = Some(status);
        }
        let status = self.workspace.status.unwrap_or(Status::Converged);
        for set in self.sets.iter_mut() {
            set.status = status;
            set.observe_step();
        }
    }

    /// Goes back to the start of the step at a time [s], however it was done.
    pub(super) fn undo(&mut self, time: f64) {
        if std::mem::take(&mut self.workspace.is_open) {
            self.roll_back();
        } else {
            let Self { sets, workspace, .. } = &mut *self;
            workspace.start.read(|visitor| sets.iter_mut().for_each(|set| set.visit_state(visitor)));
        }
        self.sets.iter_mut().for_each(|set| set.component.mend(time));
        self.workspace.substeps.clear();
    }

    /// Predictions, guesses for the step's start, first evaluations.
    fn begin(&mut self, interval: Interval, params: &StepParams, guessing: bool) {
        // An impulse between two sets is the same for both: both take steps of one kind.
        let held_back = !self.sets.iter().all(|set| set.component.can_go_on());
        self.each(|set| begin_set(set, held_back, interval, params, guessing));
        self.with_stage(|stage, shared, sets, counters| stage.find_part(shared, interval, sets, counters));
    }

    /// Contacts at the start of a step whose prediction is made.
    fn begin_contacts(&mut self, params: &StepParams) {
        let guessed = self.is_guessed();
        self.with_stage(|stage, shared, sets, counters| {
            stage.begin(shared, sets, (guessed, params.formulation), counters)
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
        let solved = self.with_stage(|stage, shared, sets, counters| {
            stage.keep_corrections(shared, sets, formulation);
            if iteration == 0 {
                stage.limit_bounces(shared, sets);
            }
            if iteration == 0 && !guessed && stage.is_far(shared, sets) {
                // The prediction knows nothing of joints; contacts are looked at where the rods take the segments, pressed as
                // they were in the step before.
                stage.press_as_before(shared, sets);
                return Ok(0);
            }
            stage.solve(shared, sets, (contact, params.contact_tolerance), counters)
        });
        self.mark_pushed();
        let (swept, segments) = (solved.unwrap_or(0), self.workspace.segments);
        self.each(|set| {
            let ConnectedSet { component, projector, exact, tangents, counters, .. } = set;
            if let Some(tangents) = tangents {
                tangents.count_sweeps(swept, segments);
            }
            if let Some(exact) = exact.as_mut().filter(|exact| exact.is_taken()) {
                if set.takes_part {
                    exact.answer_pushes(component, counters);
                }
                exact.go_on(component, counters);
                return;
            }
            if let (true, Projector::Solve { solver, .. }) = (set.takes_part, projector) {
                let mut watch = Stopwatch::start();
                component.answer_pushes();
                let has_start = solver.uses_start();
                let info = solver.solve(&component.system, has_start, &mut component.dlambda);
                component.drop_free();
                watch.mark(&mut counters.times.contact);
                count_solve(component, &info, 1, has_start, counters);
            }
            update(component, formulation, 1.0, counters);
        });
        solved.map(|_| ())
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
        let solved = self.with_stage(|stage, shared, sets, counters| {
            stage.keep_corrections(shared, sets, Formulation::Xpbd);
            if iteration == 0 {
                stage.limit_bounces(shared, sets);
            }
            stage.solve(shared, sets, (contact, params.contact_tolerance), counters)
        });
        self.mark_pushed();
        self.each(|set| {
            if set.takes_part {
                set.component.push();
            }
        });
        solved.map(|_| ())
    }

    /// The rods' own linear solves, of those that have not converged or that contacts have pushed; predictions in their
    /// place move the rods at once.
    fn project(&mut self, iteration: usize, formulation: Formulation) {
        self.each(|set| {
            let ConnectedSet { component, projector, exact, tangents, counters, .. } = set;
            if let Some(exact) = exact {
                exact.leave();
            }
            if !set.takes_part && set.attempt.error <= set.attempt.target {
                component.rest(formulation);
                return;
            }
            let is_asked = tangents.as_ref().is_none_or(TangentChoice::is_exact);
            let is_exact =
                is_asked && exact.as_mut().is_some_and(|exact| exact.project(component, &set.attempt, counters));
            if let Some(tangents) = tangents {
                tangents.count(is_exact);
            }
            if is_exact {
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
        self.with_stage(|stage, shared, sets, counters| {
            stage.observe(shared, sets, params.contact_tolerance, iteration, counters)
        })
    }

    /// Judges how far sets are from the solution, where the largest of their corrections before the last was `before`: all as one, as what
    /// one corrects moves others. Returns the largest of the last ones, in units of what is good enough.
    fn judge(&mut self, before: f64) -> f64 {
        let of = |set: &ConnectedSet| set.component.correction / set.attempt.target;
        let now = self.sets.iter().map(of).fold(0.0, max_or_nan);
        let rate = convergence_rate(now, before);
        for set in self.sets.iter_mut() {
            set.attempt.judge(0, set.component.correction, rate);
        }
        now
    }

    /// The rods' largest error, in units of what is good enough; not a number if any is not.
    fn error(&self) -> f64 {
        let of = |set: &ConnectedSet| {
            let residuals = &set.attempt.residuals;
            if residuals.check.is_finite() { set.attempt.error / set.attempt.target } else { f64::NAN }
        };
        self.sets.iter().map(of).fold(0.0, max_or_nan)
    }

    /// How a step ended whose last attempt ended so: with joints apart where they gape. Sets stay where they are, without what
    /// presses, where the smallest substep does not bring them together, or bodies apart.
    fn ended(&mut self, status: Status, params: &StepParams) -> Status {
        let is_off = self.stage.worst() > params.contact.max_error;
        let mut stay = None;
        for set in self.sets.iter_mut().filter(|set| stays(set, is_off, status, params)) {
            stay = stay.max(Some(if set.is_torn() { Status::Apart } else { status }));
            set.component.stay();
        }
        if let Some(status) = stay {
            self.stage.roll_back();
            // What counts is how deep they are where they stay, not where the last attempt had them.
            self.observe(params, 0);
            return status;
        }
        self.sets.iter().map(|set| set.ended(status)).max().unwrap_or(status)
    }

    fn mark_pushed(&mut self) {
        let Self { shared, sets, stage, .. } = self;
        for set in sets.iter_mut() {
            set.takes_part = false;
        }
        for component in stage.pushed(shared) {
            sets[component as usize].takes_part = true;
        }
    }

    /// Whether the attempt under way goes on from the steps before.
    fn is_of_second_order(&self) -> bool {
        self.sets.iter().any(|set| set.component.is_of_second_order(0))
    }

    /// Works on the contacts, on the clock of their stage.
    fn with_stage<R>(
        &mut self,
        work: impl FnOnce(&mut IslandContacts, &Shared, &mut Sets<'_>, &mut Counters) -> R,
    ) -> R {
        let Self { shared, sets, stage, workspace, .. } = self;
        let mut watch = Stopwatch::start();
        let result = work(stage, shared, sets, &mut workspace.counters);
        watch.mark(&mut workspace.counters.times.contact);
        result
    }

    /// Works on all sets, side by side where there is enough to share.
    fn each(&mut self, work: impl Fn(&mut ConnectedSet) + Send + Sync) {
        each(self.sets.all(), self.workspace.segments, work);
    }
}

/// Works on all sets, side by side where there is enough to share: so many segments.
pub(super) fn each(sets: &mut [Box<ConnectedSet>], segments: usize, work: impl Fn(&mut ConnectedSet) + Send + Sync) {
    parallel::each(sets, segments_grain(segments), |_, set| work(set));
}

/// Evaluates a set.
fn evaluate_set(set: &mut ConnectedSet, formulation: Formulation) {
    set.attempt.residuals = match set.component.slides() {
        true => Exact::evaluate_sliding(&mut set.component, &mut set.counters),
        false => evaluate(&mut set.component, formulation, &mut set.counters),
    };
}

/// Prediction, guess for the step's start, first evaluation of a set.
pub(super) fn begin_set(
    set: &mut ConnectedSet,
    held_back: bool,
    interval: Interval,
    params: &StepParams,
    guessing: bool,
) {
    set.component.hold_back(held_back);
    set.component.pushed.fill(Spatial::zero());
    set.component.contact_stiffness.fill(Sym3::zero());
    let ConnectedSet { component, projector, exact, counters, .. } = set;
    set.attempt = match projector {
        Projector::Solve { guess: Some(guess), .. } if guessing => begin(component, interval, params, guess, counters),
        _ => begin(component, interval, params, &mut NoGuess, counters),
    };
    if let (true, Some(exact)) = (component.slides(), exact) {
        exact.begin_sliding(component, &mut set.attempt, counters);
    }
    set.takes_part = true;
}

impl Steps for Island<'_> {
    fn attempt(&mut self, interval: Interval, params: &StepParams, guessing: bool, is_last: bool) -> Status {
        self.workspace.end = interval.time + interval.dt;
        if !std::mem::take(&mut self.workspace.is_begun) {
            self.begin(interval, params, guessing);
        }
        self.begin_contacts(params);
        let is_other = self.is_guessed() || self.is_of_second_order();
        if self.stage.bounces() && is_other {
            // A rule of second order would go on with velocities that an impact has turned round, and a guess hides how fast bodies
            // would arrive.
            if self.is_guessed() {
                self.count_dropped();
            }
            self.restart();
            self.roll_back();
            self.begin(interval, params, false);
            self.begin_contacts(params);
        }
        let guessed = self.is_guessed();
        self.sets.iter_mut().filter_map(|set| set.exact.as_mut()).for_each(|exact| exact.begin_attempt());
        let mut contact = self.observe(params, 0);
        self.each(|set| {
            set.attempt.target = set.attempt.target.max(params.contact.joint_tolerance * params.contact_tolerance);
            set.takes_part = true;
            if guessed {
                // Contacts press from the start.
                evaluate_set(set, params.formulation);
            }
        });
        let mut correction = f64::INFINITY;
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
            let is_lost = contact > DIVERGED
                || !is_last
                    && iteration >= params.contact.max_error_after
                    && best * params.contact_tolerance > params.contact.max_error;
            if is_lost || !may_go_on(iteration, now, before, params) {
                return Status::OutOfIterations;
            }
            if now >= before && before.is_finite() {
                self.sets.iter_mut().filter_map(|set| set.exact.as_mut()).for_each(|exact| exact.give_up());
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
                evaluate_set(set, params.formulation);
                watch.mark(&mut set.counters.times.assemble);
            });
            correction = self.judge(correction);
            self.each(|set| match set.component.slides() {
                true => Exact::judge_sliding(&mut set.component, &mut set.attempt),
                false => set.attempt.judge_residuals(&set.component, params.formulation),
            });
        }
        let own = self.sets.iter().map(|set| set.attempt.status(0)).max().unwrap_or(Status::Converged);
        if self.stage.turns_too_far(self.shared) { own.max(Status::OutOfIterations) } else { own }
    }

    fn is_guessed(&self) -> bool {
        self.sets.iter().any(ConnectedSet::is_guessed)
    }

    fn is_hopeless(&self) -> bool {
        self.sets.iter().any(|set| set.is_torn() && set.component.begins_apart())
    }

    fn roll_back(&mut self) {
        for set in self.sets.iter_mut() {
            set.component.roll_back();
            set.component.pushed.fill(Spatial::zero());
        }
        self.stage.roll_back();
    }

    fn has_impact(&self) -> bool {
        let hits = |set: &ConnectedSet| set.component.eyelet_hits();
        self.is_of_second_order() && (self.stage.has_impact() || self.sets.iter().any(hits))
    }

    fn break_joints(&mut self) -> bool {
        self.sets.iter_mut().fold(false, |any, set| set.component.break_joint() | any)
    }

    fn restart(&mut self) {
        self.sets.iter_mut().for_each(|set| set.component.restart());
    }

    fn accept(&mut self, status: Status, params: &StepParams) -> Status {
        let is_off = self.stage.worst() > params.contact.max_error;
        for set in self.sets.iter_mut() {
            let is_kept = !(status.is_stuck() || stays(set, is_off, status, params));
            count_step(&set.attempt, 0, is_kept, &mut set.counters);
        }
        // Contacts alone may be what has not converged.
        let own = self.sets.iter().map(|set| set.attempt.status(0)).max();
        let not_converged = matches!(status, Status::OutOfIterations | Status::TooManyContacts);
        self.workspace.counters.not_converged += u64::from(not_converged && own == Some(Status::Converged));
        if status.is_stuck() {
            self.roll_back();
            return status;
        }
        let status = self.ended(status, params);
        let least = self.sets.iter().map(ConnectedSet::least_status).max();
        if let Some(whole) = self.workspace.whole {
            self.stage.note_strays(self.shared, &self.sets, (self.workspace.end - whole.time) / whole.dt);
        }
        let hits = self.sets.iter().any(|set| set.component.eyelet_hits());
        let begins_anew = self.stage.end_step(self.shared) || hits || status != Status::Converged;
        if let Some(whole) = self.whole {
            let touching = self.stage.slopes(self.shared, &mut self.sets, params.contact_tolerance);
            self.workspace.substeps.extend(Substep::of_all(self.sets.as_slice(), whole, touching, begins_anew));
        }
        for set in self.sets.iter_mut() {
            finish(&mut set.component, params.formulation, 1.0, &mut set.counters);
            if begins_anew {
                set.component.begin_anew(1.0);
            }
        }
        self.workspace.counters.worst_contact = self.workspace.counters.worst_contact.max(self.stage.worst());
        self.workspace.counters.deepest_penetration =
            self.workspace.counters.deepest_penetration.max(self.stage.deepest());
        status.max(least.unwrap_or(status))
    }

    fn counters_mut(&mut self) -> &mut Counters {
        &mut self.workspace.counters
    }

    fn count_dropped(&mut self) {
        self.sets.iter_mut().for_each(ConnectedSet::count_dropped);
    }
}

/// Whether a set stays where it is at the end of a step that ended so: its joints gape, or contacts of its island are off by more
/// than what goes astray, so that bodies may be on the other side of each other.
fn stays(set: &ConnectedSet, is_off: bool, status: Status, params: &StepParams) -> bool {
    status == Status::OutOfIterations && params.max_halvings > 0 && (is_off || set.is_torn())
}

/// The larger of two; not a number if either is not.
fn max_or_nan(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}
