//! From an entry of `[[bodies]]` to a rigid body with all that belongs to it, and the joints between rods and bodies.

use nalgebra::{UnitQuaternion, Vector3};
use rod::{Body, BodyShape, Driven, Pose, RigidBody};
use toml::Spanned;

use crate::builder::Builder;
use crate::error::{Result, Source};
use crate::given::unit;
use crate::motion::Prepared;
use crate::shape::{NODE_DISTANCE, number_or};
use crate::{format, rods};

/// Builds entry `index` of the file's bodies; `beyond_planes` says whether any obstacle is no plane.
pub(crate) fn add(
    builder: &mut Builder,
    source: &Source,
    index: usize,
    entry: &Spanned<format::Body>,
    beyond_planes: bool,
) -> Result<()> {
    let own = entry.get_ref();
    let name = builder.new_name(source, &own.name, format!("body-{index}"), entry.span())?;
    let body = RigidBody { touches: touches(source, own, beyond_planes)?, ..body(source, entry)? };
    let vector = |value: &Option<format::Vector>, unit| value.as_ref().map(|v| source.vector(v, unit)).transpose();
    let orientation = orientation(source, &own.orientation, &own.turn_deg)?;
    let pose = Pose { position: vector(&own.position_m, "m")?.unwrap_or_default(), orientation };
    let segment = builder.add_body(name, body, pose);
    let is_held = own.fixed || !own.motions.is_empty();
    let velocities = [&own.velocity_m_s, &own.angular_velocity_rad_s];
    if let Some(velocity) = velocities.into_iter().flatten().find(|_| is_held) {
        return source.wrong(velocity.span(), "this body is held; leave its velocity out, or give `motions`");
    }
    let state = builder.assembly.state_mut();
    state.velocities[segment] = vector(&own.velocity_m_s, "m/s")?.unwrap_or_default();
    state.angular_velocities[segment] = vector(&own.angular_velocity_rad_s, "rad/s")?.unwrap_or_default();
    if is_held {
        builder.assembly.fix(segment);
    }
    if let Some(second) = own.motions.get(1) {
        return source.wrong(second.span(), "another motion drives the same body");
    }
    for motion in &own.motions {
        let format::Motion { at, segment: part, .. } = motion.get_ref();
        if let Some(span) = at.as_ref().map(Spanned::span).or(part.as_ref().map(Spanned::span)) {
            return source.wrong(span, WHOLE);
        }
        if let Some(span) = motion.get_ref().of_grips() {
            return source.wrong(span, "is of grips on rods; a body is driven all the time, leave it out");
        }
        let motion = Prepared::new(source, motion)?.motion(source, motion, &pose)?;
        let driven = Driven::gripped(Body::Segment(segment), motion, &pose, 0.0);
        let (state, begin) = (builder.assembly.state_mut(), driven.at(0.0));
        (state.velocities[segment], state.angular_velocities[segment]) = (begin.velocity, begin.angular_velocity);
        builder.assembly.model_mut().motions.push(driven);
    }
    for load in &own.loads {
        let format::Load { at, segment: part, fraction, .. } = load.get_ref();
        let spans =
            [at.as_ref().map(Spanned::span), part.as_ref().map(Spanned::span), fraction.as_ref().map(Spanned::span)];
        if let Some(span) = spans.into_iter().flatten().next() {
            return source.wrong(span, WHOLE);
        }
        rods::add_forces(builder, source, load, segment, 0.0)?;
    }
    Ok(())
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

/// Why keys that name a part of a rod say nothing of a body.
const WHOLE: &str = "a body is moved and loaded at its centre of mass; leave this out";

/// Mass, inertia and shape.
fn body(source: &Source, entry: &Spanned<format::Body>) -> Result<RigidBody> {
    let own = entry.get_ref();
    let shape = shape(source, own.shape.get_ref())?;
    let mass = match (&own.mass_kg, &own.density_kg_m3) {
        (Some(mass), None) => source.positive(mass, "kg")?,
        (None, Some(density)) if shape == BodyShape::Hidden => {
            return source.wrong(density.span(), "a hidden body has no volume; give `mass_kg`");
        }
        (None, Some(density)) => source.positive(density, "kg/m^3")? * shape.volume(),
        _ => return source.wrong(entry.span(), "give either `mass_kg` or `density_kg_m3`"),
    };
    let mut body = RigidBody::new(shape, mass);
    body.drag_area = number_or(&own.drag_area_m2, body.drag_area, |v| source.not_negative(v, "m^2"))?;
    match &own.inertia_kg_m2 {
        Some(value) => {
            body.inertia = source.vector(value, "kg m^2")?;
            let (least, most, sum) = (body.inertia.min(), body.inertia.max(), body.inertia.sum());
            if !(least > 0.0 && sum.is_finite() && 2.0 * most <= sum * (1.0 + 1e-9)) {
                let allowed = "three moments of inertia > 0 [kg m^2], none larger than the sum of the other two";
                return source.must_be(value.span(), allowed);
            }
        }
        None if shape == BodyShape::Hidden => {
            return source.wrong(entry.span(), "a hidden body needs `inertia_kg_m2`");
        }
        None => {}
    }
    Ok(body)
}

/// A length that one can compute with [m].
pub(crate) fn length(source: &Source, value: &format::Number) -> Result<f64> {
    let length = source.positive(value, "m")?;
    if !NODE_DISTANCE.contains(&length) {
        return source.must_be(value.span(), &format!("{:e} to {:e} m", NODE_DISTANCE.start, NODE_DISTANCE.end));
    }
    Ok(length)
}

fn shape(source: &Source, shape: &format::BodyShape) -> Result<BodyShape> {
    let length = |value: &format::Number| length(source, value);
    Ok(match shape {
        format::BodyShape::Sphere(ball) => BodyShape::Sphere { radius: length(&ball.radius_m)? },
        format::BodyShape::Capsule(round) => {
            BodyShape::Capsule { radius: length(&round.radius_m)?, length: length(&round.length_m)? }
        }
        format::BodyShape::Cylinder(round) => {
            BodyShape::Cylinder { radius: length(&round.radius_m)?, length: length(&round.length_m)? }
        }
        format::BodyShape::Box(block) => {
            let [x, y, z] = &block.sides_m.0;
            BodyShape::Box { sides: Vector3::new(length(x)?, length(y)?, length(z)?) }
        }
        format::BodyShape::Hidden(_) => BodyShape::Hidden,
    })
}

/// Whether a body touches rods and obstacles; `beyond_planes` says whether any obstacle is no plane.
fn touches(source: &Source, own: &format::Body, beyond_planes: bool) -> Result<bool> {
    let (is_hidden, has_faces) = match own.shape.get_ref() {
        format::BodyShape::Sphere(_) | format::BodyShape::Capsule(_) => (false, false),
        format::BodyShape::Cylinder(_) | format::BodyShape::Box(_) => (false, true),
        format::BodyShape::Hidden(_) => (true, false),
    };
    match &own.touches {
        Some(value) if *value.get_ref() && is_hidden => {
            source.must_be(value.span(), "false: a hidden body has nothing to touch with")
        }
        Some(value) => Ok(*value.get_ref()),
        None if has_faces && beyond_planes => source.wrong(
            own.shape.span(),
            "of obstacles, boxes and cylinders touch planes alone; say `touches = true` if it may pass through the others, \
             or `touches = false`",
        ),
        None => Ok(!is_hidden),
    }
}
