//! Training: networks that each keep other recordings aside, to choose their epoch by.

use std::path::Path;

use burn::tensor::{Device, Tensor, TensorData};
use copingnet::{Adam, AdamParams, Backend};
use identify::metric::Errors;
use identify::motions::{Way, halves, kinds};
use identify::predict::Prediction;
use identify::recording::Recording;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::applicability::Applicability;
use crate::correction::Correction;
use crate::film::{Film, Guess};
use crate::inputs::{Inputs, Kind, STRIDE, Sizes};
use crate::network::{Reader, Row, Shape};

/// How to train.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// What is corrected.
    pub guess: Guess,
    /// How frames are read.
    pub kind: Kind,
    /// Sizes of the networks.
    pub shape: Shape,
    /// Networks, each of which keeps another part of the recordings aside.
    pub members: usize,
    /// Times that all recordings are gone through.
    pub epochs: usize,
    /// Seed of weights and order.
    pub seed: u64,
}

/// Where a training is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Epoch {
    /// The network.
    pub member: usize,
    /// Epochs of it that are done.
    pub epoch: usize,
    /// Mean error of a coordinate of what it keeps aside [m]; NaN of those that tell what is gained on other kinds of motion.
    pub aside: f64,
}

/// What a training came to.
#[derive(Clone, Debug, PartialEq)]
pub struct Trained {
    /// The correction.
    pub correction: Correction,
    /// Mean errors of coordinates of what each network kept aside [m]: of the guess, and corrected.
    pub aside: Vec<[f64; 2]>,
    /// Whether it was stopped before its end.
    pub stopped: bool,
}

/// One recording in so many is kept aside by a network.
pub const ASIDE: usize = 7;
/// Kinds of motion that are told apart, to see what is gained on others.
const KINDS: usize = 8;
/// Pieces of a step. The gradient of each is made at once; sums run in the order of pieces, whichever thread made them.
const PIECES: usize = 2;
/// Largest step size; it falls to zero as a cosine.
const RATE: f64 = 2e-3;
/// Weights shrink at this rate times the step size.
const DECAY: f64 = 0.05;
/// Weights are averaged over some such number of steps.
const AVERAGED: f64 = 200.0;
/// An error [m] below which the loss is quadratic, above linear.
const SMALL: f64 = 1e-3;
/// A correction may be larger than any in training by this factor.
const BEYOND: f64 = 1.5;

impl Plan {
    /// Epochs of all networks, those included that tell what is gained on other kinds of motion.
    pub fn all_epochs(&self) -> usize {
        (self.members.max(1) + 2) * self.epochs
    }
}

impl Kind {
    /// Times that recordings are gone through, unless told otherwise.
    pub fn epochs(self) -> usize {
        match self {
            Self::Graph | Self::Perceptron => 40,
            Self::Recurrent => 80,
        }
    }

    /// Samples of a piece.
    fn piece(self) -> usize {
        match self {
            Self::Graph | Self::Perceptron => 32,
            Self::Recurrent => 2,
        }
    }
}

/// A row of frames to learn from.
struct Sample {
    inputs: Vec<Inputs>,
    /// Frame by frame what is to be added to free markers, in the grips' frame, over the bound; NaN where they were lost.
    wanted: Vec<f32>,
}

/// Trains a correction of films, each beside its recording. `watch` is told after each epoch, and says whether to go on; what is
/// best so far is kept.
pub fn train(films: &[(Recording, Film)], plan: &Plan, watch: &mut dyn FnMut(&Epoch) -> bool) -> Option<Trained> {
    let (recording, film) = films.first()?;
    let free = film.markers.free.clone();
    let reader = Reader { kind: plan.kind, shape: plan.shape, markers: recording.count(), free };
    let missed = |film: &Film| {
        let rows = film.real.iter().zip(&film.guess);
        rows.flat_map(|(real, guess)| real.iter().zip(guess).map(|(a, b)| (a - b).amax())).fold(0.0, f64::max)
    };
    // A marker that was lost has no share in the largest.
    let bound = BEYOND * films.iter().map(|(_, film)| missed(film)).fold(1e-6, f64::max);
    let scale = scale(plan.kind, films, Sizes::of(plan.kind, reader.markers).node);
    // Parts of a recording have its way, and are of its kind.
    let mut recorded: Vec<&Path> = films.iter().map(|(recording, _)| recording.path.as_path()).collect();
    recorded.dedup();
    let of = |(recording, _): &(Recording, Film)| recorded.iter().position(|path| *path == recording.path);
    let ways: Vec<Way> = recorded
        .iter()
        .filter_map(|path| films.iter().find(|own| own.0.path == *path))
        .map(|(_, film)| film.way())
        .collect();
    let applicability = Applicability::new(ways.clone(), None, None);
    let interval = film.interval();
    let members = Vec::new();
    let correction = Correction { guess: plan.guess, reader, bound, scale, members, applicability, interval };
    let pick = |which: &dyn Fn(usize) -> bool| -> Vec<&(Recording, Film)> {
        films.iter().enumerate().filter(|(k, _)| which(*k)).map(|(_, own)| own).collect()
    };
    let (mut members, mut aside, mut stopped) = (Vec::new(), Vec::new(), false);
    // Errors of recordings that were kept aside, of guesses and corrected, at epochs that the others chose.
    let mut alike = [0.0; 2];
    for member in 0..plan.members.max(1) {
        let is_aside = |k: usize| films.len() > 1 && k % ASIDE.min(films.len()) == member % ASIDE.min(films.len());
        let [kept, learned] = [pick(&is_aside), pick(&|k| !is_aside(k))];
        let mut best = (f64::INFINITY, Vec::new());
        let mut over: Vec<Vec<f64>> = Vec::new();
        stopped = !epochs(&correction, &learned, plan, member, &mut |epoch, network| {
            over.push(errors(&kept, Some(network)));
            let now = over.last().map_or(0.0, |errors| mean(errors));
            if now < best.0 || kept.is_empty() {
                best = (now, network.members[0].clone());
            }
            watch(&Epoch { member, epoch, aside: now })
        });
        let guessed = errors(&kept, None);
        alike = [alike[0] + guessed.iter().sum::<f64>(), alike[1] + unbiased(&over).iter().sum::<f64>()];
        aside.push([mean(&guessed), best.0]);
        members.push(best.1);
        if stopped {
            break;
        }
    }
    // What networks gain on kinds of motion that they did not learn from.
    let second = halves(&kinds(&ways, KINDS));
    let is_told = ways.len() >= ASIDE && second.contains(&true);
    let second: Vec<bool> = films.iter().map(|own| of(own).is_some_and(|k| second[k])).collect();
    let mut sums = [0.0; 2];
    let sum =
        |films: &[&(Recording, Film)], correction: Option<&Correction>| errors(films, correction).iter().sum::<f64>();
    let parts: &[bool] = if is_told && !stopped { &[false, true] } else { &[] };
    for (half, &which) in parts.iter().enumerate() {
        let [learned, others] = [pick(&|k| second[k] == which), pick(&|k| second[k] != which)];
        let member = members.len() + half;
        let mut last = correction.clone();
        stopped |= !epochs(&correction, &learned, plan, member, &mut |epoch, network| {
            last.members.clone_from(&network.members);
            watch(&Epoch { member, epoch, aside: f64::NAN })
        });
        sums = [sums[0] + sum(&others, None), sums[1] + sum(&others, Some(&last))];
    }
    let gain = |[before, after]: [f64; 2]| if before > 0.0 { 1.0 - after / before } else { 0.0 };
    let like = (films.len() > 1).then(|| gain(alike));
    let applicability = Applicability::new(ways, like, (is_told && !stopped).then(|| gain(sums)));
    Some(Trained { correction: Correction { members, applicability, ..correction }, aside, stopped })
}

/// Trains a network from some films, the one of this number, and shows it after each epoch to `watch`, which says whether to go on. Returns
/// whether it went to its end.
fn epochs(
    of: &Correction,
    films: &[&(Recording, Film)],
    plan: &Plan,
    member: usize,
    watch: &mut dyn FnMut(usize, &Correction) -> bool,
) -> bool {
    let mut school = School::new(of, plan.seed.wrapping_mul(1000).wrapping_add(member as u64));
    (1..=plan.epochs).all(|epoch| {
        let samples: Vec<Sample> = films
            .par_iter()
            .flat_map_iter(|(_, film)| {
                plan.kind.rows(epoch % STRIDE, film.time.len()).into_iter().map(move |row| (film, row))
            })
            .map(|(film, row)| Sample::of(&of.reader, film, &row, of.bound))
            .filter(|sample| sample.wanted.iter().any(|wanted| !wanted.is_nan()))
            .collect();
        school.epoch(&samples, (epoch, plan.epochs));
        watch(epoch, &Correction { members: vec![school.mean.clone()], ..of.clone() })
    })
}

/// Mean errors of a coordinate [m] of films, as they are guessed or corrected.
fn errors(films: &[&(Recording, Film)], correction: Option<&Correction>) -> Vec<f64> {
    let each = films.iter().map(|(recording, film)| {
        error(recording, film, &correction.map_or_else(|| film.uncorrected(), |own| film.corrected(&own.add(film))))
    });
    each.collect()
}

/// Their mean; NaN of none.
fn mean(errors: &[f64]) -> f64 {
    errors.iter().sum::<f64>() / errors.len() as f64
}

/// Errors of recordings `over[epoch][recording]`, each at the epoch that is best for the others, the last one where there are none: an epoch
/// that a recording helped to choose would flatter it.
fn unbiased(over: &[Vec<f64>]) -> Vec<f64> {
    let count = over.first().map_or(0, Vec::len);
    let of_others = |errors: &[f64], own: usize| errors.iter().sum::<f64>() - errors[own];
    let chosen = |own: usize| {
        let epochs = over.iter().rev();
        epochs.min_by(|a, b| of_others(a, own).total_cmp(&of_others(b, own))).map_or(f64::NAN, |errors| errors[own])
    };
    (0..count).map(chosen).collect()
}

/// Mean error of a coordinate [m] of a prediction of a film.
fn error(recording: &Recording, film: &Film, prediction: &Prediction) -> f64 {
    Errors::of(recording, &film.markers.free, prediction).mean(0..recording.count())
}

/// Mean of each input of a node, and its inverse spread.
fn scale(kind: Kind, films: &[(Recording, Film)], columns: usize) -> [Vec<f32>; 2] {
    let mut sums = vec![[0.0_f64; 2]; columns];
    let mut count = 0.0;
    for (_, film) in films {
        for frame in (0..film.time.len()).step_by(4 * STRIDE) {
            for row in Inputs::of(kind, film, frame).nodes.chunks_exact(columns) {
                count += 1.0;
                for (sum, x) in sums.iter_mut().zip(row) {
                    *sum = [sum[0] + f64::from(*x), sum[1] + f64::from(*x) * f64::from(*x)];
                }
            }
        }
    }
    let of = |[sum, squares]: &[f64; 2]| {
        let mean = sum / count;
        (mean as f32, (1.0 / (squares / count - mean * mean).max(1e-6).sqrt()) as f32)
    };
    let (mean, inverse) = sums.iter().map(of).unzip();
    [mean, inverse]
}

impl Sample {
    fn of(reader: &Reader, film: &Film, row: &[usize], bound: f64) -> Self {
        let inputs: Vec<Inputs> = row.iter().map(|&frame| Inputs::of(reader.kind, film, frame)).collect();
        let told = reader.told();
        let of_frame = |(inputs, &frame): (&Inputs, &usize)| -> Vec<f32> {
            let wanted = told.iter().flat_map(|&marker| {
                let missed = inputs.axes * (film.real[frame][marker] - film.guess[frame][marker]) / bound;
                let counts = film.markers.free.contains(&marker);
                [0, 1, 2].map(|axis| if counts { missed[axis] as f32 } else { f32::NAN })
            });
            wanted.collect()
        };
        Self { wanted: inputs.iter().zip(row).flat_map(of_frame).collect(), inputs }
    }
}

/// A network in training.
struct School<'a> {
    of: &'a Correction,
    device: Device,
    parameters: Vec<f32>,
    /// Their mean over the last steps.
    mean: Vec<f32>,
    adam: Adam,
    random: ChaCha8Rng,
}

impl<'a> School<'a> {
    fn new(of: &'a Correction, seed: u64) -> Self {
        let parameters = of.reader.random(seed);
        let adam = Adam::new(parameters.len());
        let (device, random) = (Backend::default().device().autodiff(), ChaCha8Rng::seed_from_u64(seed));
        Self { of, device, mean: parameters.clone(), parameters, adam, random }
    }

    fn epoch(&mut self, samples: &[Sample], (epoch, epochs): (usize, usize)) {
        let mut order: Vec<usize> = (0..samples.len()).collect();
        for k in (1..order.len()).rev() {
            order.swap(k, self.random.random_range(0..=k));
        }
        let piece = self.of.reader.kind.piece();
        let batches = order.len().div_ceil(PIECES * piece);
        for (batch, own) in order.chunks(PIECES * piece).enumerate() {
            let done = (epoch - 1) as f64 + batch as f64 / batches as f64;
            let rate = RATE * 0.5 * (1.0 + (std::f64::consts::PI * done / epochs as f64).cos());
            let gradient = |piece: &[usize]| self.gradient(&piece.iter().map(|&k| &samples[k]).collect::<Vec<_>>());
            let pieces: Vec<Vec<f32>> = own.par_chunks(piece).map(gradient).collect();
            let mut sum = vec![0.0; self.parameters.len()];
            pieces.iter().for_each(|piece| sum.iter_mut().zip(piece).for_each(|(sum, g)| *sum += g / own.len() as f32));
            let params = AdamParams { beta_1: 0.9, beta_2: 0.99, clip: 1.0 };
            self.adam.step(&params, rate, &sum, &mut self.parameters);
            let (shrink, share) = ((1.0 - rate * DECAY) as f32, (1.0 / AVERAGED.min(self.adam.steps as f64)) as f32);
            for (own, mean) in self.parameters.iter_mut().zip(&mut self.mean) {
                *own *= shrink;
                *mean += share * (*own - *mean);
            }
        }
    }

    /// The sum of samples' gradients.
    fn gradient(&self, samples: &[&Sample]) -> Vec<f32> {
        let rows: Vec<Row<'_>> = samples.iter().map(|sample| sample.inputs.as_slice()).collect();
        let longest = rows.iter().map(|row| row.len()).max().unwrap_or(0);
        let network = self.of.reader.network(&self.parameters, &self.device);
        let said = network.forward(&rows, longest, &self.of.scale, &self.device);
        let dims = said.dims();
        let found: Vec<f32> = said.clone().into_data().iter::<f32>().collect();
        // The slope of the loss sqrt(e^2 + small^2) by what the network says, over the frames of a row.
        let small = (SMALL / self.of.bound) as f32;
        let each = 3 * self.of.reader.told().len();
        let slope = |(i, found): (usize, &f32)| {
            let (sample, k) = (samples[i / (longest * each)], i % (longest * each));
            let Some(&wanted) = sample.wanted.get(k).filter(|wanted| !wanted.is_nan()) else { return 0.0 };
            let share = sample.inputs[k / each].share as f32;
            let missed = found * share - wanted;
            share * missed / (missed * missed + small * small).sqrt() / sample.inputs.len() as f32
        };
        let slopes: Vec<f32> = found.iter().enumerate().map(slope).collect();
        let against = Tensor::<2>::from_data(TensorData::new(slopes, dims), &self.device);
        network.gradients(&(said * against).sum().backward())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recording_does_not_choose_its_epoch() {
        // The first one is best at the first epoch, the others at the second.
        let over = [vec![1.0, 5.0, 5.0], vec![3.0, 2.0, 2.0], vec![4.0, 4.0, 4.0]];
        assert_eq!(unbiased(&over), [3.0, 2.0, 2.0]);
        // Alone, it has the last one.
        assert_eq!(unbiased(&[vec![1.0], vec![2.0]]), [2.0]);
        assert!(unbiased(&[]).is_empty());
    }
}
