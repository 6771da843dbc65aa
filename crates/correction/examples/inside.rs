//! What corrections inside the simulation are worth, on recordings that are kept aside, and what a gradient through a run costs:
//!
//! ```text
//! cargo run -p correction --example inside -- out/my-cable/result.json
//! ```
//!
//! Every seventh of the recordings that the cable was identified on is kept aside. It takes minutes.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result, anyhow};
use correction::film::{Film, Guess};
use correction::inputs::Kind;
use correction::inside::{Inside, Law, fit};
use correction::moments::Moments;
use correction::network::Shape;
use correction::training::{Plan, train};
use cosserat::derivative::{Recording as Steps, StateVariation, Wanted};
use cosserat::simulation::Settings;
use identify::cable::{Cable, Resolution};
use identify::fit::Stage;
use identify::metric::mean_error;
use identify::predict::{Prediction, step_params};
use identify::recording::{Reading, Recording, read_all};
use identify::result::CableFile;
use identify::specimen::Specimen;
use nalgebra::Vector3;

const STAGES: [Stage; 3] = [
    Stage { frames: Some(100), every: 4, iterations: 2 },
    Stage { frames: None, every: 4, iterations: 4 },
    Stage { frames: None, every: 2, iterations: 1 },
];
/// Runs that a gradient is taken of.
const RUNS: usize = 8;

fn main() -> Result<()> {
    let path = std::env::args().nth(1).context("which result.json of identify?")?;
    let cable = CableFile::read(&PathBuf::from(path)).map_err(|message| anyhow!(message))?;
    let parameters = cable.parameters().map_err(|message| anyhow!(message))?;
    let places: Vec<PathBuf> = cable.recordings.iter().map(PathBuf::from).collect();
    let (recordings, _) = read_all(&places, Reading::default());
    let (aside, own): (Vec<_>, Vec<_>) = recordings.into_iter().enumerate().partition(|(k, _)| k % 7 == 0);
    let [aside, own] = [aside, own].map(|part| -> Vec<Recording> { part.into_iter().map(|(_, own)| own).collect() });
    let cables = |recordings: &[Recording]| -> Result<Vec<Cable>> {
        recordings.iter().map(|recording| Ok(Cable::new(recording, Resolution::SEARCH.segments)?)).collect()
    };
    let (own_cables, aside_cables) = (cables(&own)?, cables(&aside)?);
    let even = Law { curvature: false, moments: None };
    let curved = Law { curvature: true, ..even.clone() };
    let bearing = Law { moments: Some(Moments::new(4, 1)), ..curved.clone() };
    for (name, law) in [("ten numbers", even), ("and curvatures", curved), ("and curvatures and moments", bearing)] {
        let began = Instant::now();
        let found = match name {
            "ten numbers" => Inside { parameters, law, curvatures: Vec::new() },
            _ => fit(&own, &own_cables, &parameters, law, &STAGES, &mut || true)?.context("it was not stopped")?,
        };
        let seconds = began.elapsed().as_secs_f64();
        let predictions = found.predict(&aside, &aside_cables)?;
        let films: Vec<(Recording, Film)> = own
            .iter()
            .zip(&found.predict(&own, &own_cables)?)
            .map(|(own, predicted)| (own.clone(), Film::simulated(own, predicted)))
            .collect();
        let (kind, guess) = (Kind::Perceptron, Guess::Physics);
        let plan = Plan { guess, kind, shape: Shape::of(kind), members: 3, epochs: kind.epochs(), seed: 1 };
        let correction = train(&films, &plan, &mut |_| true).context("there is nothing to learn")?.correction;
        let corrected: Vec<Prediction> = aside
            .iter()
            .zip(&predictions)
            .map(|(recording, own)| Film::simulated(recording, own))
            .map(|film| film.corrected(&correction.add(&film)))
            .collect();
        let [alone, corrected] = [&predictions, &corrected].map(|all| error(&aside, all));
        println!("{name}: {alone:.3} cm alone, {corrected:.3} cm with a correction; found in {seconds:.0} s");
    }
    let (mut forth, mut back) = (0.0, 0.0);
    for (recording, cable) in own.iter().zip(&own_cables).take(RUNS) {
        let (model, state) = cable.model(&parameters)?;
        let began = Instant::now();
        let mut run = Steps::new(&model, &state, &Settings { step: step_params(), ..Settings::default() })?;
        for times in recording.time.windows(2) {
            run.step(times[1] - times[0])?;
        }
        forth += began.elapsed().as_secs_f64() / RUNS as f64;
        let mut of = StateVariation::zero(model.segments.len());
        of.positions.iter_mut().for_each(|x| *x = Vector3::new(1.0, 1.0, 1.0));
        let objective: Vec<_> = (1..recording.frames()).map(|step| (step, of.clone())).collect();
        let began = Instant::now();
        run.backward(&objective, Wanted::ALL)?;
        back += began.elapsed().as_secs_f64() / RUNS as f64;
    }
    println!("a gradient through a run: {forth:.3} s forth, {back:.3} s back, on one thread");
    Ok(())
}

/// Mean error of a coordinate [cm].
fn error(recordings: &[Recording], predictions: &[Prediction]) -> f64 {
    let errors = recordings.iter().zip(predictions).map(|(own, predicted)| mean_error(own, predicted));
    100.0 * errors.sum::<f64>() / recordings.len() as f64
}
