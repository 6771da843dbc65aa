//! Recordings of a simulated cable, whose numbers are known: to see what can be identified, and how surely.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use cosserat::motion::KeyframeError;
use export::{ExportError, write_atomically};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use thiserror::Error;

use crate::cable::{Cable, Resolution};
use crate::parameter::Parameters;
use crate::predict::predict;
use crate::recording::Recording;
use crate::specimen::SpecimenError;

/// Time from frame to frame [s].
const INTERVAL: f64 = 0.01;

/// What is recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Number of recordings, each with motions of its own.
    pub recordings: usize,
    /// Frames of each, 0.01 s apart.
    pub frames: usize,
    /// Markers along the cable, those in the grips included.
    pub markers: usize,
    /// How many times as fast as usual the grips move: 3 to 5 rad/s.
    pub pace: f64,
    /// Standard deviation of a coordinate of a free marker [m], normal, from the third frame on: the first two say how the cable
    /// begins.
    pub noise: f64,
    /// Seed of the noise.
    pub seed: u64,
    /// Whether all of it happens in the plane of x and z, as one camera sees it.
    pub is_planar: bool,
    /// How finely it is simulated.
    pub resolution: Resolution,
}

impl Default for Plan {
    /// Eight recordings of 0.6 s with nine markers, without noise, as finely as searches are.
    fn default() -> Self {
        let resolution = Resolution::SEARCH;
        Self { recordings: 8, frames: 60, markers: 9, pace: 1.0, noise: 0.0, seed: 3, is_planar: false, resolution }
    }
}

/// What keeps a cable from being simulated.
#[derive(Debug, Error)]
#[error(transparent)]
pub enum SimulatedError {
    /// Its grips make no motion.
    Grips(#[from] KeyframeError),
    /// It cannot be simulated.
    Simulation(#[from] SpecimenError),
}

/// Recordings of a cable of about 0.7 m with these parameters, which hangs between two grips that sway and lean.
///
/// # Errors
/// If the parameters make no valid model.
pub fn recordings(truth: &Parameters, plan: &Plan) -> Result<Vec<Recording>, SimulatedError> {
    let mut random = ChaCha8Rng::seed_from_u64(plan.seed);
    let mut recordings: Vec<Recording> = (0..plan.recordings).map(|index| grips(index, plan)).collect();
    let Resolution { segments, steps } = plan.resolution;
    let cables = recordings.iter().map(|recording| Cable::new(recording, segments)).collect::<Result<Vec<_>, _>>()?;
    for (recording, prediction) in recordings.iter_mut().zip(predict(&cables, truth, plan.frames, steps)?) {
        let free = recording.free();
        for (real, predicted) in recording.markers.iter_mut().zip(prediction.markers).skip(2) {
            for (real, predicted) in real[free.clone()].iter_mut().zip(predicted) {
                let noise = Vector3::from_fn(|_, _| plan.noise * normal(&mut random));
                *real = predicted + noise;
                if plan.is_planar {
                    real.y = 0.0;
                }
            }
        }
    }
    Ok(recordings)
}

/// A normal number (Box and Muller's).
fn normal(random: &mut ChaCha8Rng) -> f64 {
    let [u, v]: [f64; 2] = [random.random(), random.random()];
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

/// A recording whose markers hang in an arc, its grips moving to and fro in a way of its own; the markers between them are not
/// yet those of a cable but in the first two frames.
fn grips(index: usize, plan: &Plan) -> Recording {
    let phase = 1.3 * index as f64;
    let place = |time: f64, k: usize| {
        let s = k as f64 / (plan.markers - 1) as f64;
        let sway = |speed: f64, shift: f64| (plan.pace * speed * time + phase + shift).sin() - (phase + shift).sin();
        let across = if plan.is_planar { 0.0 } else { 0.06 };
        let end = |x: f64, shift: f64| {
            Vector3::new(x + 0.04 * sway(4.0, shift), across * sway(5.0, shift), 0.06 * sway(3.0, shift))
        };
        let sag = Vector3::z() * (-0.9 * s * (1.0 - s));
        end(-0.25, 0.0) * (1.0 - s) + end(0.25, 1.0) * s + sag
    };
    let time: Vec<f64> = (0..plan.frames).map(|frame| INTERVAL * frame as f64).collect();
    let markers = time.iter().map(|&time| (0..plan.markers).map(|k| place(time, k)).collect()).collect();
    Recording { path: PathBuf::from(format!("simulated-{index}")), time, markers }
}

/// Writes recordings as `folder/NAME.csv`, in metres; a coordinate that was lost is empty.
///
/// # Errors
/// If the system refuses.
pub fn write(folder: &Path, recordings: &[Recording]) -> Result<(), ExportError> {
    std::fs::create_dir_all(folder).map_err(ExportError::io("create the directory", folder))?;
    for recording in recordings {
        let path = folder.join(format!("{}.csv", recording.name()));
        write_atomically(&path, |out| out.write_all(csv(recording).as_bytes()))?;
    }
    Ok(())
}

/// A recording as a table in metres.
pub fn csv(recording: &Recording) -> String {
    let mut text = "time_s".to_owned();
    (0..recording.count()).for_each(|k| text += &format!(",m{k}_x,m{k}_y,m{k}_z"));
    for (time, markers) in recording.time.iter().zip(&recording.markers) {
        let _ = write!(text, "\n{time}");
        for x in markers.iter().flat_map(|marker| marker.iter()) {
            text += &if x.is_nan() { ",".to_owned() } else { format!(",{x}") };
        }
    }
    text
}
