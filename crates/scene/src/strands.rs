//! Copies of a straight rod that stand on a sphere: hair.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;
use rod::{RodSpec, shape};

use crate::MAX_SEGMENTS;
use crate::contact::sphere;
use crate::error::{Result, Source};
use crate::format::{self, Shape};
use crate::random::Random;
use crate::refine::{Refinement, mean_radius};
use crate::shape::number_or;

impl format::Strands {
    /// Number of strands.
    pub(crate) fn count(&self, source: &Source) -> Result<usize> {
        source.count(&self.count, 1, MAX_SEGMENTS)
    }
}

/// Checked [`format::Strands`].
pub(crate) struct Strands {
    count: usize,
    centre: Vector3<f64>,
    /// Distance of the roots from the centre [m].
    distance: f64,
    /// Largest angle of a root from the top [rad].
    polar_angle: f64,
    /// Largest displacement of a root from its place in the lattice, in mean distances of roots.
    jitter: f64,
    seed: u64,
    /// Length of each strand [m].
    length: f64,
    /// Number of segments of each strand, after refinement.
    segments: usize,
}

impl Strands {
    /// Strands of `rod`, of which `spec` is built.
    pub(crate) fn new(
        source: &Source,
        strands: &format::Strands,
        rod: &format::Rod,
        spec: &RodSpec,
        refinement: Refinement,
    ) -> Result<Self> {
        let Shape::Straight(shape) = rod.shape.get_ref() else {
            return source.wrong(rod.shape.span(), "strands are straight; give `shape.straight`");
        };
        let placed = [&shape.start_m, &shape.direction].into_iter().flatten().map(|key| key.span());
        if let Some(span) = placed.chain(shape.angle_deg.as_ref().map(|key| key.span())).next() {
            return source.wrong(span, "strands start on their sphere and point outwards; leave it out");
        }
        if let Some(place) = &rod.branch_of {
            return source.wrong(place.get_ref().named(), "strands start on their sphere; leave `branch_of` out");
        }
        let (centre, radius) = sphere(source, &strands.on)?;
        let gap = number_or(&strands.gap_m, 0.0, |v| source.not_negative(v, "m"))?;
        let angle = |v: &_| source.number(v, |v| v > 0.0 && v <= 180.0, "> 0 and <= 180 [degrees]");
        let jitter = |v: &_| source.number(v, |v| (0.0..=1.0).contains(&v), "0 to 1");
        Ok(Self {
            count: strands.count(source)?,
            centre,
            distance: radius + mean_radius(spec.radii.iter().copied().take(refinement.0)) + gap,
            polar_angle: number_or(&strands.polar_angle_deg, 90.0, angle)?.to_radians(),
            jitter: number_or(&strands.jitter, 0.0, jitter)?,
            seed: strands.seed,
            length: source.positive(&shape.length_m, "m")?,
            segments: spec.nodes.len() - 1,
        })
    }

    /// Nodes [m] of each strand, radially outwards.
    pub(crate) fn nodes(&self) -> impl Iterator<Item = Vec<Vector3<f64>>> {
        self.directions().map(|out| shape::straight(self.centre + out * self.distance, out, self.length, self.segments))
    }

    /// Unit vectors from the sphere's centre to the roots: a Fibonacci lattice, from the top downwards.
    fn directions(&self) -> impl Iterator<Item = Vector3<f64>> {
        let golden_angle = PI * (3.0 - 5f64.sqrt());
        // Of the unit sphere's area, the part above the polar angle has 2 pi height.
        let height = 1.0 - self.polar_angle.cos();
        let most = self.jitter * (TAU * height / self.count as f64).sqrt();
        let mut random = Random::new(self.seed, 0);
        (0..self.count).map(move |k| {
            let up = 1.0 - height * (k as f64 + 0.5) / self.count as f64;
            let (sin, cos) = (golden_angle * k as f64).sin_cos();
            let aside = (1.0 - up * up).max(0.0).sqrt();
            let place = Vector3::new(aside * cos, aside * sin, up);
            // Anywhere in a disc about the place, all parts of it alike.
            let (east, north) = (Vector3::new(-sin, cos, 0.0), Vector3::new(-up * cos, -up * sin, aside));
            let by = most * random.uniform(0.0, 1.0).sqrt();
            let (sin, cos) = random.uniform(0.0, TAU).sin_cos();
            (place + (east * cos + north * sin) * by).normalize()
        })
    }
}
