//! The places along its rod between which an eyelet stays, and what a feed may be.

use super::SlidingJoint;
use crate::{Body, Model, ModelError};

impl SlidingJoint {
    /// The places of the eyelet along the rod between which it stays [m]. A store takes in no segment to which something is joined, and
    /// leaves the last one outside.
    pub fn range(&self, model: &Model) -> [f64; 2] {
        let line = self.centreline(model);
        let length = line.length();
        let Some(feed) = &self.feed else { return [0.0, length] };
        let [least, most] = feed.lengths;
        let mut end = length - least;
        if self.has_store() {
            end = end.min(line.centre(self.first_joined(model)));
        }
        [(length - most).max(0.0), end]
    }

    /// Whether a feed takes its rod out of a store.
    pub fn has_store(&self) -> bool {
        self.feed.as_ref().is_some_and(|feed| feed.is_stored)
    }

    /// Whether the model holds segments of its rod.
    pub fn has_held_segments(&self, model: &Model) -> bool {
        model.segments[self.segments.clone()].iter().any(|segment| segment.fixed)
    }

    /// Whether its rod runs through another eyelet before this one.
    pub fn is_behind_another(&self, model: &Model) -> bool {
        model.sliding_joints.iter().any(|other| other.segments == self.segments && other.start < self.start)
    }

    /// The first segment of the rod that is joined to something but its neighbours in the rod, or on which another rod's eyelet or pulley sits;
    /// its last one if none is.
    fn first_joined(&self, model: &Model) -> usize {
        let own = |body: Body| match body {
            Body::Segment(i) => self.segments.contains(&i).then(|| i - self.segments.start),
            Body::Anchor(_) => None,
        };
        let last = self.segments.len().saturating_sub(1);
        let joined = model.joints.iter().filter_map(|joint| match (own(joint.a), own(joint.b)) {
            (Some(a), Some(b)) if a.abs_diff(b) == 1 => None,
            (a, b) => a.or(b),
        });
        let eyelets = model.sliding_joints.iter().map(|other| other.holder);
        let holders = eyelets.chain(model.pulleys.iter().map(|pulley| pulley.holder)).filter_map(own);
        joined.chain(holders).fold(last, usize::min)
    }

    /// Whether joints of its rod have laws that are not elastic.
    pub fn has_laws(&self, model: &Model) -> bool {
        let is_own = |body: Body| matches!(body, Body::Segment(i) if self.segments.contains(&i));
        model.laws.iter().filter_map(|law| model.joints.get(law.joint)).any(|joint| is_own(joint.a) && is_own(joint.b))
    }

    /// Checks the feed.
    pub(crate) fn validate_feed(&self, model: &Model, index: usize) -> Result<(), ModelError> {
        let Some(feed) = &self.feed else { return Ok(()) };
        let what = "sliding joint";
        let value = |quantity, value, allowed| Err(ModelError::Value { what, index, quantity, value, allowed });
        if self.friction != 0.0 {
            return value("friction", self.friction, "0 where a feed drives the rod");
        }
        if feed.max_force.is_nan() || feed.max_force < 0.0 {
            return value("largest force of the feed", feed.max_force, ">= 0");
        }
        if let Some([time, speed]) = feed.speeds.iter().find(|[time, speed]| !(time.is_finite() && speed.is_finite())) {
            return value("speed of the feed, or its time,", if time.is_finite() { *speed } else { *time }, "finite");
        }
        if let Some(pair) = feed.speeds.windows(2).find(|pair| pair[0][0] >= pair[1][0]) {
            return value("time of a speed of the feed", pair[1][0], "later than the one before");
        }
        let [least, most] = feed.lengths;
        if !(least >= 0.0 && most >= least) {
            return value("least length beyond the eyelet", least, ">= 0 and not above the largest length");
        }
        let [from, to] = self.range(model);
        if !(self.start >= from && self.start <= to) {
            return value(
                "start",
                self.start,
                "where the lengths beyond the eyelet and the segments that are joined to others allow it",
            );
        }
        if !self.has_store() {
            return Ok(());
        }
        if self.has_held_segments(model) {
            return value("fixed segments", 1.0, "0 in a rod that is stored");
        }
        if self.has_laws(model) {
            return value("laws of joints", 1.0, "0 in a rod that is stored");
        }
        if self.is_behind_another(model) {
            return value("start", self.start, "before all other eyelets of a rod that is stored");
        }
        Ok(())
    }
}
