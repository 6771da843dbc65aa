//! Rigid bodies, as serde reads them.

use serde::Deserialize;
use toml::Spanned;

use super::list::List;
use super::load::Load;
use super::motion::{Motion, Quaternion};
use super::number::{Number, Vector};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Body {
    pub(crate) name: Option<Spanned<String>>,
    pub(crate) shape: Spanned<BodyShape>,
    pub(crate) mass_kg: Option<Number>,
    pub(crate) density_kg_m3: Option<Number>,
    pub(crate) inertia_kg_m2: Option<Vector>,
    pub(crate) position_m: Option<Vector>,
    pub(crate) orientation: Option<Quaternion>,
    pub(crate) turn_deg: Option<Vector>,
    pub(crate) velocity_m_s: Option<Vector>,
    pub(crate) angular_velocity_rad_s: Option<Vector>,
    #[serde(default)]
    pub(crate) fixed: bool,
    pub(crate) touches: Option<Spanned<bool>>,
    pub(crate) drag_area_m2: Option<Number>,
    #[serde(default)]
    pub(crate) motions: Vec<Spanned<Motion>>,
    #[serde(default)]
    pub(crate) loads: Vec<Spanned<Load>>,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum BodyShape {
    Sphere(Ball),
    Capsule(Round),
    Cylinder(Round),
    Box(Block),
    Mesh(Mesh),
    Hidden(Hidden),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Ball {
    pub(crate) radius_m: Number,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Round {
    pub(crate) radius_m: Number,
    pub(crate) length_m: Number,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Block {
    pub(crate) sides_m: List<Number, 3>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Mesh {
    pub(crate) file: Spanned<String>,
    pub(crate) scale: Option<Number>,
    pub(crate) centre_of_mass_m: Option<Vector>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Hidden {}
