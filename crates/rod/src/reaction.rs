//! What it takes to hold what is held: the forces and moments of grips, clamps and anchors.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::{Body, JointForce, Model, Segment, State};

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
            let a = model.pose(joint.a, after);
            let moment = a.orientation * given.moment;
            let mut add = |body: Body, offset: f64, sign: f64| {
                let own = match body {
                    Body::Segment(i) => &mut segments[i],
                    Body::Anchor(i) => &mut anchors[i],
                };
                let arm = model.pose(body, after).orientation * Vector3::z() * offset;
                own.force -= given.force * sign;
                own.moment -= (arm.cross(&given.force) + moment) * sign;
            };
            add(joint.a, joint.offset_a, 1.0);
            add(joint.b, joint.offset_b, -1.0);
        }
        for load in &model.loads {
            let own = &mut segments[load.segment];
            own.force -= load.force;
            own.moment -= (after.axis(load.segment) * load.offset).cross(&load.force) + load.torque;
        }
        for (i, (segment, own)) in model.segments.iter().zip(&mut segments).enumerate() {
            let acceleration = (after.velocities[i] - before.velocities[i]) / dt;
            own.force += (acceleration - model.gravity) * segment.mass();
            let [old, new] =
                [before, after].map(|state| inertia(segment, &state.orientations[i]) * state.angular_velocities[i]);
            own.moment += (new - old) / dt;
        }
        let held = segments.into_iter().filter(|own| matches!(own.body, Body::Segment(i) if model.segments[i].fixed));
        held.chain(anchors).collect()
    }
}

/// Inertia of a segment about its centre in world axes [kg m^2].
fn inertia(segment: &Segment, orientation: &UnitQuaternion<f64>) -> Matrix3<f64> {
    let (across, along) = (segment.transverse_inertia(), segment.axial_inertia());
    let own = Matrix3::from_diagonal(&Vector3::new(across, across, along));
    let turn = orientation.to_rotation_matrix();
    turn * own * turn.inverse()
}
