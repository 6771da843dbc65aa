//! Islands: connected sets of segments that may touch in a step, directly or through others.
//!
//! Two sets are of one island where there is a possible contact between them. What the first search of a step does not see,
//! as sets leave the rooms of that search, is found at its end: islands that may have met are one, and done again.

use collision::{Aabb, SpatialHash};
use contact::shape::Shape;
use nalgebra::Vector3;

use super::island_contacts::IslandContacts;
use super::shared::Shared;
use crate::connected_set::ConnectedSet;

/// Which connected sets are of one island, and in which order.
#[derive(Default)]
pub(crate) struct Islands {
    /// Of each set, one of its island that comes earlier; itself if it is the first.
    parents: Vec<u32>,
    /// The island of each set.
    of: Vec<u32>,
    /// The seat of each set in its island.
    pub(crate) seats: Vec<u32>,
    /// Sets of each island.
    pub(crate) sizes: Vec<u32>,
    /// Where each island's sets begin, put side by side.
    pub(crate) firsts: Vec<u32>,
    /// The first set of each island.
    pub(crate) leaders: Vec<u32>,
    /// The numbers of all sets.
    numbers: Vec<u32>,
    boxes: Vec<Aabb>,
    hash: SpatialHash,
    meetings: Vec<[u32; 2]>,
}

impl Islands {
    /// Every set an island of its own.
    pub(crate) fn reset(&mut self, sets: usize) {
        self.parents.clear();
        self.parents.extend(0..sets as u32);
        self.numbers.clone_from(&self.parents);
    }

    /// The seats of sets in the order of the model.
    pub(crate) fn numbers(&self) -> &[u32] {
        &self.numbers
    }

    /// Whether each island has become a part of another since they were numbered, or another of it.
    pub(crate) fn joined(&self) -> impl Iterator<Item = bool> {
        let mut parts = vec![0_u32; self.parents.len()];
        self.leaders.iter().for_each(|&leader| parts[self.first(leader) as usize] += 1);
        self.leaders.iter().map(move |&leader| parts[self.first(leader) as usize] > 1)
    }

    /// The first set of an island.
    fn first(&self, mut set: u32) -> u32 {
        while self.parents[set as usize] != set {
            set = self.parents[set as usize];
        }
        set
    }

    /// Makes one island of those of two sets; returns whether they were two.
    pub(crate) fn link(&mut self, a: u32, b: u32) -> bool {
        let (a, b) = (self.first(a), self.first(b));
        self.parents[a.max(b) as usize] = a.min(b);
        a != b
    }

    /// Links the sets between which there are possible contacts.
    pub(crate) fn link_found(&mut self, shared: &Shared) {
        let shapes = shared.detector.shapes();
        for contact in &shared.found {
            let others = shared.detector.sheath_of(contact).map(|outer| outer.start).or(contact.key.1.segment());
            if let Some(other) = others {
                self.link(shapes[contact.key.0 as usize].component, shapes[other as usize].component);
            }
        }
        shared.detector.near_bodies(&shared.search, |a, b| {
            self.link(shapes[a as usize].component, shapes[b as usize].component);
        });
    }

    /// Numbers the islands by their first sets, and the sets of each in order.
    pub(crate) fn number(&mut self) {
        self.of.clear();
        self.seats.clear();
        self.sizes.clear();
        self.leaders.clear();
        self.firsts.clear();
        for set in 0..self.parents.len() as u32 {
            let first = self.first(set);
            let island = match first == set {
                true => {
                    self.sizes.push(0);
                    self.leaders.push(set);
                    self.sizes.len() as u32 - 1
                }
                false => self.of[first as usize],
            };
            self.parents[set as usize] = first;
            self.of.push(island);
            self.seats.push(self.sizes[island as usize]);
            self.sizes[island as usize] += 1;
        }
        let mut first = 0;
        for size in &self.sizes {
            self.firsts.push(first);
            first += size;
        }
    }

    /// The island of a set.
    pub(crate) fn of(&self, set: u32) -> u32 {
        self.of[set as usize]
    }

    /// Hands the contacts that were found to the islands.
    pub(crate) fn deal(&self, shared: &mut Shared, stages: &mut [IslandContacts]) {
        for contact in shared.found.drain(..) {
            let component = shared.detector.shapes()[contact.key.0 as usize].component;
            stages[self.of(component) as usize].take(contact);
        }
    }

    /// Links islands that may have met in the step though nothing was found between them at its start; returns whether there
    /// are any. `is_whole`: whether an island has done the step as a whole, and is where that took it.
    pub(crate) fn link_meetings(
        &mut self,
        shared: &Shared,
        stages: &[IslandContacts],
        sets: &[Box<ConnectedSet>],
        is_whole: impl Fn(u32) -> bool,
    ) -> bool {
        if stages.len() < 2 || !stages.iter().any(|stage| stage.search.has_grown()) {
            return false;
        }
        let shapes: &[Shape] = shared.detector.shapes();
        let nowhere = Aabb { min: Vector3::zeros(), max: Vector3::zeros() };
        let mut boxes = std::mem::take(&mut self.boxes);
        boxes.clear();
        boxes.resize(shapes.len(), nowhere);
        stages.iter().for_each(|stage| stage.search.show_reach(&mut boxes));
        let mut meetings = std::mem::take(&mut self.meetings);
        shared.detector.meetings(&mut self.hash, &boxes, &mut meetings);
        let mut met = false;
        for &pair in &meetings {
            let [a, b] = pair.map(|segment| shapes[segment as usize].component);
            let islands = [self.of(a), self.of(b)];
            let is_new = islands.iter().any(|&island| stages[island as usize].search.has_grown());
            if islands[0] == islands[1] || !is_new {
                continue;
            }
            let component = |set: u32| {
                let island = self.of(set) as usize;
                &sets[(self.firsts[island] + self.seats[set as usize]) as usize].component
            };
            let stray = |segment: u32| {
                let Shape { component: set, body, .. } = shapes[segment as usize];
                match self.of(set) {
                    island if is_whole(island) => {
                        shared.search.sights[segment as usize].stray(&component(set).poses[body as usize], 1.0)
                    }
                    island => stages[island as usize].search.stray(segment),
                }
            };
            let are_apart = if islands.into_iter().all(&is_whole) {
                shared.detector.are_apart(pair, component)
            } else {
                shared.search.are_apart(pair, pair.map(stray))
            };
            if !are_apart {
                met |= self.link(a, b);
            }
        }
        (self.boxes, self.meetings) = (boxes, meetings);
        met
    }
}

#[cfg(test)]
mod tests;
