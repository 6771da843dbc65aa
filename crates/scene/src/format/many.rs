//! The keys of what makes many rods of one entry: strands, heaps, nets and copies.

use serde::Deserialize;
use toml::Spanned;

use super::contact::Sphere;
use super::list::List;
use super::number::{Count, Number, Vector};
use super::section::Stretch;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Strands {
    pub(crate) count: Count,
    pub(crate) on: Sphere,
    pub(crate) gap_m: Option<Number>,
    pub(crate) polar_angle_deg: Option<Number>,
    pub(crate) jitter: Option<Number>,
    #[serde(default)]
    pub(crate) seed: u64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Heap {
    pub(crate) count: Count,
    pub(crate) centre_m: Option<Vector>,
    pub(crate) spacing_m: Number,
    #[serde(default)]
    pub(crate) seed: u64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Net {
    pub(crate) name: Option<Spanned<String>>,
    pub(crate) centre_m: Option<Vector>,
    pub(crate) size_m: List<Number, 2>,
    pub(crate) meshes: List<Count, 2>,
    pub(crate) segments: Count,
    #[serde(default)]
    pub(crate) woven: bool,
    pub(crate) radius_m: Option<Number>,
    pub(crate) youngs_modulus_pa: Option<Number>,
    pub(crate) torsion_modulus_pa: Option<Number>,
    pub(crate) density_kg_m3: Option<Number>,
    #[serde(default)]
    pub(crate) stretch: Stretch,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Copies {
    pub(crate) rods: Spanned<Vec<Spanned<String>>>,
    pub(crate) shifts_m: Option<Spanned<Vec<Vector>>>,
    pub(crate) turns_deg: Option<Spanned<Vec<Vector>>>,
    pub(crate) about_m: Option<Vector>,
    pub(crate) count: Option<Spanned<List<Count, 3>>>,
    pub(crate) spacing_m: Option<Vector>,
}
