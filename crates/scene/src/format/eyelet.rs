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
    pub(crate) feed: Option<Spanned<Feed>>,
}

/// What drives a rod through an eyelet.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Feed {
    pub(crate) speed_m_s: Option<Number>,
    pub(crate) times_s: Option<Spanned<Vec<Number>>>,
    pub(crate) speeds_m_s: Option<Spanned<Vec<Number>>>,
    pub(crate) max_force_n: Option<Number>,
    pub(crate) store: Option<bool>,
    pub(crate) min_length_m: Option<Number>,
    pub(crate) max_length_m: Option<Number>,
}
