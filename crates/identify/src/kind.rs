//! The kinds of what is identified: what the program needs to know of each.

use std::path::{Path, PathBuf};

use anyhow::Result;
use export::ExportError;

use crate::cable::Resolution;
use crate::fit::{Of, Search};
use crate::predict::Prediction;
use crate::recording::{Reading, Recording, RecordingError};
use crate::specimen::Specimen;

mod branched;
mod cable;
mod noodle;

pub use cable::Plain;
pub use noodle::Clamped;

/// A kind of recordings: how they are read, what is searched for, and how errors are told.
pub trait Kind: Sized {
    /// What is identified.
    type Specimen: Specimen;

    /// Its name in results.
    const NAME: &'static str;
    /// How finely it is searched for at the most, and never more finely than it is predicted.
    const SEARCH: Resolution;
    /// How finely it is predicted unless told otherwise. Where this is finer, the search ends with it.
    const PREDICTION: Resolution;

    /// Reads recordings of one specimen, those to identify it on first. What is wrong with some is told beside those that are of use.
    ///
    /// # Errors
    /// If a place is not there, or what all recordings share cannot be told from them.
    fn read(places: [&[PathBuf]; 2], reading: Reading, segments: usize) -> Result<(Self, [Read<Self::Specimen>; 2])>;

    /// Where the search begins.
    fn start(&self, train: &[Self::Specimen]) -> <Self::Specimen as Specimen>::Numbers;

    /// How it is searched.
    fn search(&self) -> Search<Of<Self::Specimen>>;

    /// The markers of a recording along each rod.
    fn ways(&self, recording: &Recording) -> Vec<Vec<usize>>;

    /// Errors of a prediction by their names [m], the one by which recordings are ranked first.
    fn errors(&self, recording: &Recording, prediction: &Prediction) -> Vec<(String, f64)>;

    /// Errors over all recordings of a set by their names [m], where they are no means of those of each.
    fn errors_over_all(&self, _recordings: &[Recording], _predictions: &[Prediction]) -> Vec<(String, f64)> {
        Vec::new()
    }

    /// Writes a recording as a scene that `simulate` runs, and returns the scene's path.
    ///
    /// # Errors
    /// If the system refuses.
    fn scene(
        &self,
        folder: &Path,
        specimen: &Self::Specimen,
        name: &str,
        numbers: &<Self::Specimen as Specimen>::Numbers,
        steps: usize,
    ) -> Result<PathBuf, ExportError>;
}

/// What was read.
pub struct Read<S> {
    /// The recordings that are of use, and what is identified of each.
    pub good: Vec<(Recording, S)>,
    /// What is wrong with the others.
    pub bad: Vec<anyhow::Error>,
}

impl<S> Read<S> {
    fn new<R>(read: (Vec<R>, Vec<RecordingError>), specimen: impl Fn(R) -> Result<(Recording, S)>) -> Self {
        let mut bad: Vec<anyhow::Error> = read.1.into_iter().map(anyhow::Error::from).collect();
        let mut good = Vec::new();
        for recording in read.0 {
            match specimen(recording) {
                Ok(own) => good.push(own),
                Err(error) => bad.push(error),
            }
        }
        Self { good, bad }
    }
}
