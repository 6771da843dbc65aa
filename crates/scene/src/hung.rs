//! From the keys of a hung cable to its nodes.

use nalgebra::Vector3;
use rod::shape;

use crate::error::{Result, Source, short};
use crate::format::{Hung, Vector};

/// How much shorter than the distance of its ends a cable may be and still count as that long, as a part of it.
pub(crate) const ROUNDING: f64 = 1e-9;

impl Hung {
    /// Nodes [m]; on a line where the cable is shorter than the distance of its ends, between which it must stretch.
    pub(crate) fn nodes(
        &self,
        source: &Source,
        from: Vector3<f64>,
        gravity: Vector3<f64>,
        count: usize,
    ) -> Result<Vec<Vector3<f64>>> {
        let unit = |key: &Option<Vector>| key.as_ref().map(|key| source.direction(key)).transpose();
        let (to, length) = (source.vector(&self.to_m, "m")?, source.positive(&self.length_m, "m")?);
        let (start_direction, end_direction) = (unit(&self.start_direction)?, unit(&self.end_direction)?);
        let distance = (to - from).norm();
        if length < distance * (1.0 - ROUNDING) {
            if let Some(key) = self.start_direction.as_ref().or(self.end_direction.as_ref()) {
                let message = format!("a cable of {length} m between ends {} m apart is straight", short(distance));
                return source.wrong(key.span(), &message);
            }
            return Ok(shape::straight(from, to - from, distance, count));
        }
        let hung = shape::Hung { from, to, length: length.max(distance), start_direction, end_direction, gravity };
        match hung.nodes(count) {
            Some(nodes) => Ok(nodes),
            None => source.must_be(
                self.length_m.span(),
                &format!(
                    "longer, or have more segments: the ends are {} m apart, and between them it has to turn from and to \
                     its directions",
                    short(distance)
                ),
            ),
        }
    }
}
