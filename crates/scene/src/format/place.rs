//! Places on rods, as serde reads them.

use serde::Deserialize;
use toml::Spanned;

use super::number::{Count, Number, Vector};

#[derive(Clone, Copy, Deserialize, PartialEq)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Clamp {
    StartSegment,
    EndSegment,
    StartFace,
    EndFace,
}

#[derive(Clone, Copy, Deserialize, PartialEq)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Face {
    StartFace,
    EndFace,
}

/// A place on a rod's axis, or on a rigid body.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Place {
    pub(crate) rod: Option<Spanned<String>>,
    pub(crate) segment: Option<Count>,
    pub(crate) fraction: Option<Number>,
    pub(crate) body: Option<Spanned<String>>,
    pub(crate) at_m: Option<Vector>,
}
