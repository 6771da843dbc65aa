//! A curve whose points stand in a file.

use std::cell::OnceCell;

use nalgebra::Vector3;
use serde::Deserialize;
use toml::Spanned;

use super::number::Count;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Curve {
    pub(crate) file: Spanned<String>,
    pub(crate) prim: Option<Spanned<String>>,
    pub(crate) curve: Option<Count>,
    pub(crate) segments: Option<Count>,
    pub(crate) interpolation: Option<Spanned<Between>>,
    #[serde(default)]
    pub(crate) closed: bool,
    /// The file's points [m], once they have been read.
    #[serde(skip)]
    pub(crate) points: OnceCell<Vec<Vector3<f64>>>,
}

/// How a curve goes from one point to the next.
#[derive(Clone, Copy, Default, Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Between {
    Linear,
    #[default]
    Smooth,
}
