//! Ways to move a scene, side by side: with a solver, or with predictions in its place.

use rod::State;
use solver::projection::ProjectionFactory;
use solver::simulation::{GuessFactory, Settings, Simulation, SimulationError};
use solver::step::{Status, StepParams};

use super::Motion;

/// How constraints are projected.
#[derive(Clone, Copy)]
pub enum Method<'a> {
    /// By a solver, from a guess; `None` for a zero start.
    Solve(Settings, Option<GuessFactory<'a>>),
    /// By predictions alone, the paper's "end-to-end". Such a way refuses contacts.
    EndToEnd(StepParams, ProjectionFactory<'a>),
}

/// A way to move a scene.
#[derive(Clone)]
pub struct NamedMethod<'a> {
    /// Its name in the figure.
    pub name: String,
    /// How.
    pub method: Method<'a>,
}

impl NamedMethod<'_> {
    fn simulation(&self, motion: &Motion<'_>) -> Result<Simulation, SimulationError> {
        match self.method {
            Method::Solve(settings, guess) => Simulation::new(motion.model, motion.state, &settings, guess),
            Method::EndToEnd(params, projection) => {
                Simulation::end_to_end(motion.model, motion.state, &params, projection)
            }
        }
    }
}

/// Moves the scene in all ways in lockstep. After each step of each way `frame(step, way, state)` measures and says
/// whether its numbers are finite; a way whose numbers are not, or whose step was not, stops there. After each step of
/// all `progress()` says whether to go on. Gives for each way the step in which it stopped, if it did; `None` where
/// progress said stop.
pub(super) fn run(
    motion: &Motion<'_>,
    ways: &[NamedMethod<'_>],
    mut frame: impl FnMut(usize, usize, &State) -> bool,
    mut progress: impl FnMut() -> bool,
) -> Result<Option<Vec<Option<usize>>>, SimulationError> {
    let mut simulations = ways.iter().map(|way| way.simulation(motion)).collect::<Result<Vec<_>, _>>()?;
    let mut stopped = vec![None; ways.len()];
    let mut state = motion.state.clone();
    for step in 1..=motion.steps {
        for (way, simulation) in simulations.iter_mut().enumerate() {
            if stopped[way].is_some() {
                continue;
            }
            let is_finite = simulation.step(motion.dt)?.status != Status::NonFinite && {
                simulation.store(&mut state);
                frame(step, way, &state)
            };
            if !is_finite {
                stopped[way] = Some(step);
            }
        }
        if !progress() {
            return Ok(None);
        }
    }
    Ok(Some(stopped))
}
