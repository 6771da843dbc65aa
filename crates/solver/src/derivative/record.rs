//! What derivatives need of a step that a simulation has accepted.

use std::sync::Arc;

use rod::Body;

use crate::component::{Begin, BodyPose, Component, Members, pick_pose, pick_spatial, scatter};
use crate::connected_set::ConnectedSet;
use crate::contact::Touching;
use crate::kernel::Spatial;
use crate::kernel::lane::Real;
use crate::step::Interval;

/// A step of a connected set, or of all that can touch, that was accepted: a step of the simulation, or one of the parts that it
/// was divided into.
#[derive(Clone, Debug)]
pub(crate) struct Substep {
    pub(crate) interval: Interval,
    /// What it began with.
    pub(crate) begin: Begin,
    /// Poses at its end.
    pub(crate) poses: Arc<Vec<BodyPose<f64>>>,
    /// Multipliers.
    pub(crate) lambda: Vec<Spatial<f64>>,
    /// Contacts that press at its end.
    pub(crate) touching: Vec<Touching>,
    /// Whether the next step forgets those before.
    pub(crate) begins_anew: bool,
}

impl Substep {
    /// The one that a component has just been solved for, in one lane.
    pub(crate) fn of<T: Real>(component: &Component<T>, lane: usize) -> Self {
        let interval = Interval { time: component.time(), dt: component.dt() };
        let poses = Arc::new(component.poses.iter().map(|pose| pick_pose(pose, lane)).collect());
        let lambda = component.lambda.iter().map(|lambda| pick_spatial(lambda, lane)).collect();
        Self { interval, begin: component.begin(lane), poses, lambda, touching: Vec::new(), begins_anew: false }
    }

    /// Lets poses be kept once that the step `before` ended with and this one begins with.
    pub(crate) fn share_poses(&mut self, before: &Self) {
        if self.begin.poses == before.poses {
            self.begin.poses = before.poses.clone();
        }
    }

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
