//! The fit: least squares with Huber's loss over all recordings.

use nalgebra::{DVector, Vector3};
use optimise::{LeastSquares, Normal, Residuals};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use solver::simulation::SimulationError;

use crate::cable::Cable;
use crate::parameter::{Parameter, Parameters};
use crate::predict::{Prediction, TOGETHER, together};
use crate::recording::{GRIPPED, Recording};

/// How to search.
#[derive(Clone, Debug, PartialEq)]
pub struct Search {
    /// What is searched for; all else is held where the search begins.
    pub free: Vec<Parameter>,
    /// What is looked at, one after the other: little first, which leads to the basin.
    pub stages: Vec<Stage>,
    /// Distance of a coordinate [m] from which on it counts linearly and no longer squared.
    pub huber: f64,
    /// Steps from frame to frame.
    pub steps: usize,
}

/// A part of the recordings that is looked at until the loss falls no more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stage {
    /// Frames from the start that count, of which a recording may have fewer; `None`: all.
    pub frames: Option<usize>,
    /// One recording in so many counts.
    pub every: usize,
    /// Most iterations.
    pub iterations: usize,
}

impl Stage {
    /// So many frames of every recording.
    pub const fn of_all(frames: usize, iterations: usize) -> Self {
        Self { frames: Some(frames), every: 1, iterations }
    }
}

impl Default for Search {
    fn default() -> Self {
        let stages = vec![
            Stage { frames: Some(100), every: 4, iterations: 12 },
            Stage { frames: None, every: 4, iterations: 10 },
            Stage { frames: None, every: 1, iterations: 3 },
        ];
        Self { free: Parameter::DEFAULT.to_vec(), stages, huber: 5e-3, steps: 1 }
    }
}

/// Where a search is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iteration {
    /// Index of the stage.
    pub stage: usize,
    /// Iterations of this stage that are done.
    pub iteration: usize,
    /// Mean Huber loss of a coordinate of a free marker [m^2].
    pub loss: f64,
    /// The best parameters of this stage so far.
    pub parameters: Parameters,
}

/// A fit's end.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The best parameters.
    pub parameters: Parameters,
    /// Those of [`Search::free`].
    pub free: Vec<Parameter>,
    /// What each recording of the last stage that was reached says there, by the coordinates of the free parameters
    /// ([`Parameter::coordinate`]); losses are in m^2.
    pub normals: Vec<Normal>,
    /// Whether it was stopped before its end.
    pub stopped: bool,
}

/// Difference of a coordinate for derivatives of whole runs.
const DIFFERENCE: f64 = 5e-3;
/// Longest way of a coordinate in an iteration.
const LONGEST: f64 = 1.0;
/// A stage ends where the loss falls by less than this part of it.
const ENOUGH: f64 = 1e-3;
/// Bending stiffnesses [m^4/s^2] from which a search may begin.
const SCAN: [f64; 4] = [0.005, 0.02, 0.08, 0.3];

/// Searches for the parameters of a cable from `start`, on rayon's threads, with the same bits on any number of them. `watch` is
/// told after each iteration where the search is, and says whether to go on.
///
/// # Errors
/// If a model is not valid.
pub fn fit(
    recordings: &[Recording],
    cables: &[Cable],
    start: &Parameters,
    search: &Search,
    watch: &mut dyn FnMut(&Iteration) -> bool,
) -> Result<Fit, SimulationError> {
    let of = |stage| Part::new(recordings, cables, stage, search, start);
    let mut parts: Vec<Part<'_>> = search.stages.iter().map(of).collect();
    let begin = parts.first().map_or(Ok(*start), |part| begun(part, start))?;
    let mut least = LeastSquares::new(coordinates(&search.free, &begin));
    least.bounds = search.free.iter().map(|of| of.bounds().map(|bound| of.coordinate(bound))).collect();
    (least.longest, least.tolerance) = (LONGEST, ENOUGH);
    let (mut stopped, mut last) = (false, 0);
    for (stage, part) in parts.iter_mut().enumerate() {
        for iteration in 1..=search.stages[stage].iterations {
            let step = least.step(part)?;
            let parameters = part.parameters(&least.x);
            stopped = !watch(&Iteration { stage, iteration, loss: step.loss / step.count as f64, parameters });
            if stopped || step.converged || step.loss >= step.before {
                break;
            }
        }
        last = stage;
        if stopped {
            break;
        }
    }
    // Where the user does not want to wait, the stage that was reached must do.
    let end = parts.get(last).map(|part| (part, part.parameters(&least.x)));
    let normals = end.as_ref().map_or(Ok(Vec::new()), |(part, parameters)| part.linearised(parameters))?;
    Ok(Fit {
        parameters: end.map_or(*start, |(_, parameters)| parameters),
        free: search.free.clone(),
        normals,
        stopped,
    })
}

/// The coordinates of the free parameters.
fn coordinates(free: &[Parameter], parameters: &Parameters) -> DVector<f64> {
    DVector::from_iterator(free.len(), free.iter().map(|&of| of.coordinate(parameters[of])))
}

/// Where the search begins: at the bending stiffness of a few that fits the first stage best. Stiff and slack cables move
/// differently, and no derivative leads from one to the other.
fn begun(part: &Part<'_>, start: &Parameters) -> Result<Parameters, SimulationError> {
    let mut best = (f64::INFINITY, *start);
    if part.search.free.contains(&Parameter::Bending) {
        for bending in [start[Parameter::Bending]].into_iter().chain(SCAN) {
            let mut from = *start;
            from[Parameter::Bending] = bending;
            let loss = part.loss_of(&from)?;
            if loss < best.0 {
                best = (loss, from);
            }
        }
    }
    Ok(best.1)
}

/// The recordings that a stage looks at.
struct Part<'a> {
    recordings: Vec<&'a Recording>,
    cables: Vec<Cable>,
    frames: usize,
    search: &'a Search,
    /// The values of what is not searched for.
    held: Parameters,
}

impl<'a> Part<'a> {
    fn new(
        recordings: &'a [Recording],
        cables: &[Cable],
        stage: &Stage,
        search: &'a Search,
        held: &Parameters,
    ) -> Self {
        // Of few recordings all count: each fills a lane.
        let every = stage.every.min(recordings.len() / TOGETHER).max(1);
        let recordings = recordings.iter().step_by(every).collect();
        let cables = cables.iter().step_by(every).cloned().collect();
        Self { recordings, cables, frames: stage.frames.unwrap_or(usize::MAX), search, held: *held }
    }

    /// The parameters with these coordinates.
    fn parameters(&self, x: &DVector<f64>) -> Parameters {
        let mut parameters = self.held;
        self.search.free.iter().zip(x).for_each(|(&of, &x)| parameters[of] = of.value(x));
        parameters
    }

    /// Loss over all of its recordings.
    fn loss_of(&self, parameters: &Parameters) -> Result<f64, SimulationError> {
        let run = |cables| together(cables, parameters, self.frames, self.search.steps);
        let chunks: Result<Vec<Vec<Prediction>>, _> = self.cables.par_chunks(TOGETHER).map(run).collect();
        let predictions = chunks?.into_iter().flatten();
        let loss =
            |(real, predicted): (&&Recording, _)| normal(&recorded(real), &predicted, &[], &[], self.search.huber).loss;
        Ok(self.recordings.iter().zip(predictions).map(loss).sum())
    }

    /// What each recording says near `parameters`, its derivatives by differences of whole runs.
    fn linearised(&self, parameters: &Parameters) -> Result<Vec<Normal>, SimulationError> {
        let Search { free, huber, steps, .. } = self.search;
        let chunk = |(recordings, cables): (&[&Recording], &[Cable])| -> Result<Vec<Normal>, SimulationError> {
            // The run itself, and one beside it for each free parameter.
            let run = |run: usize| {
                let mut beside = *parameters;
                if let Some(&parameter) = run.checked_sub(1).map(|k| &free[k]) {
                    let at = parameter.coordinate(parameters[parameter]);
                    beside[parameter] = parameter.value(at + difference(parameter, parameters));
                }
                together(cables, &beside, self.frames, *steps)
            };
            let differences: Vec<f64> = free.iter().map(|&of| difference(of, parameters)).collect();
            let runs = (0..=free.len()).into_par_iter().map(run).collect::<Result<Vec<_>, _>>()?;
            let of = |(k, recording): (usize, &&Recording)| {
                let beside: Vec<&Prediction> = runs[1..].iter().map(|run| &run[k]).collect();
                normal(&recorded(recording), &runs[0][k], &beside, &differences, *huber)
            };
            Ok(recordings.iter().enumerate().map(of).collect())
        };
        let chunks = self.recordings.par_chunks(TOGETHER).zip(self.cables.par_chunks(TOGETHER)).map(chunk);
        Ok(chunks.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
    }
}

impl Residuals for Part<'_> {
    type Error = SimulationError;

    fn loss(&mut self, x: &DVector<f64>) -> Result<f64, SimulationError> {
        self.loss_of(&self.parameters(x))
    }

    fn normal(&mut self, x: &DVector<f64>) -> Result<Normal, SimulationError> {
        Ok(self.linearised(&self.parameters(x))?.iter().sum())
    }
}

/// By how much the coordinate of a parameter is changed for derivatives: back where forth would leave its bounds.
fn difference(parameter: Parameter, parameters: &Parameters) -> f64 {
    let most = parameter.coordinate(parameter.bounds()[1]);
    if parameter.coordinate(parameters[parameter]) + DIFFERENCE > most { -DIFFERENCE } else { DIFFERENCE }
}

/// Where a free marker of a recording was in a frame.
fn recorded(recording: &Recording) -> impl Fn(usize, usize) -> Vector3<f64> {
    |frame, marker| recording.markers[frame][GRIPPED + marker]
}

/// What a recording, which says where a free marker was in a frame, tells of a prediction and those `beside` it, one for each free
/// parameter, whose coordinates differ by `differences`.
pub(crate) fn normal(
    recorded: &dyn Fn(usize, usize) -> Vector3<f64>,
    predicted: &Prediction,
    beside: &[&Prediction],
    differences: &[f64],
    huber: f64,
) -> Normal {
    let mut normal = Normal::zero(beside.len());
    let mut slope = vec![0.0; beside.len()];
    for (frame, markers) in predicted.markers.iter().enumerate() {
        for (marker, here) in markers.iter().enumerate() {
            let real = recorded(frame, marker);
            for axis in 0..3 {
                if real[axis].is_nan() {
                    continue;
                }
                let residual = here[axis] - real[axis];
                for ((slope, beside), difference) in slope.iter_mut().zip(beside).zip(differences) {
                    // Where the run beside goes over to another shape there is no derivative.
                    let change = beside.markers[frame][marker][axis] - here[axis];
                    *slope = if change.abs() < huber { change / difference } else { 0.0 };
                }
                // What is no number is as far off as anything can be.
                normal.add(if residual.is_nan() { 1.0 } else { residual }, &slope, huber);
            }
        }
    }
    normal
}
