//! A model that is one cable between two grips, as a query.

use std::collections::HashMap;
use std::f64::consts::TAU;

use cosserat::state::{Body, Freedom, Joint, Model, Segment, State};
use nalgebra::{UnitQuaternion, Vector3};

use crate::answer::Equilibrium;
use crate::query::{Cable, Carried, Grip, Query};

/// By how much stiffnesses, lengths and weights along a cable may differ, relative to the first.
const EVEN: f64 = 1e-9;

/// A cable's query, and where its segments are in the model that asks it.
#[derive(Clone, Debug, PartialEq)]
pub struct CableOfModel {
    /// The query.
    pub query: Query,
    /// Indices of the model's segments that are free, from the cable's start on.
    pub segments: Vec<usize>,
}

impl CableOfModel {
    /// The query that a model asks: one even cable between two grips that stand still, at which nothing pulls but its weight along
    /// -z and at most one more: a load that pulls that way, or a mass that is added to a segment. The grips are anchors, or
    /// fixed segments at its ends, which are where `state` has them. `None` of all other models.
    ///
    /// Where segments are fixed, the query's end joints are half as long as the model's, so that its answer is near to the
    /// model's equilibrium; else it is the same.
    pub fn new(model: &Model, state: &State) -> Option<Self> {
        let gravity = model.gravity;
        let is_alone = model.motions.is_empty()
            && model.open.is_empty()
            && model.laws.is_empty()
            && model.breakable.is_empty()
            && model.changes.is_empty()
            && !model.has_followers()
            && model.contacts.is_empty()
            && model.air.is_none();
        if !is_alone || gravity.x != 0.0 || gravity.y != 0.0 || gravity.z > 0.0 {
            return None;
        }
        let joints = chain(model)?;
        let (first, last) = (joints[0], joints[joints.len() - 1]);
        let segments: Vec<usize> = joints[1..].iter().filter_map(|joint| segment(joint.a)).collect();
        if segments.len() + 1 != joints.len() {
            return None;
        }
        let bending = |joint: &Joint| {
            let bends = [joint.bend_compliance, joint.bend_compliance + joint.bend_extra];
            bends.map(|compliance| 1.0 / (compliance * joint.length))
        };
        let torsion = |joint: &Joint| 1.0 / (joint.twist_compliance * joint.length);
        let own = |i: &usize| &model.segments[*i];
        let weight = |segment: &Segment| -gravity.z * segment.own_mass() / segment.length;
        let length = own(&segments[0]).length;
        let is_even = segments.iter().map(own).all(|other| {
            same(other.length, length) && same(weight(other), weight(own(&segments[0]))) && other.body.is_none()
        }) && joints.iter().all(|joint| {
            let pairs = bending(joint).into_iter().zip(bending(first));
            pairs.into_iter().all(|(a, b)| same(a, b))
                && same(torsion(joint), torsion(first))
                && (joint.rest_darboux - first.rest_darboux).norm() <= EVEN * (1.0 + first.rest_darboux.norm())
                && joint.stretch_compliance == first.stretch_compliance
                && joint.shear_compliance == first.stretch_compliance
                && joint.shear_extra == 0.0
                && is_plain(joint)
        });
        if !is_even {
            return None;
        }
        let carried = carried(model, &segments)?;
        let cable = Cable {
            carried,
            length: length * segments.len() as f64,
            bending: bending(first),
            torsion: torsion(first),
            weight: weight(own(&segments[0])),
            rest: first.rest_darboux,
            stretch_compliance: first.stretch_compliance,
        };
        let start = grip(model, state, first.a, first.offset_a);
        let end = Some(grip(model, state, last.b, last.offset_b));
        let query = Query { cable, start, end };
        query.validate().ok().map(|()| Self { query, segments })
    }

    /// Whether `state` can come to an equilibrium without a jump and without turning a grip: whether the cable is in the same
    /// class of twist, and twisted alike within a turn.
    pub fn is_near(&self, state: &State, equilibrium: &Equilibrium) -> bool {
        let own = |i: &usize| state.orientations[*i];
        let drawn = self.twist(self.segments.iter().map(own));
        let found = self.twist(equilibrium.orientations.iter().copied());
        drawn.0 == found.0 && (drawn.1 - found.1).abs() < TAU
    }

    /// Puts an equilibrium in the place of the cable's segments.
    pub fn store(&self, equilibrium: &Equilibrium, state: &mut State) {
        let Equilibrium { positions, orientations, .. } = equilibrium;
        for ((&i, position), orientation) in self.segments.iter().zip(positions).zip(orientations) {
            (state.positions[i], state.orientations[i]) = (*position, *orientation);
        }
    }

    /// Whether quaternions that go on without a jump end in that of the second grip, not in its negative; and the sum of the
    /// turns about the axis from segment to segment.
    fn twist(&self, turns: impl Iterator<Item = UnitQuaternion<f64>>) -> (bool, f64) {
        let end = self.query.end.unwrap_or(self.query.start).orientation;
        let (mut before, mut sign, mut sum) = (self.query.start.orientation, 1.0, 0.0);
        for q in turns.chain([end]) {
            let step = before.inverse() * q;
            let own = if step.w < 0.0 { -1.0 } else { 1.0 };
            sum += 2.0 * (own * step.k).atan2(own * step.w);
            (before, sign) = (q, sign * own);
        }
        (sign > 0.0, sum)
    }
}

/// What a cable of these segments carries; `None` where that is more than one weight.
fn carried(model: &Model, segments: &[usize]) -> Option<Carried> {
    let mut all = Vec::new();
    for (k, &i) in segments.iter().enumerate() {
        let Segment { length, added_mass, .. } = model.segments[i];
        let centre = length * (k as f64 + 0.5);
        if added_mass > 0.0 {
            all.push(Carried { weight: -model.gravity.z * added_mass, place: centre });
        }
        for load in model.loads.iter().filter(|load| load.segment == i) {
            let is_weight = load.force.x == 0.0 && load.force.y == 0.0 && load.force.z <= 0.0;
            let is_on_it = load.torque == Vector3::zeros() && load.offset.abs() <= 0.5 * length;
            if !is_weight || !is_on_it {
                return None;
            }
            all.push(Carried { weight: -load.force.z, place: centre + load.offset });
        }
    }
    (all.len() < 2).then(|| all.first().copied().unwrap_or_default())
}

fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= EVEN * b.abs()
}

/// Whether a joint is one within a rod.
fn is_plain(joint: &Joint) -> bool {
    joint.mount.is_none()
        && joint.freedom == Freedom::None
        && joint.rest_frames.iter().all(|frame| *frame == UnitQuaternion::identity())
}

fn segment(body: Body) -> Option<usize> {
    match body {
        Body::Segment(i) => Some(i),
        Body::Anchor(_) => None,
    }
}

/// All joints, in the order along one chain from what is held to what is held; `None` where there are others.
fn chain(model: &Model) -> Option<Vec<&Joint>> {
    let is_held = |body: Body| segment(body).is_none_or(|i| model.segments[i].fixed);
    let next: HashMap<Body, &Joint> = model.joints.iter().map(|joint| (joint.a, joint)).collect();
    let mut joint = *model.joints.iter().filter(|joint| is_held(joint.a)).collect::<Vec<_>>().first()?;
    let mut joints = vec![joint];
    while !is_held(joint.b) {
        joint = next.get(&joint.b)?;
        joints.push(joint);
        if joints.len() > model.joints.len() {
            return None;
        }
    }
    let held = model.segments.iter().filter(|segment| segment.fixed).count() + model.anchors.len();
    let is_all = joints.len() == model.joints.len() && model.segments.len() + model.anchors.len() == joints.len() + 1;
    (is_all && held == 2 && joints.len() > 1).then_some(joints)
}

/// The face of a held body that a joint is at.
fn grip(model: &Model, state: &State, body: Body, offset: f64) -> Grip {
    let (position, orientation) = match body {
        Body::Segment(i) => (state.positions[i], state.orientations[i]),
        Body::Anchor(k) => (model.anchors[k].position, model.anchors[k].orientation),
    };
    Grip { position: position + orientation * Vector3::z() * offset, orientation }
}
