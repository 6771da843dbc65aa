//! Copies of a straight rod, level and one above the other, that point anywhere: what falls into a heap.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rod::{RodSpec, shape};

use crate::MAX_SEGMENTS;
use crate::error::{Result, Source};
use crate::format::{self, Shape};
use crate::random::Random;

impl format::Heap {
    /// Number of rods.
    pub(crate) fn count(&self, source: &Source) -> Result<usize> {
        source.count(&self.count, 1, MAX_SEGMENTS)
    }
}

/// Checked [`format::Heap`].
pub(crate) struct Heap {
    count: usize,
    /// Middle of the lowest rod [m].
    centre: Vector3<f64>,
    /// Height from rod to rod [m].
    spacing: f64,
    seed: u64,
    /// Length of each rod [m].
    length: f64,
    /// Number of segments of each rod, after refinement.
    segments: usize,
}

impl Heap {
    /// A heap of `rod`, of which `spec` is built.
    pub(crate) fn new(source: &Source, heap: &format::Heap, rod: &format::Rod, spec: &RodSpec) -> Result<Self> {
        let Shape::Straight(shape) = rod.shape.get_ref() else {
            return source.wrong(rod.shape.span(), "rods of a heap are straight; give `shape.straight`");
        };
        let placed = [&shape.start_m, &shape.direction].into_iter().flatten().map(|key| key.span());
        if let Some(span) = placed.chain(shape.angle_deg.as_ref().map(|key| key.span())).next() {
            return source.wrong(span, "rods of a heap lie about its `centre_m`; leave it out");
        }
        if let Some(place) = &rod.branch_of {
            return source.wrong(place.get_ref().named(), "rods of a heap are on no other; leave `branch_of` out");
        }
        Ok(Self {
            count: heap.count(source)?,
            centre: heap.centre_m.as_ref().map_or(Ok(Vector3::zeros()), |key| source.vector(key, "m"))?,
            spacing: source.positive(&heap.spacing_m, "m")?,
            seed: heap.seed,
            length: source.positive(&shape.length_m, "m")?,
            segments: spec.nodes.len() - 1,
        })
    }

    /// Nodes [m] of each rod, from the lowest upwards; all horizontal directions are alike likely.
    pub(crate) fn nodes(&self) -> impl Iterator<Item = Vec<Vector3<f64>>> {
        let mut random = Random::new(self.seed, 0);
        (0..self.count).map(move |k| {
            let (sin, cos) = random.uniform(0.0, TAU).sin_cos();
            let (along, up) = (Vector3::new(cos, sin, 0.0), Vector3::z() * (self.spacing * k as f64));
            shape::straight(self.centre + up - along * (0.5 * self.length), along, self.length, self.segments)
        })
    }
}
