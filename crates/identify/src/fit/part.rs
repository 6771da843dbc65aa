//! What a search looks at: recordings, their predictions, and what they say of the numbers.

use cosserat::optimise::{Normal, Residuals};
use nalgebra::DVector;

use super::search::{Dispersion, Of, Search, Stage};
use crate::predict::{Prediction, TOGETHER, groups, predict, predict_each};
use crate::quantity::Quantity;
use crate::recording::Recording;
use crate::specimen::SpecimenError;
use crate::specimen::{Numbers, Specimen};

/// Difference of a coordinate for derivatives of whole runs.
const DIFFERENCE: f64 = 5e-3;

/// Runs of recordings with some numbers, and beside them.
#[derive(Default)]
pub(super) struct Runs {
    /// Of each recording: with the numbers, and then with each that is free changed by its difference.
    of: Vec<Vec<Prediction>>,
    /// Differences of the coordinates.
    differences: Vec<f64>,
}

impl Runs {
    /// Those with the numbers.
    pub(super) fn here(&self) -> impl Iterator<Item = &Prediction> {
        self.of.iter().filter_map(|own| own.first())
    }
}

/// The recordings that a stage looks at.
pub(super) struct Part<'a, S: Specimen> {
    recordings: Vec<&'a Recording>,
    specimens: Vec<S>,
    frames: usize,
    search: &'a Search<Of<S>>,
    /// The values of what is not searched for.
    held: S::Numbers,
    /// The dispersion of the loss over recordings where it was last linearised [m^2], for what is expected of numbers
    /// ([`Quantity::prior`]).
    pub(super) dispersion: f64,
}

impl<'a, S: Specimen> Part<'a, S> {
    pub(super) fn new(
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
        Self {
            recordings,
            specimens,
            frames: stage.frames.unwrap_or(usize::MAX),
            search,
            held: held.clone(),
            dispersion: 0.0,
        }
    }

    /// The numbers with these coordinates.
    pub(super) fn numbers(&self, x: &DVector<f64>) -> S::Numbers {
        let mut numbers = self.held.clone();
        self.search.free.iter().zip(x).for_each(|(&of, &x)| numbers[of] = of.value(x));
        numbers
    }

    /// Changes what is held and follows from runs with the numbers of these coordinates.
    pub(super) fn average(&mut self, x: &DVector<f64>) -> Result<(), SpecimenError> {
        let Search { steps, .. } = *self.search;
        if let Some(held) = S::averaged(&self.specimens, &self.recordings, &self.numbers(x), steps, self.dispersion)? {
            self.held = held;
        }
        Ok(())
    }

    /// What is held.
    pub(super) fn held(&self) -> &S::Numbers {
        &self.held
    }

    /// Holds what other numbers have.
    pub(super) fn hold(&mut self, held: &S::Numbers) {
        self.held = held.clone();
    }

    /// What is expected of the numbers: a normal prior, beside a loss that disperses as it does.
    pub(super) fn expected(&self, x: &DVector<f64>) -> Normal {
        let mut normal = Normal::zero(x.len());
        for (k, of) in self.search.free.iter().enumerate() {
            let Some(spread) = of.prior() else { continue };
            let weight = self.dispersion / (spread * spread);
            let off = x[k] - of.coordinate(of.start());
            normal.loss += 0.5 * weight * off * off;
            normal.gradient[k] = weight * off;
            normal.matrix[(k, k)] = weight;
        }
        normal
    }

    /// Where the search begins: where the loss is least of all that it may begin with.
    pub(super) fn begun(&self) -> Result<S::Numbers, SpecimenError> {
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
    fn loss_of(&self, numbers: &S::Numbers) -> Result<f64, SpecimenError> {
        Ok(self.loss_from(&self.predicted(numbers)?))
    }

    fn predicted(&self, numbers: &S::Numbers) -> Result<Vec<Prediction>, SpecimenError> {
        predict(&self.specimens, numbers, self.frames, self.search.steps)
    }

    fn loss_from(&self, predictions: &[Prediction]) -> f64 {
        let none = Runs::default();
        let losses = predictions.iter().enumerate().map(|(k, own)| self.normals(k, own, &none));
        losses.flatten().map(|normal| normal.loss).sum()
    }

    /// Runs of all of its recordings with some numbers, and for each that is free with it beside.
    pub(super) fn runs(&self, numbers: &S::Numbers) -> Result<Runs, SpecimenError> {
        let Search { free, steps, .. } = self.search;
        let differences: Vec<f64> = free.iter().map(|&of| difference(of, numbers[of])).collect();
        let beside = free.iter().zip(&differences).map(|(&of, difference)| {
            let mut beside = numbers.clone();
            beside[of] = of.value(of.coordinate(numbers[of]) + difference);
            beside
        });
        let runs: Vec<S::Numbers> = std::iter::once(numbers.clone()).chain(beside).collect();
        // Of the same run side by side, so that they are of one world.
        let groups = groups(&self.specimens, S::time);
        let copies: Vec<(&S, &S::Numbers)> = groups
            .iter()
            .flat_map(|group| runs.iter().flat_map(|run| group.iter().map(move |specimen| (specimen, run))))
            .collect();
        let mut predictions = predict_each(&copies, self.frames, *steps)?.into_iter();
        let mut of: Vec<Vec<Prediction>> = Vec::new();
        for group in groups {
            let first = of.len();
            of.resize_with(first + group.len(), Vec::new);
            for _ in &runs {
                of[first..].iter_mut().zip(&mut predictions).for_each(|(own, prediction)| own.push(prediction));
            }
        }
        Ok(Runs { of, differences })
    }

    /// What the independent parts of each recording say of `predictions`, with derivatives by the differences of `runs`.
    pub(super) fn linearised<'p>(
        &self,
        predictions: impl IntoIterator<Item = &'p Prediction>,
        runs: &Runs,
    ) -> Vec<Vec<Normal>> {
        predictions.into_iter().enumerate().map(|(k, own)| self.normals(k, own, runs)).collect()
    }

    /// What the independent parts of a recording tell of its prediction.
    fn normals(&self, recording: usize, predicted: &Prediction, runs: &Runs) -> Vec<Normal> {
        let (from, beside) = runs.of.get(recording).and_then(|own| own.split_first()).unwrap_or((predicted, &[]));
        let Search { huber, independent, .. } = *self.search;
        let (recording, markers) = (self.recordings[recording], self.specimens[recording].free());
        let mut normals = Vec::new();
        let mut slope = vec![0.0; beside.len()];
        let mut until = f64::NEG_INFINITY;
        for (frame, (here, from)) in predicted.markers.iter().zip(&from.markers).enumerate() {
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
                    for ((slope, beside), difference) in slope.iter_mut().zip(beside).zip(&runs.differences) {
                        // Where the run beside goes over to another shape there is no derivative.
                        let change = beside.markers[frame][k][axis] - from[k][axis];
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
    type Error = SpecimenError;

    fn loss(&mut self, x: &DVector<f64>) -> Result<f64, SpecimenError> {
        Ok(self.loss_of(&self.numbers(x))? + self.expected(x).loss)
    }

    fn normal(&mut self, x: &DVector<f64>) -> Result<Normal, SpecimenError> {
        let runs = self.runs(&self.numbers(x))?;
        let normals = self.linearised(runs.here(), &runs);
        self.dispersion = match self.search.dispersion {
            Dispersion::Scatter => scatter(&normals),
            Dispersion::Recording => normals.iter().flatten().map(|own| own.loss).sum::<f64>() / normals.len() as f64,
        };
        Ok(normals.iter().flatten().chain([&self.expected(x)]).sum())
    }
}

/// Residuals of a finer simulation, with the derivatives that a coarser one has at one place: those change little, and cost a run for each
/// number (the chord method).
pub(super) struct Chord<'a, S: Specimen> {
    finer: Part<'a, S>,
    runs: Runs,
    /// The place of the lowest loss, and the predictions there.
    lowest: Option<(DVector<f64>, f64, Vec<Prediction>)>,
}

impl<'a, S: Specimen> Chord<'a, S> {
    pub(super) fn new(finer: Part<'a, S>, runs: Runs) -> Self {
        Self { finer, runs, lowest: None }
    }

    /// The numbers with these coordinates.
    pub(super) fn numbers(&self, x: &DVector<f64>) -> S::Numbers {
        self.finer.numbers(x)
    }

    /// What the independent parts of each recording say, and what is expected.
    pub(super) fn said(&self, x: &DVector<f64>) -> Result<(Vec<Vec<Normal>>, Normal), SpecimenError> {
        let known = self.lowest.as_ref().filter(|(place, ..)| place == x).map(|(.., predictions)| predictions);
        let normals = match known {
            Some(predictions) => self.finer.linearised(predictions, &self.runs),
            None => self.finer.linearised(&self.finer.predicted(&self.numbers(x))?, &self.runs),
        };
        Ok((normals, self.finer.expected(x)))
    }
}

impl<S: Specimen> Residuals for Chord<'_, S> {
    type Error = SpecimenError;

    fn loss(&mut self, x: &DVector<f64>) -> Result<f64, SpecimenError> {
        let predictions = self.finer.predicted(&self.numbers(x))?;
        let loss = self.finer.loss_from(&predictions) + self.finer.expected(x).loss;
        if self.lowest.as_ref().is_none_or(|(_, lowest, _)| loss < *lowest) {
            self.lowest = Some((x.clone(), loss, predictions));
        }
        Ok(loss)
    }

    fn normal(&mut self, x: &DVector<f64>) -> Result<Normal, SpecimenError> {
        let (normals, expected) = self.said(x)?;
        Ok(normals.iter().flatten().chain([&expected]).sum())
    }
}

/// By how much gradients of recordings scatter, over their curvatures, in the mean over the numbers [m^2].
fn scatter(normals: &[Vec<Normal>]) -> f64 {
    let recordings: Vec<Normal> = normals.iter().map(|parts| parts.iter().sum()).collect();
    let count = recordings.first().map_or(0, |normal| normal.gradient.len());
    let of = |k: usize| {
        let squares: f64 = recordings.iter().map(|own| own.gradient[k] * own.gradient[k]).sum();
        let curvature: f64 = recordings.iter().map(|own| own.matrix[(k, k)]).sum();
        squares / curvature
    };
    let known: Vec<f64> = (0..count).map(of).filter(|ratio| ratio.is_finite()).collect();
    known.iter().sum::<f64>() / known.len().max(1) as f64
}

/// By how much a coordinate is changed for derivatives: back where forth would leave its bounds.
fn difference<Q: Quantity>(of: Q, value: f64) -> f64 {
    let [_, most] = of.bounds().map(|bound| of.coordinate(bound));
    if of.coordinate(value) + DIFFERENCE > most { -DIFFERENCE } else { DIFFERENCE }
}
