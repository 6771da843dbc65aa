//! Recordings played beside their predictions.

use std::path::Path;

use anyhow::{Context, Result};
use cosserat::assembly::{Assembly, Material, RodSpec, shape};
use cosserat::state::{Model, State};
use nalgebra::Vector3;
use view::{Frame, Recorder, Run, write_page};

use crate::cable::{DENSITY, RADIUS};
use crate::predict::simulated;
use crate::recording::Recording;

/// Writes a page that plays a recording and its prediction in the same place. The prediction begins as `begun`, with so many
/// `steps` from frame to frame; `rods` are the recording's markers along each rod.
///
/// # Errors
/// If the system refuses, or the model is not valid.
pub fn play(
    path: &Path,
    recording: &Recording,
    rods: &[Vec<usize>],
    begun: (Model, State),
    steps: usize,
) -> Result<()> {
    let mut predicted: Option<Recorder> = None;
    let dt = recording.time[1] / steps as f64;
    let mut times = recording.time.iter();
    let mut watch = |_: usize, model: &Model, state: &State| {
        let recorder = predicted.get_or_insert_with(|| Recorder::new("prediction", dt, model));
        recorder.push(&frame(*times.next().unwrap_or(&0.0), state));
    };
    simulated(&[begun], &[&recording.time], steps, &mut watch)?;
    let predicted = predicted.context("a recording without frames")?.finish();
    Ok(write_page(path, &[predicted, recorded(recording, rods, dt)])?)
}

/// The recording as a run: rods through their markers, where all are known.
fn recorded(recording: &Recording, rods: &[Vec<usize>], dt: f64) -> Run {
    let material = Material { youngs_modulus: 1.0, torsion_modulus: 1.0, density: DENSITY };
    let nodes = |markers: &[Vector3<f64>]| -> Vec<Vec<Vector3<f64>>> {
        rods.iter().map(|rod| rod.iter().map(|&marker| markers[marker]).collect()).collect()
    };
    let mut assembly = Assembly::new(Vector3::zeros());
    let is_known =
        |markers: &&Vec<Vector3<f64>>| markers.iter().flat_map(|marker| marker.iter()).all(|x| x.is_finite());
    for nodes in recording.markers.iter().find(is_known).map_or_else(Vec::new, |markers| nodes(markers)) {
        assembly.rod(&RodSpec::new(nodes, RADIUS, material));
    }
    let (model, mut state) = assembly.finish();
    let mut recorder = Recorder::new("recording", dt, &model);
    for (&time, markers) in recording.time.iter().zip(&recording.markers) {
        if is_known(&markers) {
            let poses = nodes(markers).into_iter().flat_map(|nodes| shape::frames(&nodes, 0.0));
            for (i, pose) in poses.enumerate() {
                (state.positions[i], state.orientations[i]) = (pose.position, pose.orientation);
            }
        }
        recorder.push(&frame(time, &state));
    }
    recorder.finish()
}

fn frame(time: f64, state: &State) -> Frame<'_> {
    Frame { time, state, forces: &[], energy: f64::NAN, length_ratio: f64::NAN, iterations: f64::NAN }
}
