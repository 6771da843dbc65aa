//! Grows a random tree of branches on a rod.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rod::{RodSpec, shape};

use crate::builder::Builder;
use crate::error::{Result, Source};
use crate::format::Tree;
use crate::properties::taper;
use crate::random::Random;
use crate::refine::{Refinement, mean_radius};
use crate::shape::number_or;
use crate::{MAX_SEGMENTS, RodInfo};

/// How branches are cut into segments.
#[derive(Clone, Copy)]
enum Cut {
    /// Segments of each branch.
    Segments(usize),
    /// Length of a segment [m], as nearly as whole numbers allow.
    Length(f64),
}

/// A checked [`Tree`].
pub(crate) struct Growth {
    branches: usize,
    levels: usize,
    cut: Cut,
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
            cut: Self::cut(source, tree)?,
            length_ratio: number_or(&tree.length_ratio, 0.7, ratio)?,
            radius_ratio: number_or(&tree.radius_ratio, 0.6, ratio)?,
            angle: number_or(&tree.angle_deg, 40.0, angle)?.to_radians(),
            seed: tree.seed,
        })
    }

    fn cut(source: &Source, tree: &Tree) -> Result<Cut> {
        match (&tree.segments, &tree.segment_m) {
            (Some(segments), None) => Ok(Cut::Segments(source.count(segments, 1, MAX_SEGMENTS)?)),
            (None, Some(length)) => Ok(Cut::Length(source.positive(length, "m")?)),
            (Some(_), Some(length)) => source.wrong(length.span(), "give either `segments` or `segment_m`, not both"),
            (None, None) => source.wrong(tree.branches.span(), "give `segments` or `segment_m` with it"),
        }
    }

    /// The fewest segments that all branches can have, before refinement: their lengths are drawn as they grow.
    pub(crate) fn least_segments(&self) -> usize {
        match self.cut {
            Cut::Segments(segments) => self.branches.saturating_mul(segments),
            Cut::Length(_) => self.branches,
        }
    }

    fn segments(&self, length: f64) -> usize {
        match self.cut {
            Cut::Segments(segments) => segments,
            // A number too large for a whole one becomes the largest.
            Cut::Length(each) => ((length / each).round() as usize).max(1),
        }
    }

    /// Grows all branches on a rod built from `spec`, whose material, stretch and inner damping they share. Stops and returns `false`
    /// where they would have more than [`MAX_SEGMENTS`] segments.
    pub(crate) fn grow(
        &self,
        builder: &mut Builder,
        trunk: &RodInfo,
        trunk_length: f64,
        spec: &RodSpec,
        refinement: Refinement,
    ) -> bool {
        let mut room = MAX_SEGMENTS.saturating_sub(trunk.segments.end);
        let mut random = Random::new(self.seed, 0);
        let mut parents = vec![(trunk.segments.clone(), trunk_length)];
        let mut grown = 0;
        for count in self.level_sizes() {
            let mut level = Vec::with_capacity(count);
            for i in 0..count {
                let (segments, parent_length) = &parents[i % parents.len()];
                let count = refinement.count(segments);
                let parts = refinement.parts(segments, random.whole(count / 2, count - 1));
                let on = parts.end - 1;
                let tilt = self.angle * random.uniform(0.75, 1.25);
                let (sin, cos) = random.uniform(0.0, TAU).sin_cos();
                let direction = builder.orientation(on) * Vector3::new(tilt.sin() * cos, tilt.sin() * sin, tilt.cos());
                let length = parent_length * self.length_ratio * random.uniform(0.8, 1.2);
                let radius = mean_radius(parts.map(|i| builder.segment(i).radius)) * self.radius_ratio;
                let count = self.segments(length).saturating_mul(refinement.0);
                let Some(left) = room.checked_sub(count) else { return false };
                room = left;
                let nodes = shape::straight(builder.point(on, 1.0), direction, length, count);
                let branch = RodSpec {
                    radii: taper(radius, radius * self.radius_ratio, count),
                    stretch: spec.stretch,
                    inner_damping: spec.inner_damping,
                    ..RodSpec::new(nodes, radius, spec.material)
                };
                let segments = builder.add_rod(format!("{}/{grown}", trunk.name), &branch, Some((on, 1.0)));
                grown += 1;
                level.push((segments, length));
            }
            parents = level;
        }
        true
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
