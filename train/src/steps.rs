//! Whole steps of the formulation `newton`, recorded as they are simulated: what a guess for their starts learns from.
//!
//! Half of the trajectories are Table 1's, half their slack variants; time steps and tolerances take turns. They are
//! simulated anew for every training, within seconds, and depend on the scenario's seed alone. Histories are as loose as
//! the trajectory's tolerance; what is learned is the tight solution of each step.

use std::sync::{Arc, Mutex, PoisonError};

use copingnet::{Encoding, Inputs, StepEncoder};
use cosserat::guess::{GuessFactory, InitialGuess};
use cosserat::internals::component::{BodyPose, Component};
use cosserat::internals::dynamics::attempt::attempt;
use cosserat::internals::dynamics::guess::StepExtrapolation;
use cosserat::internals::dynamics::start::NoGuess;
use cosserat::internals::dynamics::step::Interval;
use cosserat::internals::jointed::linear::LinearSolver;
use cosserat::internals::kernels::Spatial;
use cosserat::scene::Scene;
use cosserat::simulation::{
    Counters, Formulation, Integrator, Settings, Simulation, SimulationError, SolverKind, Status, StepParams, Tangent,
};
use dataset::{Config, Scenario};
use graph::{Graph, planar_normal};
use rayon::prelude::*;

/// Time steps [s].
pub(crate) const DTS: [f64; 3] = [0.02, 0.05, 0.1];
/// Relative tolerances: a loose one shows histories as they are where tolerances are loose.
pub(crate) const TOLERANCES: [f64; 2] = [1e-3, 1e-6];
/// How tightly a step is solved to be learned from.
const TIGHT: StepParams = StepParams {
    formulation: Formulation::Newton,
    tangent: Tangent::Positive,
    integrator: Integrator::Euler,
    relative_tolerance: 1e-8,
    motion_tolerance: 1e-8,
    absolute_tolerance: 1e-10,
    max_iterations: 60,
    max_halvings: 0,
    ..StepParams::DEFAULT
};
/// Index of the first scene that no training sees.
const VALIDATION: u64 = 1 << 32;

/// A simulation of whole steps.
#[derive(Clone, Debug)]
pub(crate) struct Trajectory {
    pub(crate) scene: Scene,
    pub(crate) dt: f64,
    pub(crate) tolerance: f64,
}

/// The steps of one trajectory, raw and one after the other.
#[derive(Default)]
pub(crate) struct Recorded {
    pub(crate) graph: Option<Graph>,
    pub(crate) steps: usize,
    /// Neither whitened nor clipped; the constant ones once.
    pub(crate) inputs: Inputs<Vec<f32>>,
    pub(crate) targets: Vec<f32>,
}

impl Trajectory {
    /// Training trajectory `index` of a scenario.
    pub(crate) fn training(scenario: Scenario, index: u64) -> anyhow::Result<Self> {
        let dt = DTS[(index / 2) as usize % DTS.len()];
        let tolerance = TOLERANCES[(index / 6) as usize % TOLERANCES.len()];
        Self::sample(scenario, index, dt, tolerance)
    }

    /// Validation scene `index` of a scenario.
    pub(crate) fn validation(scenario: Scenario, index: u64, dt: f64, tolerance: f64) -> anyhow::Result<Self> {
        Self::sample(scenario, VALIDATION + index, dt, tolerance)
    }

    fn sample(scenario: Scenario, index: u64, dt: f64, tolerance: f64) -> anyhow::Result<Self> {
        let parameters = scenario.sample(Config::table_1(scenario).seed, index);
        let slack = if index.is_multiple_of(2) { None } else { parameters.slack() };
        let parameters = slack.unwrap_or(parameters);
        Ok(Self { scene: parameters.scene()?, dt, tolerance })
    }

    /// The simulation, from its first step.
    pub(crate) fn simulation(&self, guess: GuessFactory<'_>) -> Result<Simulation, SimulationError> {
        let mut settings = Settings::default();
        (settings.step.formulation, settings.step.integrator) = (Formulation::Newton, Integrator::Euler);
        settings.step.tangent = Tangent::Positive;
        (settings.step.relative_tolerance, settings.step.motion_tolerance) = (self.tolerance, self.tolerance);
        Simulation::new(&self.scene.model, &self.scene.state, &settings, Some(guess))
    }

    /// Simulates `steps` steps and keeps them.
    fn record(&self, encoding: &Arc<Encoding>, steps: usize) -> Result<Recorded, SimulationError> {
        let normal = planar_normal(&self.scene.model, &self.scene.state);
        let recorded = Arc::new(Mutex::new(Recorded::default()));
        let mut simulation = self.simulation(&|model, members, topology| {
            let graph = Graph::new(model, members, topology);
            Some(Box::new(Recorder {
                start: StepExtrapolation::new(2, graph.nodes().len(), graph.edges().len()),
                encoder: StepEncoder::new(encoding.clone(), graph.clone(), normal),
                solver: SolverKind::Direct.build(model, members, topology).ok()?,
                graph,
                inputs: Inputs::default(),
                targets: Vec::new(),
                asked: 0,
                recorded: recorded.clone(),
            }))
        })?;
        for _ in 0..steps {
            simulation.step(self.dt)?;
        }
        let mut recorded = recorded.lock().unwrap_or_else(PoisonError::into_inner);
        Ok(std::mem::take(&mut *recorded))
    }
}

/// Records the first `count` training trajectories of a scenario, on rayon's current thread pool.
pub(crate) fn record(
    scenario: Scenario,
    count: usize,
    steps: usize,
    encoding: &Arc<Encoding>,
) -> anyhow::Result<Vec<Recorded>> {
    let one = |index: u64| Ok(Trajectory::training(scenario, index)?.record(encoding, steps)?);
    (0..count as u64).into_par_iter().map(one).collect()
}

/// BLAKE3 of all numbers of the samples.
pub(crate) fn blake3(recorded: &[Recorded]) -> String {
    let (mut hasher, mut bytes) = (blake3::Hasher::new(), Vec::new());
    for Recorded { inputs, targets, .. } in recorded {
        for values in inputs.all().into_iter().chain([targets]) {
            bytes.clear();
            bytes.extend(values.iter().flat_map(|x| x.to_le_bytes()));
            hasher.update(&(values.len() as u64).to_le_bytes());
            hasher.update(&bytes);
        }
    }
    hasher.finalize().to_hex().to_string()
}

/// A guess that looks on.
struct Recorder {
    /// Where the steps start.
    start: StepExtrapolation,
    graph: Graph,
    encoder: StepEncoder,
    solver: Box<dyn LinearSolver>,
    inputs: Inputs<Vec<f32>>,
    targets: Vec<f32>,
    /// Starts asked for in the step under way.
    asked: u32,
    recorded: Arc<Mutex<Recorded>>,
}

impl Recorder {
    /// Keeps what the component's step, not yet begun, should come to; nothing where it does not converge.
    fn record(&mut self, component: &Component<f64>) {
        self.encoder.raw(component, &mut self.inputs);
        let mut end = component.clone();
        end.predicted.clone_from(&component.poses);
        end.poses.clone_from(&component.start);
        end.lambda = vec![Spatial::zero(); self.graph.edges().len()];
        let (interval, counters) = (Interval { time: component.time(), dt: component.dt() }, &mut Counters::default());
        let attempt = attempt(&mut end, interval, &TIGHT, self.solver.as_mut(), &mut NoGuess, counters);
        if attempt.status(0) != Status::Converged {
            return;
        }
        self.encoder.targets(&end, &mut self.targets);
        let (nodes, edges) = (&self.inputs.nodes, &self.inputs.edges);
        let is_finite = nodes.iter().chain(edges).chain(&self.targets).all(|x| x.is_finite());
        let (true, Ok(mut recorded)) = (is_finite, self.recorded.lock()) else { return };
        recorded.steps += 1;
        recorded.inputs.nodes.extend(nodes);
        recorded.inputs.edges.extend(edges);
        recorded.targets.extend(&self.targets);
        if recorded.graph.is_none() {
            recorded.graph = Some(self.graph.clone());
            recorded.inputs.constant_nodes.clone_from(&self.inputs.constant_nodes);
            recorded.inputs.constant_edges.clone_from(&self.inputs.constant_edges);
        }
    }
}

impl InitialGuess for Recorder {
    fn helps_steps(&self) -> bool {
        true
    }

    fn start_step(
        &mut self,
        component: &Component<f64>,
        poses: &mut [BodyPose<f64>],
        lambda: &mut [Spatial<f64>],
    ) -> bool {
        self.asked += 1;
        if self.asked == 1 {
            self.record(component);
        }
        self.start.start_step(component, poses, lambda)
    }

    fn observe_step(&mut self, component: &Component<f64>) {
        self.start.observe_step(component);
        let is_whole = std::mem::take(&mut self.asked) == 1;
        self.encoder.observe(component, is_whole);
    }
}
