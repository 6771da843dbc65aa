//! The fit: Gauss-Newton with Levenberg and Marquardt's damping on a Huber loss over all recordings.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use solver::simulation::SimulationError;

use crate::cable::Cable;
use crate::parameter::{Parameter, Parameters};
use crate::predict::{Prediction, TOGETHER, together};
use crate::recording::Recording;

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

/// What a recording says near some parameters: loss, its gradient and Gauss and Newton's matrix by the free coordinates, all
/// sums over coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Normal {
    /// Sum of the Huber loss [m^2].
    pub loss: f64,
    /// Coordinates that count.
    pub count: usize,
    /// Gradient of the loss.
    pub gradient: DVector<f64>,
    /// J^T W J.
    pub matrix: DMatrix<f64>,
}

/// A fit's end.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The best parameters.
    pub parameters: Parameters,
    /// Those of [`Search::free`].
    pub free: Vec<Parameter>,
    /// What each recording of the last stage that was reached says there.
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
/// Most trials of an iteration, each with more damping.
const TRIALS: usize = 5;

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
    let parts: Vec<Part<'_>> = search.stages.iter().map(|stage| Part::new(recordings, cables, stage, search)).collect();
    let mut best = parts.first().map_or(Ok(*start), |part| begun(part, start))?;
    let mut damping = 1e-2;
    let (mut stopped, mut last) = (false, 0);
    for (stage, part) in parts.iter().enumerate() {
        for iteration in 1..=search.stages[stage].iterations {
            let sum = total(&part.linearised(&best)?);
            let mut loss = sum.loss;
            for _ in 0..TRIALS {
                let next = stepped(&best, &sum, damping, &search.free);
                let reached = part.loss(&next)?;
                if reached < loss {
                    (best, loss) = (next, reached);
                    damping = (damping * 0.2).max(1e-6);
                    break;
                }
                damping = (damping * 8.0).min(1e6);
            }
            stopped = !watch(&Iteration { stage, iteration, loss: loss / sum.count as f64, parameters: best });
            if stopped || sum.loss - loss < ENOUGH * sum.loss {
                break;
            }
        }
        last = stage;
        if stopped {
            break;
        }
    }
    // Where the user does not want to wait, the stage that was reached must do.
    let normals = parts.get(last).map_or(Ok(Vec::new()), |part| part.linearised(&best))?;
    Ok(Fit { parameters: best, free: search.free.clone(), normals, stopped })
}

/// Where the search begins: at the bending stiffness of a few that fits the first stage best. Stiff and slack cables move
/// differently, and no derivative leads from one to the other.
fn begun(part: &Part<'_>, start: &Parameters) -> Result<Parameters, SimulationError> {
    let mut best = (f64::INFINITY, *start);
    if part.search.free.contains(&Parameter::Bending) {
        for bending in [start[Parameter::Bending]].into_iter().chain(SCAN) {
            let mut from = *start;
            from[Parameter::Bending] = bending;
            let loss = part.loss(&from)?;
            if loss < best.0 {
                best = (loss, from);
            }
        }
    }
    Ok(best.1)
}

/// Where damped Gauss-Newton leads from `parameters`. What would leave its bounds stays there, and the others move without it.
fn stepped(parameters: &Parameters, sum: &Normal, damping: f64, free: &[Parameter]) -> Parameters {
    let at = |k: usize| free[k].coordinate(parameters[free[k]]);
    let mut moving: Vec<usize> = (0..free.len()).collect();
    loop {
        let mut matrix = sum.matrix.select_rows(&moving).select_columns(&moving);
        let gradient = sum.gradient.select_rows(&moving);
        let least = 1e-9 * matrix.trace();
        for k in 0..moving.len() {
            matrix[(k, k)] += damping * matrix[(k, k)] + least;
        }
        let Some(factor) = matrix.cholesky() else { return *parameters };
        let way = -factor.solve(&gradient);
        let is_out = |&k: &usize| {
            let to = at(moving[k]) + way[k].clamp(-LONGEST, LONGEST);
            let [least, most] = free[moving[k]].bounds().map(|bound| free[moving[k]].coordinate(bound));
            (to <= least && at(moving[k]) <= least + 1e-9) || (to >= most && at(moving[k]) >= most - 1e-9)
        };
        if let Some(out) = (0..moving.len()).find(is_out) {
            moving.remove(out);
            continue;
        }
        let mut next = *parameters;
        for (&k, way) in moving.iter().zip(&way) {
            next[free[k]] = free[k].value(at(k) + way.clamp(-LONGEST, LONGEST));
        }
        return next;
    }
}

/// The sum of what all recordings say, in their order.
pub fn total(normals: &[Normal]) -> Normal {
    let size = normals.first().map_or(0, |normal| normal.gradient.len());
    let zero = Normal { loss: 0.0, count: 0, gradient: DVector::zeros(size), matrix: DMatrix::zeros(size, size) };
    normals.iter().fold(zero, |mut sum, normal| {
        sum.loss += normal.loss;
        sum.count += normal.count;
        sum.gradient += &normal.gradient;
        sum.matrix += &normal.matrix;
        sum
    })
}

/// The recordings that a stage looks at.
struct Part<'a> {
    recordings: Vec<&'a Recording>,
    cables: Vec<Cable>,
    frames: usize,
    search: &'a Search,
}

impl<'a> Part<'a> {
    fn new(recordings: &'a [Recording], cables: &[Cable], stage: &Stage, search: &'a Search) -> Self {
        // Of few recordings all count: each fills a lane.
        let every = stage.every.min(recordings.len() / TOGETHER).max(1);
        let recordings = recordings.iter().step_by(every).collect();
        let cables = cables.iter().step_by(every).cloned().collect();
        Self { recordings, cables, frames: stage.frames.unwrap_or(usize::MAX), search }
    }

    /// Loss over all of its recordings.
    fn loss(&self, parameters: &Parameters) -> Result<f64, SimulationError> {
        let run = |cables| together(cables, parameters, self.frames, self.search.steps);
        let chunks: Result<Vec<Vec<Prediction>>, _> = self.cables.par_chunks(TOGETHER).map(run).collect();
        let predictions = chunks?.into_iter().flatten();
        let loss = |(real, predicted): (&&Recording, _)| normal(real, &predicted, &[], &[], self.search.huber).loss;
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
                normal(recording, &runs[0][k], &beside, &differences, *huber)
            };
            Ok(recordings.iter().enumerate().map(of).collect())
        };
        let chunks = self.recordings.par_chunks(TOGETHER).zip(self.cables.par_chunks(TOGETHER)).map(chunk);
        Ok(chunks.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
    }
}

/// By how much the coordinate of a parameter is changed for derivatives: back where forth would leave its bounds.
fn difference(parameter: Parameter, parameters: &Parameters) -> f64 {
    let most = parameter.coordinate(parameter.bounds()[1]);
    if parameter.coordinate(parameters[parameter]) + DIFFERENCE > most { -DIFFERENCE } else { DIFFERENCE }
}

/// What a recording says of a prediction and those `beside` it, one for each free parameter, whose coordinates differ by
/// `differences`.
fn normal(
    recording: &Recording,
    predicted: &Prediction,
    beside: &[&Prediction],
    differences: &[f64],
    huber: f64,
) -> Normal {
    let size = beside.len();
    let mut normal = Normal { loss: 0.0, count: 0, gradient: DVector::zeros(size), matrix: DMatrix::zeros(size, size) };
    let mut slope = vec![0.0; size];
    for (frame, markers) in predicted.markers.iter().enumerate() {
        let real = &recording.markers[frame][recording.free()];
        for (marker, (here, real)) in markers.iter().zip(real).enumerate() {
            for axis in 0..3 {
                let residual = here[axis] - real[axis];
                if real[axis].is_nan() {
                    continue;
                }
                // What is no number is as far off as anything can be.
                let far = if residual.is_nan() { 1.0 } else { residual.abs() };
                normal.count += 1;
                let weight = if far <= huber { 1.0 } else { huber / far };
                normal.loss += if far <= huber { 0.5 * far * far } else { huber * (far - 0.5 * huber) };
                for ((slope, beside), difference) in slope.iter_mut().zip(beside).zip(differences) {
                    // Where the run beside goes over to another shape there is no derivative.
                    let change = beside.markers[frame][marker][axis] - here[axis];
                    *slope = if change.abs() < huber { change / difference } else { 0.0 };
                }
                for a in 0..size {
                    normal.gradient[a] += weight * slope[a] * far.copysign(residual);
                    for b in 0..=a {
                        normal.matrix[(a, b)] += weight * slope[a] * slope[b];
                    }
                }
            }
        }
    }
    normal.matrix.fill_upper_triangle_with_lower_triangle();
    normal
}
