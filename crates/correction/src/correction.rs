//! A correction: networks whose mean says what to add.

use std::io::Write;
use std::path::Path;

use burn::tensor::Device;
use copingnet::Backend;
use export::{ExportError, SealedError, seal, unseal, write_atomically};
use identify::predict::Prediction;
use identify::recording::ALIKE;
use nalgebra::Vector3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::applicability::{Applicability, Worth};
use crate::film::{Film, Guess};
use crate::inputs::{Inputs, STRIDE, Sizes};
use crate::network::{Reader, Row, Shape};

/// Version of the file.
const SCHEMA: u32 = 3;
/// Rows of frames that go through a network at once.
const TOGETHER: usize = 64;

/// What is added to a guess of a cable's markers.
#[derive(Clone, Debug, PartialEq)]
pub struct Correction {
    /// What is corrected.
    pub guess: Guess,
    /// What reads the frames.
    pub reader: Reader,
    /// Largest correction of a coordinate [m].
    pub bound: f64,
    /// Mean of each input of a node and its inverse spread.
    pub scale: [Vec<f32>; 2],
    /// The parameters of networks, whose mean counts.
    pub members: Vec<Vec<f32>>,
    /// Which motions it applies to.
    pub applicability: Applicability,
    /// Time from frame to frame of what it learned from [s]; NaN where that is not known.
    pub interval: f64,
}

/// What a file holds.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema_version: u32,
    guess: String,
    kind: String,
    markers: usize,
    free: Vec<usize>,
    shape: Shape,
    bound_m: f64,
    scale: [Vec<f32>; 2],
    members: Vec<Vec<f32>>,
    applicability: Applicability,
    interval_s: Option<f64>,
}

impl Correction {
    /// Checks that it can read a film: its markers are those that it learned from, and so is the time from frame to frame.
    ///
    /// # Errors
    /// With what is not.
    pub fn check(&self, film: &Film) -> Result<(), String> {
        let (found, asked) = (film.guess.first().map_or(0, Vec::len), self.reader.markers);
        if found != asked {
            return Err(format!("{found} markers, but the correction is of a cable with {asked}"));
        }
        if film.markers.free != self.reader.free {
            return Err(format!(
                "the markers {:?} are to be predicted, but the correction is of {:?}: other grips or branches",
                film.markers.free, self.reader.free
            ));
        }
        let [own, learned] = [film.interval(), self.interval];
        if (own / learned - 1.0).abs() > ALIKE {
            return Err(format!(
                "{own} s from frame to frame, but the correction learned from {learned} s: record or sample it like that"
            ));
        }
        Ok(())
    }

    /// What to add to the free markers of a film [m]: `added[frame][marker]`.
    pub fn add(&self, film: &Film) -> Vec<Vec<Vector3<f64>>> {
        let device = Backend::default().device();
        let rows: Vec<Vec<usize>> =
            (0..STRIDE).flat_map(|first| self.reader.kind.rows(first, film.time.len())).collect();
        let added: Vec<(usize, Vec<Vector3<f64>>)> =
            rows.par_chunks(TOGETHER).flat_map(|rows| self.add_rows(film, rows, &device)).collect();
        let mut out = vec![Vec::new(); film.time.len()];
        added.into_iter().for_each(|(frame, added)| out[frame] = added);
        out
    }

    /// The predictions of films: corrected where the correction applies to their motions.
    pub fn predictions(&self, films: &[&Film]) -> Vec<Prediction> {
        let each = films.iter().zip(self.worths(films));
        let one = |(film, worth): (&&Film, Worth)| match worth.applies {
            true => film.corrected(&self.add(film)),
            false => film.uncorrected(),
        };
        each.map(one).collect()
    }

    /// What it is worth to films that are predicted together.
    pub fn worths(&self, films: &[&Film]) -> Vec<Worth> {
        self.applicability.worths(&films.iter().map(|film| film.way()).collect::<Vec<_>>())
    }

    /// What to add in rows of frames, with the number of each frame.
    fn add_rows(&self, film: &Film, rows: &[Vec<usize>], device: &Device) -> Vec<(usize, Vec<Vector3<f64>>)> {
        let read = |frames: &Vec<usize>| -> Vec<Inputs> {
            frames.iter().map(|&frame| Inputs::of(self.reader.kind, film, frame)).collect()
        };
        let inputs: Vec<Vec<Inputs>> = rows.iter().map(read).collect();
        let listed: Vec<Row<'_>> = inputs.iter().map(Vec::as_slice).collect();
        let longest = rows.iter().map(Vec::len).max().unwrap_or(0);
        let mut sum: Vec<f64> = Vec::new();
        for parameters in &self.members {
            let network = self.reader.network(parameters, device);
            let found = network.forward(&listed, longest, &self.scale, device).into_data();
            sum.resize(found.num_elements(), 0.0);
            sum.iter_mut().zip(found.iter::<f32>()).for_each(|(sum, x)| *sum += f64::from(x));
        }
        let told = self.reader.told();
        let place = |marker: &usize| told.iter().position(|own| own == marker);
        let places: Vec<usize> = film.markers.free.iter().filter_map(place).collect();
        let each = 3 * told.len();
        let share = self.bound / self.members.len().max(1) as f64;
        let of = |(row, k): (usize, usize)| {
            let inputs = &inputs[row][k];
            let own = &sum[(row * longest + k) * each..][..each];
            let told = |&k: &usize| Vector3::new(own[3 * k], own[3 * k + 1], own[3 * k + 2]);
            let added = places.iter().map(told).map(|x| inputs.axes.tr_mul(&x) * (share * inputs.share));
            (rows[row][k], added.collect())
        };
        let all = rows.iter().enumerate().flat_map(|(row, frames)| (0..frames.len()).map(move |k| (row, k)));
        all.map(of).collect()
    }

    /// Writes it.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn write(&self, path: &Path) -> Result<(), ExportError> {
        let Reader { kind, shape, markers, ref free } = self.reader;
        let file = File {
            schema_version: SCHEMA,
            guess: self.guess.name().to_owned(),
            kind: kind.name().to_owned(),
            markers,
            free: free.clone(),
            shape,
            bound_m: self.bound,
            scale: self.scale.clone(),
            members: self.members.clone(),
            applicability: self.applicability.clone(),
            interval_s: Some(self.interval).filter(|interval| interval.is_finite()),
        };
        write_atomically(path, |out| out.write_all(seal(&file)?.as_bytes()))
    }

    /// Reads it back.
    ///
    /// # Errors
    /// With the file, and what is wrong in it.
    pub fn read(path: &Path) -> Result<Self, String> {
        let named = |message: String| format!("{}: {message}", path.display());
        let bytes = std::fs::read(path).map_err(|error| named(error.to_string()))?;
        let file: File = unseal(path, &bytes, SCHEMA).map_err(|error: SealedError| error.to_string())?;
        let kind = file.kind.parse().map_err(|allowed| named(format!("kind {:?}: {allowed}", file.kind)))?;
        if file.free.is_empty() || file.free.iter().any(|&free| free >= file.markers) {
            return Err(named(format!(
                "free = {:?}, but it must be some of {} markers, from 0",
                file.free, file.markers
            )));
        }
        let reader = Reader { kind, shape: file.shape, markers: file.markers, free: file.free };
        let count = reader.parameters();
        let is_whole = |values: &Vec<f32>| values.len() == count && values.iter().all(|x| x.is_finite());
        if file.members.is_empty() || !file.members.iter().all(is_whole) {
            return Err(named("its weights do not fit its network".to_owned()));
        }
        if file.scale.iter().any(|list| list.len() != Sizes::of(kind, file.markers).node) {
            return Err(named("its scale does not fit its network".to_owned()));
        }
        Ok(Self {
            guess: file.guess.parse().map_err(|allowed| named(format!("guess {:?}: {allowed}", file.guess)))?,
            reader,
            bound: file.bound_m,
            scale: file.scale,
            members: file.members,
            applicability: file.applicability,
            interval: file.interval_s.unwrap_or(f64::NAN),
        })
    }
}
