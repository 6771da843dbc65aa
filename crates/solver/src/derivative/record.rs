//! What derivatives need of a step that a simulation has accepted.

use crate::component::{Begin, BodyPose, Component};
use crate::kernel::Spatial;
use crate::step::Interval;

/// A step of a connected set that was accepted: a step of the simulation, or one of the parts that it was divided into.
#[derive(Clone, Debug)]
pub(crate) struct Substep {
    pub(crate) interval: Interval,
    /// What it began with.
    pub(crate) begin: Begin,
    /// Poses at its end.
    pub(crate) poses: Vec<BodyPose<f64>>,
    /// Multipliers.
    pub(crate) lambda: Vec<Spatial<f64>>,
}

impl Substep {
    /// The one that a component has just been solved for.
    pub(crate) fn of(component: &Component<f64>) -> Self {
        let interval = Interval { time: component.time(), dt: component.dt() };
        Self { interval, begin: component.begin(), poses: component.poses.clone(), lambda: component.lambda.clone() }
    }
}
