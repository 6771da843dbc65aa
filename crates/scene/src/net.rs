//! Nets of ropes that are joined where they cross, or woven: over and under each other in turns.

use std::f64::consts::PI;
use std::ops::Range;

use nalgebra::Vector3;
use rod::{RodSpec, shape};
use toml::Spanned;

use crate::builder::Builder;
use crate::error::{Result, Source};
use crate::refine::Refinement;
use crate::shape::{NODE_DISTANCE, number_or};
use crate::{MAX_SEGMENTS, defaults, format, properties};

/// Number of segments of a net, before refinement.
pub(crate) fn segments(source: &Source, net: &format::Net) -> Result<usize> {
    let ([x, y], side) = counts(source, net)?;
    let ends = if net.woven { 2 * (side / 2) + 1 } else { 0 };
    let of_ropes = |meshes: usize, across: usize| {
        meshes.saturating_mul(side).saturating_add(ends).saturating_mul(across.saturating_add(1))
    };
    Ok(of_ropes(x, y).saturating_add(of_ropes(y, x)))
}

/// Meshes along x and y, and segments of a mesh's side.
fn counts(source: &Source, net: &format::Net) -> Result<([usize; 2], usize)> {
    let [x, y] = &net.meshes.0;
    let count = |value| source.count(value, 1, MAX_SEGMENTS);
    let least = if net.woven { 2 } else { 1 };
    Ok(([count(x)?, count(y)?], source.count(&net.segments, least, MAX_SEGMENTS)?))
}

/// A checked [`format::Net`].
pub(crate) struct Net {
    meshes: [usize; 2],
    /// Number of segments of a mesh's side, before refinement.
    segments: usize,
    refinement: Refinement,
    /// Whether ropes pass over and under each other, and are not joined.
    woven: bool,
    /// Where its first ropes cross [m].
    corner: Vector3<f64>,
    /// Lengths along x and y [m].
    size: [f64; 2],
    /// Radius, material and stretch of all ropes; without nodes.
    rope: RodSpec,
}

impl Net {
    pub(crate) fn new(source: &Source, entry: &Spanned<format::Net>, refinement: Refinement) -> Result<Self> {
        let net = entry.get_ref();
        let (meshes, segments) = counts(source, net)?;
        let mut size = [0.0; 2];
        for ((size, key), meshes) in size.iter_mut().zip(&net.size_m.0).zip(meshes) {
            *size = source.positive(key, "m")?;
            let each = *size / (meshes * segments * refinement.0) as f64;
            if !NODE_DISTANCE.contains(&each) {
                let Range { start, end } = NODE_DISTANCE;
                let message = format!("segments of {each} m, but they must be {start:e} to {end:e} m long");
                return source.wrong(key.span(), &message);
            }
        }
        let centre = net.centre_m.as_ref().map_or(Ok(Vector3::zeros()), |key| source.vector(key, "m"))?;
        let radius = number_or(&net.radius_m, defaults::RADIUS, |v| source.positive(v, "m"))?;
        let material =
            properties::material(source, &net.youngs_modulus_pa, &net.torsion_modulus_pa, &net.density_kg_m3)?;
        let stretch = properties::stretch(source, &net.stretch, refinement)?;
        let corner = centre - 0.5 * Vector3::new(size[0], size[1], 0.0);
        let rope = RodSpec { stretch, ..RodSpec::new(Vec::new(), radius, material) };
        Ok(Self { meshes, segments, refinement, woven: net.woven, corner, size, rope })
    }

    /// Builds the ropes along x, then those along y. These start as branches of the first and are joined to the others; woven
    /// ropes are not.
    pub(crate) fn build(&self, builder: &mut Builder, name: &str) {
        let [along_x, along_y] = self.meshes;
        if self.woven {
            for (axis, of, last) in [(0, "x", along_y), (1, "y", along_x)] {
                for k in 0..=last {
                    builder.add_rod(format!("{name}/{of}-{k}"), &self.rope(axis, k), None);
                }
            }
            return;
        }
        let x_ropes: Vec<_> =
            (0..=along_y).map(|k| builder.add_rod(format!("{name}/x-{k}"), &self.rope(0, k), None)).collect();
        for k in 0..=along_x {
            let start = self.crossing(&x_ropes[0], k);
            let y_rope = builder.add_rod(format!("{name}/y-{k}"), &self.rope(1, k), Some(start));
            for (i, x_rope) in x_ropes.iter().enumerate().skip(1) {
                builder.join_at(self.crossing(x_rope, k), self.crossing(&y_rope, i));
            }
        }
    }

    /// The `k`-th rope along x (axis 0) or y (axis 1).
    fn rope(&self, axis: usize, k: usize) -> RodSpec {
        let across = 1 - axis;
        let mut start = self.corner;
        start[across] += self.size[across] * k as f64 / self.meshes[across] as f64;
        let direction = Vector3::ith(axis, 1.0);
        let nodes = if self.woven {
            self.refinement
                .cut(&self.wave(start, direction, self.size[axis] / self.meshes[axis] as f64, axis, k), false)
        } else {
            shape::straight(start, direction, self.size[axis], self.meshes[axis] * self.segments * self.refinement.0)
        };
        RodSpec { nodes, ..self.rope.clone() }
    }

    /// Nodes [m] of the `k`-th woven rope of an axis, whose first crossing is at `start`: a cosine with crests and troughs where
    /// it crosses, in meshes of `mesh` [m]. The middle of a segment is at each crossing, a radius away from the net's plane, and half a
    /// mesh or so at both ends is beyond the last ones.
    fn wave(
        &self,
        start: Vector3<f64>,
        direction: Vector3<f64>,
        mesh: f64,
        axis: usize,
        k: usize,
    ) -> Vec<Vector3<f64>> {
        let (each, beyond) = (1.0 / self.segments as f64, self.segments / 2);
        let side = if (axis + k).is_multiple_of(2) { 1.0 } else { -1.0 };
        let height = side * self.rope.radii[0] / (0.5 * PI * each).cos();
        let count = self.meshes[axis] * self.segments + 2 * beyond + 1;
        (0..=count)
            .map(|i| (i as f64 - beyond as f64 - 0.5) * each)
            .map(|at| start + direction * (mesh * at) + Vector3::z() * (height * (PI * at).cos()))
            .collect()
    }

    /// Segment and fraction at which a rope crosses the `k`-th one.
    fn crossing(&self, rope: &Range<usize>, k: usize) -> (usize, f64) {
        match k {
            0 => (rope.start, 0.0),
            _ => (rope.start + k * self.segments * self.refinement.0 - 1, 1.0),
        }
    }
}
