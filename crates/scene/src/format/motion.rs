//! Motions and grips, as serde reads them.

use serde::Deserialize;
use toml::Spanned;

use super::list::List;
use super::number::{Count, Number, Vector};
use super::place::Clamp;

pub(crate) type Quaternion = Spanned<List<f64, 4>>;

/// Where something that is held is over time: a list a quantity, one entry a time; or a file with a column each.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Motion {
    pub(crate) at: Option<Spanned<Clamp>>,
    pub(crate) segment: Option<Count>,
    pub(crate) file: Option<Spanned<String>>,
    pub(crate) times_s: Option<Spanned<Vec<Number>>>,
    pub(crate) shifts_m: Option<Spanned<Vec<Vector>>>,
    pub(crate) positions_m: Option<Spanned<Vec<Vector>>>,
    pub(crate) turns_deg: Option<Spanned<Vec<Vector>>>,
    pub(crate) orientations: Option<Spanned<Vec<Quaternion>>>,
    pub(crate) velocities_m_s: Option<Spanned<Vec<Vector>>>,
    pub(crate) angular_velocities_rad_s: Option<Spanned<Vec<Vector>>>,
    pub(crate) interpolation: Option<Spanned<Interpolation>>,
    pub(crate) from_s: Option<Number>,
    pub(crate) until_s: Option<Number>,
    pub(crate) snap: Option<Spanned<bool>>,
}

impl Motion {
    /// Where the text says how a grip takes hold and lets go, if it does: bodies and obstacles have no grips.
    pub(crate) fn of_grips(&self) -> Option<std::ops::Range<usize>> {
        let times = [&self.from_s, &self.until_s].map(|time| time.as_ref().map(Spanned::span));
        times.into_iter().chain([self.snap.as_ref().map(Spanned::span)]).flatten().next()
    }
}

/// How and when a place is held.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Grip {
    pub(crate) at: Option<Spanned<Clamp>>,
    pub(crate) segment: Option<Count>,
    pub(crate) from_s: Option<Number>,
    pub(crate) until_s: Option<Number>,
    pub(crate) joint: Option<Spanned<Hold>>,
    pub(crate) axis: Option<Vector>,
    pub(crate) stiffness_n_m: Option<Spanned<Vec<Number>>>,
    pub(crate) stiffness_n_m_rad: Option<Spanned<Vec<Number>>>,
    pub(crate) turn_deg: Option<Vector>,
}

/// What a joint holds.
#[derive(Clone, Copy, Default, Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Hold {
    #[default]
    Rigid,
    Ball,
    Hinge,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Interpolation {
    Held,
    Linear,
    Smooth,
}
