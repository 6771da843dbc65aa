//! The connected sets that an island works on, found by their numbers in the model.

use std::ops::{Index, IndexMut};

use component::Component;
use contact::shape::Components;

use crate::connected_set::ConnectedSet;

/// Connected sets side by side, and the seat of each set of the model among them.
pub(crate) struct Sets<'a> {
    own: &'a mut [Box<ConnectedSet>],
    seats: &'a [u32],
}

impl<'a> Sets<'a> {
    /// Sets `own`; `seats` has the place among them of each set of the model that is one of them, and anything for others.
    pub(crate) fn new(own: &'a mut [Box<ConnectedSet>], seats: &'a [u32]) -> Self {
        Self { own, seats }
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &ConnectedSet> {
        self.own.iter().map(|set| &**set)
    }

    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = &mut ConnectedSet> {
        self.own.iter_mut().map(|set| &mut **set)
    }

    /// How many they are.
    pub(crate) fn len(&self) -> usize {
        self.own.len()
    }

    /// The place of a set among them, by its number in the model.
    pub(crate) fn seat(&self, component: u32) -> usize {
        self.seats[component as usize] as usize
    }

    /// All of them, to be shared among threads.
    pub(crate) fn all(&mut self) -> &mut [Box<ConnectedSet>] {
        self.own
    }

    /// All of them.
    pub(crate) fn as_slice(&self) -> &[Box<ConnectedSet>] {
        self.own
    }
}

impl Index<usize> for Sets<'_> {
    type Output = ConnectedSet;

    /// A set by its number in the model.
    fn index(&self, component: usize) -> &ConnectedSet {
        &self.own[self.seats[component] as usize]
    }
}

impl IndexMut<usize> for Sets<'_> {
    fn index_mut(&mut self, component: usize) -> &mut ConnectedSet {
        &mut self.own[self.seats[component] as usize]
    }
}

impl Components for Sets<'_> {
    fn component(&self, number: u32) -> &Component<f64> {
        &self[number as usize].component
    }
}
