//! Rods that are fed out of stores: which segments are stored, from one step to the next.

mod change;

use std::borrow::Cow;
use std::ops::Range;

use contact::exclusion::PairFilter;
use contact::overlap::{Overlap, refuse_overlaps};
use rod::{Model, State};

use crate::connected_set::ConnectedSet;

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
    let stored = joints.filter(|(_, joint)| joint.has_store());
    stored.map(|(index, joint)| Store { joint: index, segments: joint.segments.clone(), stored: 0 }).collect()
}

/// Refuses overlaps of a model's bodies at the start, but for what is stored, which the filter knows from then on.
pub(super) fn refuse_overlaps_outside(
    model: &Model,
    state: &State,
    sets: &[ConnectedSet],
    filter: &mut PairFilter,
    tolerance: f64,
) -> Result<(), Overlap> {
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
    refuse_overlaps(&held, state, filter, tolerance)
}
