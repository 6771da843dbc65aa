//! A case of the table.

use cosserat::assembly::Assembly;
use cosserat::simulation::Formulation;
use cosserat::state::{Model, State};

/// A case of the table.
pub struct Case {
    /// Name.
    pub name: String,
    /// What moves.
    pub model: Model,
    /// From where.
    pub state: State,
    /// Time step [s].
    pub dt: f64,
    /// Number of steps.
    pub steps: usize,
    /// Formulations that it is run in: all, but for cases that take long.
    pub formulations: &'static [Formulation],
}

/// A case in all formulations.
pub(super) fn case(name: impl Into<String>, assembly: Assembly, dt: f64, steps: usize) -> Case {
    let (model, state) = assembly.finish();
    Case { name: name.into(), model, state, dt, steps, formulations: &Formulation::ALL }
}
