//! Where two bodies touch: normal, gap, slip and lever arms of a contact at the current poses.

use collision::sweep::{crosses, crossing_normal, first_touch};
use collision::{TriangleMesh, closest};
use component::snapshot::StateVisitor;
use kernels::Spatial;
use kernels::math::Vec3;
use nalgebra::Vector3;
use rod::{Friction, ObstacleShape};

use super::convert::{to_kernel, to_nalgebra};
use super::key::{Feature, Key, Partner, key, words};
use super::obstacles::Placed;
use super::shape::{Carrier, Components, Poses, Shape, Side, are_parallel, frame};
use super::sheath::{Tube, Wall};
use super::stiffness::tilt_arms;

/// Squared sine of the angle between two axes below which their nearest places may stay where they were.
const NEARLY_PARALLEL: f64 = 0.1;

/// A possible contact over one step.
#[derive(Clone, Copy, Debug)]
pub struct Contact {
    /// What identifies it from step to step.
    pub key: Key,
    /// The law of its friction.
    pub friction: Friction,
    /// Coefficient of friction in this step, once it is chosen: see [`Contact::choose_coefficient`].
    pub coefficient: f64,
    /// Whether it is chosen.
    pub has_coefficient: bool,
    /// By how much its surfaces have slid past each other in the last step [m]; zero where friction is the same at rest and sliding.
    pub last_slip: Vec3<f64>,
    /// The same in all steps in a row in which it gave way [m].
    pub slid: Vec3<f64>,
    /// From the partner to the segment.
    pub normal: Vec3<f64>,
    /// Normal and two tangents.
    pub frame: [Vec3<f64>; 3],
    /// From the centres of segment and partner to the place of contact [m].
    pub arms: [Vec3<f64>; 2],
    /// Distance of the surfaces along the normal [m].
    pub gap: f64,
    /// That of the nearest places, which may be more where the normal settles, and less where places do [m].
    pub distance: f64,
    /// How far the surfaces have slipped past each other since the start of the step [m].
    pub slip: Vec3<f64>,
    /// Gap to keep at least [m]: above 0 where the bodies bounce, below where an overlap at the start is let out.
    pub target: f64,
    /// Impulse times dt on the segment so far in this step [N s^2].
    pub impulse: Vec3<f64>,
    /// What of it has moved its bodies: without a momentum residual nothing brings them after an impulse that has turned since.
    pub applied: Vec3<f64>,
    /// That of the step before in its frame, from which the sweeps begin.
    pub guess: [f64; 3],
    /// Steps in a row in which it has pressed.
    pub pressed: u32,
    /// Compliance along and across the normal to its own impulse, as of the last solve; 0 before.
    pub compliance: [f64; 2],
    /// The time by whose square its impulse is a force [s]: see [`Component::effective_dt`]; 0 before the first.
    pub effective_dt: f64,
    /// Error, relative to the radius.
    pub residual: f64,
    /// Smaller radius of the two [m].
    pub radius: f64,
    /// The ends of the two axes at which the places of contact are, 0 or 1, where it is the nearest places of both that touch.
    pub(crate) ends: [Option<u8>; 2],
    /// Its gap at the start of the step, at least [m]; below all where that is not known.
    pub gap_at_start: f64,
    /// Whether it was left out of the last evaluation, as it could not touch.
    pub is_left_out: bool,
    /// Where on the two axes the places of contact are, from 0 to 1.
    places: [f64; 2],
    /// By how much other places on axes that are nearly parallel must be nearer to take the place of those before [m].
    pub hysteresis: f64,
    /// By how much other places are nearer \[m\].
    pub closer_by: f64,
    /// What its force is multiplied by to be the stiffness against a tilt of each axis: see `stiffness.rs` \[m\].
    pub tilt_arms: [f64; 2],
    /// Of a contact in a sheath, where along the outer rod it is [m], and how the wall shares its force.
    pub(super) place: f64,
    pub(super) wall: Wall,
    /// Whether another contact holds the same places apart, or nothing of it moves.
    pub is_duplicate: bool,
    /// Whether a deeper contact with the same mesh is solved for first.
    pub is_deferred: bool,
}

/// Positions of all that can touch, in one step.
pub struct World<'a> {
    /// Segments of the model.
    pub shapes: &'a [Shape],
    /// Obstacles of the model.
    pub obstacles: &'a [Placed],
    /// Segments that are rigid bodies with meshes, ascending.
    pub bodies: &'a [(u32, TriangleMesh)],
    /// Sheaths of the model.
    pub tubes: &'a [Tube],
}

impl World<'_> {
    /// Whether a segment is a rigid body with a mesh.
    pub fn is_mesh(&self, index: u32) -> bool {
        self.bodies.binary_search_by_key(&index, |body| body.0).is_ok()
    }

    /// The mesh of segment `index`, and where it is at the start of the step and in `poses`.
    pub(super) fn body(&self, index: u32, components: &impl Components, poses: Poses) -> Option<Carrier<'_>> {
        let place = self.bodies.binary_search_by_key(&index, |body| body.0).ok()?;
        let shape = &self.shapes[index as usize];
        let component = &components.component(shape.component);
        let start = component.start[shape.body as usize];
        let now = if poses == Poses::Start { start } else { component.poses[shape.body as usize] };
        Some(Carrier { mesh: &self.bodies[place].1, frames: [start, now], body: Some([start, now]) })
    }
}

impl Contact {
    /// One that is not evaluated yet; `radius`: the smaller one of the two \[m\].
    pub fn new(key: Key, friction: Friction, radius: f64) -> Self {
        let zero = Vec3::zero();
        Self {
            key,
            friction,
            coefficient: friction.at_rest,
            has_coefficient: friction.sliding == friction.at_rest,
            last_slip: zero,
            slid: zero,
            normal: zero,
            frame: [zero; 3],
            arms: [zero; 2],
            gap: 0.0,
            distance: 0.0,
            slip: zero,
            target: 0.0,
            impulse: zero,
            applied: zero,
            guess: [0.0; 3],
            pressed: 0,
            compliance: [0.0; 2],
            effective_dt: 0.0,
            residual: 0.0,
            radius,
            ends: [None; 2],
            gap_at_start: f64::NEG_INFINITY,
            is_left_out: false,
            places: [0.5; 2],
            hysteresis: 0.0,
            closer_by: 0.0,
            tilt_arms: [0.0; 2],
            place: 0.0,
            wall: Wall::NONE,
            is_duplicate: false,
            is_deferred: false,
        }
    }

    /// One that a visitor will fill.
    pub fn blank() -> Self {
        Self::new((0, Partner::Obstacle(0), Feature::Nearest), Friction::default(), 0.0)
    }

    /// Shows a visitor what the next step takes over from a contact that presses, and what is read off between steps.
    pub fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        let mut own = words(self.key);
        own.iter_mut().for_each(|word| visitor.word(word));
        self.key = key(own);
        let (now, before) = (&mut self.last_slip, &mut self.slid);
        for vector in self.arms.iter_mut().chain([&mut self.normal, &mut self.slip, &mut self.impulse, now, before]) {
            visitor.vector(vector);
        }
        let Friction { at_rest, sliding } = &mut self.friction;
        for number in [&mut self.target, &mut self.radius, &mut self.effective_dt, at_rest, sliding] {
            visitor.number(number);
        }
        let mut pressed = self.pressed as usize;
        visitor.count(&mut pressed);
        self.pressed = pressed as u32;
        if self.is_of_sheath() {
            self.wall.visit_state(visitor);
        }
        self.frame = frame(self.normal);
    }

    /// Evaluates the contact at the components' poses.
    pub fn evaluate(&mut self, world: &World<'_>, components: &impl Components, poses: Poses) {
        let (index, partner, feature) = self.key;
        let shape = &world.shapes[index as usize];
        let own = Side::of(shape, components.component(shape.component), poses);
        match partner {
            Partner::Segment(other) => {
                let shape = &world.shapes[other as usize];
                let other = Side::of(shape, components.component(shape.component), poses);
                self.between(&own, &other, feature, poses);
            }
            _ if self.is_of_solid() => {
                let obstacle = partner.obstacle().map(|which| &world.obstacles[which as usize]);
                if let (Some(body), Some(obstacle)) = (world.body(index, components, poses), obstacle) {
                    self.of_solid(&body, obstacle, poses);
                }
            }
            Partner::Obstacle(index) => {
                let obstacle = &world.obstacles[index as usize];
                let other = obstacle.side(poses);
                if let ObstacleShape::HalfSpace { point, normal } = obstacle.shape(poses) {
                    let normal = to_kernel(normal);
                    let (end, radius) = match feature {
                        Feature::Corner(corner) => {
                            let body = world.body(self.key.0, components, poses);
                            // What does not count is where the centre is, above all.
                            (body.and_then(|body| body.farthest(corner, normal)).unwrap_or(own.now.x), 0.0)
                        }
                        Feature::Own(1) => (own.ends[1], own.radius),
                        _ => (own.ends[0], own.radius),
                    };
                    let gap = normal.dot(end - to_kernel(point)) - radius;
                    self.set(&own, other.as_ref(), normal, gap, end - normal * (radius + 0.5 * gap));
                } else if let Some(other) = other {
                    self.between(&own, &other, feature, poses);
                }
            }
            Partner::Sheath(index) => {
                let tube = &world.tubes[index as usize];
                self.in_sheath(&own, tube, (world.shapes, components, poses));
            }
            Partner::Face(..)
            | Partner::Edge(..)
            | Partner::Corner(..)
            | Partner::BodyFace(..)
            | Partner::BodyEdge(..) => {
                let carrier = match partner.whole() {
                    Partner::Segment(index) => world.body(index, components, poses),
                    other => other.obstacle().and_then(|index| world.obstacles[index as usize].carrier(poses)),
                };
                if let Some(carrier) = carrier {
                    self.with_part(&own, &carrier, poses);
                }
            }
        }
    }

    /// Evaluates a contact between two capsules. Returns the direction from the other one between the places; `None` where they
    /// have passed through each other.
    pub(super) fn between(&mut self, own: &Side, other: &Side, feature: Feature, poses: Poses) -> Option<Vec3<f64>> {
        let reach = own.radius + other.radius;
        let [s, t] = match feature {
            Feature::Nearest | Feature::Corner(_) | Feature::Face(_) | Feature::Edge(_) => {
                nearest(own.ends, other.ends)
            }
            Feature::Own(end) => [f64::from(end), nearest_to(other.ends, own.ends[end as usize])],
            Feature::Partners(end) => [nearest_to(own.ends, other.ends[end as usize]), f64::from(end)],
        };
        let [s, t] = if poses == Poses::Start { [s, t] } else { self.steadied(own, other, [s, t], poses) };
        self.places = [s, t];
        self.ends = match feature {
            Feature::Nearest => [s, t].map(end_at),
            _ => [None; 2],
        };
        // An end beyond the other axis is no end of the line along which the two touch.
        self.is_duplicate = match feature {
            Feature::Nearest | Feature::Corner(_) | Feature::Face(_) | Feature::Edge(_) => false,
            Feature::Own(_) => t <= 0.0 || t >= 1.0,
            Feature::Partners(_) => s <= 0.0 || s >= 1.0,
        };
        let (mut a, mut b) = (own.at(s), other.at(t));
        let difference = a - b;
        let distance = difference.norm_squared().sqrt();
        let mut normal = if distance > 0.0 { difference * (1.0 / distance) } else { across(own.ends, other.ends) };
        let mut direction = (distance > 0.0).then_some(normal);
        // Fast enough to have passed through the other: what counts is the side from which it came.
        let moved = |side: &Side, k: usize| side.ends[k] - side.ends_before[k];
        let apart = |i: usize, j: usize| (moved(own, i) - moved(other, j)).norm_squared();
        let travel = apart(0, 0).max(apart(0, 1)).max(apart(1, 0)).max(apart(1, 1));
        let hit = (travel > 0.25 * reach * reach).then(|| first_touch(&own.way(), &other.way())).flatten();
        // Where one has turned far since, normals need not tell.
        let has_crossed = hit.is_some() && self.target >= 0.0 && crosses(&own.way(), &other.way());
        if let Some(hit) = hit
            && (has_crossed || to_kernel(&hit.normal).dot(normal) < 0.0 || distance == 0.0)
        {
            // Ends follow when the nearest places are back where they belong.
            self.is_duplicate |= feature != Feature::Nearest;
            self.ends = [None; 2];
            self.places = [hit.s, hit.t];
            (a, b, normal) = (own.at(hit.s), other.at(hit.t), to_kernel(&hit.normal));
            direction = None;
        }
        if poses == Poses::Settling {
            let between = normal + self.normal;
            let size = between.norm_squared().sqrt();
            if size > 0.1 {
                normal = between * (1.0 / size);
            }
        }
        let within = self.places.map(|place| place > 0.0 && place < 1.0);
        let moves = match feature {
            Feature::Own(_) => [false, within[1]],
            Feature::Partners(_) => [within[0], false],
            _ => within,
        };
        self.tilt_arms = tilt_arms([own.ends, other.ends], moves, distance);
        self.meet(own, other, [a, b], normal);
        if has_crossed {
            self.gap = self.gap.min(-distance - reach);
            self.distance = self.gap;
        }
        if poses == Poses::Settling && direction.is_some() {
            self.distance = distance - self.closer_by - reach;
        }
        direction
    }

    /// The places where the two touch, where others are `nearest`: on axes that are nearly parallel those of the evaluation before while
    /// others are no nearer to speak of, and half-way to these once places settle. There a turn too small to matter takes the nearest
    /// places from one end to the other, and with them the torques of the contact's force: what solves for the balance of torques would
    /// follow them to and fro.
    fn steadied(&mut self, own: &Side, other: &Side, nearest: [f64; 2], poses: Poses) -> [f64; 2] {
        self.closer_by = 0.0;
        let before = self.places;
        let moves = self.hysteresis > 0.0 && self.normal != Vec3::zero() && before != nearest;
        if !moves || !are_parallel(own.ends, other.ends, NEARLY_PARALLEL) {
            return nearest;
        }
        let distance = |[s, t]: [f64; 2]| (own.at(s) - other.at(t)).norm_squared().sqrt();
        if distance(before) - distance(nearest) <= self.hysteresis {
            return before;
        }
        if poses != Poses::Settling {
            return nearest;
        }
        let between = [0, 1].map(|k| 0.5 * (before[k] + nearest[k]));
        self.closer_by = distance(between) - distance(nearest);
        between
    }

    /// Sets what is between two capsules that meet at `a` and `b` on their axes.
    fn meet(&mut self, own: &Side, other: &Side, [a, b]: [Vec3<f64>; 2], normal: Vec3<f64>) {
        let gap = normal.dot(a - b) - own.radius - other.radius;
        let place = (a - normal * own.radius + b + normal * other.radius) * 0.5;
        self.set(own, Some(other), normal, gap, place);
    }

    pub(super) fn set(&mut self, own: &Side, other: Option<&Side>, normal: Vec3<f64>, gap: f64, place: Vec3<f64>) {
        (self.gap, self.distance) = (gap, gap);
        self.normal = normal;
        self.frame = frame(normal);
        self.arms[0] = place - own.now.x;
        self.slip = own.moved(self.arms[0]);
        if let Some(other) = other {
            self.arms[1] = place - other.now.x;
            self.slip -= other.moved(self.arms[1]);
        }
        self.slip -= normal * normal.dot(self.slip);
    }

    /// Turns the impulse as the normal has turned since it was `before`, on the shortest way; what turns by more than a right angle
    /// is another contact.
    pub fn turn_impulse(&mut self, before: Vec3<f64>) {
        let (axis, cosine) = (before.cross(self.normal), before.dot(self.normal));
        let z = self.impulse;
        if cosine > 0.0 && z != Vec3::zero() {
            self.impulse = z * cosine + axis.cross(z) + axis * (axis.dot(z) / (1.0 + cosine));
        }
    }

    /// How the two bodies move against each other at the contact, with motions (dx, dphi) or (v, w) of segments.
    pub fn relative(&self, of: impl Fn(u32) -> Spatial<f64>) -> Vec3<f64> {
        let at = |i: u32, arm: Vec3<f64>| {
            let Spatial { linear, angular } = of(i);
            linear + angular.cross(arm)
        };
        let own = at(self.key.0, self.arms[0]);
        self.others().fold(own, |sum, (other, arm, share)| sum - at(other, arm) * share)
    }

    /// Whether friction was as large as it can be in the step before: the contact has broken loose or slides.
    pub fn gave_way(&self) -> bool {
        let [normal, first, second] = self.guess;
        let friction = first.hypot(second);
        let is_largest = |coefficient: f64| (friction - coefficient * normal).abs() <= 1e-3 * coefficient * normal;
        normal > 0.0 && (is_largest(self.friction.at_rest) || is_largest(self.friction.sliding))
    }

    /// Chooses the coefficient of friction of a step: that of sliding where the surfaces slid past each other by more than `creep` [m], which is what a
    /// contact that sticks may within the tolerance, else that at rest. The slip is that of the step before and, where contacts `gave_way` in it, of those before
    /// that in which they did, too; of a contact that did not press it is what surfaces move in `dt` [s] as they meet, at `meeting` [m/s]. Within a step the
    /// coefficient stays, so that each step's law is Coulomb's with one.
    pub fn choose_coefficient(
        &mut self,
        gave_way: bool,
        meeting: impl FnOnce(&Self) -> Vec3<f64>,
        (creep, dt): (f64, f64),
    ) {
        if self.pressed == 0 {
            let meeting = meeting(self);
            self.slid = (meeting - self.normal * meeting.dot(self.normal)) * dt;
        } else if !gave_way {
            self.slid = self.last_slip;
        }
        let slides = self.slid.norm_squared() > creep * creep;
        self.coefficient = if slides { self.friction.sliding } else { self.friction.at_rest };
        self.has_coefficient = true;
    }

    /// Lets a contact that slides stick where its surfaces would go back in the step under way: they have been at rest in between. Returns whether it is one.
    pub fn stick_as_it_turns(&mut self) -> bool {
        let turns = self.coefficient < self.friction.at_rest && self.pressed > 0 && self.slip.dot(self.last_slip) < 0.0;
        if turns {
            (self.coefficient, self.slid) = (self.friction.at_rest, Vec3::zero());
        }
        turns
    }

    /// Keeps by how much the surfaces have slid past each other in a step that has ended, if it presses.
    pub fn keep_slip(&mut self) {
        if self.friction.sliding != self.friction.at_rest {
            let is_first = self.pressed <= 1;
            self.last_slip = if self.pressed > 0 { self.slip } else { Vec3::zero() };
            self.slid = if is_first { self.last_slip } else { self.slid + self.last_slip };
        }
    }

    /// A world vector in the contact's frame.
    pub fn local(&self, v: Vec3<f64>) -> [f64; 3] {
        self.frame.map(|axis| axis.dot(v))
    }

    /// A vector of the contact's frame in the world.
    pub fn world(&self, [n, t1, t2]: [f64; 3]) -> Vec3<f64> {
        self.frame[0] * n + self.frame[1] * t1 + self.frame[2] * t2
    }
}

/// A normal of two axes that cross.
#[cold]
fn across(a: [Vec3<f64>; 2], b: [Vec3<f64>; 2]) -> Vec3<f64> {
    to_kernel(&crossing_normal(&a.map(to_nalgebra), &b.map(to_nalgebra), &Vector3::zeros()))
}

/// Where on axes `a` and `b` their nearest points are, from 0 to 1.
fn nearest(a: [Vec3<f64>; 2], b: [Vec3<f64>; 2]) -> [f64; 2] {
    let found = closest::segments(&a.map(to_nalgebra), &b.map(to_nalgebra));
    [found.s, found.t]
}

/// Share of an axis that is no distance.
const SAME: f64 = 1e-6;

/// The end at a share of an axis, if one is there.
fn end_at(share: f64) -> Option<u8> {
    match share {
        share if share < SAME => Some(0),
        share if share > 1.0 - SAME => Some(1),
        _ => None,
    }
}

/// Where on an axis the point nearest to `point` is, from 0 to 1.
fn nearest_to(segment: [Vec3<f64>; 2], point: Vec3<f64>) -> f64 {
    closest::point(&segment.map(to_nalgebra), &to_nalgebra(point))
}

#[cfg(test)]
mod tests;
