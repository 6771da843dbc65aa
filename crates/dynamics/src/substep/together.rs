//! A step of sets that touch, as one.

use std::sync::Arc;

use component::{Begin, Members, scatter};
use kernels::Spatial;
use rod::Body;

use super::{Substep, Touching};
use crate::connected_set::ConnectedSet;
use crate::step::Interval;

impl Substep {
    /// The one that sets, which make up `whole`, have just been solved for; `None` where there are none.
    pub(crate) fn of_all(
        sets: &[Box<ConnectedSet>],
        whole: &Members,
        touching: Vec<Touching>,
        begins_anew: bool,
    ) -> Option<Self> {
        let first = &sets.first()?.component;
        let bodies = whole.segments.len() + whole.anchors.len();
        let parts: Vec<(Begin, Vec<usize>)> =
            sets.iter().map(|set| (set.component.begin(0), places(&set.members, whole))).collect();
        let interval = Interval { time: first.time(), dt: first.dt() };
        let mut poses = vec![*first.poses.first()?; bodies];
        let mut lambda = vec![Spatial::zero(); whole.joints.len()];
        for (set, (_, places)) in sets.iter().zip(&parts) {
            scatter(&mut poses, &set.component.poses, places);
            let joints = set.members.joints.iter().filter_map(|joint| whole.joints.binary_search(joint).ok());
            scatter(&mut lambda, &set.component.lambda, &joints.collect::<Vec<_>>());
        }
        Some(Self {
            interval,
            begin: Begin::together(&parts, [bodies, whole.segments.len()])?,
            poses: Arc::new(poses),
            lambda,
            touching,
            begins_anew,
        })
    }
}

/// Where the bodies of a set are among those of the whole.
fn places(set: &Members, whole: &Members) -> Vec<usize> {
    let bodies = set.segments.iter().map(|&i| Body::Segment(i)).chain(set.anchors.iter().map(|&i| Body::Anchor(i)));
    bodies.filter_map(|body| whole.body(body)).collect()
}
