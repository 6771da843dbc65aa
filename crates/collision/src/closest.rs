//! Closest points of line segments.
//!
//! The case distinction is that of Ericson, "Real-Time Collision Detection", 2005, section 5.1.9. Where the lines are
//! nearly parallel, at an angle theta, his determinant a e - b^2 loses all digits below theta = 1e-8. Here it is the square
//! of a cross product, whose relative error is epsilon / theta; it moves the closest points by epsilon / theta along lines
//! that part by theta only, and so the distance keeps all its digits.

use nalgebra::Vector3;

/// The closest points of two segments a and b.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// Where on a, from 0 at its start to 1 at its end.
    pub s: f64,
    /// Where on b, from 0 at its start to 1 at its end.
    pub t: f64,
    /// The point on a [m].
    pub on_a: Vector3<f64>,
    /// The point on b [m].
    pub on_b: Vector3<f64>,
    /// `on_a - on_b` [m], without the rounding of the points themselves.
    pub separation: Vector3<f64>,
    /// Length of the separation [m].
    pub distance: f64,
}

/// Squares of sizes outside of these are scaled before products of four lengths are made.
const SAFE_SQUARES: std::ops::RangeInclusive<f64> = 1e-60..=1e60;
/// A segment with a square of its length below this part of the square of all sizes is a point.
const POINT: f64 = 1e-100;

/// Closest points of the segments from `a[0]` to `a[1]` and from `b[0]` to `b[1]`; segments may be points. The error of the
/// distance is a few roundings of the segments' lengths and of their starts' distance. Where more than one pair of points
/// is closest, as on parallel segments, any of them may come back. All coordinates must be finite and their differences too.
#[inline]
pub fn segments(a: &[Vector3<f64>; 2], b: &[Vector3<f64>; 2]) -> Closest {
    let (along_a, along_b, offset) = (a[1] - a[0], b[1] - b[0], a[0] - b[0]);
    let squares = along_a.norm_squared() + along_b.norm_squared() + offset.norm_squared();
    let (s, t) = if SAFE_SQUARES.contains(&squares) {
        parameters(&along_a, &along_b, &offset, squares)
    } else {
        scaled_parameters(&along_a, &along_b, &offset)
    };
    let separation = offset + along_a * s - along_b * t;
    let mut distance = separation.norm_squared().sqrt();
    if !SAFE_SQUARES.contains(&(distance * distance)) {
        let size = separation.amax();
        distance = if size > 0.0 { (separation / size).norm() * size } else { 0.0 };
    }
    Closest { s, t, on_a: a[0] + along_a * s, on_b: b[0] + along_b * t, separation, distance }
}

/// Where a segment comes closest to a point: 0 at the start, 1 at the end; 0 if the segment is a point. The point then is
/// `start + (end - start) * s`.
#[inline]
pub fn point(segment: &[Vector3<f64>; 2], point: &Vector3<f64>) -> f64 {
    segments(segment, &[*point, *point]).s
}

/// The closest points' parameters of `offset + along_a s` and `along_b t`; `squares` is the sum of all their squares.
#[inline]
fn parameters(along_a: &Vector3<f64>, along_b: &Vector3<f64>, offset: &Vector3<f64>, squares: f64) -> (f64, f64) {
    let (square_a, square_b) = (along_a.norm_squared(), along_b.norm_squared());
    let on_a = |t: f64| ((along_b * t - offset).dot(along_a) / square_a).clamp(0.0, 1.0);
    let on_b = |s: f64| ((along_a * s + offset).dot(along_b) / square_b).clamp(0.0, 1.0);
    match (square_a > POINT * squares, square_b > POINT * squares) {
        (false, false) => (0.0, 0.0),
        (true, false) => (on_a(0.0), 0.0),
        (false, true) => (0.0, on_b(0.0)),
        (true, true) => {
            let normal = along_a.cross(along_b);
            let determinant = normal.norm_squared();
            let s = along_b.cross(offset).dot(&normal) / determinant;
            // Parallel lines: any point will do, as t and then s are projected.
            let t = on_b(if determinant > 0.0 { s.clamp(0.0, 1.0) } else { 0.0 });
            (on_a(t), t)
        }
    }
}

/// [`parameters`] of lengths whose squares or fourth powers overflow or vanish.
#[cold]
fn scaled_parameters(along_a: &Vector3<f64>, along_b: &Vector3<f64>, offset: &Vector3<f64>) -> (f64, f64) {
    let size = along_a.amax().max(along_b.amax()).max(offset.amax());
    if size == 0.0 {
        return (0.0, 0.0);
    }
    let [along_a, along_b, offset] = [along_a, along_b, offset].map(|x| x / size);
    let squares = along_a.norm_squared() + along_b.norm_squared() + offset.norm_squared();
    parameters(&along_a, &along_b, &offset, squares)
}
