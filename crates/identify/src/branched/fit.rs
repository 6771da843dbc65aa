//! The fit of the numbers of a cable with branches.

use nalgebra::DVector;
use optimise::{LeastSquares, Normal, Residuals};
use rayon::prelude::*;
use solver::simulation::SimulationError;

use super::model::alone;
use super::{BranchedCable, Number, Numbers, Tree};
use crate::confidence::{WIDTH, spreads};
use crate::fit::normal;
use crate::parameter::Parameter;
use crate::recording::Recording;

/// Difference of a coordinate for derivatives of whole runs.
const DIFFERENCE: f64 = 5e-3;
/// Longest way of a coordinate in an iteration.
const LONGEST: f64 = 1.0;
/// A stage ends where the loss falls by less than this part of it.
const ENOUGH: f64 = 1e-3;
/// Frames from the start that count, and most iterations: little first, which leads to the basin.
const STAGES: [(usize, usize); 2] = [(100, 12), (usize::MAX, 12)];
/// Most iterations in all.
pub const ITERATIONS: usize = STAGES[0].1 + STAGES[1].1;
/// Distance of a coordinate [m] from which on it counts linearly and no longer squared.
const HUBER: f64 = 5e-3;
/// Bending stiffnesses [m^4/s^2] from which a search may begin.
const SCAN: [f64; 4] = [0.005, 0.02, 0.08, 0.3];

/// What was found of a cable with branches.
#[derive(Clone, Debug)]
pub struct Found {
    /// The numbers.
    pub numbers: Numbers,
    /// 95 % intervals, in the order of [`Number::all`]; `None` where a number is at its bound or the recordings do not tell it. They are
    /// those of [`known`](crate::confidence::known), with recordings as independent units, and need more of them than numbers.
    pub intervals: Vec<Option<[f64; 2]>>,
    /// Whether the search was stopped before its end.
    pub stopped: bool,
}

/// Searches for the numbers of a cable with branches, on rayon's threads, with the same bits on any number of them. `watch` is told
/// after each iteration how many there were, and says whether to go on.
///
/// # Errors
/// If a model is not valid.
pub fn fit(
    recordings: &[Recording],
    cables: &[BranchedCable],
    tree: &Tree,
    steps: usize,
    watch: &mut dyn FnMut(usize) -> bool,
) -> Result<Found, SimulationError> {
    let numbers = Number::all(tree.branches.len());
    let mut all =
        All { recordings, cables, free: tree.free().collect(), numbers: &numbers, steps, frames: STAGES[0].0 };
    let mut least = LeastSquares::new(all.coordinates(&begun(&all, cables, tree)?));
    least.bounds = numbers.iter().map(|of| of.bounds().map(|bound| of.coordinate(bound))).collect();
    (least.longest, least.tolerance) = (LONGEST, ENOUGH);
    let (mut stopped, mut done) = (false, 0);
    for (frames, iterations) in STAGES {
        all.frames = frames;
        for iteration in 1..=iterations {
            let step = least.step(&mut all)?;
            stopped = !watch(done + iteration);
            if stopped || step.converged || step.loss >= step.before {
                break;
            }
        }
        done += iterations;
        if stopped {
            break;
        }
    }
    let normals = all.linearised(&least.x)?;
    let is_inner = |k: &usize| {
        let [low, high] = least.bounds[*k];
        least.x[*k] - low > 1e-6 && high - least.x[*k] > 1e-6
    };
    let inner: Vec<usize> = (0..numbers.len()).filter(is_inner).collect();
    let spreads = spreads(&normals, &inner);
    let interval = |(k, number): (usize, &Number)| {
        let spread = spreads.as_ref()?[inner.iter().position(|&inner| inner == k)?];
        let [low, high] = least.bounds[k];
        let ends = [-1.0, 1.0].map(|side| number.value(least.x[k] + side * WIDTH * spread));
        (2.0 * WIDTH * spread < 0.5 * (high - low)).then_some(ends)
    };
    let intervals = numbers.iter().enumerate().map(interval).collect();
    Ok(Found { numbers: all.numbers(&least.x), intervals, stopped })
}

/// Where the search begins: with branches on the sides on which they are seen, at the bending stiffness of a few that fits best.
fn begun(all: &All<'_>, cables: &[BranchedCable], tree: &Tree) -> Result<Numbers, SimulationError> {
    let sides = cables.iter().flat_map(BranchedCable::sides).map(f64::sin_cos);
    let (y, x) = sides.fold((0.0, 0.0), |(y, x), side| (y + side.0, x + side.1));
    let start = Numbers::start(tree.branches.len(), y.atan2(x));
    let mut best = (f64::INFINITY, start.clone());
    for bending in SCAN {
        let mut numbers = start.clone();
        numbers.parent[Parameter::Bending] = bending;
        let loss = all.loss_at(&all.coordinates(&numbers))?;
        if loss < best.0 {
            best = (loss, numbers);
        }
    }
    Ok(best.1)
}

/// All recordings, as far as a stage looks at them.
struct All<'a> {
    recordings: &'a [Recording],
    cables: &'a [BranchedCable],
    free: Vec<usize>,
    numbers: &'a [Number],
    steps: usize,
    frames: usize,
}

impl All<'_> {
    fn coordinates(&self, numbers: &Numbers) -> DVector<f64> {
        DVector::from_iterator(self.numbers.len(), self.numbers.iter().map(|&of| of.coordinate(numbers.get(of))))
    }

    fn numbers(&self, x: &DVector<f64>) -> Numbers {
        let branches = self.numbers.iter().filter(|of| matches!(of, Number::Kink(_))).count();
        let mut numbers = Numbers::start(branches, 0.0);
        self.numbers.iter().zip(x).for_each(|(&of, &x)| numbers.set(of, of.value(x)));
        numbers
    }

    /// What each recording says there, with derivatives by differences of whole runs.
    fn linearised(&self, x: &DVector<f64>) -> Result<Vec<Normal>, SimulationError> {
        let most = |k: usize| self.numbers[k].coordinate(self.numbers[k].bounds()[1]);
        let difference = |k: usize| if x[k] + DIFFERENCE > most(k) { -DIFFERENCE } else { DIFFERENCE };
        let differences: Vec<f64> = (0..x.len()).map(difference).collect();
        let runs = x.len() + 1;
        let run = |index: usize| {
            let mut beside = x.clone();
            if let Some(k) = (index % runs).checked_sub(1) {
                beside[k] += differences[k];
            }
            alone(&self.cables[index / runs], &self.numbers(&beside), self.frames, self.steps)
        };
        let all = (0..runs * self.cables.len()).into_par_iter().map(run).collect::<Result<Vec<_>, _>>()?;
        let of = |(recording, runs): (&Recording, &[_])| {
            let recorded = |frame: usize, marker: usize| recording.markers[frame][self.free[marker]];
            normal(&recorded, &runs[0], &runs[1..].iter().collect::<Vec<_>>(), &differences, HUBER)
        };
        Ok(self.recordings.iter().zip(all.chunks(runs)).map(of).collect())
    }

    fn loss_at(&self, x: &DVector<f64>) -> Result<f64, SimulationError> {
        let numbers = self.numbers(x);
        let of = |(recording, cable): (&Recording, &BranchedCable)| -> Result<f64, SimulationError> {
            let recorded = |frame: usize, marker: usize| recording.markers[frame][self.free[marker]];
            Ok(normal(&recorded, &alone(cable, &numbers, self.frames, self.steps)?, &[], &[], HUBER).loss)
        };
        let losses: Vec<f64> = self.recordings.par_iter().zip(self.cables).map(of).collect::<Result<_, _>>()?;
        Ok(losses.iter().sum())
    }
}

impl Residuals for All<'_> {
    type Error = SimulationError;

    fn loss(&mut self, x: &DVector<f64>) -> Result<f64, SimulationError> {
        self.loss_at(x)
    }

    fn normal(&mut self, x: &DVector<f64>) -> Result<Normal, SimulationError> {
        Ok(self.linearised(x)?.iter().sum())
    }
}
