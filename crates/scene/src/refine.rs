//! Refinement: the segments that a file names are cut into equal parts, the segments of the model.

use std::ops::Range;

use nalgebra::Vector3;

/// The number of parts that each segment is cut into; at least one.
#[derive(Clone, Copy)]
pub(crate) struct Refinement(pub(crate) usize);

impl Refinement {
    /// Number of segments of the file among these segments of the model.
    pub(crate) fn count(self, rod: &Range<usize>) -> usize {
        rod.len() / self.0
    }

    /// Parts of the file's segment `index` of a rod.
    pub(crate) fn parts(self, rod: &Range<usize>, index: usize) -> Range<usize> {
        let start = rod.start + index * self.0;
        start..start + self.0
    }

    /// The part, and the fraction of its length, at a fraction of the length of the file's segment `index` of a rod.
    pub(crate) fn place(self, rod: &Range<usize>, index: usize, fraction: f64) -> (usize, f64) {
        let along = fraction * self.0 as f64;
        let part = (along as usize).min(self.0 - 1);
        (self.parts(rod, index).start + part, along - part as f64)
    }

    /// Turn of the material frame [rad] from the first part to the last, for one of `turn` from the first to the last of
    /// `segments` segments.
    pub(crate) fn twist(self, turn: f64, segments: usize) -> f64 {
        let joints = |segments: usize| segments.saturating_sub(1).max(1) as f64;
        turn * (joints(segments * self.0) / (self.0 as f64 * joints(segments)))
    }

    /// What the joints between the parts of a rod's `segments` have, if those of the file have `values`: each what the
    /// nearest of those has, nothing where there is none.
    pub(crate) fn of_joints(self, values: &[Vector3<f64>], segments: usize, closed: bool) -> Vec<Vector3<f64>> {
        let count = segments * self.0 - usize::from(!closed);
        let nearest = |joint: usize| {
            // In segments from the rod's start; joint i of the file is at i + 1.
            let place = (joint + 1) as f64 / self.0 as f64;
            let from_start = place.round() as usize;
            let index = if closed { (from_start + values.len() - 1) % values.len() } else { from_start.max(1) - 1 };
            values.get(index.min(values.len().saturating_sub(1))).copied().unwrap_or_default()
        };
        (0..count).map(nearest).collect()
    }

    /// The nodes of a polygon [m], and those between them.
    pub(crate) fn cut(self, nodes: &[Vector3<f64>], closed: bool) -> Vec<Vector3<f64>> {
        let sides = nodes.len() - usize::from(!closed);
        let mut cut = Vec::with_capacity(sides * self.0 + 1);
        for (i, &node) in nodes.iter().enumerate() {
            cut.push(node);
            let side = nodes[(i + 1) % nodes.len()] - node;
            let between = if i < sides { self.0 } else { 1 };
            cut.extend((1..between).map(|part| node + side * (part as f64 / self.0 as f64)));
        }
        cut
    }
}

/// Mean radius [m] of parts.
pub(crate) fn mean_radius(radii: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = radii.len() as f64;
    radii.sum::<f64>() / count
}

/// Mean of vectors, at least one.
pub(crate) fn mean(vectors: &[Vector3<f64>]) -> Vector3<f64> {
    vectors.iter().sum::<Vector3<f64>>() / vectors.len() as f64
}
