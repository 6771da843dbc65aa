//! The keys of `[contact]` and `[[obstacles]]`.

use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use toml::Spanned;

use super::list::List;
use super::motion::{Motion, Quaternion};
use super::number::{Number, Vector};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Contact {
    pub(crate) friction: Option<Spanned<Friction>>,
    pub(crate) restitution: Option<Number>,
    #[serde(default)]
    pub(crate) allow_overlap: bool,
    pub(crate) between_segments: Option<bool>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Obstacle {
    pub(crate) name: Option<Spanned<String>>,
    pub(crate) shape: ObstacleShape,
    pub(crate) friction: Option<Spanned<Friction>>,
    pub(crate) restitution: Option<Number>,
    pub(crate) motion: Option<Spanned<Motion>>,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum ObstacleShape {
    Plane(Plane),
    Sphere(Sphere),
    Capsule(Capsule),
    Box(Block),
    Cylinder(Capsule),
    Mesh(Mesh),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Plane {
    pub(crate) point_m: Option<Vector>,
    pub(crate) normal: Option<Vector>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Sphere {
    pub(crate) centre_m: Option<Vector>,
    pub(crate) radius_m: Number,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Capsule {
    pub(crate) start_m: Vector,
    pub(crate) end_m: Vector,
    pub(crate) radius_m: Number,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Block {
    pub(crate) sides_m: List<Number, 3>,
    pub(crate) centre_m: Option<Vector>,
    pub(crate) turn_deg: Option<Vector>,
    pub(crate) orientation: Option<Quaternion>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Mesh {
    pub(crate) file: Spanned<String>,
    pub(crate) scale: Option<Number>,
    pub(crate) position_m: Option<Vector>,
    pub(crate) turn_deg: Option<Vector>,
    pub(crate) orientation: Option<Quaternion>,
}

/// One coefficient of friction, or one at rest and one sliding.
pub(crate) enum Friction {
    One(f64),
    Two(AtRestAndSliding),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct AtRestAndSliding {
    pub(crate) at_rest: Number,
    pub(crate) sliding: Number,
}

impl<'de> Deserialize<'de> for Friction {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrTable;

        impl<'de> Visitor<'de> for NumberOrTable {
            type Value = Friction;

            fn expecting(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
                formatter.write_str("a number or { at_rest = ..., sliding = ... }")
            }

            fn visit_f64<E: Error>(self, value: f64) -> Result<Friction, E> {
                Ok(Friction::One(value))
            }

            fn visit_i64<E: Error>(self, value: i64) -> Result<Friction, E> {
                self.visit_f64(value as f64)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Friction, A::Error> {
                AtRestAndSliding::deserialize(MapAccessDeserializer::new(map)).map(Friction::Two)
            }
        }

        deserializer.deserialize_any(NumberOrTable)
    }
}
