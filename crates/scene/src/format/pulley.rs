//! Pulleys, as serde reads them.

use serde::Deserialize;
use toml::Spanned;

use super::motion::Motion;
use super::number::{Number, Vector};
use super::place::Place;

/// A wheel over which a rod runs.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Pulley {
    pub(crate) name: Option<Spanned<String>>,
    pub(crate) rod: Spanned<String>,
    pub(crate) centre_m: Vector,
    pub(crate) axis: Vector,
    pub(crate) radius_m: Number,
    pub(crate) friction: Option<Number>,
    pub(crate) inertia_kg_m2: Option<Number>,
    pub(crate) on: Option<Spanned<Place>>,
    pub(crate) motion: Option<Spanned<Motion>>,
    pub(crate) drive: Option<Spanned<Drive>>,
}

/// What turns a wheel.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Drive {
    pub(crate) rate_rad_s: Option<Number>,
    pub(crate) times_s: Option<Spanned<Vec<Number>>>,
    pub(crate) rates_rad_s: Option<Spanned<Vec<Number>>>,
    pub(crate) max_torque_n_m: Option<Number>,
}
