//! Rods inside other rods: where the centre of each segment of the inner one is along the outer one, and the wall that keeps it there.
//!
//! The wall is at the clearance from the outer rod's smooth centreline c(s), a cubic between the centres of two segments (`rod::Centreline`). The
//! place s of a centre x is the nearest one, `(x - c(s)) . c'(s) = 0`, so that the gap `clearance - |x - c(s)|` does not change with s to first
//! order. c(s) is a mean of two points on the axes of the two segments: they share the wall's force with the weights of the mean, so that it is
//! the gradient of the gap.
//!
//! A centre beyond a mouth by d has a wall that is `d^2 / (2 reach)` further away, up to the distance `reach`; beyond that it is free. One that
//! comes within reach of a mouth, inside of this wall, is taken in.

use std::ops::Range;

use component::BodyPose;
use component::snapshot::StateVisitor;
use kernels::math::Vec3;
use rod::{Centreline, Friction, Model, Share, Sheath};

use super::shape::{Components, Shape};

/// How the wall of a sheath shares a contact's force between the two segments of the outer rod between whose centres it is.
#[derive(Clone, Copy, Debug)]
pub struct Wall {
    /// The two segments.
    pub segments: [u32; 2],
    /// From their centres to the places at which each takes its share \[m\].
    pub arms: [Vec3<f64>; 2],
    /// Their shares: none below 0, and 1 together.
    pub shares: [f64; 2],
}

impl Wall {
    /// One that is not evaluated yet.
    pub(super) const NONE: Self = Self { segments: [0; 2], arms: [Vec3([0.0; 3]); 2], shares: [0.0; 2] };

    /// Shows it to a visitor.
    pub(super) fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        for k in 0..2 {
            let mut segment = u64::from(self.segments[k]);
            visitor.word(&mut segment);
            self.segments[k] = segment as u32;
            visitor.vector(&mut self.arms[k]);
            visitor.number(&mut self.shares[k]);
        }
    }
}

/// A sheath, and where the segments inside of it are.
#[derive(Clone, Debug)]
pub struct Tube {
    pub(super) inner: Range<u32>,
    pub(super) outer: Range<u32>,
    pub(super) line: Centreline,
    /// Radius of the bore [m].
    pub(super) bore: f64,
    /// Radius of the outer rod, at least [m].
    radius: f64,
    pub(super) friction: Friction,
    reach: [f64; 2],
    /// Of each segment of the inner rod, the place of its centre along the outer rod [m]; not a number of those that are outside.
    places: Vec<f64>,
    /// Whether the places are those of a state.
    is_placed: bool,
}

/// A point of a centreline and its tangent and the change of that with the distance along the rod.
pub(super) struct Point {
    pub(super) place: Vec3<f64>,
    pub(super) tangent: Vec3<f64>,
    bend: Vec3<f64>,
}

impl Tube {
    /// A sheath of a model that passes its checks, before its first step.
    pub(super) fn new(model: &Model, sheath: &Sheath) -> Self {
        let range = |segments: &Range<usize>| segments.start as u32..segments.end as u32;
        let radii = model.segments[sheath.outer.clone()].iter().map(|segment| segment.radius);
        Self {
            inner: range(&sheath.inner),
            outer: range(&sheath.outer),
            line: sheath.centreline(model),
            bore: sheath.bore(model),
            radius: radii.fold(f64::INFINITY, f64::min),
            friction: sheath.friction,
            reach: sheath.reach(model),
            places: vec![f64::NAN; sheath.inner.len()],
            is_placed: false,
        }
    }

    /// The outer rod's segments.
    pub(super) fn outer(&self) -> Range<u32> {
        self.outer.clone()
    }

    /// The inner rod's segments that are inside, each with the place of its centre along the outer rod [m].
    pub(super) fn inside(&self) -> impl Iterator<Item = (u32, f64)> {
        let all = self.inner.clone().zip(self.places.iter().copied());
        all.filter(|(_, place)| !place.is_nan())
    }

    /// Shows a visitor where segments are.
    pub(super) fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        visitor.flag(&mut self.is_placed);
        visitor.list(&mut self.places, |visitor, place| visitor.number(place));
    }

    /// How far a place is behind the nearer mouth [m], and which mouth that is; below 0 between the two.
    fn beyond(&self, place: f64) -> (f64, usize) {
        let end = place - self.line.length();
        if end > -place { (end, 1) } else { (-place, 0) }
    }

    /// How much further away the wall is behind a mouth, and the slope of that.
    pub(super) fn widening(&self, place: f64) -> [f64; 2] {
        let (beyond, mouth) = self.beyond(place);
        let beyond = beyond.max(0.0);
        [0.5 * beyond * beyond / self.reach[mouth], beyond / self.reach[mouth]]
    }

    /// The point of the centreline at a place, with the outer rod's segments where they are.
    pub(super) fn point(&self, shares: &[Share; 2], pose: &impl Fn(u32) -> BodyPose<f64>) -> Point {
        let mut sums = [Vec3::zero(); 3];
        for share in shares {
            let BodyPose { x, q } = pose(self.outer.start + share.segment as u32);
            let axis = q.axis();
            for (sum, (position, along)) in sums.iter_mut().zip(share.position.into_iter().zip(share.axis)) {
                *sum += x * position + axis * along;
            }
        }
        let [place, tangent, bend] = sums;
        Point { place, tangent, bend }
    }

    /// The place on the centreline that is nearest to a point near the one where the search begins [m]: by Newton's method, in 50 steps at most,
    /// each of a segment's length at most, until one is 1e-12 of that.
    pub(super) fn nearest(&self, x: Vec3<f64>, start: f64, pose: &impl Fn(u32) -> BodyPose<f64>) -> f64 {
        let count = self.line.segments();
        let step = self.line.length() / count as f64;
        let mut place = start;
        for _ in 0..50 {
            let Point { place: point, tangent, bend } = self.point(&self.line.at(place), pose);
            let (off, size) = (x - point, tangent.norm_squared());
            // Beyond the centre of curvature there is no nearest place.
            let slope = (size - off.dot(bend)).max(0.1 * size);
            let change = off.dot(tangent) / slope;
            if !change.is_finite() {
                return place;
            }
            place += change.clamp(-step, step);
            if change.abs() <= 1e-12 * step {
                break;
            }
        }
        place
    }

    /// The distance of a point from the centreline at its nearest place [m].
    fn distance(&self, x: Vec3<f64>, place: f64, pose: &impl Fn(u32) -> BodyPose<f64>) -> f64 {
        let point = self.point(&self.line.at(place), pose).place;
        (x - point).norm_squared().sqrt()
    }

    /// Finds where segments are among poses of which nothing is known.
    fn search(&mut self, radius: impl Fn(u32) -> f64, pose: &impl Fn(u32) -> BodyPose<f64>) {
        for (k, inner) in self.inner.clone().enumerate() {
            let x = pose(inner).x;
            let far = |outer: u32| (pose(outer).x - x).norm_squared();
            let near = self.outer.clone().min_by(|&a, &b| far(a).total_cmp(&far(b))).unwrap_or(self.outer.start);
            let start = self.line.centre((near - self.outer.start) as usize);
            let place = self.nearest(x, start, pose);
            let distance = self.distance(x, place, pose);
            let (beyond, mouth) = self.beyond(place);
            let is_inside = match beyond > 0.0 {
                false => distance < self.radius,
                true => beyond < self.reach[mouth] && distance <= self.wall(place, radius(inner)),
            };
            self.places[k] = if is_inside { place } else { f64::NAN };
        }
    }

    /// How far a centre may be from the centreline at a place, with such a radius about it [m].
    fn wall(&self, place: f64, radius: f64) -> f64 {
        self.bore - radius + self.widening(place)[0]
    }

    /// Follows segments to where they are at the start of a step.
    pub(super) fn follow(&mut self, shapes: &[Shape], components: &impl Components) {
        let pose = |i: u32| {
            let shape = &shapes[i as usize];
            components.component(shape.component).start[shape.body as usize]
        };
        let radius = |i: u32| shapes[i as usize].radius;
        if !std::mem::replace(&mut self.is_placed, true) {
            self.search(radius, &pose);
            return;
        }
        let length = self.line.length();
        let mouths = [0.0, length].map(|place| self.point(&self.line.at(place), &pose).place);
        for (k, inner) in self.inner.clone().enumerate() {
            let x = pose(inner).x;
            let before = self.places[k];
            if !before.is_nan() {
                let place = self.nearest(x, before, &pose);
                let (beyond, mouth) = self.beyond(place);
                self.places[k] = if beyond < self.reach[mouth] { place } else { f64::NAN };
                continue;
            }
            let near = |mouth: &usize| (x - mouths[*mouth]).norm_squared() < (2.0 * self.reach[*mouth]).powi(2);
            let through = |mouth: usize| {
                let place = self.nearest(x, [0.0, length][mouth], &pose);
                let (beyond, at) = self.beyond(place);
                let is_near = at == mouth && beyond < self.reach[mouth] && beyond > -self.reach[mouth];
                let comes_in = is_near && self.distance(x, place, &pose) <= self.wall(place, radius(inner));
                comes_in.then_some(place)
            };
            if let Some(place) = (0..2).filter(near).find_map(through) {
                self.places[k] = place;
            }
        }
        // What has come in by more than that in one step is behind what is inside.
        for (k, beside) in
            (1..self.places.len()).map(|k| (k, k - 1)).chain((1..self.places.len()).rev().map(|k| (k - 1, k)))
        {
            if !self.places[k].is_nan() || self.places[beside].is_nan() {
                continue;
            }
            let inner = self.inner.start + k as u32;
            let x = pose(inner).x;
            let place = self.nearest(x, self.places[beside], &pose);
            let (beyond, mouth) = self.beyond(place);
            if beyond < -self.reach[mouth] && self.distance(x, place, &pose) <= self.wall(place, radius(inner)) {
                self.places[k] = place;
            }
        }
    }

    /// How deep segments of the inner rod are in the wall, where these poses are those of a start: each with the outer segment at which it is,
    /// and the depth [m].
    pub(super) fn depths(
        &mut self,
        radius: impl Fn(u32) -> f64,
        pose: &impl Fn(u32) -> BodyPose<f64>,
        mut see: impl FnMut(u32, u32, f64),
    ) {
        self.search(&radius, pose);
        for (inner, place) in self.inside() {
            let depth = self.distance(pose(inner).x, place, pose) - self.wall(place, radius(inner));
            let [one, other] = self.line.at(place);
            let outer = if other.position[0] > one.position[0] { other.segment } else { one.segment };
            see(inner, self.outer.start + outer as u32, depth);
        }
    }
}
