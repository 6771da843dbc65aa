//! Changes of what is held, on the way of a simulation.

use std::sync::Arc;

use component::snapshot::{Snapshot, StateVisitor};
use component::{Change, Component};
use jointed::linear::solvers::SolverKind;
use nalgebra::{UnitQuaternion, Vector3};
use rod::{Body, Driven, Model, Motion, Pose};

use super::{Phase, Scheduled, Taken, TimedGrip};
use crate::piece::Piece;
use crate::simulation::{Simulation, SimulationError};

impl Simulation {
    /// Lets a motion drive a fixed segment or an anchor of the model from the next step on, whatever moved it before; its
    /// times are [`Simulation::time`]'s. Where it is elsewhere than the body is now, the body jumps there within the next
    /// step; [`Driven::gripped`] begins where the body is. A step in which it turns by more than 1 rad is done in halves.
    /// When it takes hold and lets go is of no account here.
    ///
    /// # Errors
    /// If there is no such body, or it is free or open.
    pub fn drive(&mut self, driven: &Driven) -> Result<(), SimulationError> {
        if self.is_held(driven.body) != Some(true) {
            return Err(SimulationError::NotHeld(driven.body));
        }
        self.change(driven.body, Change::Drive(driven))
    }

    /// Takes hold of a free segment, or closes an open grip ([`Model::open`]) on its face, from the next step on, where it
    /// is now. With a `motion` it goes on with that as one rigid body; without one it stays.
    ///
    /// All other connected sets of segments keep their bits where the model has no contacts.
    ///
    /// # Errors
    /// If there is no such body, or it is held already.
    pub fn attach(&mut self, body: Body, motion: Option<Arc<Motion>>) -> Result<(), SimulationError> {
        if self.is_held(body) != Some(false) {
            return Err(SimulationError::NothingToAttach(body));
        }
        match motion {
            None => self.change(body, Change::Hold),
            Some(motion) => {
                let pose = self.pose(body).unwrap_or(motion.at(self.time).pose);
                self.change(body, Change::Drive(&Driven::gripped(body, motion, &pose, self.time)))
            }
        }
    }

    /// Lets a fixed segment go, which goes on with the velocity that it has, or opens the grip that an anchor is: its joints
    /// transmit nothing from the next step on.
    ///
    /// All other connected sets of segments keep their bits where the model has no contacts. Where the set of a fixed segment
    /// moves in a lane beside others and the model has no grip for it that lets go, all of them are stepped one by one from
    /// then on, which takes longer.
    ///
    /// # Errors
    /// If there is no such body, it is not held, the solver knows no open grips, or the factor of the segment's set would
    /// be too large.
    pub fn release(&mut self, body: Body) -> Result<(), SimulationError> {
        if self.is_held(body) != Some(true) {
            return Err(SimulationError::NothingToRelease(body));
        }
        if let (Body::Anchor(_), SolverKind::Cg(_)) = (body, self.solver) {
            return Err(SimulationError::Loose(format!("solver {}", self.solver)));
        }
        for own in self.schedule.iter_mut().filter(|own| own.driven.body == body && own.phase == Phase::Holds) {
            own.phase = Phase::Done;
            Arc::make_mut(&mut own.driven).until = self.time;
        }
        self.change(body, Change::LetGo)
    }

    /// Whether a fixed segment or an anchor of the model is held now; `None` where there is no such body.
    pub fn is_held(&self, body: Body) -> Option<bool> {
        match body {
            Body::Segment(i) => self.held.get(i).copied(),
            Body::Anchor(i) => self.open.get(i).map(|open| !open),
        }
    }

    /// Makes of `model`, which must be the simulation's, what changes over time as it is now: loads and gravity, what is
    /// held, where anchors are, which joints have broken, and where its grips have taken hold. What one reads off a model and a state expects that:
    /// energies, [`rod::Reaction`].
    pub fn store_model(&mut self, model: &mut Model) {
        for Scheduled { index, driven, .. } in &self.schedule {
            model.motions[*index].clone_from(driven.as_ref());
        }
        model.set_time(self.time);
        // One that lets go when the next step begins has held on to the end of this one.
        for Scheduled { driven, .. } in self.schedule.iter().filter(|own| own.phase == Phase::Holds) {
            if let Body::Anchor(i) = driven.body {
                model.anchors[i] = driven.at(self.time).pose;
            }
        }
        for (segment, held) in model.segments.iter_mut().zip(&self.held) {
            segment.fixed = *held;
        }
        model.open = (0..self.open.len()).filter(|anchor| self.open[*anchor]).collect();
        for (joint, freedom, broke) in self.singles().flat_map(Component::breakable_joints) {
            model.joints[joint].freedom = freedom;
            let own = model.breakable.binary_search_by_key(&joint, |own| own.joint);
            own.into_iter().for_each(|k| model.breakable[k].broke = broke);
        }
        for k in 0..self.moved_anchors.len() {
            let anchor = self.moved_anchors[k];
            if let Some(pose) = self.pose(Body::Anchor(anchor)) {
                model.anchors[anchor] = pose;
            }
        }
    }

    /// What has become of the model's grips with times, in the order of [`Model::motions`].
    pub fn timed_grips(&self) -> Vec<TimedGrip> {
        self.schedule.iter().map(Scheduled::grip).collect()
    }

    /// Lets go and takes hold of what is due when a step begins now.
    pub(in crate::simulation) fn keep_schedule(&mut self) -> Result<(), SimulationError> {
        let now = self.time;
        for k in 0..self.schedule.len() {
            let own = &mut self.schedule[k];
            if own.phase == Phase::Done || !own.driven.ends_by(now) {
                continue;
            }
            let held = std::mem::replace(&mut own.phase, Phase::Done) == Phase::Holds;
            Arc::make_mut(&mut own.driven).until = now;
            if held {
                self.change(self.schedule[k].driven.body, Change::LetGo)?;
            }
        }
        let is_due = |own: &Scheduled| own.phase == Phase::Waits && own.driven.begins_by(now);
        while let Some(first) = self.schedule.iter().position(is_due) {
            // The bodies of one motion go on as one rigid body.
            let motion = self.schedule[first].driven.carried.motion.clone();
            let is_one = |own: &Scheduled| is_due(own) && Arc::ptr_eq(&own.driven.carried.motion, &motion);
            let bodies: Vec<usize> = (0..self.schedule.len()).filter(|k| is_one(&self.schedule[*k])).collect();
            let there = motion.at(now).pose;
            let pose = |k: &usize| self.pose(self.schedule[*k].driven.body).unwrap_or(there);
            let poses: Vec<Pose> = bodies.iter().map(pose).collect();
            let centre = poses.iter().map(|pose| pose.position).sum::<Vector3<f64>>() / poses.len() as f64;
            for (k, pose) in bodies.into_iter().zip(&poses) {
                let driven = self.schedule[k].driven.taken(pose, &centre, now);
                self.change(driven.body, Change::Drive(&driven))?;
                let own = &mut self.schedule[k];
                (own.driven, own.phase) = (Arc::new(driven), Phase::Holds);
                own.taken = Some(Taken { pose: *pose, centre, time: now });
            }
        }
        Ok(())
    }

    /// Shows a visitor what is held and how far the grips with times are; takes hold and lets go of what a visitor says otherwise.
    pub(in crate::simulation) fn visit_holds(&mut self, visitor: &mut StateVisitor<'_>) {
        for own in &mut self.schedule {
            let mut phase = Phase::ALL.iter().position(|phase| *phase == own.phase).unwrap_or_default();
            visitor.count(&mut phase);
            own.phase = Phase::ALL.get(phase).copied().unwrap_or(own.phase);
            let mut grip = own.grip();
            visit_grip(visitor, &mut grip);
            if visitor.is_reading() && grip != own.grip() {
                own.driven = Arc::new(grip.of(&own.given));
                own.taken = grip.taken;
            }
        }
        self.stores.iter_mut().for_each(|store| visitor.count(&mut store.stored));
        let bodies = (0..self.held.len()).map(Body::Segment).chain((0..self.open.len()).map(Body::Anchor));
        for body in bodies {
            let now = self.is_held(body) == Some(true);
            let mut then = now;
            visitor.flag(&mut then);
            if then != now {
                // Only a connectivity that changes can fail, and then the visitor is of something else.
                let is_stored = |i: usize| self.stores.iter().any(|store| store.holds(i));
                let _ = self.change(
                    body,
                    match body {
                        _ if !then => Change::LetGo,
                        Body::Segment(i) if is_stored(i) => Change::Store,
                        _ => Change::Hold,
                    },
                );
            }
        }
        for anchor in 0..self.open.len() {
            let mut is_moved = self.moved_anchors.contains(&anchor);
            visitor.flag(&mut is_moved);
            self.note_moved(anchor, is_moved);
        }
        // The motions of a file are the model's, moved to where they took hold.
        for k in 0..self.schedule.len() {
            let Scheduled { driven, phase, .. } = &self.schedule[k];
            if visitor.is_reading() && *phase == Phase::Holds {
                let driven = driven.clone();
                let _ = self.change(driven.body, Change::Drive(&driven));
            }
        }
    }

    /// Pose of a body of the model; of an open grip where it would close now. `None` of an anchor that no joint holds on to.
    /// Nothing changes; it is mutable because open grips are looked up first.
    pub fn pose(&mut self, body: Body) -> Option<Pose> {
        self.pieces.iter_mut().find_map(|piece| piece.pose(body))
    }

    /// Holds a body, drives it or lets it go.
    pub(in crate::simulation) fn change(&mut self, body: Body, change: Change<'_>) -> Result<(), SimulationError> {
        let lets_go = matches!(change, Change::LetGo);
        let is_driven = matches!(change, Change::Drive(_));
        let comes_apart = |piece: &Piece| matches!(piece, Piece::LaneBatch(group) if group.comes_apart(body, lets_go));
        if !(is_driven && self.is_held(body) == Some(true))
            && let Some(place) = self.pieces.iter().position(comes_apart)
        {
            self.part(place);
        }
        for piece in &mut self.pieces {
            if piece.change(body, change, self.solver)? {
                break;
            }
        }
        match body {
            Body::Segment(i) => self.held[i] = !lets_go,
            Body::Anchor(i) => {
                self.open[i] = lets_go;
                self.note_moved(i, true);
            }
        }
        Ok(())
    }

    /// Notes that an anchor may be elsewhere than in the model.
    fn note_moved(&mut self, anchor: usize, is_moved: bool) {
        if is_moved && !self.moved_anchors.contains(&anchor) {
            self.moved_anchors.push(anchor);
        }
    }

    /// Steps the sets of the group at this place among the pieces one by one from now on.
    fn part(&mut self, place: usize) {
        let Some(first) = (0..=place).find(|&first| self.place_now(first) == place) else { return };
        let Piece::LaneBatch(group) = &mut self.pieces[place] else { return };
        let sets: Vec<Piece> = group.apart().map(|set| Piece::Single(Box::new(set))).collect();
        self.parted.push([first, sets.len()]);
        self.parted.sort_unstable();
        self.pieces.splice(place..=place, sets);
    }

    /// Where a piece is now that was at this place at first.
    fn place_now(&self, first: usize) -> usize {
        let earlier = self.parted.iter().filter(|[parted, _]| *parted < first);
        first + earlier.map(|[_, sets]| sets - 1).sum::<usize>()
    }

    /// Shows a visitor which groups step one by one.
    pub(in crate::simulation) fn visit_parted(&mut self, visitor: &mut StateVisitor<'_>) {
        let mut count = self.parted.len();
        visitor.count(&mut count);
        self.parted.iter_mut().for_each(|[first, _]| visitor.count(first));
    }

    /// Parts the groups that were apart in a snapshot; whether no others are.
    pub(in crate::simulation) fn part_as_in(&mut self, snapshot: &Snapshot) -> bool {
        let then = snapshot.parted();
        for &first in then {
            if self.parted.iter().all(|[parted, _]| *parted != first as usize) {
                let place = self.place_now(first as usize);
                if !matches!(self.pieces.get(place), Some(Piece::LaneBatch(_))) {
                    return false;
                }
                self.part(place);
            }
        }
        self.parted.len() == then.len()
    }
}

/// Shows a grip to a visitor.
fn visit_grip(visitor: &mut StateVisitor<'_>, grip: &mut TimedGrip) {
    let none = Taken {
        pose: Pose { position: Vector3::zeros(), orientation: UnitQuaternion::identity() },
        centre: Vector3::zeros(),
        time: 0.0,
    };
    let mut has_taken = grip.taken.is_some();
    visitor.flag(&mut has_taken);
    let mut taken = grip.taken.unwrap_or(none);
    let Taken { pose, centre, time } = &mut taken;
    pose.position.iter_mut().chain(centre.iter_mut()).for_each(|x| visitor.number(x));
    let mut turn = *pose.orientation.as_ref();
    turn.coords.iter_mut().for_each(|x| visitor.number(x));
    pose.orientation = UnitQuaternion::new_unchecked(turn);
    visitor.number(time);
    visitor.number(&mut grip.until);
    grip.taken = has_taken.then_some(taken);
}
