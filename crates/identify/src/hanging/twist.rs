//! The twist at which a hanging wire leaves its plane.

use std::sync::Arc;

use cosserat::motion::{Driven, Interpolation, Keyframe, Motion};
use cosserat::state::Body;
use cosserat::statics::{PathEnd, PathParams, StaticParams, path};
use nalgebra::Vector3;

use super::{HangingError, Photograph, Wire};

/// Ratios GJ / EI between which is searched. Wires that are stiffer against twist do not snap: as they are turned, they go round.
const RATIOS: [f64; 2] = [0.2, 4.0];
/// From one tried ratio to the next.
const STRIDE: f64 = 1.3;
/// The ratio is found to this share of it.
const FOUND: f64 = 1e-3;

/// The turn of the end's grip about its axis [rad] at which a hanging wire snaps, with `bending` EI [N m^2] and `ratio` GJ / EI: where
/// the path of its equilibria, which begins in the plane and without twist, first has a direction in which it is unstable.
/// 0 where it is so without twist, `None` where it is not up to `most` [rad].
///
/// # Errors
/// If the wire does not reach from grip to grip, a model is not valid, or its equilibria cannot be followed so far.
pub fn critical_twist(
    wire: &Wire,
    photograph: &Photograph,
    bending: f64,
    ratio: f64,
    most: f64,
) -> Result<Option<f64>, HangingError> {
    let (mut model, mut state) = wire.model(photograph, bending, ratio)?;
    let anchor = model.anchors[1];
    let turned = |time: f64, angle: f64| Keyframe {
        time,
        position: anchor.position,
        turn: anchor.orientation * Vector3::z() * angle,
    };
    let keyframes = [turned(0.0, 0.0), turned(1.0, most)];
    let motion = Motion::new(anchor.orientation, &keyframes, Interpolation::Linear)?;
    model.motions.push(Driven::new(Body::Anchor(1), Arc::new(motion)));
    let (mut snaps_at, mut reached) = (None, 0.0);
    let params = PathParams {
        rest: StaticParams { leave_unstable: false, ..StaticParams::default() },
        ..PathParams::until(1.0)
    };
    let report = path(&model, &mut state, &params, &mut |point, _, _| {
        reached = point.time * most;
        snaps_at = (point.unstable > 0).then_some(point.time * most);
        snaps_at.is_none()
    })?;
    match report.end {
        PathEnd::Until | PathEnd::Stopped => Ok(snaps_at),
        _ => Err(HangingError::Lost { ratio, degrees: reached.to_degrees() }),
    }
}

/// The ratio GJ / EI with which a wire of `bending` EI [N m^2] snaps at a turn of `twist` [rad]: the stiffer it is against twist, the sooner
/// it snaps. From the least ratio upwards, then by bisection of its logarithm.
///
/// # Errors
/// As [`critical_twist`], and if it does not snap with any ratio from 0.2 to 4, or with each of them.
pub fn twist_ratio(wire: &Wire, photograph: &Photograph, bending: f64, twist: f64) -> Result<f64, HangingError> {
    let snaps = |ratio: f64| Ok::<_, HangingError>(critical_twist(wire, photograph, bending, ratio, twist)?.is_some());
    let [least, most] = RATIOS;
    if snaps(least)? {
        return Err(HangingError::AnyTwist { degrees: twist.to_degrees(), least });
    }
    let (mut low, mut high) = (least, least * STRIDE);
    while !snaps(high)? {
        if high >= most {
            return Err(HangingError::NoTwist { degrees: twist.to_degrees(), least, most });
        }
        (low, high) = (high, (high * STRIDE).min(most));
    }
    while high / low > 1.0 + FOUND {
        let middle = (low * high).sqrt();
        *(if snaps(middle)? { &mut high } else { &mut low }) = middle;
    }
    Ok((low * high).sqrt())
}
