//! Poses as MJCF gives them: `pos` and one of `quat`, `axisangle`, `euler`, `xyaxes`, `zaxis`.

use nalgebra::{Isometry3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3};

use crate::error::Result;
use crate::option::Compiler;
use crate::xml::Element;

/// The attributes of a pose.
pub(crate) const POSE: [&str; 6] = ["pos", "quat", "axisangle", "euler", "xyaxes", "zaxis"];

/// The pose of an element in what it is in.
pub(crate) fn pose(element: &Element, compiler: &Compiler) -> Result<Isometry3<f64>> {
    let position = element.vector("pos")?.unwrap_or_default();
    Ok(Isometry3::from_parts(Translation3::from(position), orientation(element, compiler)?))
}

fn orientation(element: &Element, compiler: &Compiler) -> Result<UnitQuaternion<f64>> {
    let given: Vec<&str> = POSE[1..].iter().copied().filter(|name| element.has(name)).collect();
    if let [_, second, ..] = given[..] {
        return element.at(second, &format!("{} says how it is turned, too", given[0]));
    }
    let axis = |name: &str, v: Vector3<f64>| match Unit::try_new(v, 1e-12) {
        Some(axis) => Ok(axis),
        None => element.must_be(name, "an axis other than zero"),
    };
    if let Some([w, x, y, z]) = element.exactly("quat")? {
        return match UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-12) {
            Some(turn) => Ok(turn),
            None => element.must_be("quat", "a quaternion other than zero"),
        };
    }
    if let Some([x, y, z, angle]) = element.exactly("axisangle")? {
        let axis = axis("axisangle", Vector3::new(x, y, z))?;
        return Ok(UnitQuaternion::from_axis_angle(&axis, compiler.radians(angle)));
    }
    if let Some(angles) = element.exactly::<3>("euler")? {
        let mut turn = UnitQuaternion::identity();
        for (letter, angle) in compiler.eulerseq.iter().zip(angles) {
            let axis = match letter.to_ascii_lowercase() {
                'x' => Vector3::x_axis(),
                'y' => Vector3::y_axis(),
                _ => Vector3::z_axis(),
            };
            let next = UnitQuaternion::from_axis_angle(&axis, compiler.radians(angle));
            // Small letters turn about axes that turn along, large ones about axes that stay.
            turn = if letter.is_ascii_lowercase() { turn * next } else { next * turn };
        }
        return Ok(turn);
    }
    if let Some([x1, x2, x3, y1, y2, y3]) = element.exactly("xyaxes")? {
        let x = axis("xyaxes", Vector3::new(x1, x2, x3))?;
        let y = Vector3::new(y1, y2, y3);
        let y = axis("xyaxes", y - x.into_inner() * x.dot(&y))?;
        let z = x.cross(&y);
        return Ok(UnitQuaternion::from_basis_unchecked(&[x.into_inner(), y.into_inner(), z]));
    }
    if let Some(z) = element.vector("zaxis")? {
        return Ok(z_to(&axis("zaxis", z)?));
    }
    Ok(UnitQuaternion::identity())
}

/// The smallest turn that takes z to an axis.
pub(crate) fn z_to(axis: &Unit<Vector3<f64>>) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between(&Vector3::z(), axis)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
}
