//! The fit: least squares with Huber's loss over all recordings.

use std::ops::Range;

use nalgebra::DVector;
use optimise::{LeastSquares, Normal, Residuals};
use serde::{Deserialize, Serialize};
use solver::simulation::SimulationError;

use crate::parameter::Parameter;
use crate::predict::{Prediction, TOGETHER, are_in_time, predict, predict_each};
use crate::quantity::Quantity;
use crate::recording::Recording;
use crate::specimen::{Numbers, Specimen};

/// What a specimen has numbers of.
pub type Of<S> = <<S as Specimen>::Numbers as Numbers>::Quantity;

/// How to search.
#[derive(Clone, Debug, PartialEq)]
pub struct Search<Q> {
    /// What is searched for; all else is held where the search begins.
    pub free: Vec<Q>,
    /// Other lists of what may be searched for. All go through all stages but the last, and the one goes on whose loss is least by then.
    pub instead: Vec<Vec<Q>>,
    /// What is looked at, one after the other: little first, which leads to the basin.
    pub stages: Vec<Stage>,
    /// Distance of a coordinate [m] from which on it counts linearly and no longer squared.
    pub huber: f64,
    /// Steps from frame to frame.
    pub steps: usize,
    /// How long parts of a recording are that count as independent of each other [s]; infinite: each recording is one.
    pub independent: f64,
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

impl Default for Search<Parameter> {
    fn default() -> Self {
        let stages = vec![
            Stage { frames: Some(100), every: 4, iterations: 12 },
            Stage { frames: None, every: 4, iterations: 10 },
            Stage { frames: None, every: 1, iterations: 3 },
        ];
        Self { instead: vec![Parameter::INSTEAD.to_vec()], ..Self::of(Parameter::DEFAULT.to_vec(), stages) }
    }
}

impl<Q: Quantity> Search<Q> {
    /// A search for some quantities, without any other list.
    pub fn of(free: Vec<Q>, stages: Vec<Stage>) -> Self {
        Self { free, instead: Vec::new(), stages, huber: 5e-3, steps: 1, independent: f64::INFINITY }
    }

    /// Most iterations: of all lists, of whose stages the last is gone through once.
    pub fn iterations(&self) -> usize {
        let all: usize = self.stages.iter().map(|stage| stage.iterations).sum();
        all + self.instead.len() * (all - self.stages.last().map_or(0, |stage| stage.iterations))
    }

    /// A search for each list.
    fn alternatives(&self) -> Vec<Self> {
        let of = |free: &Vec<Q>| Self { free: free.clone(), instead: Vec::new(), ..self.clone() };
        std::iter::once(&self.free).chain(&self.instead).map(of).collect()
    }
}

/// Where a search is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iteration {
    /// Index of the stage.
    pub stage: usize,
    /// Iterations of [`Search::iterations`] that are done, or were not needed.
    pub done: usize,
    /// Mean Huber loss of a coordinate of a free marker [m^2].
    pub loss: f64,
}

/// A fit's end.
#[derive(Clone, Debug)]
pub struct Fit<N: Numbers> {
    /// The best numbers.
    pub parameters: N,
    /// Those of [`Search::free`].
    pub free: Vec<N::Quantity>,
    /// What each independent part of the recordings of the last stage that was reached says there, by the coordinates of what is free
    /// ([`Quantity::coordinate`]); losses are in m^2.
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

/// Searches for the numbers of recordings from the best of where `start` may begin, on rayon's threads, with the same bits on any
/// number of them. `watch` is told after each iteration where the search is, and says whether to go on.
///
/// # Errors
/// If a model is not valid.
///
/// # Panics
/// If the search has no stage.
pub fn fit<S: Specimen>(
    recordings: &[Recording],
    specimens: &[S],
    start: &S::Numbers,
    search: &Search<Of<S>>,
    watch: &mut dyn FnMut(&Iteration) -> bool,
) -> Result<Fit<S::Numbers>, SimulationError> {
    let searches = search.alternatives();
    let last = search.stages.len().saturating_sub(1);
    let mut done = 0;
    let mut best = Way::begun(recordings, specimens, start, &searches[0])?;
    best.go(0..last, &mut done, watch)?;
    for own in &searches[1..] {
        if best.stopped {
            break;
        }
        let mut way = Way::begun(recordings, specimens, start, own)?;
        way.go(0..last, &mut done, watch)?;
        // A list that was not gone through cannot be compared.
        best.stopped = way.stopped;
        if !way.stopped && way.loss < best.loss {
            best = way;
        }
    }
    if !best.stopped {
        best.go(last..search.stages.len(), &mut done, watch)?;
    }
    best.end()
}

/// The way of a search for one list.
struct Way<'a, S: Specimen> {
    parts: Vec<Part<'a, S>>,
    search: &'a Search<Of<S>>,
    least: LeastSquares,
    /// The stage that was reached.
    stage: usize,
    loss: f64,
    stopped: bool,
}

impl<'a, S: Specimen> Way<'a, S> {
    fn begun(
        recordings: &'a [Recording],
        specimens: &[S],
        start: &S::Numbers,
        search: &'a Search<Of<S>>,
    ) -> Result<Self, SimulationError> {
        let of = |stage| Part::new(recordings, specimens, stage, search, start);
        let parts: Vec<Part<'a, S>> = search.stages.iter().map(of).collect();
        let begin = parts.first().map_or(Ok(start.clone()), Part::begun)?;
        let mut least = LeastSquares::new(coordinates(&search.free, &begin));
        least.bounds = search.free.iter().map(|of| of.bounds().map(|bound| of.coordinate(bound))).collect();
        (least.longest, least.tolerance) = (LONGEST, ENOUGH);
        Ok(Self { parts, search, least, stage: 0, loss: f64::INFINITY, stopped: false })
    }

    /// Goes through some stages, after the iterations that are `done`.
    fn go(
        &mut self,
        stages: Range<usize>,
        done: &mut usize,
        watch: &mut dyn FnMut(&Iteration) -> bool,
    ) -> Result<(), SimulationError> {
        for stage in stages {
            self.stage = stage;
            for iteration in 1..=self.search.stages[stage].iterations {
                let step = self.least.step(&mut self.parts[stage])?;
                self.loss = step.loss;
                let loss = step.loss / step.count as f64;
                self.stopped = !watch(&Iteration { stage, done: *done + iteration, loss });
                if self.stopped || step.converged || step.loss >= step.before {
                    break;
                }
            }
            *done += self.search.stages[stage].iterations;
            if self.stopped {
                break;
            }
        }
        Ok(())
    }

    /// What was found. Where the user does not want to wait, the stage that was reached must do.
    fn end(self) -> Result<Fit<S::Numbers>, SimulationError> {
        let part = &self.parts[self.stage];
        let parameters = part.numbers(&self.least.x);
        let normals = part.linearised(&parameters)?;
        Ok(Fit { parameters, free: self.search.free.clone(), normals, stopped: self.stopped })
    }
}

/// The coordinates of what is free.
fn coordinates<N: Numbers>(free: &[N::Quantity], numbers: &N) -> DVector<f64> {
    DVector::from_iterator(free.len(), free.iter().map(|&of| of.coordinate(numbers[of])))
}

/// The recordings that a stage looks at.
struct Part<'a, S: Specimen> {
    recordings: Vec<&'a Recording>,
    specimens: Vec<S>,
    frames: usize,
    search: &'a Search<Of<S>>,
    /// The values of what is not searched for.
    held: S::Numbers,
}

impl<'a, S: Specimen> Part<'a, S> {
    fn new(
        recordings: &'a [Recording],
        specimens: &[S],
        stage: &Stage,
        search: &'a Search<Of<S>>,
        held: &S::Numbers,
    ) -> Self {
        // Of few recordings all count: each fills a lane.
        let every = stage.every.min(recordings.len() / TOGETHER).max(1);
        let recordings = recordings.iter().step_by(every).collect();
        let specimens = specimens.iter().step_by(every).cloned().collect();
        Self { recordings, specimens, frames: stage.frames.unwrap_or(usize::MAX), search, held: held.clone() }
    }

    /// The numbers with these coordinates.
    fn numbers(&self, x: &DVector<f64>) -> S::Numbers {
        let mut numbers = self.held.clone();
        self.search.free.iter().zip(x).for_each(|(&of, &x)| numbers[of] = of.value(x));
        numbers
    }

    /// Where the search begins: where the loss is least of all that it may begin with.
    fn begun(&self) -> Result<S::Numbers, SimulationError> {
        let mut best = (f64::INFINITY, self.held.clone());
        for beginning in self.held.beginnings() {
            let mut numbers = self.held.clone();
            self.search.free.iter().for_each(|&of| numbers[of] = beginning[of]);
            let loss = self.loss_of(&numbers)?;
            if loss < best.0 {
                best = (loss, numbers);
            }
        }
        Ok(best.1)
    }

    /// Loss over all of its recordings.
    fn loss_of(&self, numbers: &S::Numbers) -> Result<f64, SimulationError> {
        let predictions = predict(&self.specimens, numbers, self.frames, self.search.steps)?;
        let losses = predictions.iter().enumerate().map(|(k, own)| self.normals(k, own, &[], &[]));
        Ok(losses.flatten().map(|normal| normal.loss).sum())
    }

    /// What each independent part of the recordings says near some numbers, its derivatives by differences of whole runs.
    fn linearised(&self, numbers: &S::Numbers) -> Result<Vec<Normal>, SimulationError> {
        let Search { free, steps, .. } = self.search;
        let differences: Vec<f64> = free.iter().map(|&of| difference(of, numbers[of])).collect();
        let beside = free.iter().zip(&differences).map(|(&of, difference)| {
            let mut beside = numbers.clone();
            beside[of] = of.value(of.coordinate(numbers[of]) + difference);
            beside
        });
        let runs: Vec<S::Numbers> = std::iter::once(numbers.clone()).chain(beside).collect();
        let mut normals = Vec::new();
        // Of the same run side by side, so that they are of one world.
        let same_times = |a: &S, b: &S| are_in_time(a.time(), b.time());
        let groups: Vec<&[S]> = self.specimens.chunk_by(same_times).flat_map(|group| group.chunks(TOGETHER)).collect();
        let copies: Vec<(&S, &S::Numbers)> = groups
            .iter()
            .flat_map(|group| runs.iter().flat_map(|run| group.iter().map(move |specimen| (specimen, run))))
            .collect();
        let predictions = predict_each(&copies, self.frames, *steps)?;
        let mut first = 0;
        for group in groups {
            let own = &predictions[runs.len() * first..][..runs.len() * group.len()];
            for k in 0..group.len() {
                let beside: Vec<&Prediction> = own.iter().skip(k).step_by(group.len()).collect();
                normals.append(&mut self.normals(first + k, beside[0], &beside[1..], &differences));
            }
            first += group.len();
        }
        Ok(normals)
    }

    /// What the independent parts of a recording tell of its prediction and those `beside` it, one for each free number, whose
    /// coordinates differ by `differences`.
    fn normals(
        &self,
        recording: usize,
        predicted: &Prediction,
        beside: &[&Prediction],
        differences: &[f64],
    ) -> Vec<Normal> {
        let Search { huber, independent, .. } = *self.search;
        let (recording, markers) = (self.recordings[recording], self.specimens[recording].free());
        let mut normals = Vec::new();
        let mut slope = vec![0.0; beside.len()];
        let mut until = f64::NEG_INFINITY;
        for (frame, here) in predicted.markers.iter().enumerate() {
            if recording.time[frame] >= until {
                until = recording.time[frame] + independent;
                normals.push(Normal::zero(beside.len()));
            }
            let Some(normal) = normals.last_mut() else { continue };
            for (k, (&marker, here)) in markers.iter().zip(here).enumerate() {
                let real = recording.markers[frame][marker];
                for axis in 0..3 {
                    if real[axis].is_nan() {
                        continue;
                    }
                    let residual = here[axis] - real[axis];
                    for ((slope, beside), difference) in slope.iter_mut().zip(beside).zip(differences) {
                        // Where the run beside goes over to another shape there is no derivative.
                        let change = beside.markers[frame][k][axis] - here[axis];
                        *slope = if change.abs() < huber { change / difference } else { 0.0 };
                    }
                    // What is no number is as far off as anything can be.
                    normal.add(if residual.is_nan() { 1.0 } else { residual }, &slope, huber);
                }
            }
        }
        normals
    }
}

impl<S: Specimen> Residuals for Part<'_, S> {
    type Error = SimulationError;

    fn loss(&mut self, x: &DVector<f64>) -> Result<f64, SimulationError> {
        self.loss_of(&self.numbers(x))
    }

    fn normal(&mut self, x: &DVector<f64>) -> Result<Normal, SimulationError> {
        Ok(self.linearised(&self.numbers(x))?.iter().sum())
    }
}

/// By how much a coordinate is changed for derivatives: back where forth would leave its bounds.
fn difference<Q: Quantity>(of: Q, value: f64) -> f64 {
    let [_, most] = of.bounds().map(|bound| of.coordinate(bound));
    if of.coordinate(value) + DIFFERENCE > most { -DIFFERENCE } else { DIFFERENCE }
}
