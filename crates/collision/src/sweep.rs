//! First touch of moving capsules, by conservative advancement, and whether their centre lines pass through each other.
//!
//! Mirtich 1996, "Impulse-based Dynamic Simulation of Rigid Body Systems", advances to the time before which
//! the bodies' distance and the bound of their relative speed allow no touch. The bound along the direction of the closest
//! points is far better: let n be the unit vector between these points of centre lines a and b. The distance of the lines
//! is at least the smallest n . (a_i - b_j) over their ends, and as the ends move linearly, so do these four numbers.

use nalgebra::Vector3;

use crate::closest;
use crate::shape::{Aabb, Capsule};

/// Capsules touch when their centre lines come within the sum of radii times one plus this.
pub const TOLERANCE: f64 = 1e-3;
/// Lines meet where they are no farther apart than this share of their lengths.
const MEETING: f64 = 1e-6;
/// Most advances of a pair. A few do for random motions; a rod that turns while it passes close by takes more.
const ADVANCES: usize = 1000;

/// A capsule whose ends move linearly over a step, from time 0 to time 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovingCapsule {
    /// Ends of the centre line at time 0 [m].
    pub from: [Vector3<f64>; 2],
    /// Ends of the centre line at time 1 [m].
    pub to: [Vector3<f64>; 2],
    /// Radius [m].
    pub radius: f64,
}

/// Where and when two capsules touch first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Part of the step until then, from 0 to 1.
    pub time: f64,
    /// Where on the centre line of a, from 0 at its start to 1 at its end.
    pub s: f64,
    /// Where on the centre line of b, from 0 at its start to 1 at its end.
    pub t: f64,
    /// Unit vector from b to a between these points.
    pub normal: Vector3<f64>,
    /// Distance of the centre lines [m].
    pub distance: f64,
}

impl MovingCapsule {
    /// A capsule that does not move.
    pub fn fixed(capsule: &Capsule) -> Self {
        let ends = [capsule.start, capsule.end];
        Self { from: ends, to: ends, radius: capsule.radius }
    }

    /// The capsule at a time from 0 to 1.
    pub fn at(&self, time: f64) -> Capsule {
        let [start, end] = self.ends(time);
        Capsule { start, end, radius: self.radius }
    }

    /// The smallest box around the capsule over the whole step, but for rounding.
    pub fn aabb(&self) -> Aabb {
        self.at(0.0).aabb().union(&self.at(1.0).aabb())
    }

    #[inline]
    fn ends(&self, time: f64) -> [Vector3<f64>; 2] {
        [0, 1].map(|k| self.from[k] * (1.0 - time) + self.to[k] * time)
    }

    /// Way of the ends over the step [m].
    #[inline]
    fn ways(&self) -> [Vector3<f64>; 2] {
        [0, 1].map(|k| self.to[k] - self.from[k])
    }
}

/// First touch of two capsules, at least one of which has a radius above zero. Those that already touch at time 0 touch
/// then. Where the centre lines cross at time 0, the normal is perpendicular to both and against the relative motion.
///
/// `None` proves that the lines do not come within the sum of radii. The distance of a touch is at most this sum times one
/// plus [`TOLERANCE`]. Motions that stay just outside of it for more than 1000 advances come back as a touch of a larger
/// distance, at the time up to which no touch is proven.
pub fn first_touch(a: &MovingCapsule, b: &MovingCapsule) -> Option<Touch> {
    let radii = a.radius + b.radius;
    // Half of the tolerance is aimed at, so that each advance has a least length.
    let (reached, target) = (radii * (1.0 + TOLERANCE), radii * (1.0 + 0.5 * TOLERANCE));
    let (ways_a, ways_b) = (a.ways(), b.ways());
    let speed = relative_speed(&ways_a, &ways_b);
    let mut time = 0.0;
    let mut advances = 0;
    loop {
        let (ends_a, ends_b) = (a.ends(time), b.ends(time));
        let closest = closest::segments(&ends_a, &ends_b);
        let distance = closest.distance;
        let normal = if distance > 0.0 {
            closest.separation / distance
        } else {
            crossing_normal(&ends_a, &ends_b, &(ways_a[0] + ways_a[1] - ways_b[0] - ways_b[1]))
        };
        if distance <= reached || advances == ADVANCES {
            return Some(Touch { time, s: closest.s, t: closest.t, normal, distance });
        }
        let mut step = f64::INFINITY;
        for (end_a, way_a) in ends_a.iter().zip(&ways_a) {
            for (end_b, way_b) in ends_b.iter().zip(&ways_b) {
                let closing = normal.dot(&(way_b - way_a));
                if closing > 0.0 {
                    step = step.min((normal.dot(&(end_a - end_b)) - target) / closing);
                }
            }
        }
        // Both bounds hold; rounding can make the first one stand still.
        time += step.max((distance - target) / speed);
        if time > 1.0 {
            return None;
        }
        advances += 1;
    }
}

/// Whether the centre lines of two capsules pass through each other: whether they meet, to a millionth of their lengths, at a time at
/// which the volume that their four ends span changes its sign. Lines that lie in one plane all the time do not.
///
/// The volume is a polynomial of the third degree in time. It is followed from one of its turning points to the next, between
/// which it is zero once at most: where the lines meet, would meet if they were longer, or are parallel.
pub fn crosses(a: &MovingCapsule, b: &MovingCapsule) -> bool {
    let volume = |time: f64| {
        let (a, b) = (a.ends(time), b.ends(time));
        (b[0] - a[0]).dot(&(a[1] - a[0]).cross(&(b[1] - b[0])))
    };
    let [first, second] = turning_points([0.0, 0.5, 1.0, -1.0].map(volume));
    let mut times = [0.0, first, second, 1.0];
    times.sort_unstable_by(f64::total_cmp);
    times.windows(2).any(|times| {
        let (mut from, mut to) = (times[0], times[1]);
        let before = volume(from);
        if before * volume(to) > 0.0 || before == volume(to) {
            return false;
        }
        // As near as doubles are.
        while from < 0.5 * (from + to) && 0.5 * (from + to) < to {
            let middle = 0.5 * (from + to);
            if volume(middle) * before > 0.0 { from = middle } else { to = middle }
        }
        let (a, b) = (a.ends(to), b.ends(to));
        let size = (a[1] - a[0]).norm() + (b[1] - b[0]).norm();
        closest::segments(&a, &b).distance <= MEETING * size
    })
}

/// Where a polynomial of the third degree with such values at 0, 1/2, 1 and -1 turns between 0 and 1; 1 where it does not.
fn turning_points([start, middle, end, earlier]: [f64; 4]) -> [f64; 2] {
    // c0 + c1 t + c2 t^2 + c3 t^3
    let c2 = 0.5 * (end + earlier) - start;
    let odd = 0.5 * (end - earlier);
    let c3 = (odd - 2.0 * (middle - start - 0.25 * c2)) / 0.75;
    let c1 = odd - c3;
    let root = (c2 * c2 - 3.0 * c3 * c1).sqrt();
    // The root that cancels nothing, and the other one from the product of both.
    let far = -(c2 + root.copysign(c2));
    [far / (3.0 * c3), c1 / far].map(|time| if time > 0.0 && time < 1.0 { time } else { 1.0 })
}

/// Greatest relative speed of any two points of the lines [m per step]: that of two ends, as speeds are convex along lines.
fn relative_speed(ways_a: &[Vector3<f64>; 2], ways_b: &[Vector3<f64>; 2]) -> f64 {
    let speed = |way_a: &Vector3<f64>| (way_a - ways_b[0]).norm().max((way_a - ways_b[1]).norm());
    speed(&ways_a[0]).max(speed(&ways_a[1]))
}

/// Unit vector perpendicular to lines a and b that cross, pointing against the relative `motion` of a [any unit]. For lines
/// that are parallel or points: perpendicular to the longer one, or along the motion, or along an axis.
#[cold]
pub fn crossing_normal(a: &[Vector3<f64>; 2], b: &[Vector3<f64>; 2], motion: &Vector3<f64>) -> Vector3<f64> {
    let (along_a, along_b) = (a[1] - a[0], b[1] - b[0]);
    let longer = if along_a.norm() < along_b.norm() { along_b } else { along_a };
    let axis = Vector3::ith(longer.iamin(), 1.0);
    let normal = along_a
        .cross(&along_b)
        .try_normalize(0.0)
        .or_else(|| longer.cross(&axis).try_normalize(0.0))
        .or_else(|| motion.try_normalize(0.0))
        .unwrap_or(axis);
    if normal.dot(motion) > 0.0 { -normal } else { normal }
}
