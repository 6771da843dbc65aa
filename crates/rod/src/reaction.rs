//! What it takes to hold what is held: the forces and moments of grips, clamps and anchors.

use nalgebra::Vector3;

use crate::measure::apply_inertia;
use crate::{Body, JointForce, Model, Segment, State};

/// A force [N] and a moment about a body's position [N m], in world axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wrench {
    /// Force [N].
    pub force: Vector3<f64>,
    /// Moment [N m].
    pub moment: Vector3<f64>,
}

impl Wrench {
    /// Adds a force [N] at `arm` [m] from the body's position, and a moment [N m].
    pub fn add(&mut self, force: &Vector3<f64>, arm: &Vector3<f64>, moment: &Vector3<f64>) {
        self.force += force;
        self.moment += arm.cross(force) + moment;
    }

    fn subtract(&mut self, other: &Self) {
        self.force -= other.force;
        self.moment -= other.moment;
    }
}

/// What holds a fixed segment or an anchor gives to it, in world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reaction {
    /// The body that is held.
    pub body: Body,
    /// Force [N].
    pub force: Vector3<f64>,
    /// Moment about the body's position [N m].
    pub moment: Vector3<f64>,
    /// What else acts on the body; with the reaction, it makes up for `inertia`.
    pub parts: ReactionParts,
}

/// What acts on a held body beside what holds it, each as a force and a moment on the body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReactionParts {
    /// Of its joints.
    pub joints: Wrench,
    /// Of what presses on it, friction included.
    pub contacts: Wrench,
    /// Of the air.
    pub drag: Wrench,
    /// Of the model's loads.
    pub loads: Wrench,
    /// What moves it as it moves, less its weight: `m (a - g)` and `d(I w)/dt`.
    pub inertia: Wrench,
}

impl ReactionParts {
    /// Names of the parts, in the order of [`ReactionParts::all`].
    pub const NAMES: [&str; 5] = ["joints", "contacts", "drag", "loads", "inertia"];

    /// The parts in the order of their declaration.
    pub fn all(&self) -> [Wrench; 5] {
        [self.joints, self.contacts, self.drag, self.loads, self.inertia]
    }
}

impl Reaction {
    /// The reactions at the end of a step from state `before` to state `after` at the times `[from, to]` [s], in which joints
    /// transmit `forces`, one a joint, and what presses on segments gives them `contacts`, one a segment; none may be given
    /// where nothing touches. Fixed segments come in their order, then anchors. What of the model changes over time must be that
    /// of the end of the step: see [`Model::set_time`].
    ///
    /// Eyelets and pulleys are not among them, nor are fixed segments that bear their forces: see [`crate::Sliding`] and [`crate::OnPulley`].
    ///
    /// A fixed segment's is what moves it as it moves, beside gravity, its loads, its joints, its contacts and the air's drag on
    /// it: `m (a - g) - F` and `d(I w)/dt - M` with velocities that change from state to state. An anchor has no mass.
    pub fn all(
        model: &Model,
        [before, after]: [&State; 2],
        [from, to]: [f64; 2],
        forces: &[JointForce],
        contacts: &[Wrench],
    ) -> Vec<Self> {
        let mut anchors = vec![ReactionParts::default(); model.anchors.len()];
        let mut segments = vec![ReactionParts::default(); model.segments.len()];
        for (joint, given) in model.joints.iter().zip(forces) {
            let [a, b] = [joint.a, joint.b].map(|body| model.pose(body, after).orientation);
            let moment = a * given.moment;
            let mut add = |body: Body, arm: Vector3<f64>, sign: f64| {
                let own = match body {
                    Body::Segment(i) => &mut segments[i],
                    Body::Anchor(i) => &mut anchors[i],
                };
                own.joints.add(&(given.force * sign), &arm, &(moment * sign));
            };
            add(joint.a, joint.arm_a(&a), 1.0);
            add(joint.b, joint.arm_b(&b), -1.0);
        }
        for load in &model.loads {
            let arm = after.axis(load.segment) * load.offset;
            let [force, torque] = load.in_world(&after.orientations[load.segment]);
            segments[load.segment].loads.add(&force, &arm, &torque);
        }
        // The wind is the same for all.
        let air = model.air.as_ref().map(|air| (air, air.wind.at(to)));
        let mut held = Vec::new();
        // Equilibria may share a time.
        let rate = if to > from { 1.0 / (to - from) } else { 0.0 };
        let eyelets = model.sliding_joints.iter().map(|joint| (joint.holder, &joint.segments));
        let through = || eyelets.clone().chain(model.pulleys.iter().map(|pulley| (pulley.holder, &pulley.segments)));
        let bears_eyelet = |i: &usize| through().any(|(holder, rod)| holder == Body::Segment(*i) || rod.contains(i));
        let is_told = |(i, segment): &(usize, &Segment)| segment.fixed && !bears_eyelet(i);
        for (i, segment) in model.segments.iter().enumerate().filter(is_told) {
            let parts = &mut segments[i];
            let acceleration = (after.velocities[i] - before.velocities[i]) * rate;
            let momentum = |state: &State| apply_inertia(segment, &state.orientations[i], &state.angular_velocities[i]);
            parts.inertia = Wrench {
                force: (acceleration - model.gravity) * segment.mass(),
                moment: (momentum(after) - momentum(before)) * rate,
            };
            parts.contacts = contacts.get(i).copied().unwrap_or_default();
            parts.drag = air.as_ref().map_or_else(Wrench::default, |(air, wind)| model.drag_in(air, wind, i, after));
            held.push((Body::Segment(i), *parts));
        }
        let is_eyelet = |i: usize| through().any(|(holder, _)| holder == Body::Anchor(i));
        let anchors = anchors.into_iter().enumerate().filter(|(i, _)| !is_eyelet(*i));
        held.extend(anchors.map(|(i, parts)| (Body::Anchor(i), parts)));
        held.into_iter().map(|(body, parts)| Self::of(body, parts)).collect()
    }

    /// What holds a body on which the parts act.
    fn of(body: Body, parts: ReactionParts) -> Self {
        let mut sum = parts.inertia;
        for given in [parts.joints, parts.contacts, parts.drag, parts.loads] {
            sum.subtract(&given);
        }
        Self { body, force: sum.force, moment: sum.moment, parts }
    }
}
