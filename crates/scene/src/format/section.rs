//! The keys of a rod's sections, frame and inner damping.

use serde::Deserialize;
use toml::Spanned;

use super::list::List;
use super::number::{Number, Vector};

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Section {
    Circle(Circle),
    Tube(Tube),
    Rectangle(Sides),
    Ellipse(Sides),
    Stiffness(Box<Stiffness>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Circle {
    pub(crate) radius_m: Number,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Tube {
    pub(crate) outer_radius_m: Number,
    pub(crate) inner_radius_m: Number,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Sides {
    pub(crate) width_m: Number,
    pub(crate) height_m: Number,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Stiffness {
    pub(crate) bending_n_m2: List<Number, 2>,
    pub(crate) torsion_n_m2: Number,
    pub(crate) mass_kg_m: Number,
    pub(crate) polar_inertia_kg_m: Option<Number>,
    pub(crate) stretch_n: Option<Number>,
    pub(crate) shear_n: Option<Number>,
}

/// A piece of a rod, up to a fraction of its length.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Piece {
    pub(crate) until: Option<Number>,
    pub(crate) section: Spanned<Section>,
    pub(crate) strength: Option<Spanned<super::law::Strength>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Frame {
    pub(crate) d1: Vector,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct InnerDamping {
    pub(crate) bending_s: Option<Number>,
    pub(crate) twist_s: Option<Number>,
    pub(crate) stretch_s: Option<Number>,
}

/// What of its rotation a joint's moment goes with, and from where that is measured.
#[derive(Clone, Copy, Default, Deserialize, PartialEq)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Bending {
    #[default]
    Angle,
    Paper,
    RestRotation,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Stretch {
    #[default]
    Zero,
    Physical,
    #[serde(rename = "compliance_m_per_n")]
    Compliance(Number),
}
