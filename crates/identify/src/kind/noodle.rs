//! Noodles in one clamp.

use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow};
use export::ExportError;

use super::{Kind, Read};
use crate::cable::Resolution;
use crate::fit::{Search, Stage};
use crate::metric::Errors;
use crate::noodle::{MARKERS, Noodle, NoodleRecording, Number, Numbers, read, scene, tip_error};
use crate::predict::Prediction;
use crate::recording::{Reading, Recording, drop_other_lengths, each, files};

/// Over how long errors of the tip are told [s]: the horizons of the published ones.
const HORIZONS: [f64; 2] = [5.0, 20.0];

/// A noodle whose length is at least this [m].
pub struct Clamped(f64);

impl Kind for Clamped {
    type Specimen = Noodle;

    const NAME: &'static str = "noodle";
    /// As it is predicted.
    const SEARCH: Resolution = Resolution { segments: usize::MAX, steps: usize::MAX };
    const PREDICTION: Resolution = Resolution { segments: 20, steps: 1 };

    fn read(places: [&[PathBuf]; 2], reading: Reading, segments: usize) -> Result<(Self, [Read<Noodle>; 2])> {
        let mut reach = 0.0;
        let mut of = |places: &[PathBuf]| -> Result<Read<Noodle>> {
            let mut all = each(&files(places)?, |path| read(path, reading.unit));
            all.1.extend(drop_other_lengths(&mut all.0, |own| (&own.recording.path, own.reach())));
            reach = all.0.iter().map(NoodleRecording::reach).fold(reach, f64::max);
            Ok(Read::new(all, |own| {
                let noodle = Noodle::new(&own, segments);
                let noodle = noodle.map_err(|error| anyhow!("{}: {error}", own.recording.path.display()))?;
                Ok((own.recording, noodle))
            }))
        };
        let read = [of(places[0])?, of(places[1])?];
        Ok((Self(reach), read))
    }

    fn start(&self, _: &[Noodle]) -> Numbers {
        Numbers::start(self.0)
    }

    fn search(&self) -> Search<Number> {
        let stages = vec![Stage { frames: None, every: 1, iterations: 40 }];
        Search { huber: 0.1, independent: 1.0, ..Search::of(Number::ALL.to_vec(), stages) }
    }

    fn ways(&self, _: &Recording) -> Vec<Vec<usize>> {
        vec![(0..MARKERS).collect()]
    }

    fn errors(&self, recording: &Recording, prediction: &Prediction) -> Vec<(String, f64)> {
        let tip = |time: f64| tip_error(recording, prediction, time);
        let horizons = HORIZONS.map(|time| (format!("tip over {time} s"), tip(time)));
        let mean = Errors::of(recording, &[1, 2], prediction).mean(0..MARKERS);
        std::iter::once(("tip".to_owned(), tip(f64::INFINITY)))
            .chain(horizons)
            .chain([("mean".to_owned(), mean)])
            .collect()
    }

    fn scene(
        &self,
        folder: &Path,
        noodle: &Noodle,
        name: &str,
        numbers: &Numbers,
        steps: usize,
    ) -> Result<PathBuf, ExportError> {
        scene::write(folder, noodle, name, numbers, steps)
    }
}
