//! Many simulations side by side: copies of a model that differ in numbers, states, motions and loads, or in all.
//!
//! Copies in the same world (gravity, damping, air) become one model, whose alike rods move in the lanes of vector registers
//! and whose sets are shared among threads. Copies with contacts are simulations of their own, as they must not touch
//! each other.

use std::ops::Range;
use std::sync::Arc;

use component::snapshot::Snapshot;
use kernels::parallel;
use nalgebra::Vector3;
use rod::{Body, Change, Changing, Contacts, Driven, JointForce, Model, Motion, State};

use crate::counters::Counters;
use crate::simulation::{ContactForce, GuessFactory, Settings, Simulation, SimulationError, StepReport};
use crate::step::Status;

/// Simulations that are stepped together, each a copy. Each has the bits that it has alone.
///
/// Bodies, joints and loads of a copy have the indices that they have in its own model.
pub struct Batch {
    worlds: Vec<World>,
    copies: Vec<Place>,
}

/// Copies in one model.
struct World {
    simulation: Simulation,
    /// All that moves, and what joints transmit, as of the last look.
    state: State,
    forces: Vec<JointForce>,
    statuses: Vec<Status>,
    /// Whether state, forces and statuses are those of the last step.
    looked_at: [bool; 3],
}

/// Where a copy is in its world.
struct Place {
    world: usize,
    segments: Range<usize>,
    joints: Range<usize>,
    anchors: Range<usize>,
    loads: Range<usize>,
}

impl Batch {
    /// A simulation for each of `copies`, a model and its first state.
    ///
    /// # Errors
    /// [`SimulationError::Copy`], with the first copy that is not valid and why; otherwise as [`Simulation::new`].
    pub fn new(
        copies: &[(&Model, &State)],
        settings: &Settings,
        guess: Option<GuessFactory<'_>>,
    ) -> Result<Self, SimulationError> {
        let mut models: Vec<(Model, State)> = Vec::new();
        // Rods of each.
        let mut rods: Vec<usize> = Vec::new();
        let mut places = Vec::with_capacity(copies.len());
        for (index, &(model, state)) in copies.iter().enumerate() {
            let wrong = |source: SimulationError| SimulationError::Copy { index, source: Box::new(source) };
            model.validate(state).map_err(|error| wrong(error.into()))?;
            let world = models.iter().position(|(other, _)| share_world(other, model)).unwrap_or(models.len());
            if world == models.len() {
                let alone = Model {
                    gravity: model.gravity,
                    damping: model.damping,
                    contacts: Contacts { sheaths: Vec::new(), ..model.contacts.clone() },
                    air: model.air.clone(),
                    changes: gravity_of(model).cloned().collect(),
                    ..Model::default()
                };
                models.push((alone, State::default()));
                rods.push(0);
            }
            let (all, states) = &mut models[world];
            let before = [all.segments.len(), all.joints.len(), all.anchors.len(), all.loads.len()];
            let laws = all.laws.len();
            all.append_after(rods[world], model);
            rods[world] += model.rods();
            states.append(state, laws);
            places.push(Place {
                world,
                segments: before[0]..all.segments.len(),
                joints: before[1]..all.joints.len(),
                anchors: before[2]..all.anchors.len(),
                loads: before[3]..all.loads.len(),
            });
        }
        let world = |(index, (model, state)): (usize, (Model, State))| {
            let simulation = Simulation::new(&model, &state, settings, guess).map_err(|source| {
                let index = places.iter().position(|copy: &Place| copy.world == index).unwrap_or_default();
                SimulationError::Copy { index, source: Box::new(source) }
            })?;
            let forces = vec![JointForce::default(); model.joints.len()];
            let statuses = vec![Status::Converged; state.len()];
            Ok(World { simulation, state, forces, statuses, looked_at: [false; 3] })
        };
        let worlds = models.into_iter().enumerate().map(world).collect::<Result<_, SimulationError>>()?;
        Ok(Self { worlds, copies: places })
    }

    /// Number of copies.
    pub fn len(&self) -> usize {
        self.copies.len()
    }

    /// Whether there is no copy.
    pub fn is_empty(&self) -> bool {
        self.copies.is_empty()
    }

    /// Advances all copies by `dt` [s], as [`Simulation::step`]; the status is the worst of all. A copy that fails keeps
    /// none of the others from going on; [`Batch::status`] tells which it is.
    ///
    /// # Errors
    /// If `dt` is not finite and positive.
    pub fn step(&mut self, dt: f64) -> Result<StepReport, SimulationError> {
        let step = |_, world: &mut World| {
            world.looked_at = [false; 3];
            world.simulation.step(dt).map(|report| report.status)
        };
        let worst = |one: Result<Status, _>, other| Ok(one?.max(other?));
        let status = parallel::reduce(&mut self.worlds, Some(1), step, worst).unwrap_or(Ok(Status::Converged));
        status.map(|status| StepReport { status })
    }

    /// How the last step of a copy ended: the worst status of its connected sets.
    ///
    /// # Panics
    /// If there is no such copy; so do all functions that take one.
    pub fn status(&mut self, copy: usize) -> Status {
        let Place { world, segments, .. } = &self.copies[copy];
        let statuses = &self.worlds[*world].statuses()[segments.clone()];
        statuses.iter().copied().max().unwrap_or(Status::Converged)
    }

    /// Time since the start [s].
    pub fn time(&self) -> f64 {
        self.worlds.first().map_or(0.0, |world| world.simulation.time())
    }

    /// Copies poses and velocities of a copy to `state`, which takes its size.
    pub fn store(&mut self, copy: usize, state: &mut State) {
        let Place { world, segments, .. } = &self.copies[copy];
        let all = self.worlds[*world].state();
        copy_to(&mut state.positions, &all.positions[segments.clone()]);
        copy_to(&mut state.orientations, &all.orientations[segments.clone()]);
        copy_to(&mut state.velocities, &all.velocities[segments.clone()]);
        copy_to(&mut state.angular_velocities, &all.angular_velocities[segments.clone()]);
    }

    /// Copies what the joints of a copy transmit to `forces`, which takes its size, as [`Simulation::store_joint_forces`].
    pub fn store_joint_forces(&mut self, copy: usize, forces: &mut Vec<JointForce>) {
        let Place { world, joints, .. } = &self.copies[copy];
        copy_to(forces, &self.worlds[*world].forces()[joints.clone()]);
    }

    /// Copies the contacts of a copy that press to `forces`, as [`Simulation::store_contact_forces`].
    pub fn store_contact_forces(&self, copy: usize, forces: &mut Vec<ContactForce>) {
        // Where there are contacts, a world is one copy.
        self.worlds[self.copies[copy].world].simulation.store_contact_forces(forces);
    }

    /// Lets a motion drive a fixed segment or an anchor of a copy, as [`Simulation::drive`].
    ///
    /// # Errors
    /// If the copy has no such body, or it is free.
    pub fn drive(&mut self, copy: usize, driven: &Driven) -> Result<(), SimulationError> {
        let refused = SimulationError::NotHeld(driven.body);
        let Some((world, body)) = self.body(copy, driven.body) else { return Err(refused) };
        world.simulation.drive(&Driven { body, ..driven.clone() }).map_err(|_| refused)
    }

    /// Takes hold of a free segment of a copy, or closes an open grip, as [`Simulation::attach`].
    ///
    /// # Errors
    /// As there.
    pub fn attach(&mut self, copy: usize, body: Body, motion: Option<Arc<Motion>>) -> Result<(), SimulationError> {
        let refused = SimulationError::NothingToAttach(body);
        let Some((world, body)) = self.body(copy, body) else { return Err(refused) };
        world.looked_at = [false; 3];
        world.simulation.attach(body, motion).map_err(|error| match error {
            SimulationError::NothingToAttach(_) => refused,
            error => error,
        })
    }

    /// Lets a fixed segment of a copy go, or opens a grip, as [`Simulation::release`].
    ///
    /// # Errors
    /// As there.
    pub fn release(&mut self, copy: usize, body: Body) -> Result<(), SimulationError> {
        let refused = SimulationError::NothingToRelease(body);
        let Some((world, body)) = self.body(copy, body) else { return Err(refused) };
        world.looked_at = [false; 3];
        world.simulation.release(body).map_err(|error| match error {
            SimulationError::NothingToRelease(_) => refused,
            error => error,
        })
    }

    /// Whether a fixed segment or an anchor of a copy is held now, as [`Simulation::is_held`].
    pub fn is_held(&mut self, copy: usize, body: Body) -> Option<bool> {
        let (world, body) = self.body(copy, body)?;
        world.simulation.is_held(body)
    }

    /// The world of a copy, and what a body of the copy is there; `None` where there is no such body.
    fn body(&mut self, copy: usize, body: Body) -> Option<(&mut World, Body)> {
        let Place { world, segments, anchors, .. } = &self.copies[copy];
        let is_there = match body {
            Body::Segment(i) => i < segments.len(),
            Body::Anchor(i) => i < anchors.len(),
        };
        is_there.then(|| (&mut self.worlds[*world], body.shifted(segments.start, anchors.start)))
    }

    /// Takes the velocities of `state`, which must be of the copy's size, as [`Simulation::set_velocities`].
    pub fn set_velocities(&mut self, copy: usize, state: &State) {
        let Place { world, segments, .. } = &self.copies[copy];
        let world = &mut self.worlds[*world];
        world.state();
        world.state.velocities[segments.clone()].copy_from_slice(&state.velocities);
        world.state.angular_velocities[segments.clone()].copy_from_slice(&state.angular_velocities);
        world.simulation.set_velocities(&world.state);
        world.looked_at[0] = false;
    }

    /// Changes a load of a copy from the next step on, as [`Simulation::set_load`].
    ///
    /// # Errors
    /// As there.
    pub fn set_load(
        &mut self,
        copy: usize,
        index: usize,
        force: Vector3<f64>,
        torque: Vector3<f64>,
    ) -> Result<(), SimulationError> {
        let Place { world, loads, .. } = &self.copies[copy];
        if index >= loads.len() {
            return Err(SimulationError::NoLoad { index, count: loads.len() });
        }
        self.worlds[*world].simulation.set_load(loads.start + index, force, torque)
    }

    /// Changes the rest of a joint of a copy from the next step on, as [`Simulation::set_rest`].
    ///
    /// # Errors
    /// As there.
    pub fn set_rest(&mut self, copy: usize, joint: usize, darboux: Vector3<f64>) -> Result<(), SimulationError> {
        let Place { world, joints, .. } = &self.copies[copy];
        if joint >= joints.len() {
            return Err(SimulationError::NoJoint { index: joint, count: joints.len() });
        }
        self.worlds[*world].simulation.set_rest(joints.start + joint, darboux)
    }

    /// All that the steps to come depend on, to go on from again and again: see [`Simulation::snapshot`].
    pub fn snapshot(&mut self) -> Vec<Snapshot> {
        self.worlds.iter_mut().map(|world| world.simulation.snapshot()).collect()
    }

    /// Goes back to a snapshot, as [`Simulation::restore`].
    ///
    /// # Errors
    /// [`SimulationError::Snapshot`] if it is of another batch; some copies may be those of the snapshot then.
    pub fn restore(&mut self, snapshot: &[Snapshot]) -> Result<(), SimulationError> {
        if snapshot.len() != self.worlds.len() {
            return Err(SimulationError::Snapshot);
        }
        for (world, snapshot) in self.worlds.iter_mut().zip(snapshot) {
            world.looked_at = [false; 3];
            world.simulation.restore(snapshot)?;
        }
        Ok(())
    }

    /// Counters summed over all copies.
    pub fn counters(&self) -> Counters {
        let mut sum = Counters::default();
        self.worlds.iter().for_each(|world| sum += world.simulation.counters());
        sum
    }

    /// Number of connected sets of segments that move in the lanes of vector registers.
    pub fn in_lanes(&self) -> usize {
        self.worlds.iter().map(|world| world.simulation.in_lanes()).sum()
    }
}

impl World {
    /// The state as it is now.
    fn state(&mut self) -> &State {
        if !std::mem::replace(&mut self.looked_at[0], true) {
            self.simulation.store(&mut self.state);
        }
        &self.state
    }

    /// What joints transmit now.
    fn forces(&mut self) -> &[JointForce] {
        if !std::mem::replace(&mut self.looked_at[1], true) {
            self.simulation.store_joint_forces(&mut self.forces);
        }
        &self.forces
    }

    /// How the last step ended, one a segment.
    fn statuses(&mut self) -> &[Status] {
        if !std::mem::replace(&mut self.looked_at[2], true) {
            self.simulation.store_statuses(&mut self.statuses);
        }
        &self.statuses
    }
}

/// Whether two models can be one: the same world, and nothing to touch in it.
fn share_world(a: &Model, b: &Model) -> bool {
    a.contacts.is_empty()
        && b.contacts.is_empty()
        && (a.gravity, a.damping, &a.air) == (b.gravity, b.damping, &b.air)
        && gravity_of(a).eq(gravity_of(b))
}

/// How a model changes gravity.
fn gravity_of(model: &Model) -> impl Iterator<Item = &Change> {
    model.changes.iter().filter(|change| change.of == Changing::Gravity)
}

/// Makes a list what another one is.
fn copy_to<T: Clone>(to: &mut Vec<T>, from: &[T]) {
    to.clear();
    to.extend_from_slice(from);
}
