//! What a card says of how the data were simulated.

use std::fmt;
use std::path::Path;

use export::ExportError as CheckpointError;
use rod::Integrator;
use serde::{Deserialize, Serialize};

/// How the trajectories of a data set were simulated, as far as what is learned from them depends on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Simulated {
    /// From what bending is measured, by its name in scene files.
    pub bending: String,
    /// Name of the integrator.
    pub integrator: String,
    /// Shortest and longest time step [s].
    pub dt_s: [f64; 2],
}

impl Simulated {
    /// The paper's measure of bending, the only one that guesses know.
    const BENDING: &str = "paper";

    /// As the paper does it, at time steps from the shortest to the longest of these [s].
    pub fn as_in_the_paper(dt_s: [f64; 2]) -> Self {
        Self { bending: Self::BENDING.to_owned(), integrator: Integrator::Euler.to_string(), dt_s }
    }

    /// Whether a time step of `dt` [s] is within those of the data.
    pub fn has_time_step(&self, dt: f64) -> bool {
        let [shortest, longest] = self.dt_s;
        shortest * (1.0 - 1e-9) <= dt && dt <= longest * (1.0 + 1e-9)
    }

    /// Its time steps in words: "0.02 s", "0.02 to 0.1 s".
    pub fn time_steps(&self) -> String {
        let [shortest, longest] = self.dt_s;
        if shortest == longest { format!("{shortest:?} s") } else { format!("{shortest:?} to {longest:?} s") }
    }

    pub(super) fn check(&self, file: &Path) -> Result<(), CheckpointError> {
        let wrong = |key: &str, value: String, allowed: String| {
            Err(CheckpointError::value(file, format!("simulated.{key}"), value, allowed))
        };
        let Self { bending, integrator, dt_s: [shortest, longest] } = self;
        let names = [("bending", bending, Self::BENDING), ("integrator", integrator, Integrator::Euler.name())];
        if let Some((key, found, known)) = names.into_iter().find(|(_, found, known)| found != known) {
            return wrong(key, format!("{found:?}"), format!("\"{known}\": no guess knows another"));
        }
        if *shortest > 0.0 && shortest <= longest && longest.is_finite() {
            return Ok(());
        }
        let allowed = "the shortest and the longest time step, finite and > 0";
        wrong("dt_s", format!("{:?}", self.dt_s), allowed.to_owned())
    }
}

impl fmt::Display for Simulated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { bending, integrator, .. } = self;
        write!(f, "bending \"{bending}\", integrator {integrator}, time steps of {}", self.time_steps())
    }
}
