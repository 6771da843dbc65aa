//! Loads, as serde reads them.

use serde::Deserialize;
use toml::Spanned;

use super::motion::Interpolation;
use super::number::{Count, Number, Vector};
use super::place::Face;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Load {
    pub(crate) at: Option<Spanned<Face>>,
    pub(crate) segment: Option<Count>,
    pub(crate) fraction: Option<Number>,
    pub(crate) force_n: Option<Vector>,
    pub(crate) torque_n_m: Option<Vector>,
    pub(crate) times_s: Option<Spanned<Vec<Number>>>,
    pub(crate) forces_n: Option<Spanned<Vec<Vector>>>,
    pub(crate) torques_n_m: Option<Spanned<Vec<Vector>>>,
    pub(crate) interpolation: Option<Spanned<Interpolation>>,
}
