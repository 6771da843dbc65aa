//! What a scene needs: the cost of each stage, and what is left out because the scene has no use for it.

use cosserat::guess::{self, Choice, GuessKind, Members, Topology};
use cosserat::internals::component::split;
use cosserat::scene::Scene;
use cosserat::simulation::{Counters, Formulation, Settings, Simulation, SimulationError, SolverKind, Status};
use cosserat::state::Model;
use serde::{Deserialize, Serialize};

use crate::stages::Stages;
use crate::time_step::settings;

/// What a scene needs of the solver that is chosen for it ([`guess::choose`]).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Needs {
    /// Linear solver.
    pub solver: String,
    /// Start of steps.
    pub guess: String,
    /// Why that solver and that start.
    pub reason: String,
    /// Number of segments.
    pub segments: usize,
    /// Number of connected sets of segments.
    pub sets: usize,
    /// Number of those that move in the lanes of vector registers.
    pub sets_in_lanes: usize,
    /// Threads that share the steps.
    pub threads: usize,
    /// Steps done.
    pub steps: usize,
    /// Time step [s].
    pub dt_s: f64,
    /// Worst status of any step.
    pub status: String,
    /// Median wall time of each stage of a step.
    pub median_us: Stages,
    /// What was done in all steps.
    pub work: Counters,
    /// What the scene does not need.
    pub left_out: Vec<LeftOut>,
}

/// Something that a scene does not need.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeftOut {
    /// What.
    pub what: String,
    /// Why.
    pub why: String,
    /// How often it was done all the same; anything but 0 is a mistake of the solver.
    pub count: u64,
}

/// Runs so many steps of a scene and says what they needed. After each step `go_on()` says whether to go on; `None` if not.
///
/// # Errors
/// If the scene is not valid.
pub fn measure(
    Scene { model, state, run, .. }: &Scene,
    steps: usize,
    formulation: Formulation,
    mut go_on: impl FnMut() -> bool,
) -> Result<Option<Needs>, SimulationError> {
    let step = settings(formulation, run.integrator.unwrap_or_default()).step;
    let choice = guess::choose(model, &step, None);
    let settings = Settings { step, solver: choice.solver };
    let build = |model: &Model, members: &Members, topology: &Topology| choice.build_guess(model, members, topology);
    let mut simulation = Simulation::new(model, state, &settings, Some(&build))?;
    let (mut costs, mut status) = (Vec::with_capacity(steps), Status::Converged);
    while costs.len() < steps {
        let before = simulation.counters();
        status = status.max(simulation.step(run.dt)?.status);
        costs.push(Stages::between(&before, &simulation.counters()));
        if !go_on() {
            return Ok(None);
        }
    }
    Ok(Some(Needs {
        solver: choice.solver.to_string(),
        guess: choice.guess.to_string(),
        reason: choice.reason(),
        segments: model.segments.len(),
        sets: simulation.components(),
        sets_in_lanes: simulation.in_lanes(),
        threads: simulation.threads(),
        steps,
        dt_s: run.dt,
        status: status.name().to_owned(),
        median_us: Stages::medians(&costs),
        work: simulation.counters(),
        left_out: left_out(model, formulation, &choice, &simulation),
    }))
}

/// What the model has no use for, by the model itself; the counts are what the solver did all the same.
fn left_out(model: &Model, formulation: Formulation, choice: &Choice, simulation: &Simulation) -> Vec<LeftOut> {
    let work = simulation.counters();
    let contacts = work.contact_searches
        + work.contact_candidates
        + work.contact_evaluations
        + work.contact_solves
        + work.contact_sweeps;
    let starts = work.guesses_used + work.guesses_dropped;
    let is_damped = model.damping.linear != 0.0 || model.damping.angular != 0.0;
    let branches = || split(model).iter().any(|(_, topology)| topology.branches > 0);
    let parts = [
        ("drag", model.air.is_none(), "there is no air", work.drag_evaluations),
        ("loads", model.loads.is_empty(), "nothing is loaded", work.load_evaluations),
        ("damping", !is_damped, "nothing is damped", work.damping_evaluations),
        ("contacts", model.contacts.is_empty(), "nothing can touch", contacts),
        ("branches", !branches(), "no segment has three joints", work.branch_eliminations),
        ("momentum residual", !formulation.momentum(), "not in this formulation", work.momentum_evaluations),
        ("start", choice.guess == GuessKind::Zero, "steps begin at the prediction", starts),
        (
            "linear iterations",
            choice.solver == SolverKind::Direct,
            "the linear solver is direct",
            work.linear_iterations,
        ),
        ("lanes", simulation.in_lanes() == 0, "too few alike sets that cannot touch", 0),
        ("threads", simulation.threads() == 1, "too little to share", 0),
    ];
    let left_out = parts.into_iter().filter(|(_, is_left_out, ..)| *is_left_out);
    left_out.map(|(what, _, why, count)| LeftOut { what: what.to_owned(), why: why.to_owned(), count }).collect()
}
