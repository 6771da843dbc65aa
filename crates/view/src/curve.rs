//! Curves over time beside energy, length and iterations: what probes read, what grips bear.

use serde::{Deserialize, Serialize};

use crate::DecodeError;

/// Quantities over time that belong into one chart: "hand: reaction force" in N with its x, y and z.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Curve {
    /// What it is one of: "Probes", "Reactions".
    pub group: String,
    /// What it is, without its unit.
    pub label: String,
    /// Its unit; empty where it has none.
    pub unit: String,
    /// At least one.
    pub lines: Vec<Line>,
}

/// One quantity over time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Line {
    /// What it is of the curve: "x".
    pub name: String,
    values: Vec<Option<f32>>,
}

impl Line {
    /// One value a frame, in the curve's unit; not finite where there is none. Five digits are kept.
    pub fn new(name: &str, values: &[f64]) -> Self {
        let rounded = |value: &f64| format!("{value:.4e}").parse().ok().filter(|value: &f32| value.is_finite());
        Self { name: name.to_owned(), values: values.iter().map(rounded).collect() }
    }

    /// The values, one a frame; `None` where there is none.
    pub fn values(&self) -> &[Option<f32>] {
        &self.values
    }
}

impl Curve {
    pub(crate) fn validate(&self, frames: usize) -> Result<(), DecodeError> {
        if !self.lines.is_empty() && self.lines.iter().all(|line| line.values.len() == frames) {
            return Ok(());
        }
        let must = format!("\"{}\" must have lines of {frames} values each", self.label);
        Err(DecodeError::new("curves", must))
    }
}
