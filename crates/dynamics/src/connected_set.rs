//! One connected set of segments with what projects its constraints.

use std::sync::Arc;

use component::APART;
use component::snapshot::StateVisitor;
use component::{Change, Component, Members, Residuals};
use contact::motion_bound::MotionBounds;
use jointed::linear::LinearSolver;
use jointed::linear::articulated::Side;
use jointed::linear::compliance::Compliance;
use jointed::linear::solvers::{SolverError, SolverKind};
use jointed::topology::Topology;
use kernels::Spatial;
use nalgebra::Vector3;
use rod::{Body, Pose, State};

use crate::attempt::{Attempt, Exact, TangentChoice, attempt, attempt_exactly, count_step, finish};
use crate::counters::{Counters, Stopwatch};
use crate::guess::InitialGuess;
use crate::projection::Predictor;
use crate::start::{NoGuess, Start, StepGuess};
use crate::step::{Interval, Status, StepParams};
use crate::step_control::{self, Steps};
use crate::substep::Substep;

/// What projects the constraints in an outer iteration (line 9 of Algorithm 1).
pub(crate) enum Projector {
    /// A linear solve, from a start or from zero.
    Solve { solver: Box<dyn LinearSolver>, guess: Option<Box<dyn InitialGuess>> },
    /// A prediction in its place.
    Predict(Predictor),
}

/// What contacts need of a connected set.
pub(crate) struct Touch {
    /// Number of the set in the model.
    pub(crate) number: u32,
    /// How its bodies answer impulses.
    pub(crate) response: Compliance,
    /// Memory for the sides of contacts that push it.
    pub(crate) sides: Vec<Side>,
    /// Corrections of the rods' own solve.
    pub(crate) corrections: Vec<Spatial<f64>>,
    /// How far its bodies have moved, one entry a body.
    pub(crate) ways: Vec<MotionBounds>,
}

impl Touch {
    /// What contacts need of set `number`, before its first step.
    pub(crate) fn new(number: u32, response: Compliance) -> Self {
        Self { number, response, sides: Vec::new(), corrections: Vec::new(), ways: Vec::new() }
    }
}

/// One connected set of segments.
pub(crate) struct ConnectedSet {
    pub(crate) component: Component<f64>,
    pub(crate) members: Members,
    pub(crate) projector: Projector,
    /// The exact tangent, where steps may take it.
    pub(crate) exact: Option<Box<Exact<f64>>>,
    /// Which iterations take it; `None` where all of them do.
    pub(crate) tangents: Option<TangentChoice>,
    pub(crate) counters: Counters,
    /// The last attempt at a step.
    pub(crate) attempt: Attempt<f64>,
    /// Whether contacts pushed it in the last outer iteration, so that it takes part in the next.
    pub(crate) takes_part: bool,
    /// How the last step ended.
    pub(crate) status: Status,
    /// What contacts need of it; `None` where nothing can touch.
    pub(crate) touch: Option<Box<Touch>>,
    /// The steps that were accepted since they were last taken, where derivatives ask for them.
    pub(crate) substeps: Option<Vec<Substep>>,
}

impl ConnectedSet {
    pub(crate) fn new(component: Component<f64>, members: Members, projector: Projector) -> Self {
        let residuals = Residuals { stretch: 0.0, bend: 0.0, momentum: 0.0, check: 0.0 };
        let attempt =
            Attempt { residuals, error: 0.0, target: 0.0, correction: 0.0, unsolved: 0.0, start: Start::Prediction };
        Self {
            component,
            members,
            projector,
            exact: None,
            tangents: None,
            counters: Counters::default(),
            attempt,
            takes_part: true,
            status: Status::Converged,
            touch: None,
            substeps: None,
        }
    }

    /// Advances over `interval`, on its own.
    pub(crate) fn advance(&mut self, interval: Interval, params: &StepParams) -> Status {
        self.status = step_control::advance(self, interval, 0, params);
        self.observe_step();
        self.status
    }

    /// Shows the guess and the choice of the tangent the end of a step.
    pub(crate) fn observe_step(&mut self) {
        if let Some(tangents) = &mut self.tangents {
            tangents.end_step();
        }
        if let Projector::Solve { guess: Some(guess), .. } = &mut self.projector {
            let mut watch = Stopwatch::start();
            guess.observe_step(&self.component);
            watch.mark(&mut self.counters.times.guess);
        }
    }

    /// Whether the last attempt began at a guess.
    pub(crate) fn is_guessed(&self) -> bool {
        self.attempt.start != Start::Prediction
    }

    /// Counts a guess that the last attempt began at as dropped.
    pub(crate) fn count_dropped(&mut self) {
        self.counters.guesses_dropped += u64::from(self.attempt.start == Start::Guess);
    }

    /// How a step ended whose attempt ended so: with joints apart where they gape. Predictions in the place of solves answer
    /// with no forces.
    pub(crate) fn ended(&self, status: Status) -> Status {
        let is_solved = matches!(self.projector, Projector::Solve { .. });
        let gapes = self.component.gapes();
        if is_solved && gapes >= 0.0 { status.max(Status::Apart) } else { status }
    }

    /// What the status of the last attempt is at least: a joint may have turned past half a turn. The step stands, and those after it go on from it.
    pub(crate) fn least_status(&self) -> Status {
        let is_past = self.component.is_past_half_turn(0, self.attempt.target);
        if is_past { Status::PastHalfTurn } else { Status::Converged }
    }

    /// Whether the last attempt leaves joints apart or askew by more than a tenth.
    pub(crate) fn is_torn(&self) -> bool {
        let residuals = &self.attempt.residuals;
        matches!(self.projector, Projector::Solve { .. }) && residuals.stretch.max(residuals.bend) > APART
    }

    pub(crate) fn store(&self, state: &mut State) {
        self.component.store_state(state, &self.members, 0);
    }

    pub(crate) fn set_velocities(&mut self, state: &State, time: f64) {
        self.component.set_velocities(state, &self.members, 0, time);
    }

    /// Changes the rest of a joint of the model, if it is one of these.
    pub(crate) fn set_rest(&mut self, joint: usize, rest: &Vector3<f64>) {
        if let Ok(place) = self.members.joints.binary_search(&joint) {
            self.component.set_rest(0, place, rest);
        }
    }

    /// Shows a visitor the component and what its guess and the choice of its tangent have learned; solvers and predictions have no memory.
    pub(crate) fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        self.component.visit_state(visitor);
        if self.touch.is_some() {
            // Tells its snapshots from those without what follows.
            visitor.size(6);
        }
        visitor.size(usize::from(self.tangents.is_some()));
        if let Some(tangents) = &mut self.tangents {
            tangents.visit_state(visitor);
        }
        match &mut self.projector {
            Projector::Solve { guess: None, .. } => visitor.size(0),
            Projector::Solve { guess: Some(guess), .. } => {
                visitor.size(1);
                guess.visit_state(visitor);
            }
            Projector::Predict(_) => visitor.size(2),
        }
    }

    /// Pose of a body of the model, if it is one of these.
    pub(crate) fn pose(&mut self, body: Body) -> Option<Pose> {
        self.members.body(body).map(|body| self.component.pose(0, body))
    }

    /// Holds a body of the model, drives it or lets it go, if it is one of these: returns whether it is. A segment that the
    /// connectivity takes for fixed couples its joints from then on, for which the `solver` is made anew. A guess stays: what
    /// it knows of the last steps costs iterations at worst.
    ///
    /// # Errors
    /// If the factor would be too large.
    pub(crate) fn change(&mut self, body: Body, change: Change<'_>, solver: SolverKind) -> Result<bool, SolverError> {
        let Some(own) = self.members.body(body) else { return Ok(false) };
        if let (Body::Segment(_), Change::LetGo) = (body, change)
            && self.component.system.topology.fixed[own]
        {
            let old = &self.component.system.topology;
            let mut fixed = old.fixed.clone();
            fixed[own] = false;
            let topology = Topology::new(old.joints.clone(), fixed);
            if let (Projector::Solve { solver: old, .. }, Some(new)) =
                (&mut self.projector, solver.factored(&topology)?)
            {
                *old = new;
            }
            if self.exact.is_some() {
                self.exact = Exact::new(&topology);
                self.tangents = self.tangents.take().filter(|_| self.exact.is_some());
            }
            self.component.system.topology = Arc::new(topology);
        }
        self.component.change(0, own, change);
        Ok(true)
    }
}

impl Steps for ConnectedSet {
    fn attempt(&mut self, interval: Interval, params: &StepParams, guessing: bool, _is_last: bool) -> Status {
        let Self { component, projector, exact, tangents, counters, .. } = self;
        let mut none = NoGuess;
        let (solver, guess): (_, &mut dyn StepGuess<f64>) = match projector {
            Projector::Solve { solver, guess: Some(guess) } if guessing => (solver.as_mut(), guess),
            Projector::Solve { solver, .. } => (solver.as_mut(), &mut none),
            Projector::Predict(predictor) => {
                self.attempt = predictor.attempt(component, interval, params, counters);
                return self.attempt.status(0);
            }
        };
        self.attempt = match exact {
            Some(exact) if component.slides() => exact.attempt_sliding(component, interval, params, guess, counters),
            None => attempt(component, interval, params, solver, guess, counters),
            Some(exact) => attempt_exactly(
                component,
                interval,
                params,
                (exact.as_mut(), tangents.as_mut_slice(), solver),
                guess,
                counters,
            ),
        };
        self.attempt.status(0)
    }

    fn is_guessed(&self) -> bool {
        self.is_guessed()
    }

    fn roll_back(&mut self) {
        self.component.roll_back();
    }

    fn break_joints(&mut self) -> bool {
        self.component.break_joint()
    }

    fn restart(&mut self) {
        self.component.restart();
    }

    fn accept(&mut self, status: Status, params: &StepParams) -> Status {
        count_step(&self.attempt, 0, !status.is_stuck(), &mut self.counters);
        if status.is_stuck() {
            self.component.roll_back();
            return status;
        }
        let (status, least) = (self.ended(status), self.least_status());
        if let Some(substeps) = &mut self.substeps {
            substeps.push(Substep::of(&self.component, 0));
        }
        let hits = self.component.eyelet_hits();
        finish(&mut self.component, params.formulation, 1.0, &mut self.counters);
        if hits || status != Status::Converged {
            self.component.begin_anew(1.0);
        }
        status.max(least)
    }

    fn counters_mut(&mut self) -> &mut Counters {
        &mut self.counters
    }

    fn count_dropped(&mut self) {
        self.count_dropped();
    }
}
