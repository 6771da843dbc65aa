//! The canonical frame of a query: what is the same but for a turn about the vertical, a mirror, a turn about the cable's own
//! axis, or its direction has the same numbers.

use std::f64::consts::PI;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::scaled::Scaled;

/// Numbers that a network reads of a query.
pub const INPUTS: usize = 16;

/// A query of a round cable without twist at rest, between two grips, in its canonical frame: the chord goes upwards in the
/// plane of x and z, towards x; the cable leaves the first grip towards y; its first frame is turned from the world's by the
/// smallest rotation.
///
/// Shapes fall into two classes, as their frames are turned on their way by the smaller or by the greater of the two least
/// twists, but for whole double turns: quaternions that go on without a jump end in `q` or in `-q`.
#[derive(Clone, Debug)]
pub struct Canonical {
    is_reversed: bool,
    about: UnitQuaternion<f64>,
    is_mirrored: bool,
    roll: UnitQuaternion<f64>,
    /// Frames of the grips; that of the second one with the sign of the first class.
    pub(crate) ends: [Quaternion<f64>; 2],
    numbers: [f64; INPUTS],
}

/// Where cosine and sine of half of the twist are among the inputs.
const TWIST: usize = 8;
/// Units of curvatures at rest and of weights that are carried.
const CURVATURE: f64 = 0.25;
const CARRIED: f64 = 0.05;

impl Canonical {
    /// That of a query whose end is held.
    pub fn new(query: &Scaled) -> Self {
        let is_reversed = query.chord.z < 0.0;
        let (chord, ends) = if is_reversed {
            (-query.chord, [reversed(true, query.ends[1]), reversed(true, query.ends[0])])
        } else {
            (query.chord, query.ends)
        };
        let across = chord.x.hypot(chord.y);
        let about = about_z(-chord.y.atan2(chord.x));
        let is_mirrored = (about * ends[0] * Vector3::z()).y < 0.0;
        let [first, last] = ends.map(|q| mirrored(is_mirrored, about * q));
        let [a, b] = [first * Vector3::z(), last * Vector3::z()];
        let start = shortest(&Vector3::z(), &a);
        let roll = (start.inverse() * first).inverse();
        let end = last * roll;
        let twist = (shortest(&a, &b) * start).inverse() * end;
        let sign = if twist.w < 0.0 { -1.0 } else { 1.0 };
        let weight = query.weight.max(f64::MIN_POSITIVE).log10() - 1.0;
        let torsion = 3.0 * query.stiffness[2].ln();
        let (cos, sin) = (sign * twist.w, sign * twist.k);
        // Curvatures at rest, in the frame that is reversed, mirrored and turned about its axis.
        let [mut bent, other, _] = query.rest;
        for changes in [is_reversed, is_mirrored] {
            bent = if changes { -bent } else { bent };
        }
        let bent = roll.inverse() * Vector3::new(bent, other, 0.0) * CURVATURE;
        let [carried, place] = query.carried;
        let carried = carried * CARRIED;
        let off = carried * (2.0 * if is_reversed { 1.0 - place } else { place } - 1.0);
        Self {
            is_reversed,
            about,
            is_mirrored,
            roll,
            ends: [start.into_inner(), end.into_inner() * sign],
            numbers: [
                across, chord.z, a.x, a.y, a.z, b.x, b.y, b.z, cos, sin, weight, torsion, bent.x, bent.y, carried, off,
            ],
        }
    }

    /// What a network reads of the query and a class, 0 or 1: the chord's x and z over L; the tangents at both grips; cosine and
    /// sine of half of the twist; log10 of `w L^3 / B`, less 1; three times the logarithm of GJ / B; curvatures at rest, over 4 / L; the weight that is carried, over
    /// 20 B / L^2, and that times its place, from -1 to 1.
    pub fn inputs(&self, class: usize) -> [f32; INPUTS] {
        let mut numbers = self.numbers;
        if class == 1 {
            numbers[TWIST] = -numbers[TWIST];
            numbers[TWIST + 1] = -numbers[TWIST + 1];
        }
        numbers.map(|x| x as f32)
    }

    /// A place along the cable, 0 to 1.
    pub(crate) fn place(&self, place: f64) -> f64 {
        if self.is_reversed { 1.0 - place } else { place }
    }

    /// A frame of the cable in the canonical frame.
    pub(crate) fn turn(&self, q: &UnitQuaternion<f64>) -> Quaternion<f64> {
        (mirrored(self.is_mirrored, self.about * reversed(self.is_reversed, *q)) * self.roll).into_inner()
    }

    /// What turns frames back from the canonical frame.
    pub(crate) fn back(&self) -> Back {
        // The mirror image of a product is the product of the mirror images.
        let roll = mirrored(self.is_mirrored, self.roll.inverse());
        let last = if self.is_reversed { roll * half_turn().inverse() } else { roll };
        Back { about: self.about.inverse(), is_mirrored: self.is_mirrored, last }
    }

    /// The mean of the forces at both grips, in the canonical frame.
    pub(crate) fn force(&self, force: Vector3<f64>) -> Vector3<f64> {
        let own = reflected(self.is_mirrored, self.about * force);
        if self.is_reversed { -own } else { own }
    }

    /// The same back.
    pub(crate) fn force_back(&self, force: Vector3<f64>) -> Vector3<f64> {
        let own = self.about.inverse() * reflected(self.is_mirrored, force);
        if self.is_reversed { -own } else { own }
    }
}

/// The way back from a canonical frame.
pub(crate) struct Back {
    about: UnitQuaternion<f64>,
    is_mirrored: bool,
    last: UnitQuaternion<f64>,
}

impl Back {
    /// The frame of the cable that a quaternion of any norm but 0 stands for.
    pub(crate) fn turn(&self, q: Quaternion<f64>) -> UnitQuaternion<f64> {
        self.about * mirrored(self.is_mirrored, UnitQuaternion::from_quaternion(q)) * self.last
    }
}

/// A half turn about x.
fn half_turn() -> UnitQuaternion<f64> {
    UnitQuaternion::new_unchecked(Quaternion::new(0.0, 1.0, 0.0, 0.0))
}

/// The frame of a cable that is gone along the other way.
fn reversed(is_reversed: bool, q: UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    if is_reversed { q * half_turn() } else { q }
}

/// A frame mirrored at the plane of x and z, its d2 turned round so that it stays right-handed.
fn mirrored(is_mirrored: bool, q: UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    if is_mirrored { UnitQuaternion::new_unchecked(Quaternion::new(q.w, -q.i, q.j, -q.k)) } else { q }
}

fn reflected(is_mirrored: bool, v: Vector3<f64>) -> Vector3<f64> {
    if is_mirrored { Vector3::new(v.x, -v.y, v.z) } else { v }
}

fn about_z(angle: f64) -> UnitQuaternion<f64> {
    let (sin, cos) = (0.5 * angle).sin_cos();
    UnitQuaternion::new_unchecked(Quaternion::new(cos, 0.0, 0.0, sin))
}

/// The smallest rotation from one unit vector to another, its scalar part positive.
fn shortest(from: &Vector3<f64>, to: &Vector3<f64>) -> UnitQuaternion<f64> {
    let scalar = 1.0 + from.dot(to);
    if scalar > 1e-9 {
        return UnitQuaternion::from_quaternion(Quaternion::from_parts(scalar, from.cross(to)));
    }
    UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI)
}
