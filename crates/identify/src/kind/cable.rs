//! Cables between two grips.

use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow};
use export::ExportError;

use super::{Kind, Read};
use crate::cable::{Cable, Resolution};
use crate::fit::Search;
use crate::metric::mean_error;
use crate::parameter::{Parameter, Parameters};
use crate::predict::Prediction;
use crate::recording::{Reading, Recording, files, read_all};
use crate::scene;

/// A cable without branches.
pub struct Plain;

impl Kind for Plain {
    type Specimen = Cable;

    const NAME: &'static str = "cable";
    const SEARCH: Resolution = Resolution::SEARCH;
    const PREDICTION: Resolution = Resolution::PREDICTION;

    fn read(places: [&[PathBuf]; 2], reading: Reading, segments: usize) -> Result<(Self, [Read<Cable>; 2])> {
        let of = |places: &[PathBuf]| -> Result<Read<Cable>> {
            Ok(Read::new(read_all(&files(places)?, reading), |recording| {
                let cable = Cable::new(&recording, segments);
                let cable = cable.map_err(|error| anyhow!("{}: {error}", recording.path.display()))?;
                Ok((recording, cable))
            }))
        };
        Ok((Self, [of(places[0])?, of(places[1])?]))
    }

    fn start(&self, _: &[Cable]) -> Parameters {
        Parameters::default()
    }

    fn search(&self) -> Search<Parameter> {
        Search::default()
    }

    fn ways(&self, recording: &Recording) -> Vec<Vec<usize>> {
        vec![(0..recording.count()).collect()]
    }

    fn errors(&self, recording: &Recording, prediction: &Prediction) -> Vec<(String, f64)> {
        vec![("mean".to_owned(), mean_error(recording, prediction))]
    }

    fn scene(
        &self,
        folder: &Path,
        cable: &Cable,
        name: &str,
        parameters: &Parameters,
        steps: usize,
    ) -> Result<PathBuf, ExportError> {
        scene::write(folder, cable, name, parameters, steps)
    }
}
