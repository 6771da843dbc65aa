//! What it takes to hold what is held: the forces and moments of grips, clamps and anchors.

use nalgebra::Vector3;

use crate::measure::apply_inertia;
use crate::{Body, JointForce, Model, State};

/// What holds a fixed segment or an anchor gives to it, in world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reaction {
    /// The body that is held.
    pub body: Body,
    /// Force [N].
    pub force: Vector3<f64>,
    /// Moment about the body's position [N m].
    pub moment: Vector3<f64>,
}

impl Reaction {
    /// The reactions at the end of a step of `dt` [s] from state `before` to state `after`, in which joints transmit `forces`,
    /// one a joint: fixed segments in their order, then anchors. What of the model changes over time must be that of the end
    /// of the step: see [`Model::set_time`].
    ///
    /// A fixed segment's is what moves it as it moves, beside gravity, its loads and its joints: `m (a - g) - F` and
    /// `d(I w)/dt - M` with velocities that change from state to state. An anchor has no mass. What contacts give to fixed
    /// segments is left out.
    pub fn all(model: &Model, [before, after]: [&State; 2], dt: f64, forces: &[JointForce]) -> Vec<Self> {
        let zero = |body| Self { body, force: Vector3::zeros(), moment: Vector3::zeros() };
        let mut anchors: Vec<Self> = (0..model.anchors.len()).map(|i| zero(Body::Anchor(i))).collect();
        let mut segments: Vec<Self> = (0..model.segments.len()).map(|i| zero(Body::Segment(i))).collect();
        for (joint, given) in model.joints.iter().zip(forces) {
            let [a, b] = [joint.a, joint.b].map(|body| model.pose(body, after).orientation);
            let moment = a * given.moment;
            let mut add = |body: Body, arm: Vector3<f64>, sign: f64| {
                let own = match body {
                    Body::Segment(i) => &mut segments[i],
                    Body::Anchor(i) => &mut anchors[i],
                };
                own.force -= given.force * sign;
                own.moment -= (arm.cross(&given.force) + moment) * sign;
            };
            add(joint.a, joint.arm_a(&a), 1.0);
            add(joint.b, joint.arm_b(&b), -1.0);
        }
        for load in &model.loads {
            let own = &mut segments[load.segment];
            own.force -= load.force;
            own.moment -= (after.axis(load.segment) * load.offset).cross(&load.force) + load.torque;
        }
        let mut held: Vec<Self> = segments
            .into_iter()
            .zip(&model.segments)
            .filter(|(_, segment)| segment.fixed)
            .map(|(own, _)| own)
            .collect();
        for own in &mut held {
            let Body::Segment(i) = own.body else { continue };
            let segment = &model.segments[i];
            let acceleration = (after.velocities[i] - before.velocities[i]) / dt;
            own.force += (acceleration - model.gravity) * segment.mass();
            let momentum = |state: &State| apply_inertia(segment, &state.orientations[i], &state.angular_velocities[i]);
            own.moment += (momentum(after) - momentum(before)) / dt;
        }
        held.extend(anchors);
        held
    }
}
