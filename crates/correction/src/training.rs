//! Training: networks that each keep other recordings aside, to choose their epoch by.

use burn::tensor::{Device, Tensor, TensorData};
use copingnet::{Adam, AdamParams, Backend, Network, Weights};
use identify::metric::mean_error;
use identify::recording::Recording;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::correction::{Correction, Shape, tensors};
use crate::film::{Film, Guess};
use crate::inputs::{Inputs, Kind, Sizes};

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
    /// Mean error of a coordinate of what it keeps aside [m].
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
const ASIDE: usize = 7;
/// Frames of a step, and those whose gradient is made in one piece. Sums run in the order of pieces, whichever thread made
/// them.
const BATCH: usize = 64;
/// See [`BATCH`].
const PIECE: usize = 32;
/// Of so many frames one is looked at in an epoch, in the next epoch the next one.
const STRIDE: usize = 5;
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

/// A frame to learn from.
struct Sample {
    inputs: Inputs,
    /// What is to be added to free markers, in the grips' frame, over the bound; NaN where they were lost.
    wanted: Vec<f32>,
}

/// Trains a correction of films, each beside its recording. `watch` is told after each epoch, and says whether to go on; what is
/// best so far is kept.
pub fn train(films: &[(&Recording, Film)], plan: &Plan, watch: &mut dyn FnMut(&Epoch) -> bool) -> Option<Trained> {
    let (markers, free) = (films.first()?.0.count(), films[0].1.free.clone());
    let missed = |film: &Film| {
        let rows = film.real.iter().zip(&film.guess);
        rows.flat_map(|(real, guess)| real.iter().zip(guess).map(|(a, b)| (a - b).amax())).fold(0.0, f64::max)
    };
    // A marker that was lost has no share in the largest.
    let bound = BEYOND * films.iter().map(|(_, film)| missed(film)).fold(1e-6, f64::max);
    let scale = scale(plan.kind, films, Sizes::of(plan.kind, markers).node);
    let correction = Correction { guess: plan.guess, kind: plan.kind, markers, bound, scale, members: Vec::new() };
    let (mut members, mut aside, mut stopped) = (Vec::new(), Vec::new(), false);
    for member in 0..plan.members.max(1) {
        let is_aside = |k: usize| films.len() > 1 && k % ASIDE.min(films.len()) == member % ASIDE.min(films.len());
        let (kept, learned): (Vec<usize>, Vec<usize>) = (0..films.len()).partition(|&k| is_aside(k));
        let network = plan.shape.network(plan.kind, markers, free.len());
        let seed = plan.seed.wrapping_mul(1000).wrapping_add(member as u64);
        let mut school = School::new(&correction, Weights::random(network, seed), seed);
        let kept: Vec<&(&Recording, Film)> = kept.iter().map(|&k| &films[k]).collect();
        let nothing = |film: &Film| film.corrected(&vec![vec![Vector3::zeros(); free.len()]; film.time.len()]);
        let plain = kept.iter().map(|(recording, film)| mean_error(recording, &nothing(film))).sum::<f64>();
        let mut best = (f64::INFINITY, school.mean.clone());
        for epoch in 1..=plan.epochs {
            let samples: Vec<Sample> = learned
                .par_iter()
                .flat_map_iter(|&k| {
                    let film = &films[k].1;
                    (epoch % STRIDE..film.time.len()).step_by(STRIDE).map(move |frame| (film, frame))
                })
                .map(|(film, frame)| Sample::of(plan.kind, film, frame, bound))
                .collect();
            school.epoch(&samples, (epoch, plan.epochs));
            let now = Correction { members: vec![school.mean.clone()], ..correction.clone() };
            let error =
                |(recording, film): &&(&Recording, Film)| mean_error(recording, &film.corrected(&now.add(film)));
            let error = kept.iter().map(error).sum::<f64>() / kept.len().max(1) as f64;
            if error < best.0 || kept.is_empty() {
                best = (error, school.mean.clone());
            }
            stopped = !watch(&Epoch { member, epoch, aside: error });
            if stopped {
                break;
            }
        }
        aside.push([plain / kept.len().max(1) as f64, best.0]);
        members.push(best.1);
        if stopped {
            break;
        }
    }
    Some(Trained { correction: Correction { members, ..correction }, aside, stopped })
}

/// Mean of each input of a node, and its inverse spread.
fn scale(kind: Kind, films: &[(&Recording, Film)], columns: usize) -> [Vec<f32>; 2] {
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
    fn of(kind: Kind, film: &Film, frame: usize, bound: f64) -> Self {
        let inputs = Inputs::of(kind, film, frame);
        let markers = if kind == Kind::Graph { 0..film.real[frame].len() } else { film.free.clone() };
        let wanted = markers.flat_map(|marker| {
            let missed = inputs.axes * (film.real[frame][marker] - film.guess[frame][marker]) / bound;
            let counts = film.free.contains(&marker);
            [0, 1, 2].map(|axis| if counts { missed[axis] as f32 } else { f32::NAN })
        });
        Self { wanted: wanted.collect(), inputs }
    }
}

/// A network in training.
struct School<'a> {
    of: &'a Correction,
    device: Device,
    weights: Weights,
    /// Their mean over the last steps.
    mean: Weights,
    adam: Adam,
    random: ChaCha8Rng,
}

impl<'a> School<'a> {
    fn new(of: &'a Correction, weights: Weights, seed: u64) -> Self {
        let adam = Adam::new(weights.values().len());
        let (device, random) = (Backend::default().device().autodiff(), ChaCha8Rng::seed_from_u64(seed));
        Self { of, device, mean: weights.clone(), weights, adam, random }
    }

    fn epoch(&mut self, samples: &[Sample], (epoch, epochs): (usize, usize)) {
        let mut order: Vec<usize> = (0..samples.len()).collect();
        for k in (1..order.len()).rev() {
            order.swap(k, self.random.random_range(0..=k));
        }
        let batches = order.len().div_ceil(BATCH);
        for (batch, own) in order.chunks(BATCH).enumerate() {
            let done = (epoch - 1) as f64 + batch as f64 / batches as f64;
            let rate = RATE * 0.5 * (1.0 + (std::f64::consts::PI * done / epochs as f64).cos());
            let gradient = |piece: &[usize]| self.gradient(&piece.iter().map(|&k| &samples[k]).collect::<Vec<_>>());
            let pieces: Vec<Vec<f32>> = own.par_chunks(PIECE).map(gradient).collect();
            let mut sum = vec![0.0; self.weights.values().len()];
            pieces.iter().for_each(|piece| sum.iter_mut().zip(piece).for_each(|(sum, g)| *sum += g / own.len() as f32));
            let params = AdamParams { beta_1: 0.9, beta_2: 0.99, clip: 1.0 };
            self.adam.step(&params, rate, &sum, self.weights.values_mut());
            let (shrink, share) = ((1.0 - rate * DECAY) as f32, (1.0 / AVERAGED.min(self.adam.steps as f64)) as f32);
            for (own, mean) in self.weights.values_mut().iter_mut().zip(self.mean.values_mut()) {
                *own *= shrink;
                *mean += share * (*own - *mean);
            }
        }
    }

    /// The sum of samples' gradients.
    fn gradient(&self, samples: &[&Sample]) -> Vec<f32> {
        let inputs: Vec<&Inputs> = samples.iter().map(|sample| &sample.inputs).collect();
        let network = Network::new(&self.weights, &self.device);
        let scans = self.weights.config().scans > 0;
        let graph = tensors(self.of.kind, &inputs, &self.of.scale, scans, &self.device);
        let (nodes, _) = network.forward(&graph);
        let [rows, columns] = nodes.dims();
        let found: Vec<f32> = nodes.clone().into_data().iter::<f32>().collect();
        // The slope of the loss sqrt(e^2 + small^2) by what the network says.
        let small = (SMALL / self.of.bound) as f32;
        let each = found.len() / samples.len();
        let slope = |(i, found): (usize, &f32)| {
            let sample = samples[i / each];
            let (share, wanted) = (sample.inputs.share as f32, sample.wanted[i % each]);
            let missed = found * share - wanted;
            if wanted.is_nan() { 0.0 } else { share * missed / (missed * missed + small * small).sqrt() }
        };
        let slopes: Vec<f32> = found.iter().enumerate().map(slope).collect();
        let against = Tensor::<2>::from_data(TensorData::new(slopes, [rows, columns]), &self.device);
        network.gradients(&(nodes * against).sum().backward())
    }
}
