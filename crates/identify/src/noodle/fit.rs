//! The fit of a noodle's numbers.

use nalgebra::DVector;
use optimise::{LeastSquares, Normal, Residuals};
use rayon::prelude::*;
use solver::simulation::SimulationError;

use super::{Number, Numbers, Recording, Resolution, predict};
use crate::confidence::{WIDTH, spreads};

/// Difference of a coordinate for derivatives of whole runs.
const DIFFERENCE: f64 = 2e-3;
/// Longest way of a coordinate in an iteration.
const LONGEST: f64 = 0.5;
/// The search ends where the loss falls by less than this part of it.
const ENOUGH: f64 = 1e-3;
/// Most iterations.
pub const ITERATIONS: usize = 40;
/// Distance of a coordinate [m] from which on it counts linearly and no longer squared.
const HUBER: f64 = 0.1;
/// Parts of a recording that are taken as independent of each other last so long [s].
const INDEPENDENT: f64 = 1.0;
/// Bending stiffnesses [m^4/s^2] from which a search may begin, for a noodle of 1 m; they go with the length's cube.
const SCAN: [f64; 4] = [0.1, 0.4, 1.6, 6.4];

/// What was found of a noodle.
#[derive(Clone, Debug)]
pub struct Found {
    /// The numbers.
    pub numbers: Numbers,
    /// 95 % intervals, in the order of [`Number::ALL`]; `None` where a number is at its bound or the recordings do not tell it. They are
    /// robust as those of [`known`](crate::confidence::known), with seconds of recordings as independent units.
    pub intervals: Vec<Option<[f64; 2]>>,
    /// Whether the search was stopped before its end.
    pub stopped: bool,
}

/// Searches for the numbers of a noodle, on rayon's threads, with the same bits on any number of them. `watch` is told after each
/// iteration, and says whether to go on.
///
/// # Errors
/// If a model is not valid.
pub fn fit(
    recordings: &[Recording],
    resolution: Resolution,
    watch: &mut dyn FnMut() -> bool,
) -> Result<Found, SimulationError> {
    let mut all = All { recordings, resolution };
    let reach = recordings.iter().flat_map(|recording| {
        recording
            .clamp
            .iter()
            .zip(&recording.markers)
            .map(|(clamp, [middle, tip])| (middle - clamp.position).norm() + (tip - middle).norm())
    });
    let length = reach.fold(0.0, f64::max);
    let mut best = (f64::INFINITY, Numbers::start(length));
    for scale in SCAN {
        let mut numbers = Numbers::start(length);
        numbers[Number::Bending] = scale * length.powi(3);
        let loss = all.loss(&coordinates(&numbers))?;
        if loss < best.0 {
            best = (loss, numbers);
        }
    }
    let mut least = LeastSquares::new(coordinates(&best.1));
    least.bounds = Number::ALL.iter().map(|of| of.bounds().map(|bound| of.coordinate(bound))).collect();
    (least.longest, least.tolerance) = (LONGEST, ENOUGH);
    let mut stopped = false;
    for _ in 0..ITERATIONS {
        let step = least.step(&mut all)?;
        stopped = !watch();
        if stopped || step.converged || step.loss >= step.before {
            break;
        }
    }
    let numbers = numbers(&least.x);
    let normals = all.linearised(&numbers)?;
    let inner: Vec<usize> = (0..Number::COUNT).filter(|&k| !is_at_bound(least.x[k], least.bounds[k])).collect();
    let spreads = spreads(&normals, &inner);
    let interval = |(k, &number): (usize, &Number)| {
        let spread = spreads.as_ref()?[inner.iter().position(|&inner| inner == k)?];
        let ends = [-1.0, 1.0].map(|side| number.value(least.x[k] + side * WIDTH * spread));
        let [low, high] = least.bounds[k];
        (2.0 * WIDTH * spread < 0.5 * (high - low)).then_some(ends)
    };
    let intervals = Number::ALL.iter().enumerate().map(interval).collect();
    Ok(Found { numbers, intervals, stopped })
}

fn is_at_bound(x: f64, [least, most]: [f64; 2]) -> bool {
    x - least < 1e-6 || most - x < 1e-6
}

fn coordinates(numbers: &Numbers) -> DVector<f64> {
    DVector::from_iterator(Number::COUNT, Number::ALL.iter().map(|&of| of.coordinate(numbers[of])))
}

fn numbers(x: &DVector<f64>) -> Numbers {
    let mut numbers = Numbers::start(1.0);
    Number::ALL.iter().zip(x).for_each(|(&of, &x)| numbers[of] = of.value(x));
    numbers
}

/// All recordings that count.
struct All<'a> {
    recordings: &'a [Recording],
    resolution: Resolution,
}

impl All<'_> {
    /// What each second of each recording says near some numbers, with derivatives by differences of whole runs.
    fn linearised(&self, at: &Numbers) -> Result<Vec<Normal>, SimulationError> {
        let x = coordinates(at);
        let difference = |k: usize| {
            let most = Number::ALL[k].coordinate(Number::ALL[k].bounds()[1]);
            if x[k] + DIFFERENCE > most { -DIFFERENCE } else { DIFFERENCE }
        };
        let runs = Number::COUNT + 1;
        let run = |index: usize| {
            let mut beside = x.clone();
            if let Some(k) = (index % runs).checked_sub(1) {
                beside[k] += difference(k);
            }
            predict(&self.recordings[index / runs], &numbers(&beside), self.resolution)
        };
        let all: Vec<_> =
            (0..runs * self.recordings.len()).into_par_iter().map(run).collect::<Result<_, SimulationError>>()?;
        let mut normals = Vec::new();
        for (recording, runs) in self.recordings.iter().zip(all.chunks(runs)) {
            let mut second = f64::NEG_INFINITY;
            for frame in (0..recording.time.len()).step_by(self.resolution.frames) {
                if recording.time[frame] >= second + INDEPENDENT {
                    second = recording.time[frame];
                    normals.push(Normal::zero(Number::COUNT));
                }
                let normal = normals.last_mut().expect("a first frame begins a second");
                for (marker, real) in recording.markers[frame].iter().enumerate() {
                    for (axis, real) in real.iter().enumerate() {
                        let here = runs[0][frame][marker][axis];
                        let slope: [f64; Number::COUNT] =
                            std::array::from_fn(|k| (runs[k + 1][frame][marker][axis] - here) / difference(k));
                        normal.add(here - real, &slope, HUBER);
                    }
                }
            }
        }
        Ok(normals)
    }
}

impl Residuals for All<'_> {
    type Error = SimulationError;

    fn loss(&mut self, x: &DVector<f64>) -> Result<f64, SimulationError> {
        let numbers = numbers(x);
        let run = |recording: &Recording| -> Result<f64, SimulationError> {
            let predicted = predict(recording, &numbers, self.resolution)?;
            let mut normal = Normal::zero(0);
            for frame in (0..recording.time.len()).step_by(self.resolution.frames) {
                for (here, real) in predicted[frame].iter().zip(&recording.markers[frame]) {
                    (here - real).iter().for_each(|&residual| normal.add(residual, &[], HUBER));
                }
            }
            Ok(normal.loss)
        };
        let losses: Vec<f64> = self.recordings.par_iter().map(run).collect::<Result<_, _>>()?;
        Ok(losses.iter().sum())
    }

    fn normal(&mut self, x: &DVector<f64>) -> Result<Normal, SimulationError> {
        Ok(self.linearised(&numbers(x))?.iter().sum())
    }
}
