//! Rods that are fed out of stores: which segments are stored, from one step to the next.

use std::borrow::Cow;
use std::ops::Range;

use component::Change;
use contact::exclusion::PairFilter;
use contact::overlap::{Overlap, refuse_overlaps};
use rod::{Body, Model, State};

use super::{Simulation, SimulationError};
use crate::connected_set::ConnectedSet;
use crate::piece::Piece;

/// The store of a rod that is fed.
#[derive(Debug)]
pub(super) struct Store {
    /// Index of the sliding joint in the model.
    joint: usize,
    segments: Range<usize>,
    /// How many segments are stored, from the rod's start on.
    pub(super) stored: usize,
}

impl Store {
    /// Whether a segment of the model is stored.
    pub(super) fn holds(&self, segment: usize) -> bool {
        (self.segments.start..self.segments.start + self.stored).contains(&segment)
    }
}

/// The stores of a model, with nothing in them.
pub(super) fn stores(model: &Model) -> Vec<Store> {
    let joints = model.sliding_joints.iter().enumerate();
    let stored = joints.filter(|(_, joint)| joint.feed.as_ref().is_some_and(|feed| feed.is_stored));
    stored.map(|(index, joint)| Store { joint: index, segments: joint.segments.clone(), stored: 0 }).collect()
}

/// Refuses overlaps of a model's bodies at the start, but for what is stored.
pub(super) fn refuse_overlaps_outside(
    model: &Model,
    state: &State,
    sets: &[ConnectedSet],
    tolerance: f64,
) -> Result<(), Overlap> {
    let mut filter = PairFilter::new(model);
    let mut stored = Vec::new();
    for set in sets {
        set.component.each_store(0.0, 0.0, |joint, count| {
            let start = model.sliding_joints[joint].segments.start;
            stored.extend(start..start + count);
        });
    }
    let mut held = Cow::Borrowed(model);
    for i in stored {
        held.to_mut().segments[i].fixed = true;
        filter.set_stored(i, true);
    }
    refuse_overlaps(&held, state, &filter, tolerance)
}

impl Simulation {
    /// Lets a feed drive its rod with this speed [m/s] from the next step on, whatever the model says: > 0 pays out.
    ///
    /// # Errors
    /// If the sliding joint has no feed, or the speed is not finite.
    pub fn set_feed(&mut self, joint: usize, speed: f64) -> Result<(), SimulationError> {
        if !speed.is_finite() {
            return Err(SimulationError::NotFinite(format!("the speed of feed {joint}")));
        }
        let is_there =
            self.pieces.iter_mut().flat_map(Piece::singles_mut).any(|set| set.component.set_feed(joint, speed));
        if is_there { Ok(()) } else { Err(SimulationError::NoFeed(joint)) }
    }

    /// Stores segments and lets them out as the step to come needs it, which is so long [s].
    pub(super) fn keep_stores(&mut self, dt: f64) -> Result<(), SimulationError> {
        for k in 0..self.stores.len() {
            let (joint, start) = (self.stores[k].joint, self.stores[k].segments.start);
            let mut due = 0;
            self.singles().for_each(|component| {
                component.each_store(self.time, dt, |of, stored| due = if of == joint { stored } else { due });
            });
            while self.stores[k].stored < due {
                let next = start + self.stores[k].stored;
                self.stores[k].stored += 1;
                self.change(Body::Segment(next), Change::Store)?;
            }
            while self.stores[k].stored > due {
                self.stores[k].stored -= 1;
                let last = start + self.stores[k].stored;
                self.change(Body::Segment(last), Change::LetGo)?;
            }
        }
        Ok(())
    }
}
