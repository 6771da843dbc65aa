//! Cables with branches.

use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow};
use export::ExportError;

use super::{Kind, Read};
use crate::branched::{BranchedCable, Number, Numbers, Tree, scene};
use crate::cable::Resolution;
use crate::fit::{Search, Stage};
use crate::metric::Errors;
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
        let tree = Self::of(told).map_err(|message| anyhow!(message))?;
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
        // Branches on the side on which they are seen in the mean.
        let sides = train.iter().flat_map(BranchedCable::sides).map(f64::sin_cos);
        let (y, x) = sides.fold((0.0, 0.0), |(y, x), side| (y + side.0, x + side.1));
        Numbers::start(self.branches.len(), y.atan2(x))
    }

    fn search(&self) -> Search<Number> {
        let stages = vec![Stage::of_all(100, 12), Stage { frames: None, every: 1, iterations: 12 }];
        let free = Number::all(self.branches.len());
        Search { finer: 2, ..Search::of(free, stages) }
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
