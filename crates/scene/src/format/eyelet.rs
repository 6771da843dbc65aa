//! Eyelets, as serde reads them.

use serde::Deserialize;
use toml::Spanned;

use super::motion::Motion;
use super::number::Number;
use super::place::Place;

/// A place through which a rod runs.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Eyelet {
    pub(crate) name: Option<Spanned<String>>,
    pub(crate) at: Spanned<Place>,
    pub(crate) on: Option<Spanned<Place>>,
    pub(crate) motion: Option<Spanned<Motion>>,
    pub(crate) friction: Option<Number>,
}
