//! Alike sets of segments in the lanes of vector registers.

use std::sync::Arc;

use rod::{Driven, JointForce, Model, State};

use crate::attempt::{attempt, count_step, finish};
use crate::component::{Component, Members};
use crate::connected_set::{ConnectedSet, Projector};
use crate::counters::Counters;
use crate::integrator::Integrator;
use crate::kernel::lane::{Lanes, Real};
use crate::limits::GROUP;
use crate::linear::direct::Direct;
use crate::retry;
use crate::start::NoGuess;
use crate::step::{Interval, Status, StepParams};
use crate::topology::Topology;

/// Alike sets of segments, one a lane, solved directly and without guesses. A lane that does not converge goes on alone.
pub(crate) struct Group {
    component: Component<Lanes<GROUP>>,
    members: Vec<Members>,
    solver: Direct<Lanes<GROUP>>,
    pub(crate) counters: Counters,
}

impl Group {
    /// A group over a graph without loops.
    pub(crate) fn new(
        model: &Model,
        state: &State,
        topology: &Arc<Topology>,
        members: Vec<Members>,
        integrator: Integrator,
    ) -> Self {
        let lanes: Vec<&Members> = members.iter().collect();
        let mut component = Component::new(model, state, topology.clone(), &lanes);
        component.integrate_by(integrator);
        let solver = Direct::for_tree(topology);
        Self { component, members, solver, counters: Counters::default() }
    }

    /// Advances over `interval`.
    pub(crate) fn advance(&mut self, interval: Interval, params: &StepParams) -> Status {
        let Self { component, members, solver, counters } = self;
        let result = attempt(component, interval, params, solver, &mut NoGuess, counters);
        let mut worst = Status::Converged;
        let mut alone: Vec<(usize, ConnectedSet)> = Vec::new();
        let (mut active, mut anew) = (Lanes::splat(1.0), Lanes::splat(-1.0));
        for (lane, members) in members.iter().enumerate() {
            let status = result.status(lane);
            if status == Status::Converged || params.max_halvings == 0 {
                count_step(&result, lane, counters);
                worst = worst.max(status);
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
            let single = component.extract_lane(lane);
            let solver = Box::new(Direct::for_tree(&single.system.topology));
            let mut set = ConnectedSet::new(single, members.clone(), Projector::Solve { solver, guess: None });
            worst = worst.max(retry::advance_halves(&mut set, interval, 0, params));
            alone.push((lane, set));
        }
        finish(component, params.formulation, active, counters);
        if worst != Status::Converged {
            component.begin_anew(anew);
        }
        for (lane, set) in alone {
            component.insert_lane(lane, &set.component);
            *counters += set.counters;
        }
        worst
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

    pub(crate) fn drive(&mut self, driven: &Driven) {
        for (lane, members) in self.members.iter().enumerate() {
            if let Some(body) = members.body(driven.body) {
                self.component.drive(lane, body, driven);
            }
        }
    }

    pub(crate) fn store(&self, state: &mut State) {
        for (lane, members) in self.members.iter().enumerate() {
            self.component.store_state(state, members, lane);
        }
    }
}
