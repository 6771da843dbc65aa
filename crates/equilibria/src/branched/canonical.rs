//! The canonical frame of a branched query: what is the same but for a turn about the vertical, a mirror, or the order of the arms
//! has the same numbers.

use std::f64::consts::{FRAC_PI_3, PI};

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::query::ARMS;
use super::star::{Junction, Star};
use super::start::{Begin, SIGNS, reference};
use crate::known::Known;
use crate::scaled::Cut;

/// Numbers that a network reads of a query and a class: seven an arm with four of its grip's frame, and the direction of gravity.
pub const INPUTS: usize = 11 * ARMS;
/// Among the inputs: the grips' frames, the direction of gravity.
const FRAMES: usize = 2 * ARMS;
const GRAVITY: usize = FRAMES + 4 * ARMS;
const CABLES: usize = GRAVITY + 3;

/// A branched query in its canonical frame, that of [`reference()`]: the grips lie in the plane of x and y around the origin. Of the
/// orders of the arms and the two mirror images it is the one in which gravity points upwards, between the first arm's direction
/// from the junction and the middle between it and the second one's.
///
/// The frames of an arm are measured from that of its end in a junction that is not turned: straight arms without twist have
/// quaternions of 1. Shapes fall into four classes ([`SIGNS`]), by the signs with which the quaternions of the grips go on
/// without a jump to those of the same junction.
#[derive(Clone, Debug)]
pub struct StarCanonical {
    /// The query's arm in each place.
    pub(crate) order: [usize; ARMS],
    /// Whether the arms' frames are turned by half a turn about their axes: the order goes the other way round.
    is_flipped: bool,
    is_mirrored: bool,
    /// The frame: its origin, and its turn.
    origin: Vector3<f64>,
    turn: UnitQuaternion<f64>,
    /// What turns the query's junction into that of the arms in this order.
    relabel: UnitQuaternion<f64>,
    directions: [UnitQuaternion<f64>; ARMS],
    /// Frames of the grips, their scalar parts not negative.
    pub(crate) grips: [Quaternion<f64>; ARMS],
    numbers: [f64; INPUTS],
}

impl StarCanonical {
    /// That of a query.
    pub fn new(star: &Star) -> Self {
        let base = reference(star);
        let gravity = base.orientation.inverse() * -Vector3::z();
        let sector = (gravity.y.atan2(gravity.x) / (2.0 * FRAC_PI_3)).round();
        let first = (sector as i32).rem_euclid(3) as usize;
        let about_z = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), sector * 2.0 * FRAC_PI_3);
        let mut gravity = about_z.inverse() * gravity;
        let is_flipped = gravity.y < 0.0;
        let (mut relabel, mut order) = (about_z, [first, (first + 1) % ARMS, (first + 2) % ARMS]);
        if is_flipped {
            relabel *= UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI);
            order.swap(1, 2);
            (gravity.y, gravity.z) = (-gravity.y, -gravity.z);
        }
        let is_mirrored = gravity.z < 0.0;
        gravity.z = gravity.z.abs();
        let turn = base.orientation * relabel;
        let mut own = Self {
            order,
            is_flipped,
            is_mirrored,
            origin: base.position,
            turn,
            relabel,
            directions: star.directions,
            grips: [Quaternion::identity(); ARMS],
            numbers: [0.0; INPUTS],
        };
        for (j, &arm) in order.iter().enumerate() {
            let grip = own.frame(j, &star.arms[arm].ends[0]);
            own.grips[j] = if grip.w < 0.0 { -grip } else { grip };
            let place = own.place(&star.places[arm]);
            (own.numbers[2 * j], own.numbers[2 * j + 1]) = (place.x, place.y);
            let q = own.grips[j];
            own.numbers[FRAMES + 4 * j..][..4].copy_from_slice(&[q.w, q.i, q.j, q.k]);
            let scaled = &star.arms[arm];
            let stiffness = scaled.stiffness[0];
            own.numbers[CABLES + 4 * j..][..4].copy_from_slice(&[
                3.0 * (star.lengths[arm] - 1.0),
                stiffness.ln(),
                3.0 * (scaled.stiffness[2] / stiffness).ln(),
                scaled.weight.max(f64::MIN_POSITIVE).log10() - 1.0,
            ]);
        }
        own.numbers[GRAVITY..CABLES].copy_from_slice(gravity.as_slice());
        own
    }

    /// What a network reads of the query and a class, 0 to 3: of each arm the grip's place x and y over L; of each the grip's frame
    /// with the class's sign, real part first; the direction of gravity; of each arm three times its length over L less 1,
    /// the logarithm of its stiffness over B, three times that of GJ / EI, and log10 of its weight over B / L^2, less 1.
    pub fn inputs(&self, class: usize) -> [f32; INPUTS] {
        let mut numbers = self.numbers;
        for (own, sign) in numbers[FRAMES..GRAVITY].chunks_mut(4).zip(SIGNS[class]) {
            own.iter_mut().for_each(|x| *x *= sign);
        }
        numbers.map(|x| x as f32)
    }

    /// A frame of the arm in place `j`, in the canonical frame.
    pub(crate) fn frame(&self, j: usize, q: &UnitQuaternion<f64>) -> Quaternion<f64> {
        let q = if self.is_flipped { q * about_own() } else { *q };
        let own = (self.turn * self.directions[j]).inverse() * q;
        mirrored(self.is_mirrored, own.into_inner())
    }

    /// What turns frames of the arm in place `j` back.
    pub(crate) fn back(&self, j: usize) -> Back {
        let last = if self.is_flipped { about_own().inverse() } else { UnitQuaternion::identity() };
        Back { is_mirrored: self.is_mirrored, first: self.turn * self.directions[j], last }
    }

    /// The quaternion in which the arm in place `j` ends at a junction, which is given in the canonical frame.
    pub(crate) fn end(&self, j: usize, junction: &Quaternion<f64>) -> Quaternion<f64> {
        let direction = self.directions[j].into_inner();
        // Directions are the same in the mirror image.
        let own = if self.is_mirrored { junction_mirrored(junction) } else { *junction };
        mirrored(self.is_mirrored, direction.conjugate() * own * direction)
    }

    /// A junction in the canonical frame: its place, and its quaternion.
    pub(crate) fn junction(&self, own: &Junction) -> (Vector3<f64>, Quaternion<f64>) {
        let q = (self.turn.inverse() * own.orientation * self.relabel).into_inner();
        (self.place(&own.position), if self.is_mirrored { junction_mirrored(&q) } else { q })
    }

    /// The same back, of a quaternion of any norm but 0.
    pub(crate) fn junction_back(&self, place: &Vector3<f64>, q: &Quaternion<f64>) -> Junction {
        let q = if self.is_mirrored { junction_mirrored(q) } else { *q };
        let orientation = self.turn * UnitQuaternion::from_quaternion(q) * self.relabel.inverse();
        Junction { position: self.origin + self.vector_back(place), orientation }
    }

    fn place(&self, x: &Vector3<f64>) -> Vector3<f64> {
        self.vector(&(x - self.origin))
    }

    /// A vector in the canonical frame.
    pub(crate) fn vector(&self, v: &Vector3<f64>) -> Vector3<f64> {
        let own = self.turn.inverse() * v;
        if self.is_mirrored { Vector3::new(own.x, own.y, -own.z) } else { own }
    }

    /// The same back.
    pub(crate) fn vector_back(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.turn * if self.is_mirrored { Vector3::new(v.x, v.y, -v.z) } else { *v }
    }
}

/// The way back from a canonical frame.
pub(crate) struct Back {
    is_mirrored: bool,
    first: UnitQuaternion<f64>,
    last: UnitQuaternion<f64>,
}

impl Back {
    /// The frame of the arm that a quaternion of any norm but 0 stands for.
    pub(crate) fn frame(&self, q: Quaternion<f64>) -> UnitQuaternion<f64> {
        self.first * UnitQuaternion::from_quaternion(mirrored(self.is_mirrored, q)) * self.last
    }
}

/// Half a turn about an arm's own axis.
fn about_own() -> UnitQuaternion<f64> {
    UnitQuaternion::new_unchecked(Quaternion::new(0.0, 0.0, 0.0, 1.0))
}

/// An arm's frame, measured from its end in a junction that is not turned, mirrored at the junction's plane. Its d1, which is across
/// that plane at the end, is turned round, so that it stays right-handed.
fn mirrored(is_mirrored: bool, q: Quaternion<f64>) -> Quaternion<f64> {
    if is_mirrored { Quaternion::new(q.w, q.i, -q.j, -q.k) } else { q }
}

/// A junction's frame mirrored at the plane of x and y, its z turned round.
fn junction_mirrored(q: &Quaternion<f64>) -> Quaternion<f64> {
    Quaternion::new(q.w, -q.i, -q.j, q.k)
}

/// An equilibrium in its query's canonical frame, as a start of queries that are near.
#[derive(Clone, Debug)]
pub struct CanonicalStar {
    grips: [Quaternion<f64>; ARMS],
    place: Vector3<f64>,
    junction: Quaternion<f64>,
    forces: [Vector3<f64>; ARMS],
    /// Frames of the segments, in the order of the canonical frame.
    turns: Vec<UnitQuaternion<f64>>,
}

impl StarCanonical {
    /// What is known of the query's equilibrium, in this frame.
    pub fn known(&self, known: &Known<Star>) -> CanonicalStar {
        let (place, junction) = self.junction(&known.begin.junction);
        let count = known.turns.len() / ARMS;
        let mut turns = Vec::with_capacity(known.turns.len());
        for (j, &arm) in self.order.iter().enumerate() {
            let own = &known.turns[arm * count..(arm + 1) * count];
            turns.extend(own.iter().map(|q| UnitQuaternion::new_unchecked(self.frame(j, q))));
        }
        let forces = self.order.map(|arm| self.vector(&known.begin.forces[arm]));
        CanonicalStar { grips: self.grips, place, junction, forces, turns }
    }

    /// A start of this query at the equilibrium of another one on the same cut: the junction as it is there, the arms turned evenly
    /// to the grips. Fills in the orientations of the segments, arm after arm.
    ///
    /// # Panics
    /// If the cut is another one.
    pub fn begin(&self, other: &CanonicalStar, cut: &Cut, out: &mut [UnitQuaternion<f64>]) -> Begin {
        let count = cut.segments;
        let mut forces = [Vector3::zeros(); ARMS];
        for (j, &arm) in self.order.iter().enumerate() {
            let unit = UnitQuaternion::new_unchecked;
            let off = unit(self.grips[j]) * unit(other.grips[j]).inverse();
            let back = self.back(j);
            let from = &other.turns[j * count..(j + 1) * count];
            for (k, (to, q)) in out[arm * count..(arm + 1) * count].iter_mut().zip(from).enumerate() {
                *to = back.frame((off.powf(1.0 - cut.place(k)) * q).into_inner());
            }
            forces[arm] = self.vector_back(&other.forces[j]);
        }
        Begin { junction: self.junction_back(&other.place, &other.junction), forces }
    }

    /// The squared distance to another query's numbers, frames taken as they are turned, without their quaternions' signs.
    pub fn distance(numbers: &[f32; INPUTS], other: &[f32; INPUTS]) -> f32 {
        let square = |range: std::ops::Range<usize>| range.map(|k| (numbers[k] - other[k]).powi(2)).sum::<f32>();
        let frame = |j: usize| {
            let at = FRAMES + 4 * j;
            let cosine = (at..at + 4).map(|k| numbers[k] * other[k]).sum::<f32>();
            2.0 - 2.0 * cosine.abs()
        };
        square(0..FRAMES) + square(GRAVITY..INPUTS) + frame(0) + frame(1) + frame(2)
    }
}
