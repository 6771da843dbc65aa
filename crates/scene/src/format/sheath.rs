//! Sheaths, as serde reads them.

use serde::Deserialize;
use toml::Spanned;

use super::contact::Friction;
use super::number::Number;

/// A rod that runs inside another one.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Sheath {
    pub(crate) name: Option<Spanned<String>>,
    pub(crate) rod: Spanned<String>,
    pub(crate) inside: Spanned<String>,
    pub(crate) clearance_m: Number,
    pub(crate) friction: Option<Spanned<Friction>>,
}
