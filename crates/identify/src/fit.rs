//! The fit: least squares with Huber's loss over all recordings.

use std::ops::Range;

use cosserat::optimise::{LeastSquares, Normal};
use nalgebra::DVector;

use crate::quantity::Quantity;
use crate::recording::Recording;
use crate::specimen::SpecimenError;
use crate::specimen::{Numbers, Specimen};

mod part;
mod search;

use part::{Chord, Part};
pub use search::{Dispersion, Of, Search, Stage};

/// Where a search is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iteration {
    /// Index of the stage; the end with a finer simulation comes after the last.
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
    /// What each recording of the last stage that was reached says there, by its independent parts ([`Search::independent`]) and by the
    /// coordinates of what is free ([`Quantity::coordinate`]); losses are in m^2.
    pub normals: Vec<Vec<Normal>>,
    /// What is expected of them beside ([`Quantity::prior`]).
    pub expected: Normal,
    /// Whether it was stopped before its end.
    pub stopped: bool,
}

/// Longest way of a coordinate in an iteration.
pub(crate) const LONGEST: f64 = 1.0;
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
) -> Result<Fit<S::Numbers>, SpecimenError> {
    searched(recordings, specimens, None, start, search, watch)
}

/// The same, with an end in which the residuals are those of `finer` specimens of the same recordings, simulated in so many steps from
/// frame to frame: so that time step and segments are no part of what is found. Derivatives stay those of the coarser simulation.
///
/// # Errors
/// If a model is not valid.
///
/// # Panics
/// If the search has no stage.
pub fn fit_finer<S: Specimen>(
    recordings: &[Recording],
    specimens: &[S],
    finer: (&[S], usize),
    start: &S::Numbers,
    search: &Search<Of<S>>,
    watch: &mut dyn FnMut(&Iteration) -> bool,
) -> Result<Fit<S::Numbers>, SpecimenError> {
    searched(recordings, specimens, Some(finer), start, search, watch)
}

fn searched<S: Specimen>(
    recordings: &[Recording],
    specimens: &[S],
    finer: Option<(&[S], usize)>,
    start: &S::Numbers,
    search: &Search<Of<S>>,
    watch: &mut dyn FnMut(&Iteration) -> bool,
) -> Result<Fit<S::Numbers>, SpecimenError> {
    let last = search.stages.len().saturating_sub(1);
    let mut done = 0;
    let mut way = Way::begun(recordings, specimens, start, search)?;
    way.go(0..last, &mut done, watch)?;
    let with_later;
    if !way.stopped && !search.later.is_empty() {
        let free = [search.free.as_slice(), &search.later].concat();
        with_later = Search { free, ..search.clone() };
        way = Way::from(recordings, specimens, &way.numbers(), &with_later);
    }
    if !way.stopped {
        way.go(last..search.stages.len(), &mut done, watch)?;
    }
    let Some((finer, steps)) = finer.filter(|_| !way.stopped) else { return way.end() };
    let of_last = Search { steps, ..way.search.clone() };
    let part = Part::new(recordings, finer, &search.stages[last], &of_last, start);
    way.finish(part, done, watch)
}

/// The way of a search.
struct Way<'a, S: Specimen> {
    parts: Vec<Part<'a, S>>,
    search: &'a Search<Of<S>>,
    least: LeastSquares,
    /// The stage that was reached.
    stage: usize,
    stopped: bool,
}

impl<'a, S: Specimen> Way<'a, S> {
    /// A way from the best of where `start` may begin.
    fn begun(
        recordings: &'a [Recording],
        specimens: &[S],
        start: &S::Numbers,
        search: &'a Search<Of<S>>,
    ) -> Result<Self, SpecimenError> {
        let mut way = Self::from(recordings, specimens, start, search);
        if let Some(first) = way.parts.first() {
            way.least.x = coordinates(&search.free, &first.begun()?);
        }
        Ok(way)
    }

    /// A way from `start`, which also says what is not searched for.
    fn from(recordings: &'a [Recording], specimens: &[S], start: &S::Numbers, search: &'a Search<Of<S>>) -> Self {
        let of = |stage| Part::new(recordings, specimens, stage, search, start);
        let mut least = LeastSquares::new(coordinates(&search.free, start));
        least.bounds = search.free.iter().map(|of| of.bounds().map(|bound| of.coordinate(bound))).collect();
        (least.longest, least.tolerance) = (LONGEST, ENOUGH);
        let parts = search.stages.iter().map(of).collect();
        Self { parts, search, least, stage: 0, stopped: false }
    }

    /// Where it is.
    fn numbers(&self) -> S::Numbers {
        self.parts[self.stage].numbers(&self.least.x)
    }

    /// Goes through some stages, after the iterations that are `done`.
    fn go(
        &mut self,
        stages: Range<usize>,
        done: &mut usize,
        watch: &mut dyn FnMut(&Iteration) -> bool,
    ) -> Result<(), SpecimenError> {
        for stage in stages {
            let before = &self.parts[self.stage];
            let (held, dispersion) = (before.held().clone(), before.dispersion);
            self.stage = stage;
            self.parts[stage].hold(&held);
            self.parts[stage].dispersion = dispersion;
            // Means over frames need all of them.
            let is_whole = self.search.stages[stage].frames.is_none();
            if is_whole {
                self.parts[stage].average(&self.least.x)?;
            }
            for iteration in 1..=self.search.stages[stage].iterations {
                let step = self.least.step(&mut self.parts[stage])?;
                if is_whole {
                    self.parts[stage].average(&self.least.x)?;
                }
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
    fn end(self) -> Result<Fit<S::Numbers>, SpecimenError> {
        let part = &self.parts[self.stage];
        let parameters = self.numbers();
        let runs = part.runs(&parameters)?;
        let (normals, expected) = (part.linearised(runs.here(), &runs), part.expected(&self.least.x));
        Ok(Fit { parameters, free: self.search.free.clone(), normals, expected, stopped: self.stopped })
    }

    /// Goes on with a finer simulation from the derivatives of this one, after the iterations that are `done`.
    fn finish(
        mut self,
        mut finer: Part<'_, S>,
        done: usize,
        watch: &mut dyn FnMut(&Iteration) -> bool,
    ) -> Result<Fit<S::Numbers>, SpecimenError> {
        let part = &self.parts[self.stage];
        let runs = part.runs(&self.numbers())?;
        finer.dispersion = part.dispersion;
        finer.hold(part.held());
        finer.average(&self.least.x)?;
        let mut chord = Chord::new(finer, runs);
        for iteration in 1..=self.search.finer {
            let step = self.least.step(&mut chord)?;
            let loss = step.loss / step.count as f64;
            self.stopped = !watch(&Iteration { stage: self.parts.len(), done: done + iteration, loss });
            if self.stopped || step.converged || step.loss >= step.before {
                break;
            }
        }
        let parameters = chord.numbers(&self.least.x);
        let (normals, expected) = chord.said(&self.least.x)?;
        Ok(Fit { parameters, free: self.search.free.clone(), normals, expected, stopped: self.stopped })
    }
}

/// The coordinates of what is free.
fn coordinates<N: Numbers>(free: &[N::Quantity], numbers: &N) -> DVector<f64> {
    DVector::from_iterator(free.len(), free.iter().map(|&of| of.coordinate(numbers[of])))
}
