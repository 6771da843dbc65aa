//! Corrections inside the simulation: curvatures at rest and moments of the joints beyond those of a rod that is the same all along.
//!
//! A [`Law`] says what joints bear; its numbers are found together with the cable's ten by Gauss and Newton's method through whole
//! runs, which grow from stage to stage. What it says is internal: a pair of moments on the two segments of a joint, in the frame
//! of the first, so that neither momentum nor angular momentum changes by it.

use cosserat::assembly::Load;
use cosserat::optimise::{LeastSquares, Normal, Residuals};
use cosserat::simulation::Batch;
use cosserat::state::darboux::darboux;
use cosserat::state::{Model, State};
use identify::cable::{Cable, DENSITY, RADIUS, Resolution};
use identify::fit::Stage;
use identify::parameter::{Parameter, Parameters};
use identify::predict::{Prediction, TOGETHER, Watch, are_in_time, simulated};
use identify::quantity::Quantity;
use identify::recording::{GRIPPED, Recording};
use identify::specimen::Specimen;
use identify::specimen::SpecimenError;
use nalgebra::{DVector, Vector2, Vector3};
use rayon::prelude::*;

use crate::moments::{Memory, Moments};

/// What joints bear beyond those of an even rod.
#[derive(Clone, Debug, PartialEq)]
pub struct Law {
    /// Whether the curvature at rest differs along the cable: linear from marker to marker.
    pub curvature: bool,
    /// The perceptron that says moments; none.
    pub moments: Option<Moments>,
}

/// A cable with a law, identified.
#[derive(Clone, Debug, PartialEq)]
pub struct Inside {
    /// Numbers of the cable.
    pub parameters: Parameters,
    /// What it bears beyond.
    pub law: Law,
    /// Change of the curvature at rest [1/m] about d1 and d2, from the inner marker of one grip to that of the other; empty where it
    /// is even.
    pub curvatures: Vec<Vector2<f64>>,
}

/// Bending over the mass per length is what is identified; moments are in its units.
const LINE_DENSITY: f64 = DENSITY * std::f64::consts::PI * RADIUS * RADIUS;
/// Distance of a coordinate [m] from which on it counts linearly and no longer squared.
const HUBER: f64 = 5e-3;
/// Differences for derivatives of whole runs: of coordinates of parameters, and of a law's numbers.
const DIFFERENCES: [f64; 2] = [5e-3, 2e-2];
/// Longest way of a coordinate in an iteration.
const LONGEST: f64 = 0.5;
/// A stage ends where the loss falls by less than this part of it.
const ENOUGH: f64 = 1e-3;

/// A recording and its cable.
#[derive(Clone)]
struct Case<'a> {
    recording: &'a Recording,
    cable: Cable,
}

/// Recordings with their cables.
fn cases<'a>(recordings: &'a [Recording], cables: &[Cable]) -> Vec<Case<'a>> {
    recordings.iter().zip(cables).map(|(recording, cable)| Case { recording, cable: cable.clone() }).collect()
}

impl Inside {
    /// Predicts recordings, of which cables know the first two frames and the grips; of the rest nothing is used.
    ///
    /// # Errors
    /// If a model is not valid.
    pub fn predict(&self, recordings: &[Recording], cables: &[Cable]) -> Result<Vec<Prediction>, SpecimenError> {
        let cases = cases(recordings, cables);
        let runs: Vec<Vec<Prediction>> =
            cases.par_chunks(TOGETHER).map(|cases| self.run(cases, usize::MAX)).collect::<Result<_, _>>()?;
        Ok(runs.into_iter().flatten().collect())
    }

    /// The model of a cable, with a load on each segment.
    fn model(&self, cable: &Cable) -> Result<(Model, State), SpecimenError> {
        let (mut model, state) = cable.model(&self.parameters)?;
        let parts = Resolution::SEARCH.segments;
        let inner = model.segments.len() - 1;
        if let Some(last) = self.curvatures.len().checked_sub(1) {
            // Beside the joints between segments those of the two grips.
            let places = (1..=inner).map(|node| node as f64 / parts as f64).chain([0.0, last as f64]);
            for (joint, place) in model.joints.iter_mut().zip(places) {
                let knot = (place as usize).min(last.saturating_sub(1));
                let change = self.curvatures[knot].lerp(&self.curvatures[(knot + 1).min(last)], place - knot as f64);
                joint.rest_darboux += Vector3::new(change.x, change.y, 0.0);
            }
        }
        if self.law.moments.is_some() {
            let load = |segment| Load {
                segment,
                offset: 0.0,
                force: Vector3::zeros(),
                torque: Vector3::zeros(),
                follows: false,
            };
            model.loads.extend((0..model.segments.len()).map(load));
        }
        Ok((model, state))
    }

    /// Runs some cables on this thread, side by side where their frames come at the same times.
    fn run(&self, cases: &[Case<'_>], frames: usize) -> Result<Vec<Prediction>, SpecimenError> {
        let longest = cases.iter().map(|case| &case.recording.time).max_by_key(|time| time.len());
        let are_together = |longest: &Vec<f64>| cases.iter().all(|case| are_in_time(&case.recording.time, longest));
        if !longest.is_none_or(are_together) {
            let alone = cases.iter().map(|case| self.run(std::slice::from_ref(case), frames));
            return Ok(alone.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect());
        }
        let models: Vec<(Model, State)> = cases.iter().map(|case| self.model(&case.cable)).collect::<Result<_, _>>()?;
        let time = |case: &Case<'_>| case.recording.time.len().min(frames);
        let times: Vec<&[f64]> = cases.iter().map(|case| &case.recording.time[..time(case)]).collect();
        let mut bearing = Bearing {
            inside: self,
            copies: cases.iter().zip(&models).map(Run::new).collect(),
            markers: vec![Vec::new(); cases.len()],
            torques: Vec::new(),
        };
        let unsolved = simulated(&models, &times, Resolution::SEARCH.steps, &mut bearing)?;
        let each = bearing.markers.into_iter().zip(unsolved);
        Ok(each.map(|(markers, unsolved)| Prediction { markers, unsolved }).collect())
    }

    /// Torques on the segments [N m]: what each joint does to its two. It then remembers `dt` [s] more.
    fn bear(
        &self,
        moments: &Moments,
        model: &Model,
        state: &State,
        memory: &mut Memory,
        dt: f64,
        torques: &mut Vec<Vector3<f64>>,
    ) {
        let stiffness = self.parameters[Parameter::Bending] * LINE_DENSITY;
        torques.clear();
        torques.resize(model.segments.len(), Vector3::zeros());
        for (k, joint) in model.joints[..model.segments.len() - 1].iter().enumerate() {
            let [a, b] = [k, k + 1].map(|segment| state.orientations[segment]);
            let now = darboux(&a, &b, joint.length).xy();
            let place = (k + 1) as f64 / model.segments.len() as f64;
            let change = moments.change(now - joint.rest_darboux.xy(), memory.look(k, now, dt), place);
            let torque = a * Vector3::new(change.x, change.y, 0.0) * stiffness;
            torques[k] -= torque;
            torques[k + 1] += torque;
        }
    }

    /// All numbers as coordinates.
    fn coordinates(&self) -> DVector<f64> {
        let of = Parameter::DEFAULT.iter().map(|&of| of.coordinate(self.parameters[of]));
        let own = self.curvatures.iter().flat_map(|change| [change.x, change.y]);
        let moments = self.law.moments.iter().flat_map(|moments| moments.numbers().iter().copied());
        DVector::from_iterator(self.count(), of.chain(own).chain(moments))
    }

    fn count(&self) -> usize {
        let moments = self.law.moments.as_ref().map_or(0, |moments| moments.numbers().len());
        Parameter::DEFAULT.len() + 2 * self.curvatures.len() + moments
    }

    /// The same with these coordinates.
    fn at(&self, x: &DVector<f64>) -> Self {
        let mut out = self.clone();
        let (of, own) = x.as_slice().split_at(Parameter::DEFAULT.len());
        Parameter::DEFAULT.iter().zip(of).for_each(|(&of, &x)| out.parameters[of] = of.value(x));
        let (curvatures, moments) = own.split_at(2 * out.curvatures.len());
        out.curvatures.iter_mut().zip(curvatures.chunks_exact(2)).for_each(|(to, x)| *to = Vector2::new(x[0], x[1]));
        out.law.moments.iter_mut().for_each(|own| own.numbers_mut().copy_from_slice(moments));
        out
    }
}

/// A cable that is run.
struct Run<'a> {
    case: &'a Case<'a>,
    model: &'a Model,
    /// Its state in the last frame.
    now: State,
    memory: Memory,
}

impl<'a> Run<'a> {
    fn new((case, (model, state)): (&'a Case<'a>, &'a (Model, State))) -> Self {
        Self { case, model, now: state.clone(), memory: Memory::new(model, state) }
    }
}

/// Cables whose joints bear what a law says, while they are simulated.
struct Bearing<'a> {
    inside: &'a Inside,
    copies: Vec<Run<'a>>,
    /// Free markers of each [m], by frame.
    markers: Vec<Vec<Vec<Vector3<f64>>>>,
    torques: Vec<Vector3<f64>>,
}

impl Watch for Bearing<'_> {
    fn act(&mut self, batch: &mut Batch, dt: f64) -> Result<(), SpecimenError> {
        let Some(moments) = &self.inside.law.moments else { return Ok(()) };
        for (index, Run { model, now, memory, .. }) in self.copies.iter_mut().enumerate() {
            self.inside.bear(moments, model, now, memory, dt, &mut self.torques);
            for (segment, torque) in self.torques.iter().enumerate() {
                batch.set_load(index, segment, Vector3::zeros(), *torque)?;
            }
        }
        Ok(())
    }

    fn look(&mut self, copy: usize, model: &Model, state: &State) {
        let Run { case, now, .. } = &mut self.copies[copy];
        now.clone_from(state);
        self.markers[copy].push(case.cable.markers(&self.inside.parameters, model, state));
    }
}

/// Finds a law's numbers and those of the cables of some recordings, from those that were identified, on rayon's threads, with the same bits on any number of
/// them. A number of the law is held by a prior: as if one more recording said that it is where it began, within 1. `watch` says after
/// each iteration whether to go on; `None` where it does not.
///
/// # Errors
/// If a model is not valid.
pub fn fit(
    recordings: &[Recording],
    cables: &[Cable],
    parameters: &Parameters,
    law: Law,
    stages: &[Stage],
    watch: &mut dyn FnMut() -> bool,
) -> Result<Option<Inside>, SpecimenError> {
    let cases = cases(recordings, cables);
    let knots = cases.first().filter(|_| law.curvature).map_or(0, |case| case.recording.count() + 2 - 2 * GRIPPED);
    let begin = Inside { parameters: *parameters, law, curvatures: vec![Vector2::zeros(); knots] };
    let mut least = LeastSquares::new(begin.coordinates());
    least.bounds = Parameter::DEFAULT.iter().map(|of| of.bounds().map(|bound| of.coordinate(bound))).collect();
    (least.longest, least.tolerance) = (LONGEST, ENOUGH);
    for stage in stages {
        // Of few recordings all count: each fills a lane.
        let every = stage.every.min(cases.len() / TOGETHER).max(1);
        let cases: Vec<Case<'_>> = cases.iter().step_by(every).cloned().collect();
        let frames = stage.frames.unwrap_or(usize::MAX);
        let mut part = Part { cases: &cases, frames, begin: &begin, prior: 0.0 };
        part.prior = part.loss(&least.x)? / cases.len().max(1) as f64;
        for _ in 0..stage.iterations {
            let step = least.step(&mut part)?;
            if !watch() {
                return Ok(None);
            }
            if step.converged || step.loss >= step.before {
                break;
            }
        }
    }
    Ok(Some(begin.at(&least.x)))
}

/// What a stage looks at.
struct Part<'a> {
    cases: &'a [Case<'a>],
    frames: usize,
    begin: &'a Inside,
    /// What a number of the law costs that is 1 from where it began, twice.
    prior: f64,
}

impl Part<'_> {
    /// Adds the prior.
    fn held(&self, x: &DVector<f64>, normal: &mut Normal) {
        let from = self.begin.coordinates();
        for k in Parameter::DEFAULT.len()..x.len() {
            let away = x[k] - from[k];
            normal.loss += 0.5 * self.prior * away * away;
            if !normal.gradient.is_empty() {
                normal.gradient[k] += self.prior * away;
                normal.matrix[(k, k)] += self.prior;
            }
        }
    }
}

impl Residuals for Part<'_> {
    type Error = SpecimenError;

    fn loss(&mut self, x: &DVector<f64>) -> Result<f64, SpecimenError> {
        let at = self.begin.at(x);
        let of = |cases: &[Case<'_>]| -> Result<Normal, SpecimenError> {
            let runs = [at.run(cases, self.frames)?];
            Ok(normal(cases, &runs, &[]))
        };
        let mut sum: Normal = self.cases.par_chunks(TOGETHER).map(of).collect::<Result<Vec<_>, _>>()?.iter().sum();
        self.held(x, &mut sum);
        Ok(sum.loss)
    }

    fn normal(&mut self, x: &DVector<f64>) -> Result<Normal, SpecimenError> {
        let step = |k: usize| {
            let size = DIFFERENCES[usize::from(k >= Parameter::DEFAULT.len())];
            let most = Parameter::DEFAULT.get(k).map_or(f64::INFINITY, |of| of.coordinate(of.bounds()[1]));
            if x[k] + size > most { -size } else { size }
        };
        let steps: Vec<f64> = (0..x.len()).map(step).collect();
        let of = |cases: &[Case<'_>]| -> Result<Normal, SpecimenError> {
            // The run itself, and one beside it for each coordinate: back where forth would leave its bounds.
            let run = |run: usize| {
                let mut beside = x.clone();
                if let Some(k) = run.checked_sub(1) {
                    beside[k] += steps[k];
                }
                self.begin.at(&beside).run(cases, self.frames)
            };
            let runs = (0..=x.len()).into_par_iter().map(run).collect::<Result<Vec<_>, _>>()?;
            Ok(normal(cases, &runs, &steps))
        };
        let mut sum: Normal = self.cases.par_chunks(TOGETHER).map(of).collect::<Result<Vec<_>, _>>()?.iter().sum();
        self.held(x, &mut sum);
        Ok(sum)
    }
}

/// What some recordings say of runs: the first, and one beside it for each coordinate, by its difference.
fn normal(cases: &[Case<'_>], runs: &[Vec<Prediction>], steps: &[f64]) -> Normal {
    let mut normal = Normal::zero(steps.len());
    let mut slopes = vec![0.0; steps.len()];
    for (copy, case) in cases.iter().enumerate() {
        for (frame, markers) in runs[0][copy].markers.iter().enumerate() {
            for (marker, here) in markers.iter().enumerate() {
                let real = case.recording.markers[frame][GRIPPED + marker];
                for axis in (0..3).filter(|&axis| !real[axis].is_nan()) {
                    for ((slope, beside), step) in slopes.iter_mut().zip(&runs[1..]).zip(steps) {
                        // Where the run beside goes over to another shape there is no derivative.
                        let change = beside[copy].markers[frame][marker][axis] - here[axis];
                        *slope = if change.abs() < HUBER { change / step } else { 0.0 };
                    }
                    // What is no number is as far off as anything can be.
                    let residual = here[axis] - real[axis];
                    normal.add(if residual.is_nan() { 1.0 } else { residual }, &slopes, HUBER);
                }
            }
        }
    }
    normal
}
