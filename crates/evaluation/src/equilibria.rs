//! Equilibria: Newton's method beside the flow.

use std::time::Instant;

use cosserat::scene::Scene;
use cosserat::statics::{StaticError, StaticMethod, StaticParams, equilibrium};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::precision::metrics::position_error;

/// What one method came to on a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rest {
    /// Name of the [`StaticMethod`].
    pub method: String,
    /// Whether nothing moves any more.
    pub converged: bool,
    /// Whether the energy is at a minimum; `None` where that is not known.
    pub stable: Option<bool>,
    /// Linear solves, over all connected sets.
    pub solves: usize,
    /// Least wall time of all repetitions [ms].
    pub least_ms: f64,
    /// How far the segments are from where the first method has them: root mean square, relative to the rods' mean length.
    pub apart: f64,
}

/// Solves for a scene's equilibrium with each method in turns, so many times. After each turn `go_on()` says whether to go on;
/// `None` if not.
///
/// # Errors
/// If the scene is not valid, or has contacts.
pub fn measure(
    Scene { model, state, .. }: &Scene,
    turns: usize,
    mut go_on: impl FnMut() -> bool,
) -> Result<Option<Vec<Rest>>, StaticError> {
    let mut rests: Vec<Rest> = Vec::new();
    for turn in 0..turns {
        let mut first: Option<Vec<Vector3<f64>>> = None;
        for (place, method) in StaticMethod::ALL.into_iter().enumerate() {
            let (mut state, begin) = (state.clone(), Instant::now());
            let report = equilibrium(model, &mut state, &StaticParams { method, ..StaticParams::default() })?;
            let ms = 1e3 * begin.elapsed().as_secs_f64();
            let first = first.get_or_insert_with(|| state.positions.clone());
            let apart = position_error(model, &state.positions, first);
            match rests.get_mut(place).filter(|_| turn > 0) {
                Some(rest) => rest.least_ms = rest.least_ms.min(ms),
                None => rests.push(Rest {
                    method: method.name().to_owned(),
                    converged: report.converged,
                    stable: report.stable,
                    solves: report.steps,
                    least_ms: ms,
                    apart,
                }),
            }
            if !go_on() {
                return Ok(None);
            }
        }
    }
    Ok(Some(rests))
}
