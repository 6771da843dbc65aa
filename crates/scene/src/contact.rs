//! From the keys of contacts and obstacles to what segments can touch.

use std::collections::HashSet;
use std::sync::Arc;

use nalgebra::{Unit, Vector3};
use rod::{Carried, Contacts, Friction, Obstacle, ObstacleShape, Pose, Surface};
use toml::Spanned;

use crate::error::{AT_MOST, LARGEST, Result, Source, short};
use crate::measures::{length, orientation};
use crate::motion::Prepared;
use crate::shape::{NODE_DISTANCE, number_or};
use crate::{format, mesh};

/// What segments can touch, and the obstacles' names.
pub(crate) fn contacts(source: &Source, file: &format::File) -> Result<(Contacts, Vec<String>)> {
    let of_segments = file.contact.as_ref().filter(|contact| contact.between_segments != Some(false));
    let between_segments = of_segments.map(|c| surface(source, &c.friction, &c.restitution)).transpose()?;
    let allow_overlap = file.contact.as_ref().is_some_and(|contact| contact.allow_overlap);
    let mut contacts = Contacts { between_segments, allow_overlap, ..Contacts::default() };
    let mut names = Vec::with_capacity(file.obstacles.len());
    let mut known = HashSet::new();
    for (i, entry) in file.obstacles.iter().enumerate() {
        let format::Obstacle { name, shape, friction, restitution, motion } = entry.get_ref();
        let own = name.as_ref().map_or_else(|| format!("obstacle-{i}"), |name| name.get_ref().clone());
        if !known.insert(own.clone()) {
            let span = name.as_ref().map_or(entry.span(), Spanned::span);
            return source.must_be(span, "a name that no other obstacle has");
        }
        names.push(own);
        let surface = surface(source, friction, restitution)?;
        let mut obstacle = Obstacle::new(obstacle_shape(source, shape)?, surface);
        if let Some(entry) = motion {
            obstacle.motion = Some(carried(source, entry, &obstacle.at(0.0).pose)?);
        }
        contacts.obstacles.push(obstacle);
    }
    Ok((contacts, names))
}

/// The motion of an obstacle that is at `pose` at time 0.
fn carried(source: &Source, entry: &Spanned<format::Motion>, pose: &Pose) -> Result<Carried> {
    let own = entry.get_ref();
    let places = [own.at.as_ref().map(Spanned::span), own.segment.as_ref().map(Spanned::span)];
    if let Some(span) = places.into_iter().flatten().next() {
        return source.wrong(span, "is a place on a rod; an obstacle moves as a whole, leave it out");
    }
    if let Some(span) = own.of_grips() {
        return source.wrong(span, "is of grips on rods; an obstacle moves all the time, leave it out");
    }
    let motion = Prepared::new(source, entry)?.motion(source, entry, pose)?;
    Ok(Carried::gripped(motion, pose, 0.0))
}

/// Centre and radius [m] of a sphere.
pub(crate) fn sphere(source: &Source, sphere: &format::Sphere) -> Result<(Vector3<f64>, f64)> {
    let centre = sphere.centre_m.as_ref().map_or(Ok(Vector3::zeros()), |key| source.vector(key, "m"))?;
    Ok((centre, length(source, &sphere.radius_m)?))
}

fn surface(
    source: &Source,
    friction: &Option<Spanned<format::Friction>>,
    restitution: &Option<format::Number>,
) -> Result<Surface> {
    let friction = self::friction(source, friction)?;
    let restitution = number_or(restitution, 0.0, |v| source.number(v, |v| (0.0..=1.0).contains(&v), "0 to 1"))?;
    Ok(Surface { friction, restitution })
}

/// Friction as a key says; none where it is left out.
pub(crate) fn friction(source: &Source, friction: &Option<Spanned<format::Friction>>) -> Result<Friction> {
    Ok(match friction.as_ref().map(|key| (key, key.get_ref())) {
        None => Friction::default(),
        Some((key, format::Friction::One(coefficient))) => {
            if coefficient.is_finite() && *coefficient > LARGEST {
                return source.must_be(key.span(), AT_MOST);
            }
            if !(coefficient.is_finite() && *coefficient >= 0.0) {
                return source.must_be(key.span(), "finite and >= 0");
            }
            Friction::new(*coefficient)
        }
        Some((_, format::Friction::Two(two))) => {
            let (at_rest, sliding) = (source.not_negative(&two.at_rest, "")?, source.not_negative(&two.sliding, "")?);
            if sliding > at_rest {
                return source.must_be(two.sliding.span(), &format!("0 to at_rest = {}", short(at_rest)));
            }
            Friction { at_rest, sliding }
        }
    })
}

fn obstacle_shape(source: &Source, shape: &format::ObstacleShape) -> Result<ObstacleShape> {
    match shape {
        format::ObstacleShape::Plane(plane) => {
            let point = plane.point_m.as_ref().map_or(Ok(Vector3::zeros()), |key| source.vector(key, "m"))?;
            let normal = plane.normal.as_ref().map_or(Ok(Vector3::z()), |key| source.direction(key))?;
            Ok(ObstacleShape::HalfSpace { point, normal: Unit::new_unchecked(normal) })
        }
        format::ObstacleShape::Sphere(key) => {
            let (centre, radius) = sphere(source, key)?;
            Ok(ObstacleShape::Sphere { centre, radius })
        }
        format::ObstacleShape::Capsule(capsule) => {
            let ([start, end], radius) = about_an_axis(source, capsule)?;
            Ok(ObstacleShape::Capsule { start, end, radius })
        }
        format::ObstacleShape::Cylinder(cylinder) => {
            let ([start, end], radius) = about_an_axis(source, cylinder)?;
            Ok(ObstacleShape::Cylinder { start, end, radius })
        }
        format::ObstacleShape::Box(block) => {
            let [x, y, z] = &block.sides_m.0;
            let sides = Vector3::new(length(source, x)?, length(source, y)?, length(source, z)?);
            let pose = pose(source, &block.centre_m, &block.orientation, &block.turn_deg)?;
            Ok(ObstacleShape::Box { pose, sides })
        }
        format::ObstacleShape::Mesh(key) => {
            let pose = pose(source, &key.position_m, &key.orientation, &key.turn_deg)?;
            let scale = number_or(&key.scale, 1.0, |v| source.positive(v, ""))?;
            Ok(ObstacleShape::Mesh { pose, mesh: Arc::new(mesh::read(source, &key.file, scale)?) })
        }
    }
}

fn pose(
    source: &Source,
    place: &Option<format::Vector>,
    quaternion: &Option<format::Quaternion>,
    turn: &Option<format::Vector>,
) -> Result<Pose> {
    let position = place.as_ref().map_or(Ok(Vector3::zeros()), |key| source.vector(key, "m"))?;
    Ok(Pose { position, orientation: orientation(source, quaternion, turn)? })
}

/// Ends of the axis of a capsule or a cylinder, and its radius [m].
fn about_an_axis(source: &Source, shape: &format::Capsule) -> Result<([Vector3<f64>; 2], f64)> {
    let (start, end) = (source.vector(&shape.start_m, "m")?, source.vector(&shape.end_m, "m")?);
    if !NODE_DISTANCE.contains(&(end - start).norm()) {
        let allowed = format!("{:e} to {:e} m from start_m", NODE_DISTANCE.start, NODE_DISTANCE.end);
        return source.must_be(shape.end_m.span(), &allowed);
    }
    Ok(([start, end], length(source, &shape.radius_m)?))
}
