//! Grows a random tree of branches on a rod.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rod::{RodSpec, shape};

use crate::assemble::Builder;
use crate::error::{Result, Source};
use crate::format::Tree;
use crate::random::Random;
use crate::shape::number_or;
use crate::{MAX_SEGMENTS, RodInfo};

/// A checked [`Tree`].
pub(crate) struct Growth {
    pub(crate) branches: usize,
    levels: usize,
    pub(crate) segments: usize,
    length_ratio: f64,
    radius_ratio: f64,
    angle: f64,
    seed: u64,
}

impl Growth {
    pub(crate) fn new(source: &Source, tree: &Tree) -> Result<Self> {
        let ratio = |v: &_| source.number(v, |v| v > 0.0 && v <= 1.0, "> 0 and <= 1");
        let angle = |v: &_| source.number(v, |v| (0.0..=90.0).contains(&v), "0 to 90 [degrees]");
        let levels = source.count(&tree.levels, 1, 20)?;
        Ok(Self {
            branches: source.count(&tree.branches, levels, MAX_SEGMENTS)?,
            levels,
            segments: source.count(&tree.segments, 1, MAX_SEGMENTS)?,
            length_ratio: number_or(&tree.length_ratio, 0.7, ratio)?,
            radius_ratio: number_or(&tree.radius_ratio, 0.6, ratio)?,
            angle: number_or(&tree.angle_deg, 40.0, angle)?.to_radians(),
            seed: tree.seed,
        })
    }

    /// Grows all branches on a rod built from `spec`, whose material and stretch they share.
    pub(crate) fn grow(&self, builder: &mut Builder, trunk: &RodInfo, trunk_length: f64, spec: &RodSpec) {
        let mut random = Random::new(self.seed, 0);
        let mut parents = vec![(trunk.segments.clone(), trunk_length)];
        let mut grown = 0;
        for count in self.level_sizes() {
            let mut level = Vec::with_capacity(count);
            for i in 0..count {
                let (segments, parent_length) = &parents[i % parents.len()];
                let on = segments.start + random.whole(segments.len() / 2, segments.len() - 1);
                let tilt = self.angle * random.uniform(0.75, 1.25);
                let (sin, cos) = random.uniform(0.0, TAU).sin_cos();
                let direction = builder.orientation(on) * Vector3::new(tilt.sin() * cos, tilt.sin() * sin, tilt.cos());
                let length = parent_length * self.length_ratio * random.uniform(0.8, 1.2);
                let radius = builder.segment(on).radius * self.radius_ratio;
                let nodes = shape::straight(builder.point(on, 1.0), direction, length, self.segments);
                let branch = RodSpec {
                    radii: taper(radius, radius * self.radius_ratio, self.segments),
                    stretch: spec.stretch,
                    ..RodSpec::new(nodes, radius, spec.material)
                };
                let segments = builder.add_rod(format!("{}/{grown}", trunk.name), &branch, Some((on, 1.0)));
                grown += 1;
                level.push((segments, length));
            }
            parents = level;
        }
    }

    /// Branches of each level, in geometric progression, at least one.
    fn level_sizes(&self) -> Vec<usize> {
        let growth = (self.branches as f64).powf(1.0 / self.levels as f64);
        let total: f64 = (1..=self.levels).map(|level| growth.powi(level as i32)).sum();
        let mut left = self.branches;
        let size = |level: usize| {
            let later = self.levels - level;
            let share = self.branches as f64 * growth.powi(level as i32) / total;
            let size = if later == 0 { left } else { (share as usize).clamp(1, left - later) };
            left -= size;
            size
        };
        (1..=self.levels).map(size).collect()
    }
}

/// Radii at the centres of `segments` segments, linear from `start` to `end` [m] at the faces.
pub(crate) fn taper(start: f64, end: f64, segments: usize) -> Vec<f64> {
    if start == end {
        return vec![start];
    }
    (0..segments).map(|i| start + (end - start) * (i as f64 + 0.5) / segments as f64).collect()
}
