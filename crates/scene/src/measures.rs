//! Lengths and orientations as keys give them.

use nalgebra::UnitQuaternion;

use crate::error::{Result, Source};
use crate::format;
use crate::given::unit;
use crate::shape::NODE_DISTANCE;

/// A length that one can compute with [m].
pub(crate) fn length(source: &Source, value: &format::Number) -> Result<f64> {
    let length = source.positive(value, "m")?;
    if !NODE_DISTANCE.contains(&length) {
        return source.must_be(value.span(), &format!("{:e} to {:e} m", NODE_DISTANCE.start, NODE_DISTANCE.end));
    }
    Ok(length)
}

/// The orientation that either of two keys gives; none is that of the world.
pub(crate) fn orientation(
    source: &Source,
    quaternion: &Option<format::Quaternion>,
    turn: &Option<format::Vector>,
) -> Result<UnitQuaternion<f64>> {
    match (quaternion, turn) {
        (Some(_), Some(turn)) => source.wrong(turn.span(), "give either `orientation` or `turn_deg`, not both"),
        (Some(value), None) => match unit(value.get_ref().0) {
            Some(orientation) => Ok(orientation),
            None => source.must_be(value.span(), "a unit quaternion [w, x, y, z], its norm 1 to within 1e-3"),
        },
        (None, Some(turn)) => {
            Ok(UnitQuaternion::from_scaled_axis(source.vector(turn, "degrees")?.map(f64::to_radians)))
        }
        (None, None) => Ok(UnitQuaternion::identity()),
    }
}
