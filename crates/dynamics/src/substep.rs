//! What derivatives need of a step that a simulation has accepted.

mod together;

use std::sync::Arc;

use component::{Begin, BodyPose, Component, pick_pose, pick_spatial};
use kernels::Spatial;
use kernels::lane::Real;
use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::step::Interval;

/// A step of a connected set, or of all that can touch, that was accepted: a step of the simulation, or one of the parts that it
/// was divided into.
#[derive(Clone, Debug)]
pub struct Substep {
    /// When it was.
    pub interval: Interval,
    /// What it began with.
    pub begin: Begin,
    /// Poses at its end.
    pub poses: Arc<Vec<BodyPose<f64>>>,
    /// Multipliers.
    pub lambda: Vec<Spatial<f64>>,
    /// Contacts that press at its end.
    pub touching: Vec<Touching>,
    /// Whether the next step forgets those before.
    pub begins_anew: bool,
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
    pub fn share_poses(&mut self, before: &Self) {
        if self.begin.poses == before.poses {
            self.begin.poses = before.poses.clone();
        }
    }
}

/// A contact that presses, at the end of a solved step. Its bodies are a segment and its partner, another one or an obstacle; six
/// rows or columns each: shift and turn, or force and torque.
#[derive(Clone, Debug)]
pub struct Touching {
    /// Segments of the model; no second one where the partner is an obstacle.
    pub segments: (usize, Option<usize>),
    /// The obstacle, where the partner is one.
    pub obstacle: Option<usize>,
    /// The push by the poses at the end, with the impulse as it is in the contact's frame.
    pub push_by_pose: SMatrix<f64, 12, 12>,
    /// The push by the impulse.
    pub push_by_impulse: SMatrix<f64, 12, 3>,
    /// The equations [m] by the poses at the end.
    pub by_pose: SMatrix<f64, 3, 12>,
    /// The equations by the poses at the start.
    pub by_start: SMatrix<f64, 3, 12>,
    /// The equations by the impulse.
    pub by_impulse: Matrix3<f64>,
    /// The equations by the logarithm of the friction.
    pub by_friction: Vector3<f64>,
}
