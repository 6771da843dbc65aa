//! Motors: torques of two rods on each other about the axis of their hinge.

use nalgebra::Vector3;
use rod::{Body, Change, Changing, Load};
use toml::Spanned;

use crate::builder::Builder;
use crate::error::{Result, Source};
use crate::format;
use crate::motion::{ascending, interpolation, made, one_a_time};

/// Lets a motor turn the second rod of the hinge that was made last about the axis of the first one, which bears the opposite torque: two loads
/// that turn with their segments.
pub(crate) fn add(builder: &mut Builder, source: &Source, entry: &Spanned<format::Motor>) -> Result<()> {
    let format::Motor { torque_n_m, times_s, torques_n_m, interpolation: between, repeats } = entry.get_ref();
    let number = |value: &format::Number| source.finite(value, "N m");
    let (first, course) = match (torque_n_m, times_s, torques_n_m) {
        (Some(torque), None, None) => match between {
            Some(between) => return source.wrong(between.span(), "goes with `times_s`"),
            None => (number(torque)?, None),
        },
        (None, Some(times), Some(list)) => {
            let seconds = ascending(source, times)?;
            one_a_time(source, list, seconds.len())?;
            let torques = list.get_ref().iter().map(number).collect::<Result<Vec<f64>>>()?;
            let first = torques.first().copied().unwrap_or_default();
            (first, Some(seconds.into_iter().zip(torques).collect::<Vec<_>>()))
        }
        _ => return source.wrong(entry.span(), "give either `torque_n_m`, or `times_s` and `torques_n_m`"),
    };
    if *repeats && times_s.is_none() {
        return source.wrong(entry.span(), "`repeats` goes with `times_s`");
    }
    let model = builder.assembly.model_mut();
    let Some(joint) = model.joints.last().copied() else { return Ok(()) };
    let (Body::Segment(a), Body::Segment(b)) = (joint.a, joint.b) else { return Ok(()) };
    let axis = Vector3::z();
    for (segment, axis) in [(b, joint.rest_frames[1] * axis), (a, -axis)] {
        let index = model.loads.len();
        if let Some(course) = &course {
            let values: Vec<_> = course.iter().map(|&(time, torque)| (time, axis * torque)).collect();
            let track = made(source, entry.span(), &values, interpolation(between), *repeats)?;
            model.changes.push(Change { of: Changing::Torque(index), track });
        }
        let torque = axis * first;
        model.loads.push(Load { segment, offset: 0.0, force: Vector3::zeros(), torque, follows: true });
    }
    builder.motors.push([a, b]);
    Ok(())
}
