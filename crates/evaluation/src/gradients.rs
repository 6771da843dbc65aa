//! Derivatives of a run: what they cost beside the run itself.

use std::time::Instant;

use cosserat::derivative::{DerivativeError, Forward, Parameter, Recording, Rods, StateVariation, Wanted};
use cosserat::scene::Scene;
use cosserat::simulation::{Formulation, Settings, Simulation, SimulationError, SolverKind, StepParams, Tangent};
use serde::{Deserialize, Serialize};

/// Wall times of a run and of its derivatives, least of all repetitions [ms].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Costs {
    /// The run alone, to the derivatives' tolerance.
    pub run_ms: f64,
    /// The run with all its steps kept.
    pub recording_ms: f64,
    /// Back through the steps: with respect to the first state and what is held.
    pub backward_ms: f64,
    /// Back through the steps: with respect to everything.
    pub backward_all_ms: f64,
    /// The same with a checkpoint each square root of the steps in the place of all steps.
    pub checkpoints_ms: f64,
    /// The run with derivatives along one direction, in all.
    pub forward_ms: f64,
}

impl Costs {
    fn least(self, other: Self) -> Self {
        Self {
            run_ms: self.run_ms.min(other.run_ms),
            recording_ms: self.recording_ms.min(other.recording_ms),
            backward_ms: self.backward_ms.min(other.backward_ms),
            backward_all_ms: self.backward_all_ms.min(other.backward_all_ms),
            checkpoints_ms: self.checkpoints_ms.min(other.checkpoints_ms),
            forward_ms: self.forward_ms.min(other.forward_ms),
        }
    }
}

/// A scene so many times over, each copy by itself.
pub fn beside(scene: &Scene, copies: usize) -> Scene {
    let mut all = scene.clone();
    for _ in 1..copies {
        let laws = all.model.laws.len();
        all.model.append(&scene.model);
        all.state.append(&scene.state, laws);
    }
    all
}

/// Runs so many steps of a scene, alone and with derivatives of its last segment's height at the end, so many times in turns.
/// After each turn `go_on()` says whether to go on; `None` if not.
///
/// # Errors
/// If the scene is not valid, has what is not differentiated, or a step does not converge.
pub fn measure(
    scene: &Scene,
    steps: usize,
    turns: usize,
    mut go_on: impl FnMut() -> bool,
) -> Result<Option<Costs>, DerivativeError> {
    let mut least: Option<Costs> = None;
    for _ in 0..turns {
        let costs = once(scene, steps)?;
        least = Some(least.map_or(costs.clone(), |least| least.least(costs)));
        if !go_on() {
            return Ok(None);
        }
    }
    Ok(least)
}

/// The residual to which steps are solved here; derivatives ask for it.
const TOLERANCE: f64 = 1e-10;

fn once(Scene { model, state, run, .. }: &Scene, steps: usize) -> Result<Costs, DerivativeError> {
    let step = StepParams { formulation: Formulation::Newton, tangent: Tangent::Exact, ..StepParams::DEFAULT };
    let settings = Settings { step, solver: SolverKind::Direct };
    let tight =
        StepParams { relative_tolerance: TOLERANCE, motion_tolerance: TOLERANCE, absolute_tolerance: 1e-12, ..step };
    let run_ms = timed(|| {
        let mut simulation = Simulation::new(model, state, &Settings { step: tight, ..settings }, None)?;
        (0..steps).try_for_each(|_| simulation.step(run.dt).map(|_| ()))?;
        Ok::<_, SimulationError>(())
    })?
    .1;
    let (mut recording, recording_ms) = timed(|| {
        let mut recording = Recording::new(model, state, &settings)?;
        (0..steps).try_for_each(|_| recording.step(run.dt).map(|_| ()))?;
        Ok::<_, DerivativeError>(recording)
    })?;
    let mut height = StateVariation::zero(model.segments.len());
    if let Some(last) = height.positions.last_mut() {
        last.z = 1.0;
    }
    let objective = [(steps, height)];
    let backward_ms = timed(|| recording.backward(&objective, Wanted::default()))?.1;
    let backward_all_ms = timed(|| recording.backward(&objective, Wanted::ALL))?.1;
    drop(recording);
    let stretch = steps.isqrt().max(1);
    let mut recording = Recording::with_checkpoints(model, state, &settings, stretch)?;
    (0..steps).try_for_each(|_| recording.step(run.dt).map(|_| ()))?;
    let checkpoints_ms = timed(|| recording.backward(&objective, Wanted::ALL))?.1;
    let forward_ms = timed(|| {
        let mut forward = Forward::new(model, state, &settings, &[Parameter::Bending(Rods::All).variation(model)])?;
        (0..steps).try_for_each(|_| forward.step(run.dt).map(|_| ()))
    })?
    .1;
    Ok(Costs { run_ms, recording_ms, backward_ms, backward_all_ms, checkpoints_ms, forward_ms })
}

/// What a closure returns, and the wall time that it took [ms].
fn timed<T, E>(work: impl FnOnce() -> Result<T, E>) -> Result<(T, f64), E> {
    let begin = Instant::now();
    let out = work()?;
    Ok((out, 1e3 * begin.elapsed().as_secs_f64()))
}
