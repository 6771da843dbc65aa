//! Where searches begin: curves with the grips' directions and the cable's length, and frames along them.

use std::f64::consts::{PI, TAU};

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub use crate::problem::Starts;
use crate::scaled::{Cut, Scaled};

/// Pieces in which a curve is measured.
const PIECES: usize = 16;
/// Most trials of a curve's free number, and the error of its length that will do.
const MOST_TRIALS: usize = 8;
const NEAR: f64 = 1e-2;

/// Starts without any learning: curves with the grips' directions and the cable's length, each with one or two twists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Curves {
    /// The cubic of Hermite whose tangents are as long as the length asks for.
    pub hermite: bool,
    /// One that sags.
    pub sagging: bool,
    /// Of each the twist on the other side, too.
    pub both_twists: bool,
}

impl Default for Curves {
    fn default() -> Self {
        Self::all()
    }
}

impl Curves {
    /// All of them.
    pub fn all() -> Self {
        Self { hermite: true, sagging: true, both_twists: true }
    }
}

impl Starts for Curves {
    fn count(&self) -> usize {
        (usize::from(self.hermite) + usize::from(self.sagging)) * (1 + usize::from(self.both_twists))
    }

    fn fill(
        &self,
        _: usize,
        query: &Scaled,
        cut: &Cut,
        turns: &mut [UnitQuaternion<f64>],
        _: &mut [Vector3<f64>],
    ) -> usize {
        let mut places = turns.chunks_mut(cut.segments);
        if !query.held {
            for (k, out) in places.enumerate() {
                free(query, cut, k % 2 == 1, out);
            }
            return self.count();
        }
        let curves =
            [self.hermite.then(|| Curve::hermite(query)), self.sagging.then(|| Curve::bowed(query, -Vector3::z()))];
        for curve in curves.into_iter().flatten() {
            let Some(first) = places.next() else { break };
            let twists = curve.frames(query, cut, first);
            let second = if self.both_twists { places.next() } else { None };
            if let Some(second) = second {
                second.copy_from_slice(first);
                twist(cut, twists[1], second);
            }
            twist(cut, twists[0], first);
        }
        self.count()
    }
}

/// Random starts: curves that bow to random sides, every other one with the twist on the other side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RandomCurves {
    /// How many of each query.
    pub count: usize,
    /// The seed.
    pub seed: u64,
}

impl Starts for RandomCurves {
    fn count(&self) -> usize {
        self.count
    }

    fn fill(
        &self,
        index: usize,
        query: &Scaled,
        cut: &Cut,
        turns: &mut [UnitQuaternion<f64>],
        _: &mut [Vector3<f64>],
    ) -> usize {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(index as u64);
        for (k, out) in turns.chunks_mut(cut.segments).enumerate() {
            if !query.held {
                free(query, cut, k % 2 == 1, out);
                continue;
            }
            let (z, angle) = (rng.random_range(-1.0..1.0), rng.random_range(0.0..TAU));
            let side = Vector3::new(angle.cos(), angle.sin(), 0.0) * f64::sqrt(1.0 - z * z) + Vector3::z() * z;
            let twists = Curve::bowed(query, side).frames(query, cut, out);
            twist(cut, twists[k % 2], out);
        }
        self.count
    }
}

/// A smooth curve of length 1, about, from the first grip to the second.
///
/// A cubic of Hermite, whose tangents at the ends are `speed` long, and a bow of `16 u^2 (1 - u)^2`, which keeps them.
#[derive(Clone, Copy, Debug)]
struct Curve {
    chord: Vector3<f64>,
    tangents: [Vector3<f64>; 2],
    bow: Vector3<f64>,
}

impl Curve {
    /// The cubic that is as long as the cable because its tangents at the ends are.
    fn hermite(query: &Scaled) -> Self {
        let base = Self::plain(query, 0.0);
        base.with_length(|own, x| {
            let directions = query.ends.map(|q| q * Vector3::z());
            Self { tangents: directions.map(|d| d * (4.0 * x)), bow: sideways(query) * x, ..*own }
        })
    }

    /// The cubic with a bow to one side, towards `side`, as long as the cable's length asks for.
    fn bowed(query: &Scaled, side: Vector3<f64>) -> Self {
        let speed = query.chord.norm().clamp(0.3, 0.8);
        let side = side + sideways(query);
        Self::plain(query, speed).with_length(|own, x| Self { bow: side * x, ..*own })
    }

    fn plain(query: &Scaled, speed: f64) -> Self {
        let tangents = query.ends.map(|q| q * Vector3::z() * speed);
        Self { chord: query.chord, tangents, bow: Vector3::zeros() }
    }

    /// A member of a family, whose number goes from 0 to 1, that is as long as 1, or nearly.
    fn with_length(&self, member: impl Fn(&Self, f64) -> Self) -> Self {
        let off = |x: f64| member(self, x).length() - 1.0;
        let (mut low, mut high) = (0.0, 1.0);
        let (mut below, mut above) = (off(low), off(high));
        let mut x = high;
        // False position; an end that stays counts half (Dowell and Jarratt 1971).
        for _ in 0..MOST_TRIALS {
            if above <= 0.0 || below >= 0.0 {
                break;
            }
            x = (low * above - high * below) / (above - below);
            let own = off(x);
            if own.abs() < NEAR {
                break;
            }
            if own < 0.0 {
                (low, below, above) = (x, own, 0.5 * above);
            } else {
                (high, above, below) = (x, own, 0.5 * below);
            }
        }
        member(self, if below >= 0.0 { 0.0 } else { x })
    }

    /// Derivative by u.
    fn slope(&self, u: f64) -> Vector3<f64> {
        let v = 1.0 - u;
        let [start, end] = &self.tangents;
        self.chord * (6.0 * u * v)
            + start * (v * (1.0 - 3.0 * u))
            + end * (u * (3.0 * u - 2.0))
            + self.bow * (32.0 * u * v * (1.0 - 2.0 * u))
    }

    fn length(&self) -> f64 {
        let piece = |k: usize| self.slope((k as f64 + 0.5) / PIECES as f64).norm();
        (0..PIECES).map(piece).sum::<f64>() / PIECES as f64
    }

    /// Orientations of the segments along it, from the first grip's frame without twist. Returns the twist that brings the last
    /// to the second grip's: the one that is nearest to that at rest, and the next nearest.
    fn frames(&self, query: &Scaled, cut: &Cut, out: &mut [UnitQuaternion<f64>]) -> [f64; 2] {
        let mut frame = query.ends[0];
        let mut before = 0.0;
        let total = self.length();
        let mut next = 0;
        for k in 0..PIECES {
            let u = (k as f64 + 0.5) / PIECES as f64;
            let slope = self.slope(u);
            let own = slope.norm() / (PIECES as f64 * total);
            while next < cut.segments && (cut.place(next) <= before + own || k + 1 == PIECES) {
                // The tangent there, within the piece.
                let share = ((cut.place(next) - before) / own.max(1e-12)).clamp(0.0, 1.0);
                let tangent = self.slope((k as f64 + share) / PIECES as f64);
                frame = carried(&frame, &tangent);
                out[next] = frame;
                next += 1;
            }
            before += own;
        }
        let last = carried(&frame, &(query.ends[1] * Vector3::z()));
        let (off, natural) = (roll(&(last.inverse() * query.ends[1])), query.rest[2]);
        let nearest = off + TAU * ((natural - off) / TAU).round();
        [nearest, if nearest > natural { nearest - TAU } else { nearest + TAU }]
    }
}

/// A little off, so that no curve folds back on itself where grips and gravity are in line.
fn sideways(query: &Scaled) -> Vector3<f64> {
    query.ends[0] * Vector3::x() * 0.05
}

/// The shape of a cable between two grips without twist: the cubic, or a curve that bows towards `side`. Returns the twists that
/// bring its last frame to the second grip's quaternion and to its negative, each the one that is nearest to that at rest.
pub(crate) fn untwisted(
    query: &Scaled,
    cut: &Cut,
    side: Option<Vector3<f64>>,
    out: &mut [UnitQuaternion<f64>],
) -> [f64; 2] {
    let curve = side.map_or_else(|| Curve::hermite(query), |side| Curve::bowed(query, side));
    curve.frames(query, cut, out);
    let before = out.last().copied().unwrap_or(query.ends[0]);
    let last = carried(&before, &(query.ends[1] * Vector3::z())).inverse() * query.ends[1];
    // Frames go on from the first grip's without a jump, and so do their quaternions.
    let to_it = 2.0 * last.k.atan2(last.w);
    [to_it, to_it + TAU].map(|angle| angle - 2.0 * TAU * ((angle - query.rest[2]) / (2.0 * TAU)).round())
}

/// Twists frames about their axes, evenly from none to `angle`.
pub(crate) fn twist(cut: &Cut, angle: f64, frames: &mut [UnitQuaternion<f64>]) {
    for (k, q) in frames.iter_mut().enumerate() {
        *q *= about_z(angle * cut.place(k));
    }
}

/// A cable with a free end: in its shape at rest, or turning downwards on its way.
fn free(query: &Scaled, cut: &Cut, hangs: bool, out: &mut [UnitQuaternion<f64>]) {
    let mut frame = query.ends[0];
    let rest = Vector3::from(query.rest);
    let first = frame * Vector3::new(0.1, 0.0, 1.0);
    for (k, q) in out.iter_mut().enumerate() {
        let place = cut.place(k);
        if hangs {
            frame = carried(&frame, &(first * (1.0 - place) - Vector3::z() * place));
            *q = frame * about_z(query.rest[2] * place);
        } else {
            *q = frame * UnitQuaternion::from_scaled_axis(rest * place);
        }
    }
}

fn about_z(angle: f64) -> UnitQuaternion<f64> {
    let (sin, cos) = (0.5 * angle).sin_cos();
    UnitQuaternion::new_unchecked(Quaternion::new(cos, 0.0, 0.0, sin))
}

/// The angle about z of a rotation that is next to one about z, from -pi to pi.
fn roll(q: &UnitQuaternion<f64>) -> f64 {
    let angle = 2.0 * q.k.atan2(q.w);
    angle - TAU * ((angle - PI) / TAU).ceil()
}

/// A frame turned by the smallest rotation that takes its z to `tangent`, of any length.
fn carried(frame: &UnitQuaternion<f64>, tangent: &Vector3<f64>) -> UnitQuaternion<f64> {
    let from = frame * Vector3::z();
    let norm = tangent.norm();
    let scalar = norm + from.dot(tangent);
    if scalar > 1e-9 * norm {
        let by = UnitQuaternion::from_quaternion(Quaternion::from_parts(scalar, from.cross(tangent)));
        return by * frame;
    }
    // Back the way it came: about any axis across.
    frame * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI)
}
