//! From an entry of `[[bodies]]` to a rigid body with all that belongs to it, and the joints between rods and bodies.

use std::sync::Arc;

use nalgebra::Vector3;
use rod::{Body, BodyShape, Driven, Pose, RigidBody, SolidMesh};
use toml::Spanned;

use crate::builder::Builder;
use crate::error::{Result, Source};
use crate::measures::{length, orientation};
use crate::motion::Prepared;
use crate::shape::{NODE_DISTANCE, number_or};
use crate::{format, mesh, rods};

/// Builds entry `index` of the file's bodies.
pub(crate) fn add(builder: &mut Builder, source: &Source, index: usize, entry: &Spanned<format::Body>) -> Result<()> {
    let own = entry.get_ref();
    let name = builder.new_name(source, &own.name, format!("body-{index}"), entry.span())?;
    let body = RigidBody { touches: touches(source, own)?, ..body(source, entry)? };
    let vector = |value: &Option<format::Vector>, unit| value.as_ref().map(|v| source.vector(v, unit)).transpose();
    let orientation = orientation(source, &own.orientation, &own.turn_deg)?;
    let given = Pose { position: vector(&own.position_m, "m")?.unwrap_or_default(), orientation };
    // A mesh stands where the axes of its file are.
    let pose = if let BodyShape::Mesh(solid) = &body.shape { solid.pose(&given) } else { given };
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
        let motion = Prepared::new(source, motion)?.motion(source, motion, &given)?;
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

/// Why keys that name a part of a rod say nothing of a body.
const WHOLE: &str = "a body is moved and loaded at its centre of mass; leave this out";

/// Mass, inertia and shape.
fn body(source: &Source, entry: &Spanned<format::Body>) -> Result<RigidBody> {
    let own = entry.get_ref();
    let shape = shape(source, own)?;
    let mass = match (&own.mass_kg, &own.density_kg_m3) {
        (Some(mass), None) => source.positive(mass, "kg")?,
        (None, Some(density)) if shape == BodyShape::Hidden => {
            return source.wrong(density.span(), "a hidden body has no volume; give `mass_kg`");
        }
        (None, Some(density)) if shape.volume() == 0.0 => {
            return source.wrong(density.span(), "a mesh that is open or inside out has no volume; give `mass_kg`");
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
        None if body.shape == BodyShape::Hidden => {
            return source.wrong(entry.span(), "a hidden body needs `inertia_kg_m2`");
        }
        None => {}
    }
    Ok(body)
}

fn shape(source: &Source, own: &format::Body) -> Result<BodyShape> {
    let length = |value: &format::Number| length(source, value);
    Ok(match own.shape.get_ref() {
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
        format::BodyShape::Mesh(file) => BodyShape::Mesh(Arc::new(solid(source, own, file)?)),
        format::BodyShape::Hidden(_) => BodyShape::Hidden,
    })
}

/// A mesh as a body: full of mass, or with the centre of mass and the moments of inertia that are given.
fn solid(source: &Source, own: &format::Body, file: &format::BodyMesh) -> Result<SolidMesh> {
    let format::BodyMesh { file, scale, centre_of_mass_m: centre } = file;
    let scale = number_or(scale, 1.0, |v| source.positive(v, ""))?;
    if let (Some(centre), None) = (centre, &own.inertia_kg_m2) {
        return source.wrong(centre.span(), "goes with `inertia_kg_m2`; without it both are those of the full mesh");
    }
    let centre = centre.as_ref().map(|centre| source.vector(centre, "m")).transpose()?;
    let mesh = mesh::read(source, file, scale)?;
    let name = file.get_ref();
    let full = |mesh| {
        SolidMesh::full(mesh).or_else(|error| {
            let keys = "`mass_kg`, `inertia_kg_m2` and `shape.mesh.centre_of_mass_m`";
            source.wrong(file.span(), &format!("{name}: {error}; a mesh that is not full of mass needs {keys}"))
        })
    };
    let solid = match (&own.inertia_kg_m2, centre) {
        (None, _) => full(mesh)?,
        (Some(_), centre) => {
            let centre = match centre {
                Some(centre) => centre,
                None => full(mesh.clone())?.centre(),
            };
            SolidMesh::about(mesh, centre).or_else(|error| source.wrong(file.span(), &format!("{name}: {error}")))?
        }
    };
    // Its corners are about its centre of mass, and neither so near to it nor so far that nothing can be computed.
    let reach = solid.mesh().positions.iter().map(|place| place.norm()).fold(0.0, f64::max);
    if !NODE_DISTANCE.contains(&reach) {
        let range = format!("{:e} to {:e} m", NODE_DISTANCE.start, NODE_DISTANCE.end);
        return source
            .must_be(file.span(), &format!("a mesh whose farthest corner is {range} from its centre of mass"));
    }
    Ok(solid)
}

/// Whether a body touches rods and obstacles.
fn touches(source: &Source, own: &format::Body) -> Result<bool> {
    let is_hidden = matches!(own.shape.get_ref(), format::BodyShape::Hidden(_));
    match &own.touches {
        Some(value) if *value.get_ref() && is_hidden => {
            source.must_be(value.span(), "false: a hidden body has nothing to touch with")
        }
        Some(value) => Ok(*value.get_ref()),
        None => Ok(!is_hidden),
    }
}
