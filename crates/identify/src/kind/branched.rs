//! Cables with branches.

use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow, bail};
use export::ExportError;

use super::{Kind, Read};
use crate::branched::{BranchedCable, Number, Numbers, Tree, scene};
use crate::cable::Resolution;
use crate::fit::{Dispersion, Search, Stage};
use crate::metric::{Errors, padded_places, padded_squares};
use crate::predict::Prediction;
use crate::recording::{
    Reading, Recording, drop_other_counts, drop_other_lengths, each, files, first_length, read_flat,
};

impl Kind for Tree {
    type Specimen = BranchedCable;

    const NAME: &'static str = "cable with branches";
    const SEARCH: Resolution = Resolution::SEARCH;
    const PREDICTION: Resolution = Resolution { segments: 4, steps: 1 };

    fn read(places: [&[PathBuf]; 2], reading: Reading, segments: usize) -> Result<(Self, [Read<BranchedCable>; 2])> {
        let of = |places: &[PathBuf]| {
            let (mut good, mut bad) = each(&files(places)?, |path| read_flat(path, reading));
            bad.extend(drop_other_counts(&mut good));
            Ok::<_, anyhow::Error>((good, bad))
        };
        let [train, eval] = [of(places[0])?, of(places[1])?];
        let told = if train.0.is_empty() { &eval.0 } else { &train.0 };
        if let (true, Some(fault)) = (told.is_empty(), train.1.iter().chain(&eval.1).next()) {
            bail!("none of the recordings is of use; the first: {fault}");
        }
        let tree = Self::of(told, reading.grips).map_err(|message| {
            let faults: Vec<String> = train.1.iter().chain(&eval.1).map(|fault| format!("; {fault}")).collect();
            anyhow!("{message}{}", faults.concat())
        })?;
        let read = [train, eval].map(|(all, mut bad)| {
            let (mut good, others) = each(all, |recording| tree.checked(recording));
            bad.extend(others);
            let length = |own: &Recording| first_length(own, tree.neighbours());
            bad.extend(drop_other_lengths(&mut good, |own| (&own.path, length(own))));
            Read::new((good, bad), |recording| {
                let cable = BranchedCable::new(&recording, &tree, segments);
                let cable = cable.map_err(|error| anyhow!("{}: {error}", recording.path.display()))?;
                Ok((recording, cable))
            })
        });
        Ok((tree, read))
    }

    fn start(&self, train: &[BranchedCable]) -> Numbers {
        let mut sums = vec![(0.0, 0.0); self.junctions().len() + 1];
        for angles in train.iter().map(BranchedCable::seen) {
            for (sum, (y, x)) in sums.iter_mut().zip(angles.into_iter().map(f64::sin_cos)) {
                *sum = (sum.0 + y, sum.1 + x);
            }
        }
        let means: Vec<f64> = sums.into_iter().map(|(y, x): (f64, f64)| y.atan2(x)).collect();
        Numbers::start(self, &means)
    }

    fn search(&self) -> Search<Number> {
        let stages = vec![
            Stage { frames: Some(100), every: 4, iterations: 12 },
            Stage { frames: None, every: 4, iterations: 10 },
            Stage { frames: None, every: 1, iterations: 4 },
        ];
        Search { finer: 2, dispersion: Dispersion::Recording, ..Search::of(Number::all(self), stages) }
    }

    fn ways(&self, _: &Recording) -> Vec<Vec<usize>> {
        self.ways()
    }

    fn errors(&self, recording: &Recording, prediction: &Prediction) -> Vec<(String, f64)> {
        let free: Vec<usize> = self.free().collect();
        let errors = Errors::of(recording, &free, prediction);
        let name = |k: usize| if k == 0 { "parent".to_owned() } else { format!("branch {k}") };
        let rods = self.rods().enumerate().map(|(k, markers)| (name(k), errors.mean(markers)));
        std::iter::once(("mean".to_owned(), errors.mean(0..self.count())))
            .chain(rods)
            .chain([("root mean square".to_owned(), errors.root_mean_square())])
            .collect()
    }

    fn errors_over_all(&self, recordings: &[Recording], predictions: &[Prediction]) -> Vec<(String, f64)> {
        let (free, ways) = (self.free().collect::<Vec<_>>(), self.ways());
        let mean_square = |(recording, prediction): (&Recording, &Prediction)| {
            padded_squares(recording, &free, prediction, &ways) / (recording.frames() * padded_places(&ways)) as f64
        };
        let sum: f64 = recordings.iter().zip(predictions).map(mean_square).sum();
        vec![("padded root mean square, as DEFT's".to_owned(), (sum / recordings.len() as f64).sqrt())]
    }

    fn scene(
        &self,
        folder: &Path,
        cable: &BranchedCable,
        name: &str,
        numbers: &Numbers,
        steps: usize,
    ) -> Result<PathBuf, ExportError> {
        scene::write(folder, cable, name, numbers, steps)
    }
}
