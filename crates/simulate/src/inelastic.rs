//! What joints that are not elastic have lost and kept in a run.

use std::fmt::{self, Display, Formatter};

use cosserat::scene::Scene;
use cosserat::state::{Body, State, measure};
use serde::Serialize;

use crate::held::place;
use crate::numbers::number;

/// What joints with laws came to at the end of a run.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Inelastic {
    /// Work that they have lost since the start [J].
    dissipated_j: f64,
    /// The joint with the largest plastic curvature or twist, if any has yielded.
    #[serde(skip_serializing_if = "Option::is_none")]
    plastic: Option<Set>,
}

/// What a joint keeps when nothing bends it any more.
#[derive(Clone, Debug, Serialize)]
struct Set {
    /// The bodies that it joins, in words.
    between: [String; 2],
    curvature_per_m: f64,
    twist_per_m: f64,
}

impl Inelastic {
    /// That of a state; `None` where all joints are elastic.
    pub(crate) fn of(scene: &Scene, state: &State) -> Option<Self> {
        let model = &scene.model;
        if model.laws.is_empty() {
            return None;
        }
        let sets = model.laws.iter().zip(&state.internals).map(|(own, at)| (own.joint, own.law.set(at)));
        let most = sets.max_by(|(_, a), (_, b)| a.norm().total_cmp(&b.norm())).filter(|(_, set)| set.norm() > 0.0);
        let plastic = most.map(|(joint, set)| Set {
            between: [model.joints[joint].a, model.joints[joint].b].map(|body: Body| place(scene, body)),
            curvature_per_m: set.xy().norm(),
            twist_per_m: set.z.abs(),
        });
        Some(Self { dissipated_j: measure::dissipated(model, state), plastic })
    }
}

impl Display for Inelastic {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "joints that are not elastic lost {} J", number(self.dissipated_j))?;
        let Some(Set { between: [a, b], curvature_per_m, twist_per_m }) = &self.plastic else { return Ok(()) };
        write!(
            f,
            "; the largest set, between {a} and {b}: a curvature of {} 1/m, a twist of {} rad/m",
            number(*curvature_per_m),
            number(*twist_per_m)
        )
    }
}
