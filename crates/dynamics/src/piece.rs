//! What a simulation steps as one piece, needing no other: a connected set, alike ones in lanes, or all that can touch.

use component::snapshot::StateVisitor;
use component::{Change, Members};
use jointed::linear::solvers::{SolverError, SolverKind};
use nalgebra::Vector3;
use rod::ContactForce;
use rod::{Body, Carried, JointForce, Pose, State};

use crate::connected_set::ConnectedSet;
use crate::contact_world::ContactWorld;
use crate::counters::Counters;
use crate::lane_batch::LaneBatch;
use crate::step::{Interval, Status, StepParams};
use crate::substep::Substep;

/// A piece of the simulation.
pub(crate) enum Piece {
    Single(Box<ConnectedSet>),
    LaneBatch(Box<LaneBatch>),
    ContactWorld(Box<ContactWorld>),
}

impl LaneBatch {
    /// The group, or its sets one by one where they cannot go side by side.
    pub(crate) fn into_pieces(mut self) -> Vec<Piece> {
        if self.goes_together() {
            return vec![Piece::LaneBatch(Box::new(self))];
        }
        self.apart().map(|set| Piece::Single(Box::new(set))).collect()
    }
}

impl Piece {
    pub(crate) fn advance(&mut self, interval: Interval, params: &StepParams) -> Status {
        match self {
            Piece::Single(set) => set.advance(interval, params),
            Piece::LaneBatch(group) => group.advance(interval, params),
            Piece::ContactWorld(sets) => sets.advance(interval, params),
        }
    }

    /// The connected sets that are stepped one by one.
    pub(crate) fn singles(&self) -> &[Box<ConnectedSet>] {
        match self {
            Piece::Single(set) => std::slice::from_ref(set),
            Piece::LaneBatch(_) => &[],
            Piece::ContactWorld(sets) => &sets.sets,
        }
    }

    /// The same, to change them.
    pub(crate) fn singles_mut(&mut self) -> &mut [Box<ConnectedSet>] {
        match self {
            Piece::Single(set) => std::slice::from_mut(set),
            Piece::LaneBatch(_) => &mut [],
            Piece::ContactWorld(sets) => &mut sets.sets,
        }
    }

    /// Keeps what derivatives need of each step from now on; `whole` are all segments as one set.
    pub(crate) fn record_substeps(&mut self, whole: &Members) {
        match self {
            Piece::Single(set) => set.substeps = Some(Vec::new()),
            Piece::ContactWorld(sets) => sets.substeps = Some((whole.clone(), Vec::new())),
            Piece::LaneBatch(group) => group.record_substeps(),
        }
    }

    /// Takes what was kept since, of which segments.
    pub(crate) fn take_substeps(&mut self) -> Vec<(&Members, Vec<Substep>)> {
        match self {
            Piece::Single(set) => {
                let kept = set.substeps.as_mut().map(std::mem::take);
                kept.into_iter().map(|kept| (&set.members, kept)).collect()
            }
            Piece::ContactWorld(sets) => {
                let kept = sets.substeps.iter_mut();
                kept.map(|(whole, kept)| (&*whole, std::mem::take(kept))).collect()
            }
            Piece::LaneBatch(group) => group.take_substeps().collect(),
        }
    }

    pub(crate) fn store(&self, state: &mut State) {
        match self {
            Piece::LaneBatch(group) => group.store(state),
            piece => piece.singles().iter().for_each(|set| set.store(state)),
        }
    }

    pub(crate) fn store_joint_forces(&self, forces: &mut [JointForce]) {
        match self {
            Piece::LaneBatch(group) => group.store_joint_forces(forces),
            piece => {
                piece.singles().iter().for_each(|set| set.component.store_joint_forces(forces, &set.members, 0));
            }
        }
    }

    /// Takes the velocities of `state` at `time` [s].
    pub(crate) fn set_velocities(&mut self, state: &State, time: f64) {
        match self {
            Piece::Single(set) => set.set_velocities(state, time),
            Piece::LaneBatch(group) => group.set_velocities(state, time),
            Piece::ContactWorld(sets) => sets.sets.iter_mut().for_each(|set| set.set_velocities(state, time)),
        }
    }

    /// Pose of a body of the model, if it is one of these; of an open grip where it would close now.
    pub(crate) fn pose(&mut self, body: Body) -> Option<Pose> {
        match self {
            Piece::Single(set) => set.pose(body),
            Piece::LaneBatch(group) => group.pose(body),
            Piece::ContactWorld(sets) => sets.sets.iter_mut().find_map(|set| set.pose(body)),
        }
    }

    /// Holds a body of the model, drives it or lets it go, if it is one of these: returns whether it is. `solver` is what
    /// solves the sets that are stepped one by one.
    ///
    /// # Errors
    /// If the factor of the set would be too large.
    pub(crate) fn change(&mut self, body: Body, change: Change<'_>, solver: SolverKind) -> Result<bool, SolverError> {
        match self {
            Piece::Single(set) => set.change(body, change, solver),
            Piece::LaneBatch(group) => Ok(group.change(body, change)),
            Piece::ContactWorld(sets) => sets.change(body, change, solver),
        }
    }

    /// Lets a motion drive an obstacle; returns whether there is such an obstacle.
    pub(crate) fn drive_obstacle(&mut self, index: usize, motion: &Carried) -> bool {
        match self {
            Piece::ContactWorld(sets) => sets.drive_obstacle(index, motion),
            Piece::Single(_) | Piece::LaneBatch(_) => false,
        }
    }

    /// Changes a load of the model, if it is on one of these segments.
    pub(crate) fn set_load(&mut self, index: usize, force: &Vector3<f64>, torque: &Vector3<f64>) {
        match self {
            Piece::Single(set) => set.component.set_load(index, force, torque),
            Piece::LaneBatch(group) => group.component_mut().set_load(index, force, torque),
            Piece::ContactWorld(sets) => {
                sets.sets.iter_mut().for_each(|set| set.component.set_load(index, force, torque));
            }
        }
    }

    /// Changes the rest of a joint of the model, if it is one of these.
    pub(crate) fn set_rest(&mut self, joint: usize, rest: &Vector3<f64>) {
        match self {
            Piece::Single(set) => set.set_rest(joint, rest),
            Piece::LaneBatch(group) => group.set_rest(joint, rest),
            Piece::ContactWorld(sets) => sets.sets.iter_mut().for_each(|set| set.set_rest(joint, rest)),
        }
    }

    /// Changes gravity [m/s^2].
    pub(crate) fn set_gravity(&mut self, gravity: &Vector3<f64>) {
        match self {
            Piece::Single(set) => set.component.set_gravity(gravity),
            Piece::LaneBatch(group) => group.component_mut().set_gravity(gravity),
            Piece::ContactWorld(sets) => sets.set_gravity(gravity),
        }
    }

    /// Lets the next step be one of Euler's rule.
    pub(crate) fn restart(&mut self) {
        match self {
            Piece::Single(set) => set.component.restart(),
            Piece::LaneBatch(group) => group.component_mut().restart(),
            Piece::ContactWorld(sets) => sets.restart(),
        }
    }

    /// Copies how the last step ended for each segment of these.
    pub(crate) fn store_statuses(&self, statuses: &mut [Status]) {
        let mut store = |members: &Members, status: Status| members.segments.iter().for_each(|&i| statuses[i] = status);
        match self {
            Piece::LaneBatch(group) => group.statuses().for_each(|(members, status)| store(members, status)),
            piece => piece.singles().iter().for_each(|set| store(&set.members, set.status)),
        }
    }

    /// Adds what contacts give the segments.
    pub(crate) fn store_contact_forces(&self, forces: &mut Vec<ContactForce>) {
        if let Piece::ContactWorld(sets) = self {
            forces.extend(sets.contact_forces());
        }
    }

    /// Shows a visitor all that the next step depends on.
    pub(crate) fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        visitor.size(self.sets());
        match self {
            Piece::Single(set) => set.visit_state(visitor),
            Piece::LaneBatch(group) => group.visit_state(visitor),
            Piece::ContactWorld(sets) => sets.visit_state(visitor),
        }
    }

    pub(crate) fn counters(&self) -> Counters {
        match self {
            Piece::Single(set) => set.counters,
            Piece::LaneBatch(group) => group.counters,
            Piece::ContactWorld(sets) => sets.counters(),
        }
    }

    /// Number of connected sets.
    pub(crate) fn sets(&self) -> usize {
        match self {
            Piece::LaneBatch(group) => group.lanes(),
            piece => piece.singles().len(),
        }
    }
}
