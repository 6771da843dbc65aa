//! Alike sets of segments in the lanes of vector registers.

use std::sync::Arc;

use component::GROUP;
use component::snapshot::StateVisitor;
use component::{Change, Component, Members};
use jointed::linear::direct::Direct;
use jointed::topology::Topology;
use kernels::lane::{Lanes, Real};
use nalgebra::Vector3;
use rod::{Body, JointForce, Model, Pose, State};

use crate::attempt::{Exact, TangentChoice, attempt, attempt_exactly, count_step, finish};
use crate::connected_set::{ConnectedSet, Projector};
use crate::counters::Counters;
use crate::formulation::Tangent;
use crate::start::NoGuess;
use crate::step::{Interval, Status, StepParams};
use crate::step_control;
use crate::substep::Substep;

/// Alike sets of segments, one a lane, solved directly and without guesses. A lane that does not converge goes on alone.
pub(crate) struct LaneBatch {
    component: Component<Lanes<GROUP>>,
    members: Vec<Members>,
    /// How the last step ended, a lane each.
    statuses: Vec<Status>,
    solver: Direct<Lanes<GROUP>>,
    /// The exact tangent, where steps may take it.
    exact: Option<Box<Exact<Lanes<GROUP>>>>,
    /// Which iterations take it, a lane each; empty where all of them do.
    tangents: Vec<TangentChoice>,
    /// The steps that were accepted since they were last taken, a lane each; empty where derivatives do not ask for them.
    substeps: Vec<Vec<Substep>>,
    pub(crate) counters: Counters,
}

impl LaneBatch {
    /// A group over a graph without loops.
    pub(crate) fn new(
        model: &Model,
        state: &State,
        topology: &Arc<Topology>,
        members: Vec<Members>,
        params: &StepParams,
    ) -> Self {
        let lanes: Vec<&Members> = members.iter().collect();
        let mut component = Component::new(model, state, topology.clone(), &lanes);
        component.integrate_by(params.integrator);
        let solver = Direct::for_tree(topology);
        let statuses = vec![Status::Converged; members.len()];
        let exact = if params.may_be_exact() { Exact::new(topology) } else { None };
        let choices = if params.tangent == Tangent::Auto && exact.is_some() { members.len() } else { 0 };
        let tangents = vec![TangentChoice::new(topology); choices];
        Self {
            component,
            members,
            statuses,
            solver,
            exact,
            tangents,
            substeps: Vec::new(),
            counters: Counters::default(),
        }
    }

    /// Whether its sets can go side by side: the exact tangent knows of no bodies that are held in some lanes alone.
    pub(crate) fn goes_together(&self) -> bool {
        self.exact.is_none() || self.component.is_held_alike()
    }

    /// Keeps what derivatives need of each step from now on.
    pub(crate) fn record_substeps(&mut self) {
        self.substeps = vec![Vec::new(); self.members.len()];
    }

    /// Takes what was kept since, set by set.
    pub(crate) fn take_substeps(&mut self) -> impl Iterator<Item = (&Members, Vec<Substep>)> {
        self.members.iter().zip(self.substeps.iter_mut().map(std::mem::take))
    }

    /// Advances over `interval`.
    pub(crate) fn advance(&mut self, interval: Interval, params: &StepParams) -> Status {
        let Self { component, members, statuses, solver, exact, tangents, substeps, counters } = self;
        let result = match exact {
            None => attempt(component, interval, params, solver, &mut NoGuess, counters),
            Some(exact) => {
                attempt_exactly(component, interval, params, (exact.as_mut(), tangents, solver), &mut NoGuess, counters)
            }
        };
        let mut alone: Vec<(usize, ConnectedSet)> = Vec::new();
        let (mut active, mut anew) = (Lanes::splat(1.0), Lanes::splat(-1.0));
        for (lane, members) in members.iter().enumerate() {
            let status = result.status(lane);
            if status == Status::Converged || params.max_halvings == 0 {
                count_step(&result, lane, true, counters);
                statuses[lane] = status;
                if status == Status::NonFinite {
                    component.roll_back_lane(lane);
                    active.set_lane(lane, -1.0);
                } else if status != Status::Converged {
                    anew.set_lane(lane, 1.0);
                }
                continue;
            }
            component.roll_back_lane(lane);
            counters.retries += 1;
            let mut set = single(component, members.clone(), lane);
            take_tangent(&mut set, exact.is_some(), tangents.get(lane));
            set.substeps = (!substeps.is_empty()).then(Vec::new);
            statuses[lane] = step_control::advance_parts(&mut set, interval, 0, params);
            alone.push((lane, set));
        }
        let gapes = Lanes::<GROUP>::dispatch(
            #[inline(always)]
            || component.gapes(),
        );
        let kept = (0..members.len()).filter(|&lane| active.lane(lane) >= 0.0);
        for lane in kept.filter(|lane| alone.iter().all(|(other, _)| other != lane)) {
            if gapes.lane(lane) >= 0.0 {
                statuses[lane] = Status::Apart;
                anew.set_lane(lane, 1.0);
            } else if component.is_past_half_turn(lane, result.target.lane(lane)) {
                statuses[lane] = statuses[lane].max(Status::PastHalfTurn);
            }
        }
        for (lane, substeps) in substeps.iter_mut().enumerate().filter(|(lane, _)| active.lane(*lane) >= 0.0) {
            if alone.iter().all(|(other, _)| *other != lane) {
                substeps.push(Substep::of(component, lane));
            }
        }
        finish(component, params.formulation, active, counters);
        if statuses.iter().any(|status| *status != Status::Converged) {
            component.begin_anew(anew);
        }
        for (lane, set) in alone {
            component.insert_lane(lane, &set.component);
            *counters += set.counters;
            if let (Some(own), Some(choice)) = (tangents.get_mut(lane), set.tangents) {
                *own = choice;
            }
            if let (Some(own), Some(substeps)) = (substeps.get_mut(lane), set.substeps) {
                own.extend(substeps);
            }
        }
        tangents.iter_mut().for_each(TangentChoice::end_step);
        statuses.iter().copied().max().unwrap_or(Status::Converged)
    }

    /// Shows its state to a visitor.
    pub(crate) fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        self.component.visit_state(visitor);
        visitor.size(self.tangents.len());
        self.tangents.iter_mut().for_each(|choice| choice.visit_state(visitor));
    }

    /// Each set with how its last step ended.
    pub(crate) fn statuses(&self) -> impl Iterator<Item = (&Members, Status)> {
        self.members.iter().zip(self.statuses.iter().copied())
    }

    pub(crate) fn lanes(&self) -> usize {
        self.members.len()
    }

    pub(crate) fn store_joint_forces(&self, forces: &mut [JointForce]) {
        for (lane, members) in self.members.iter().enumerate() {
            self.component.store_joint_forces(forces, members, lane);
        }
    }

    pub(crate) fn set_velocities(&mut self, state: &State, time: f64) {
        for (lane, members) in self.members.iter().enumerate() {
            self.component.set_velocities(state, members, lane, time);
        }
    }

    /// Pose of a body of the model, if it is one of these.
    pub(crate) fn pose(&mut self, body: Body) -> Option<Pose> {
        let (lane, body) = self.place(body)?;
        Some(self.component.pose(lane, body))
    }

    /// Holds a body of the model, drives it or lets it go, if it is one of these: returns whether it is.
    pub(crate) fn change(&mut self, body: Body, change: Change<'_>) -> bool {
        let place = self.place(body);
        if let Some((lane, body)) = place {
            self.component.change(lane, body, change);
        }
        place.is_some()
    }

    /// Whether lanes would no longer be alike if one held a segment of the model or, if it `lets_go`, did not: where the
    /// connectivity of all lanes takes it for fixed, and where the exact tangent does, which knows of no body that is held in
    /// some lanes alone.
    pub(crate) fn comes_apart(&self, body: Body, lets_go: bool) -> bool {
        let fixed = &self.component.system.topology.fixed;
        let is_apart = |own: usize| self.exact.is_some() || (lets_go && fixed[own]);
        matches!(body, Body::Segment(_)) && self.place(body).is_some_and(|(_, body)| is_apart(body))
    }

    /// The sets of all lanes one by one, with the same bits from then on; the first has the counters of all.
    pub(crate) fn apart(&mut self) -> impl Iterator<Item = ConnectedSet> {
        let Self { component, members, exact, tangents, substeps, counters, .. } = self;
        members.iter().enumerate().map(move |(lane, members)| {
            let mut set = single(component, members.clone(), lane);
            take_tangent(&mut set, exact.is_some(), tangents.get(lane));
            set.substeps = substeps.get(lane).cloned();
            set.counters = std::mem::take(counters);
            set
        })
    }

    /// Lane and body of a body of the model.
    fn place(&self, body: Body) -> Option<(usize, usize)> {
        self.members.iter().enumerate().find_map(|(lane, members)| Some((lane, members.body(body)?)))
    }

    /// Changes the rest of a joint of the model, if it is one of these.
    pub(crate) fn set_rest(&mut self, joint: usize, rest: &Vector3<f64>) {
        for (lane, members) in self.members.iter().enumerate() {
            if let Ok(place) = members.joints.binary_search(&joint) {
                self.component.set_rest(lane, place, rest);
            }
        }
    }

    pub(crate) fn component_mut(&mut self) -> &mut Component<Lanes<GROUP>> {
        &mut self.component
    }

    pub(crate) fn store(&self, state: &mut State) {
        for (lane, members) in self.members.iter().enumerate() {
            self.component.store_state(state, members, lane);
        }
    }
}

/// The set of one lane on its own.
fn single(component: &Component<Lanes<GROUP>>, members: Members, lane: usize) -> ConnectedSet {
    let single = component.extract_lane(lane);
    let solver = Box::new(Direct::for_tree(&single.system.topology));
    ConnectedSet::new(single, members, Projector::Solve { solver, guess: None })
}

/// Lets a set on its own take the exact tangent as its lane does.
fn take_tangent(set: &mut ConnectedSet, is_exact: bool, choice: Option<&TangentChoice>) {
    if is_exact {
        set.exact = Exact::new(&set.component.system.topology);
        set.tangents = choice.cloned();
    }
}
