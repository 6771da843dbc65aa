//! What is stepped as one piece: a connected set of segments, or a group of alike ones in lanes.

use std::sync::Arc;

use rod::{JointForce, Model, State};

use crate::component::{Component, Members};
use crate::counters::{Counters, Stopwatch};
use crate::formulation::Formulation;
use crate::guess::InitialGuess;
use crate::kernel::dispatch::vectorized;
use crate::kernel::lane::{Lanes, Real};
use crate::linear::LinearSolver;
use crate::linear::direct::Direct;
use crate::projection::Predictor;
use crate::simulation::GROUP;
use crate::step::{Attempt, Interval, NoGuess, Start, Status, StepGuess, StepParams, attempt};
use crate::topology::Topology;
use crate::touching::Touching;

/// A piece of the simulation that needs no other to be stepped.
pub(crate) enum Unit {
    Single(Box<Single>),
    Group(Box<Group>),
    Touching(Box<Touching>),
}

impl Unit {
    pub(crate) fn advance(&mut self, interval: Interval, params: &StepParams) {
        match self {
            Unit::Single(single) => single.advance(interval, params),
            Unit::Group(group) => group.advance(interval, params),
            Unit::Touching(touching) => touching.advance(interval, params),
        }
    }

    pub(crate) fn status(&self) -> Status {
        match self {
            Unit::Single(single) => single.status,
            Unit::Group(group) => group.status,
            Unit::Touching(touching) => touching.status,
        }
    }

    pub(crate) fn store(&self, state: &mut State) {
        match self {
            Unit::Single(single) => single.store(state),
            Unit::Group(group) => group.store(state),
            Unit::Touching(touching) => touching.units.iter().for_each(|unit| unit.store(state)),
        }
    }

    pub(crate) fn store_joint_forces(&self, forces: &mut [JointForce]) {
        let of_single = |single: &Single, forces: &mut [JointForce]| {
            single.component.store_joint_forces(forces, &single.members, 0);
        };
        match self {
            Unit::Single(single) => of_single(single, forces),
            Unit::Group(group) => {
                for (lane, members) in group.members.iter().enumerate() {
                    group.component.store_joint_forces(forces, members, lane);
                }
            }
            Unit::Touching(touching) => touching.units.iter().for_each(|single| of_single(single, forces)),
        }
    }

    pub(crate) fn set_velocities(&mut self, state: &State, time: f64) {
        match self {
            Unit::Single(single) => single.set_velocities(state, time),
            Unit::Group(group) => {
                for (lane, members) in group.members.iter().enumerate() {
                    group.component.set_velocities(state, members, lane, time);
                }
            }
            Unit::Touching(touching) => touching.units.iter_mut().for_each(|unit| unit.set_velocities(state, time)),
        }
    }

    pub(crate) fn counters(&self) -> Counters {
        match self {
            Unit::Single(single) => single.counters,
            Unit::Group(group) => group.counters,
            Unit::Touching(touching) => touching.counters(),
        }
    }

    pub(crate) fn lanes(&self) -> usize {
        match self {
            Unit::Single(_) => 1,
            Unit::Group(group) => group.members.len(),
            Unit::Touching(touching) => touching.units.len(),
        }
    }
}

/// What line 9 of Algorithm 1 is for one connected set of segments.
pub(crate) enum Line9 {
    /// A linear solve, from a start or from zero.
    Solved { solver: Box<dyn LinearSolver>, guess: Option<Box<dyn InitialGuess>> },
    /// A prediction in its place.
    Predicted(Predictor),
}

/// One connected set of segments with what projects its constraints.
pub(crate) struct Single {
    pub(crate) component: Component<f64>,
    pub(crate) members: Members,
    pub(crate) line9: Line9,
    pub(crate) counters: Counters,
    status: Status,
}

impl Single {
    fn store(&self, state: &mut State) {
        self.component.store_state(state, &self.members, 0);
    }

    fn set_velocities(&mut self, state: &State, time: f64) {
        self.component.set_velocities(state, &self.members, 0, time);
    }

    pub(crate) fn new(component: Component<f64>, members: Members, line9: Line9) -> Self {
        Self { component, members, line9, counters: Counters::default(), status: Status::Converged }
    }

    fn advance(&mut self, interval: Interval, params: &StepParams) {
        let Self { component, line9, counters, .. } = self;
        self.status = match line9 {
            Line9::Solved { solver, guess: Some(guess) } => {
                let status = advance(component, interval, 0, params, solver.as_mut(), guess, counters);
                let mut watch = Stopwatch::start();
                guess.observe_step(component);
                watch.mark(&mut counters.times.guess);
                status
            }
            Line9::Solved { solver, guess: None } => {
                advance(component, interval, 0, params, solver.as_mut(), &mut NoGuess, counters)
            }
            Line9::Predicted(predictor) => predictor.advance(component, interval, params, counters),
        };
    }
}

/// Steps over `interval`; where that does not converge, from the prediction if it was begun at a guess, else in two halves,
/// `halvings` deep so far.
fn advance(
    component: &mut Component<f64>,
    interval: Interval,
    halvings: u32,
    params: &StepParams,
    solver: &mut dyn LinearSolver,
    guess: &mut dyn StepGuess<f64>,
    counters: &mut Counters,
) -> Status {
    let mut result = attempt(component, interval, params, solver, guess, counters);
    if result.start != Start::Prediction && result.status(0) != Status::Converged {
        component.roll_back();
        if result.start == Start::Guess {
            counters.guesses_used -= 1;
            counters.guesses_dropped += 1;
        }
        result = attempt(component, interval, params, solver, &mut NoGuess, counters);
    }
    let status = result.status(0);
    if status != Status::Converged && halvings < params.max_halvings {
        component.roll_back();
        counters.retries += 1;
        return halves(component, interval, halvings, params, solver, guess, counters);
    }
    accept(&result, 0, counters);
    if status == Status::NonFinite {
        component.roll_back();
    } else {
        finish(component, params.formulation, 1.0, counters);
    }
    status
}

fn halves(
    component: &mut Component<f64>,
    interval: Interval,
    halvings: u32,
    params: &StepParams,
    solver: &mut dyn LinearSolver,
    guess: &mut dyn StepGuess<f64>,
    counters: &mut Counters,
) -> Status {
    let mut worst = Status::ConvergedInSubsteps;
    for half in interval.halves() {
        worst = worst.max(advance(component, half, halvings + 1, params, solver, guess, counters));
        if worst == Status::NonFinite {
            break;
        }
    }
    worst
}

pub(crate) fn finish<T: Real>(
    component: &mut Component<T>,
    formulation: Formulation,
    active: T,
    counters: &mut Counters,
) {
    let mut watch = Stopwatch::start();
    vectorized(
        #[inline(always)]
        || component.update_velocities(formulation, active),
    );
    watch.mark(&mut counters.times.predict);
}

pub(crate) fn accept<T: Real>(result: &Attempt<T>, lane: usize, counters: &mut Counters) {
    counters.steps += 1;
    match result.status(lane) {
        Status::NonFinite => counters.non_finite += 1,
        status => {
            counters.not_converged += u64::from(status == Status::OutOfIterations);
            let residuals = &result.residuals;
            counters.worst_stretch = counters.worst_stretch.max(residuals.stretch.lane(lane));
            counters.worst_bend = counters.worst_bend.max(residuals.bend.lane(lane));
            counters.worst_momentum = counters.worst_momentum.max(residuals.momentum.lane(lane));
        }
    }
}

/// Alike sets of segments, one a lane, solved directly and without guesses. A lane that does not converge goes on alone.
pub(crate) struct Group {
    component: Component<Lanes<GROUP>>,
    members: Vec<Members>,
    solver: Direct<Lanes<GROUP>>,
    counters: Counters,
    status: Status,
}

impl Group {
    /// A group over a graph without loops.
    pub(crate) fn new(model: &Model, state: &State, topology: &Arc<Topology>, members: Vec<Members>) -> Self {
        let lanes: Vec<&Members> = members.iter().collect();
        let component = Component::new(model, state, topology.clone(), &lanes);
        let solver = Direct::for_tree(topology);
        Self { component, members, solver, counters: Counters::default(), status: Status::Converged }
    }

    fn advance(&mut self, interval: Interval, params: &StepParams) {
        let Self { component, solver, counters, .. } = self;
        let result = attempt(component, interval, params, solver, &mut NoGuess, counters);
        self.status = Status::Converged;
        let mut alone: Vec<(usize, Component<f64>)> = Vec::new();
        let mut active = Lanes::splat(1.0);
        for lane in 0..self.members.len() {
            if result.status(lane) == Status::Converged || params.max_halvings == 0 {
                accept(&result, lane, counters);
                self.status = self.status.max(result.status(lane));
                if result.status(lane) == Status::NonFinite {
                    component.roll_back_lane(lane);
                    active.set_lane(lane, -1.0);
                }
                continue;
            }
            component.roll_back_lane(lane);
            let mut single = component.extract_lane(lane);
            let mut solver = Direct::for_tree(&single.system.topology);
            counters.retries += 1;
            let status = halves(&mut single, interval, 0, params, &mut solver, &mut NoGuess, counters);
            self.status = self.status.max(status);
            alone.push((lane, single));
        }
        finish(component, params.formulation, active, counters);
        for (lane, single) in alone {
            component.insert_lane(lane, &single);
        }
    }

    fn store(&self, state: &mut State) {
        for (lane, members) in self.members.iter().enumerate() {
            self.component.store_state(state, members, lane);
        }
    }
}
