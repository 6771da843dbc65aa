//! The keys of `[[probes]]`.

use serde::Deserialize;
use toml::Spanned;

use super::number::{Count, Number};
use super::place::Clamp;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Probe {
    pub(crate) name: Option<Spanned<String>>,
    pub(crate) rod: Spanned<String>,
    pub(crate) at: Option<Spanned<Clamp>>,
    pub(crate) segment: Option<Count>,
    pub(crate) fraction: Option<Number>,
    pub(crate) quantities: Spanned<Vec<Spanned<String>>>,
}
