//! Laws of joints that are not elastic, as serde reads them.

use serde::Deserialize;
use toml::Spanned;

use super::number::Number;

/// Plasticity: yield moments, or the stress at which the material yields, and hardening.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Yield {
    pub(crate) moment_n_m: Option<Number>,
    pub(crate) torque_n_m: Option<Number>,
    pub(crate) stress_pa: Option<Number>,
    pub(crate) hardening_isotropic: Option<Number>,
    pub(crate) hardening_kinematic: Option<Number>,
}

/// Friction between the strands of a cable that bends.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct StrandFriction {
    pub(crate) moment_n_m: Number,
    pub(crate) stiffness_n_m2: Number,
}

/// A branch of the generalised Maxwell model.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Branch {
    pub(crate) share: Number,
    pub(crate) time_s: Number,
}

/// Branches.
pub(crate) type Relaxation = Spanned<Vec<Branch>>;

/// What joints bear before they break.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Strength {
    pub(crate) tension_n: Option<Number>,
    pub(crate) moment_n_m: Option<Number>,
    pub(crate) curvature_per_m: Option<Number>,
}

/// Bending by a table of moment over curvature.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MomentTable {
    pub(crate) curvatures_per_m: Spanned<Vec<Number>>,
    pub(crate) moments_n_m: Spanned<Vec<Number>>,
    #[serde(default)]
    pub(crate) unloading: Unloading,
}

/// How it unloads.
#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Unloading {
    #[default]
    Elastic,
    Masing,
}
