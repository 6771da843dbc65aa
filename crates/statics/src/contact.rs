//! Contacts of rods at rest with obstacles, without friction.
//!
//! At rest `z >= 0`, `gap >= 0` and `z gap = 0`: the energy is at a minimum over all shapes that overlap nothing. Each linear
//! solve takes the contacts for which `z - k (gap + J dp) > 0` as pressing and all others as open, and is done again as long as
//! that changes (a primal-dual active set; Hintermueller, Ito and Kunisch 2002). A contact that presses has the force
//! `z - k (gap + J dp)`, as in the method of multipliers (Hestenes 1969): k has no part in what is at rest, and only makes
//! the solves regular.
//!
//! The energy less `z gap` has the tangent `K - z gap''`, of which both parts are exact. With y from the nearest place of the
//! obstacle's axis to that of the segment's, `y = rho n`, both of which slide as the segment moves,
//!
//! ```text
//! gap'' = (|q|^2 - (n.q)^2) / rho + n.(phi x (phi x r)) - v^T M^-1 v        q = dx + phi x r
//! v = [q.d / rho + n.(phi x d), -q.e / rho]   M = [1, -d.e; -d.e, 1] / rho
//! ```
//!
//! for the axes d of the segment and e of the obstacle; an end of an axis does not slide, and a plane has `rho` infinite.

use std::collections::HashSet;

use collision::closest;
use component::{Component, Members};
use jointed::tangent::elimination::Elimination;
use jointed::tangent::{BodyRow, Equations, curvature};
use kernels::math::Vec3;
use nalgebra::{Vector3, Vector6};
use rod::{ContactForce, Touched};
use rod::{Model, ObstacleShape};

use crate::error::StaticError;

/// Overlap that may be left where it does not shrink, in radii.
const NEGLIGIBLE: f64 = 1e-4;
/// Depth from which on a rod lies in an obstacle, in radii.
const OVERLAP: f64 = 1e-3;
/// k over the stiffness B / l^3 with which a joint bends, and over the largest force in joints by the length of a segment.
const STIFFNESS: f64 = 1e4;
const TENSION: f64 = 10.0;
/// By how much an obstacle that rods lie in at the start comes out to its place in a step, over the length of the shortest segment.
const RISE: f64 = 0.5;
/// How far what presses may slide in a step, over the distance of the axes.
const ASIDE: f64 = 0.3;
/// The same distance is at least such a share of the radius, so that what is on the axis leaves it.
const LEAST_DISTANCE: f64 = 0.1;
/// Distance over the radius up to which axes cross, and no direction from one to the other is known.
const ON_THE_AXIS: f64 = 1e-9;
/// Share of an obstacle's and a rod's radius that is taken away at first where a search has failed.
const WITHDRAWN: f64 = 0.9;
/// The share of an axis that is its end.
const END: f64 = 1e-9;
/// Axes that are parallel to within this sine squared do not slide along each other.
const PARALLEL: f64 = 1e-6;

/// A place where a segment may touch an obstacle.
#[derive(Clone, Copy, Debug)]
struct Contact {
    body: usize,
    obstacle: usize,
    /// The end of the segment's axis that is held off a plane; `None`: the place of it that is nearest.
    end: Option<f64>,
    /// Whether a neighbour's far end touches in the place of this one's near end.
    goes_on: bool,
    /// Half the length of the axis, and the radius [m].
    half: f64,
    radius: f64,
    /// Force on the segment [N].
    force: f64,
    presses: bool,
    /// At the last evaluation: gap [m], normal out of the obstacle, from the segment's centre to the place [m].
    gap: f64,
    normal: Vector3<f64>,
    arm: Vector3<f64>,
    /// Distance of the axes [m], infinite for a plane, and the axes along which the nearest places slide.
    distance: f64,
    slides: [Option<Vector3<f64>>; 2],
}

/// All places where a connected set may touch obstacles.
#[derive(Clone, Debug, Default)]
pub(super) struct Contacts {
    contacts: Vec<Contact>,
    obstacles: Vec<ObstacleShape>,
    /// k [N/m], and the part of it that bending asks for.
    stiffness: f64,
    of_bending: f64,
    /// Length of the shortest segment [m].
    shortest: f64,
    /// How far each obstacle still stands back from its place, so that what lies in it at the start comes out step by step [m].
    reliefs: Vec<f64>,
    /// Largest change of a force in the last solve over k [m].
    pub(super) change: f64,
    /// What of it is no more than rounding where it does not shrink [m].
    pub(super) negligible: f64,
}

/// Refuses what contacts at rest do not know.
pub(super) fn refuse_unknown(model: &Model) -> Result<(), StaticError> {
    let refused = |what: &'static str| Err(StaticError::UnknownContacts(what));
    if model.contacts.is_empty() {
        return Ok(());
    }
    if model.contacts.between_segments.is_some() {
        return refused("none between segments");
    }
    let is_round = |shape: &ObstacleShape| {
        matches!(shape, ObstacleShape::HalfSpace { .. } | ObstacleShape::Sphere { .. } | ObstacleShape::Capsule { .. })
    };
    if !model.contacts.obstacles.iter().all(|obstacle| is_round(&obstacle.shape)) {
        return refused("no boxes, cylinders with flat ends and meshes");
    }
    if model.segments.iter().any(|segment| segment.surface().is_some()) {
        return refused("no rigid bodies with flat faces");
    }
    Ok(())
}

impl Contacts {
    pub(super) fn new(model: &Model, members: &Members, component: &Component<f64>) -> Self {
        let obstacles: Vec<_> = model.contacts.obstacles.iter().map(|obstacle| obstacle.shape.clone()).collect();
        let mut contacts = Vec::new();
        let mut stiffness = 0.0_f64;
        if obstacles.is_empty() {
            return Self::default();
        }
        for (&index, ends) in members.joints.iter().zip(&component.system.topology.joints) {
            let joint = &model.joints[index];
            let least = joint.bend_compliance.min(joint.bend_compliance + joint.bend_extra);
            let length = ends.iter().map(|&body| body as usize).filter(|&body| body < members.segments.len());
            let length = length.map(|body| component.length(body)).fold(joint.length, f64::max);
            if least > 0.0 {
                stiffness = stiffness.max(STIFFNESS / (least * joint.length * length.powi(3)));
            }
        }
        // Where two segments meet end to end, the end of the first one stands for both if it is as thick, unless the joint gives way across.
        let goes_on: HashSet<usize> = members.joints.iter().filter_map(|&k| going_on(model, k)).collect();
        for (body, &index) in members.segments.iter().enumerate() {
            let Some((half, radius)) = model.segments[index].capsule() else { continue };
            if component.system.topology.fixed[body] {
                continue;
            }
            let goes_on = goes_on.contains(&index);
            for (obstacle, shape) in obstacles.iter().enumerate() {
                let of_plane = [(!goes_on).then_some(-half), Some(half)];
                let ends = match shape {
                    ObstacleShape::HalfSpace { .. } => of_plane.into_iter().flatten().map(Some).collect(),
                    _ => vec![None],
                };
                contacts.extend(ends.into_iter().map(|end| Contact {
                    body,
                    obstacle,
                    end,
                    goes_on,
                    half,
                    radius,
                    force: 0.0,
                    presses: false,
                    gap: f64::INFINITY,
                    normal: Vector3::z(),
                    arm: Vector3::zeros(),
                    distance: f64::INFINITY,
                    slides: [None; 2],
                }));
            }
        }
        let lengths = (0..members.segments.len()).map(|body| component.length(body));
        let shortest = lengths.fold(f64::INFINITY, f64::min);
        let thinnest = contacts.iter().map(|contact: &Contact| contact.radius).fold(f64::INFINITY, f64::min);
        let negligible = NEGLIGIBLE * thinnest;
        let reliefs = vec![0.0; obstacles.len()];
        let mut own =
            Self { contacts, obstacles, stiffness, of_bending: stiffness, shortest, reliefs, change: 0.0, negligible };
        own.evaluate(component);
        let Self { contacts, reliefs, .. } = &mut own;
        for contact in contacts.iter().filter(|contact| contact.gap < -OVERLAP * contact.radius) {
            let relief = &mut reliefs[contact.obstacle];
            *relief = relief.max(-contact.gap);
        }
        own
    }

    /// Lets round obstacles begin as thin as they can be without a rod on the other side of their axes; they grow back as those grow that rods lie in. Returns
    /// whether there are any.
    pub(super) fn withdraw(&mut self) -> bool {
        let thinnest = self.contacts.iter().map(|contact| contact.radius).fold(f64::INFINITY, f64::min);
        let mut any = false;
        for (relief, obstacle) in self.reliefs.iter_mut().zip(&self.obstacles) {
            if let ObstacleShape::Sphere { radius, .. } | ObstacleShape::Capsule { radius, .. } = obstacle {
                *relief = relief.max(WITHDRAWN * (radius + thinnest));
                any = true;
            }
        }
        any
    }

    pub(super) fn is_empty(&self) -> bool {
        self.contacts.is_empty()
    }

    /// Evaluates gaps where the component stands; those press that the gaps and the forces so far say.
    pub(super) fn evaluate(&mut self, component: &Component<f64>) {
        let sizes = component.lambda.iter().map(|lambda| lambda.linear.norm_squared());
        let tension = sizes.fold(0.0, f64::max).sqrt();
        self.stiffness = self.of_bending.max(TENSION * tension / self.shortest);
        let Self { contacts, obstacles, stiffness, reliefs, .. } = self;
        for contact in contacts {
            let pose = &component.poses[contact.body];
            let (x, d) = (Vector3::from(pose.x.0), Vector3::from(pose.q.axis().0));
            contact.evaluate(&obstacles[contact.obstacle], x, d);
            contact.gap += reliefs[contact.obstacle];
            contact.presses = contact.force - *stiffness * contact.gap > 0.0;
        }
    }

    /// Adds the contacts that press to the equations of the last evaluation.
    pub(super) fn add(&self, equations: &mut Equations) {
        equations.rows.clear();
        for contact in self.contacts.iter().filter(|contact| contact.presses) {
            let row = contact.row();
            let force = contact.force - self.stiffness * contact.gap;
            let body = &mut equations.bodies[contact.body];
            let kernel = |x: Vector3<f64>| Vec3(x.into());
            body.defect.linear += kernel(contact.normal * force);
            body.defect.angular += kernel(contact.arm.cross(&contact.normal) * force);
            body.turning += curvature::of_force(kernel(contact.normal * contact.force), kernel(contact.arm));
            let mut add = |row: Vector6<f64>, stiffness: f64| {
                equations.rows.push(BodyRow { body: contact.body as u32, row: row.into(), stiffness });
            };
            add(row, self.stiffness);
            contact.add_curvature(&mut add);
        }
    }

    /// Which contacts press after a solve; returns whether those are others than before.
    pub(super) fn choose(&mut self, elimination: &Elimination) -> bool {
        let mut changed = false;
        for contact in &mut self.contacts {
            let presses = contact.answered(elimination, self.stiffness) > 0.0;
            changed |= presses != contact.presses;
            contact.presses = presses;
        }
        changed
    }

    /// Takes over the forces of a solve.
    pub(super) fn take(&mut self, elimination: &Elimination) {
        self.change = 0.0;
        for contact in &mut self.contacts {
            let force = contact.answered(elimination, self.stiffness).max(0.0);
            self.change = self.change.max((force - contact.force).abs() / self.stiffness);
            contact.force = force;
        }
        let rise = RISE * self.shortest;
        self.reliefs.iter_mut().for_each(|relief| *relief = (*relief - rise).max(0.0));
    }

    /// Whether all obstacles are in their places.
    pub(super) fn are_placed(&self) -> bool {
        self.reliefs.iter().all(|&relief| relief == 0.0)
    }

    /// How many times the step what presses moves aside by no more than a part of its distance from the axis of what it presses on;
    /// infinite where nothing presses but on planes.
    pub(super) fn farthest(&self, elimination: &Elimination) -> f64 {
        let near = self.contacts.iter().filter(|contact| contact.presses && contact.distance.is_finite());
        near.map(|contact| {
            let dp = &elimination.corrections[contact.body];
            let moved = Vector3::from(dp.linear.0) + Vector3::from(dp.angular.0).cross(&contact.arm);
            let aside = (moved - contact.normal * contact.normal.dot(&moved)).norm();
            ASIDE * contact.distance.max(LEAST_DISTANCE * contact.radius) / aside.max(f64::MIN_POSITIVE)
        })
        .fold(f64::INFINITY, f64::min)
    }

    /// What presses, as forces on the segments of the model.
    pub(super) fn forces(&self, members: &Members, component: &Component<f64>) -> impl Iterator<Item = ContactForce> {
        let pressing = self.contacts.iter().filter(|contact| contact.force > 0.0);
        pressing.map(|contact| ContactForce {
            segment: members.segments[contact.body],
            other: Touched::Obstacle(contact.obstacle),
            place: Vector3::from(component.poses[contact.body].x.0) + contact.arm - contact.normal * contact.radius,
            normal: contact.normal,
            force: contact.normal * contact.force,
            slip: Vector3::zeros(),
        })
    }
}

/// The segment whose start is the end of another at a joint that does not give way across, if that one is as thick.
fn going_on(model: &Model, joint: usize) -> Option<usize> {
    let joint = &model.joints[joint];
    let (rod::Body::Segment(first), rod::Body::Segment(second)) = (joint.a, joint.b) else { return None };
    let is_end = |offset: f64, half: f64| (offset.abs() - half).abs() <= 1e-6 * half;
    let [(half_a, radius_a), (half_b, radius_b)] =
        [model.segments[first].capsule()?, model.segments[second].capsule()?];
    let holds = joint.mount.is_none()
        && joint.freedom != rod::Freedom::Broken
        && joint.shear_compliance <= rod::Joint::RIGID
        && joint.offset_b < 0.0
        && is_end(joint.offset_b, half_b)
        && is_end(joint.offset_a, half_a);
    (holds && radius_a >= radius_b).then_some(second)
}

impl Contact {
    fn evaluate(&mut self, shape: &ObstacleShape, x: Vector3<f64>, d: Vector3<f64>) {
        let axis = match shape {
            ObstacleShape::HalfSpace { point, normal } => {
                self.arm = d * self.end.unwrap_or_default();
                self.normal = **normal;
                self.gap = (x + self.arm - point).dot(normal) - self.radius;
                return;
            }
            ObstacleShape::Sphere { centre, radius } => ([*centre; 2], *radius),
            ObstacleShape::Capsule { start, end, radius } => ([*start, *end], *radius),
            // Refused before.
            _ => return,
        };
        let (own, (other, radius)) = ([x - d * self.half, x + d * self.half], axis);
        let near = closest::segments(&own, &other);
        self.arm = d * (self.half * (2.0 * near.s - 1.0));
        self.distance = near.distance;
        let is_neighbours = self.goes_on && near.s < END;
        self.gap = if is_neighbours { f64::INFINITY } else { near.distance - radius - self.radius };
        let across = d.cross(&if d.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() }).normalize();
        self.normal = near.separation.try_normalize(ON_THE_AXIS * self.radius).unwrap_or(across);
        let within = |share: f64| (END..1.0 - END).contains(&share);
        let along = (other[1] - other[0]).try_normalize(0.0);
        self.slides = [within(near.s).then_some(d), along.filter(|_| within(near.t))];
    }

    /// The derivative of the gap.
    fn row(&self) -> Vector6<f64> {
        six(self.normal, self.arm.cross(&self.normal))
    }

    /// The force after a solve's step.
    fn answered(&self, elimination: &Elimination, stiffness: f64) -> f64 {
        self.force
            - stiffness * (self.gap + self.row().dot(&Vector6::from(elimination.corrections[self.body].to_array())))
    }

    /// Adds `-z gap''`, but for how the arm turns.
    fn add_curvature(&self, add: &mut impl FnMut(Vector6<f64>, f64)) {
        let Self { force, distance, normal, arm, .. } = *self;
        if !distance.is_finite() || distance == 0.0 {
            return;
        }
        let first = normal.cross(&if normal.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() }).normalize();
        for tangent in [first, normal.cross(&first)] {
            add(six(tangent, arm.cross(&tangent)), -force / distance);
        }
        let own = |d: Vector3<f64>| six(d / distance, d.cross(&normal));
        let other = |e: Vector3<f64>| six(-e / distance, -arm.cross(&e) / distance);
        match self.slides {
            [Some(d), None] => add(own(d), force * distance),
            [None, Some(e)] => add(other(e), force * distance),
            [Some(d), Some(e)] => {
                add(own(d), force * distance);
                let (cosine, sine_squared) = (d.dot(&e), d.cross(&e).norm_squared());
                if sine_squared > PARALLEL {
                    add(other(e) + own(d) * cosine, force * distance / sine_squared);
                }
            }
            [None, None] => {}
        }
    }
}

fn six(linear: Vector3<f64>, angular: Vector3<f64>) -> Vector6<f64> {
    Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
}
