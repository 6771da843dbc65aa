//! From a rod's keys to its material, section, resistance to stretch, twist and rest shape.

use rod::{Material, RestShape, Stretch};
use toml::Spanned;

use crate::error::{Result, Source, short};
use crate::refine::Refinement;
use crate::shape::{NODE_DISTANCE, number_or};
use crate::{defaults, format};

/// The material of these moduli and this density.
pub(crate) fn material(
    source: &Source,
    youngs_modulus_pa: &Option<format::Number>,
    torsion_modulus_pa: &Option<format::Number>,
    density_kg_m3: &Option<format::Number>,
) -> Result<Material> {
    let youngs_modulus = number_or(youngs_modulus_pa, defaults::YOUNGS_MODULUS, |v| source.positive(v, "Pa"))?;
    Ok(Material {
        youngs_modulus,
        torsion_modulus: number_or(torsion_modulus_pa, youngs_modulus, |v| source.positive(v, "Pa"))?,
        density: number_or(density_kg_m3, defaults::DENSITY, |v| source.positive(v, "kg/m^3"))?,
    })
}

/// Resistance to stretch of a segment's parts.
pub(crate) fn stretch(source: &Source, stretch: &format::Stretch, refinement: Refinement) -> Result<Stretch> {
    let of_parts = |whole: Stretch| match whole {
        Stretch::Compliance(compliance) => Stretch::Compliance(compliance / refinement.0 as f64),
        Stretch::Physical => Stretch::Physical,
    };
    Ok(of_parts(match stretch {
        format::Stretch::Zero => Stretch::ZERO_STRETCH,
        format::Stretch::Physical => Stretch::Physical,
        format::Stretch::Compliance(value) => Stretch::Compliance(source.not_negative(value, "m/N")?),
    }))
}

/// Shape without energy, of a rod of so many segments of the file whose `longest` part [m] is that long.
pub(crate) fn rest(
    source: &Source,
    rest: &format::Rest,
    longest: f64,
    (segments, closed): (usize, bool),
    refinement: Refinement,
) -> Result<RestShape> {
    let darboux = |value: &format::Vector| {
        let omega = source.vector(value, "1/m")?;
        if omega.norm() * longest >= 2.0 {
            let allowed = format!("shorter than 2 / segment length = {} [1/m]", short(2.0 / longest));
            return source.must_be(value.span(), &allowed);
        }
        Ok(omega)
    };
    Ok(match rest {
        format::Rest::Initial => RestShape::Initial,
        format::Rest::Straight => RestShape::Straight,
        format::Rest::Darboux(value) => RestShape::Uniform(darboux(value)?),
        format::Rest::OfJoints(values) => {
            let joints = segments - usize::from(!closed);
            let found = values.get_ref().len();
            if found != joints {
                return source
                    .wrong(values.span(), &format!("{found} vectors, but there must be one a joint ({joints})"));
            }
            let omegas = values.get_ref().iter().map(darboux).collect::<Result<Vec<_>>>()?;
            RestShape::PerJoint(refinement.of_joints(&omegas, segments, closed))
        }
    })
}

/// Radii [m] of `segments` segments.
pub(crate) fn radii(source: &Source, radius: &Option<Spanned<format::Radius>>, segments: usize) -> Result<Vec<f64>> {
    let Some(radius) = radius else { return Ok(vec![defaults::RADIUS]) };
    let format::Radius { start, end } = *radius.get_ref();
    match [start, end].iter().all(|r| r.is_finite() && *r > 0.0) {
        true if start.max(end) > NODE_DISTANCE.end => {
            source.must_be(radius.span(), &format!("{:e} m at most", NODE_DISTANCE.end))
        }
        true => Ok(taper(start, end, segments)),
        false => source.must_be(radius.span(), "finite and > 0 [m]"),
    }
}

/// Radii at the centres of `segments` segments, linear from `start` to `end` [m] at the faces.
pub(crate) fn taper(start: f64, end: f64, segments: usize) -> Vec<f64> {
    if start == end {
        return vec![start];
    }
    (0..segments).map(|i| start + (end - start) * (i as f64 + 0.5) / segments as f64).collect()
}

/// Turn [rad] of the material frame along an open rod of `segments` segments.
pub(crate) fn twist(source: &Source, twist: &Option<format::Number>, closed: bool, segments: usize) -> Result<f64> {
    let Some(twist) = twist else { return Ok(0.0) };
    let degrees = source.finite(twist, "degrees")?;
    if closed {
        return source
            .wrong(twist.span(), "a closed rod is twisted by `rest = { darboux_per_m = [0, 0, -turn / length] }`");
    }
    let most = 180.0 * (segments as f64 - 1.0);
    match degrees == 0.0 || degrees.abs() < most {
        true => Ok(degrees.to_radians()),
        false => source.must_be(twist.span(), &format!("less than half a turn a joint: {most} [degrees]")),
    }
}
