//! Sheaths: their measures in a model, and their checks.

use std::collections::HashSet;
use std::ops::Range;

use crate::{Body, Centreline, Contacts, Model, ModelError, Sheath};

impl Sheath {
    /// Radius of the bore of the outer rod [m].
    pub fn bore(&self, model: &Model) -> f64 {
        let radii = model.segments[self.inner.clone()].iter().map(|segment| segment.radius);
        self.clearance + radii.fold(0.0, f64::max)
    }

    /// The centreline of the outer rod.
    pub fn centreline(&self, model: &Model) -> Centreline {
        Centreline::new(model.segments[self.outer.clone()].iter().map(|segment| segment.length))
    }

    /// The distance behind each of the two mouths over which the bore widens to let go of the inner rod smoothly [m]: the longest segment of the
    /// inner rod, or the outer rod's last one at the mouth if that is longer. At the distance d behind the mouth the wall is `d^2 / (2 reach)`
    /// further away.
    pub fn reach(&self, model: &Model) -> [f64; 2] {
        let longest = model.segments[self.inner.clone()].iter().map(|segment| segment.length).fold(0.0, f64::max);
        [self.outer.start, self.outer.end - 1].map(|i| longest.max(model.segments[i].length))
    }

    /// Checks it.
    pub(crate) fn validate(&self, model: &Model, index: usize) -> Result<(), ModelError> {
        let what = "sheath";
        let value = |quantity, value, allowed| Err(ModelError::Value { what, index, quantity, value, allowed });
        let Self { inner, outer, clearance, friction } = self;
        model.check_threaded(what, index, inner, Body::Segment(outer.start))?;
        model.check_threaded(what, index, outer, Body::Segment(inner.start))?;
        let both = || inner.clone().chain(outer.clone());
        if let Some(body) = both().find(|&i| model.segments[i].body.is_some()) {
            return value("its segment", body as f64, "no rigid body");
        }
        let pair = |[a, b]: [Body; 2]| match (a, b) {
            (Body::Segment(a), Body::Segment(b)) => Some([a.min(b), a.max(b)]),
            _ => None,
        };
        let joined: HashSet<[usize; 2]> = model.joints.iter().filter_map(|joint| pair([joint.a, joint.b])).collect();
        let is_last = |i: usize| i + 1 == inner.end || i + 1 == outer.end;
        if let Some(open) = both().find(|&i| !is_last(i) && !joined.contains(&[i, i + 1])) {
            return value("its segment", open as f64, "joined to the next");
        }
        let least = model.segments[outer.clone()].iter().map(|segment| segment.radius).fold(f64::INFINITY, f64::min);
        if !(*clearance > 0.0 && self.bore(model) < least) {
            return value("clearance", *clearance, "> 0, and less than the outer rod's radius less the inner one's");
        }
        for coefficient in [friction.at_rest, friction.sliding] {
            if !(coefficient.is_finite() && coefficient >= 0.0) {
                return value("friction", coefficient, "finite and >= 0");
            }
        }
        if friction.sliding > friction.at_rest {
            return value("friction", friction.sliding, "no more sliding than at rest");
        }
        Ok(())
    }
}

/// Checks the sheaths of a model together: no rod is inside of itself.
pub(crate) fn validate(model: &Model) -> Result<(), ModelError> {
    let sheaths = &model.contacts.sheaths;
    sheaths.iter().enumerate().try_for_each(|(index, sheath)| sheath.validate(model, index))?;
    let rods = nested(sheaths);
    match rods.iter().position(|[inner, outer]| inner.start < outer.end && outer.start < inner.end) {
        None => Ok(()),
        Some(place) => {
            let what = "sheath";
            let index = place.min(sheaths.len() - 1);
            let (quantity, value) = ("its rod, from segment", rods[place][0].start as f64);
            Err(ModelError::Value { what, index, quantity, value, allowed: "inside of other rods only" })
        }
    }
}

/// All pairs of an inner and an outer rod: those of the sheaths themselves, then what is inside of what is inside.
fn nested(sheaths: &[Sheath]) -> Vec<[Range<usize>; 2]> {
    let mut pairs: Vec<_> = sheaths.iter().map(|own| [own.inner.clone(), own.outer.clone()]).collect();
    let mut done = 0;
    while done < pairs.len() {
        let [inner, outer] = pairs[done].clone();
        for own in sheaths {
            let pair = [inner.clone(), own.outer.clone()];
            if outer.start < own.inner.end && own.inner.start < outer.end && !pairs.contains(&pair) {
                pairs.push(pair);
            }
        }
        done += 1;
    }
    pairs
}

impl Contacts {
    /// Pairs of rods, as ranges of segments, that do not touch each other but through sheaths: each inner rod with its outer one, and with what that
    /// is inside of.
    pub fn sheathed(&self) -> Vec<[Range<usize>; 2]> {
        nested(&self.sheaths)
    }
}
