//! Loads, as serde reads them.

use serde::Deserialize;
use toml::Spanned;

use super::motion::Interpolation;
use super::number::{Count, Number, Vector};
use super::place::Face;

/// Springs to the ground along a part of a rod.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Foundation {
    pub(crate) from: Option<Number>,
    pub(crate) until: Option<Number>,
    pub(crate) across_n_m2: Option<Number>,
    pub(crate) along_n_m2: Option<Number>,
    pub(crate) damping_s: Option<Number>,
}

/// What turns two rods against each other at their hinge: a torque, or torques over time.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Motor {
    pub(crate) torque_n_m: Option<Number>,
    pub(crate) times_s: Option<Spanned<Vec<Number>>>,
    pub(crate) torques_n_m: Option<Spanned<Vec<Number>>>,
    pub(crate) interpolation: Option<Spanned<Interpolation>>,
    #[serde(default)]
    pub(crate) repeats: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Load {
    pub(crate) at: Option<Spanned<Face>>,
    pub(crate) segment: Option<Count>,
    pub(crate) fraction: Option<Number>,
    #[serde(default)]
    pub(crate) follows: bool,
    pub(crate) force_n: Option<Vector>,
    pub(crate) torque_n_m: Option<Vector>,
    pub(crate) times_s: Option<Spanned<Vec<Number>>>,
    pub(crate) forces_n: Option<Spanned<Vec<Vector>>>,
    pub(crate) torques_n_m: Option<Spanned<Vec<Vector>>>,
    pub(crate) interpolation: Option<Spanned<Interpolation>>,
    #[serde(default)]
    pub(crate) repeats: bool,
}
