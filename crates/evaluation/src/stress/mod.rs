//! The stability table: stiff, slack, tiny, huge and degenerate cases, each with its status.

mod case;
mod cases;
mod contact;

use std::time::Instant;

use cosserat::guess::GuessFactory;
use cosserat::simulation::{Formulation, Settings, Simulation, SimulationError, Status, StepParams};
use cosserat::state::{Model, measure};
use serde::{Deserialize, Serialize};

pub use case::Case;
pub use contact::PILE_RODS;

/// A row of the table: one case in one formulation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CaseRun {
    /// Name of the case.
    pub case: String,
    /// Formulation.
    pub formulation: String,
    /// Number of segments.
    pub segments: usize,
    /// Number of steps asked for.
    pub steps: usize,
    /// Worst status of any step.
    pub status: String,
    /// Whether every number of every frame is finite.
    pub finite: bool,
    /// Outer iterations per step and connected set, taken-back steps included.
    pub iterations_per_step: f64,
    /// Steps that were done again in halves.
    pub retries: u64,
    /// Largest rise of the total energy above its start, relative to the energy at stake: the larger of what was turned
    /// over and the sum of all rods' weight times length; a rise of rounding errors alone counts as none. Contacts must
    /// not raise it: friction and impacts only take energy. `None` in air, where wind does work.
    pub energy_rise: Option<f64>,
    /// Deepest penetration after any step, relative to the smaller radius. `None` without contacts.
    pub deepest_penetration: Option<f64>,
    /// Worst error of a contact after any step, relative to the smaller radius: penetration, or slip where it should
    /// stick. `None` without contacts.
    pub worst_contact: Option<f64>,
    /// Largest relative change of any rod's length.
    pub length_drift: f64,
    /// Worst stretch-shear residual, in segment lengths.
    pub worst_stretch: f64,
    /// Worst bend-twist residual [rad].
    pub worst_bend: f64,
    /// Wall time [s].
    pub seconds: f64,
}

/// Relative tolerance of the outer iterations: the energy of a gap grows with its square, and fast (1e10 N/m).
pub const RELATIVE_TOLERANCE: f64 = 1e-9;
/// Absolute tolerance of the outer iterations.
pub const ABSOLUTE_TOLERANCE: f64 = 1e-10;

/// The table's settings in a formulation: direct solves to [`RELATIVE_TOLERANCE`] and [`ABSOLUTE_TOLERANCE`].
pub fn settings(formulation: Formulation) -> Settings {
    let [relative_tolerance, absolute_tolerance] = [RELATIVE_TOLERANCE, ABSOLUTE_TOLERANCE];
    let step = StepParams {
        formulation,
        relative_tolerance,
        motion_tolerance: relative_tolerance,
        absolute_tolerance,
        ..StepParams::default()
    };
    Settings { step, ..Settings::default() }
}

/// Runs a case, from a guess or from zero.
///
/// # Errors
/// If the case is not valid, or the guess does not fit the settings.
pub fn run(case: &Case, settings: &Settings, guess: Option<GuessFactory<'_>>) -> Result<CaseRun, SimulationError> {
    let mut simulation = Simulation::new(&case.model, &case.state, settings, guess)?;
    let (mut state, model) = (case.state.clone(), settings.step.formulation.measured(&case.model));
    let first = measure::energy(&model, &state);
    let lengths = measure::rod_lengths(&model, &state);
    let (mut finite, mut length_drift, mut seconds) = (true, 0.0, 0.0);
    let mass_times_length: f64 = case.model.segments.iter().map(|s| s.mass() * lengths[s.rod]).sum();
    let (mut highest, mut at_stake) = (f64::NEG_INFINITY, case.model.gravity.norm() * mass_times_length);
    let mut worst = Status::Converged;
    for _ in 0..case.steps {
        let begin = Instant::now();
        worst = worst.max(simulation.step(case.dt)?.status);
        seconds += begin.elapsed().as_secs_f64();
        simulation.store(&mut state);
        let energy = measure::energy(&model, &state);
        finite &= energy.total().is_finite();
        highest = highest.max(energy.total() - first.total());
        let moved = energy.kinetic + energy.stretch + energy.bend + (energy.external - first.external).abs();
        at_stake = f64::max(at_stake, moved);
        length_drift = f64::max(length_drift, measure::length_drift(&case.model, &state, &lengths));
    }
    let counters = simulation.counters();
    let rise = if highest > rounding(&case.model) { highest / at_stake } else { 0.0 };
    let has_contacts = !case.model.contacts.is_empty();
    Ok(CaseRun {
        case: case.name.clone(),
        formulation: settings.step.formulation.name().to_owned(),
        segments: case.model.segments.len(),
        steps: case.steps,
        status: worst.name().to_owned(),
        finite,
        iterations_per_step: counters.iterations as f64 / (case.steps * simulation.components()).max(1) as f64,
        retries: counters.retries,
        energy_rise: case.model.air.is_none().then_some(rise),
        deepest_penetration: has_contacts.then_some(counters.deepest_penetration),
        worst_contact: has_contacts.then_some(counters.worst_contact),
        length_drift,
        worst_stretch: counters.worst_stretch,
        worst_bend: counters.worst_bend,
        seconds,
    })
}

/// Energy [J] that errors in the last digits of gaps and curvatures make.
fn rounding(model: &Model) -> f64 {
    let of = |error: f64, compliance: f64| error.powi(2) / compliance.max(f64::MIN_POSITIVE);
    let joints = model.joints.iter();
    joints.map(|j| of(1e-14 * j.length, j.stretch_compliance) + of(1e-14 / j.length, j.bend_compliance)).sum()
}

/// All cases.
pub fn cases() -> Vec<Case> {
    cases::all().into_iter().chain([contact::stack(), contact::impact(), contact::pile()]).collect()
}
