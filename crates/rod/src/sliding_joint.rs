//! Sliding joints: a rod that runs through an eyelet, and the smooth centreline on which the eyelet's place moves.

mod feed;
mod point;
mod range;

use std::ops::Range;

use nalgebra::Vector3;

use crate::Body;

pub use feed::Feed;
pub(crate) use feed::linear;

/// A rod runs through a small eyelet. The eyelet is on the rod's smooth centreline ([`Centreline`]); where along the rod is an unknown of
/// each step. All turns are free. The rod cannot leave the eyelet: at its ends it stops.
#[derive(Clone, Debug, PartialEq)]
pub struct SlidingJoint {
    /// The rod's segments, in order.
    pub segments: Range<usize>,
    /// What the eyelet is part of: an anchor, or a segment that is none of the rod's.
    pub holder: Body,
    /// Place of the eyelet in the holder's frame, from its centre [m].
    pub place: Vector3<f64>,
    /// Distance along the rod, from its start, of the eyelet at the start [m].
    pub start: f64,
    /// Coefficient of Coulomb friction. A taut rod that turns by the angle theta in the eyelet begins to slide where its tensions differ by the
    /// factor exp(friction theta).
    pub friction: f64,
    /// Drives the rod through the eyelet; `None` where it slides by itself.
    pub feed: Option<Feed>,
}

/// Where an eyelet is, and what it does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sliding {
    /// Distance of the eyelet from the rod's start, along the rod [m].
    pub place: f64,
    /// Its rate over the last step [m/s].
    pub rate: f64,
    /// Force of the eyelet on the rod at the end of the last step [N].
    pub force: Vector3<f64>,
}

/// The share of one segment in a point of a centreline: its centre times `position` plus its axis times `axis` [m]; each with its first and
/// second derivative with respect to the distance along the rod.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Share {
    /// Which segment of the rod.
    pub segment: usize,
    /// Of its centre.
    pub position: [f64; 3],
    /// Of its axis.
    pub axis: [f64; 3],
}

/// The smooth centreline of a rod: through the centres of segments along their axes, between two of them a cubic (Hermite's) over the distance
/// along the rod, straight beyond the outermost. So the tangent is continuous from segment to segment.
#[derive(Clone, Debug, PartialEq)]
pub struct Centreline {
    /// Distances of the segments' centres from the rod's start [m].
    centres: Vec<f64>,
    length: f64,
}

impl Centreline {
    /// That of segments of these lengths [m].
    pub fn new(lengths: impl Iterator<Item = f64>) -> Self {
        let mut end = 0.0;
        let centre = |length: f64| {
            end += length;
            end - 0.5 * length
        };
        let centres = lengths.map(centre).collect();
        Self { centres, length: end }
    }

    /// Length of the rod [m].
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Number of its segments.
    pub fn segments(&self) -> usize {
        self.centres.len()
    }

    /// Distance of a segment's centre from the rod's start [m].
    pub fn centre(&self, segment: usize) -> f64 {
        self.centres[segment]
    }

    /// The last segment whose centre is not beyond this distance from the rod's start; the first one if there is none.
    pub fn segment_before(&self, distance: f64) -> usize {
        self.centres.partition_point(|&centre| centre <= distance).saturating_sub(1)
    }

    /// The shares of segments in the point at this distance from the rod's start: of two neighbours, or of the outermost one, twice, of which
    /// the second has none.
    pub fn at(&self, distance: f64) -> [Share; 2] {
        let next = self.centres.partition_point(|&centre| centre <= distance);
        if next == 0 || next == self.centres.len() {
            let segment = next.saturating_sub(1);
            let along = distance - self.centres.get(segment).copied().unwrap_or(0.0);
            let none = Share { segment, ..Share::default() };
            return [Share { segment, position: [1.0, 0.0, 0.0], axis: [along, 1.0, 0.0] }, none];
        }
        let (from, to) = (self.centres[next - 1], self.centres[next]);
        let h = to - from;
        let u = (distance - from) / h;
        let position =
            |sign: f64, value: f64| [value, sign * 6.0 * u * (u - 1.0) / h, sign * (12.0 * u - 6.0) / (h * h)];
        let first = Share {
            segment: next - 1,
            position: position(1.0, (1.0 + 2.0 * u) * (1.0 - u) * (1.0 - u)),
            axis: [h * u * (1.0 - u) * (1.0 - u), (1.0 - u) * (1.0 - 3.0 * u), (6.0 * u - 4.0) / h],
        };
        let second = Share {
            segment: next,
            position: position(-1.0, u * u * (3.0 - 2.0 * u)),
            axis: [h * u * u * (u - 1.0), u * (3.0 * u - 2.0), (6.0 * u - 2.0) / h],
        };
        [first, second]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_those_of_a_smooth_curve() {
        let line = Centreline::new([1.0, 2.0, 0.5].into_iter());
        assert_eq!(line.length(), 3.5);
        let sum = |s: f64, order: usize, of: &dyn Fn(f64) -> [f64; 2]| {
            line.at(s)
                .iter()
                .map(|share| {
                    let [position, axis] = of(line.centres[share.segment]);
                    position * share.position[order] + axis * share.axis[order]
                })
                .sum::<f64>()
        };
        let straight = |s: f64| [3.0 + 2.0 * s, 2.0];
        let wave = |s: f64| [(0.3 * s).sin(), 0.3 * (0.3 * s).cos()];
        for k in 0..=70 {
            let s = 0.05 * k as f64;
            assert!((sum(s, 0, &straight) - (3.0 + 2.0 * s)).abs() < 1e-12, "{s}");
            let is_between = (0.5..=3.25).contains(&s);
            assert!(!is_between || (sum(s, 0, &wave) - (0.3 * s).sin()).abs() < 5e-4, "{s}");
            for order in 0..2 {
                let h = 1e-6;
                let slope = (sum(s + h, order, &wave) - sum(s - h, order, &wave)) / (2.0 * h);
                // Second derivatives jump at centres.
                let near = line.centres.iter().any(|centre| (centre - s).abs() < 2.0 * h);
                assert!(near || (slope - sum(s, order + 1, &wave)).abs() < 1e-7, "{s} {order}: {slope}");
            }
        }
        for &centre in &line.centres {
            let jump = sum(centre + 1e-9, 1, &wave) - sum(centre - 1e-9, 1, &wave);
            assert!(jump.abs() < 1e-8, "the tangent is continuous: {jump}");
        }
    }
}
