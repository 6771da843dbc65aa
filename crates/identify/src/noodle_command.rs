//! Noodles on the command line.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use export::write_json;
use identify::noodle::{ITERATIONS, Number, Numbers, Recording, Resolution, fit, is_noodle, predict, read, tip_error};
use identify::recording::files;
use identify::result::Value;
use report::significant;
use serde::Serialize;
use terminal::{Progress, say};

/// Over how long errors are told [s]: the horizons of the published ones, and all.
const HORIZONS: [f64; 3] = [5.0, 20.0, f64::INFINITY];

/// All that is needed to repeat an identification of a noodle.
#[derive(Serialize)]
struct NoodleFile {
    numbers: BTreeMap<String, Value>,
    segments: usize,
    frames_a_step: usize,
    recordings: Vec<String>,
    stopped: bool,
    seconds: f64,
    /// Mean distances of the tip [m] over the first 5 s, the first 20 s and all.
    tip_errors_m: BTreeMap<String, [f64; 3]>,
}

/// The recordings at these places, if they are of noodles.
///
/// # Errors
/// If one cannot be read, or only some are of noodles.
pub(crate) fn noodles(places: &[PathBuf]) -> Result<Option<Vec<Recording>>> {
    let files = files(places)?;
    let count = files.iter().filter(|path| is_noodle(path)).count();
    if count == 0 {
        return Ok(None);
    }
    if let Some(other) = files.iter().find(|path| !is_noodle(path)) {
        bail!("{}: it is no recording of a noodle (a header with p_b_x), but others are", other.display());
    }
    Ok(Some(files.iter().map(|path| read(path)).collect::<Result<_, _>>()?))
}

/// Identifies a noodle, predicts, prints and writes `result.json`. Returns whether it was stopped.
///
/// # Errors
/// If a model is not valid or the file cannot be written.
pub(crate) fn run(
    train: &[Recording],
    eval: &[Recording],
    resolution: Resolution,
    out: &Path,
    quiet: bool,
) -> Result<bool> {
    std::fs::create_dir_all(out).with_context(|| format!("--out: cannot create {}", out.display()))?;
    let began = Instant::now();
    let progress = Progress::new(ITERATIONS, "iterations", quiet)?;
    let found = fit(train, resolution, &mut || progress.advance())?;
    progress.finish();
    let seconds = began.elapsed().as_secs_f64();
    let mut numbers = BTreeMap::new();
    for (&number, &interval) in Number::ALL.iter().zip(&found.intervals) {
        let value = found.numbers[number];
        let told = interval.map_or_else(
            || "not determined".to_owned(),
            |[low, high]| format!("{} to {}", significant(low, 3), significant(high, 3)),
        );
        say!("{:<14} {:>9} {:<8} {told}", number.name(), significant(value, 3), number.unit())?;
        numbers.insert(number.name().to_owned(), Value { value, unit: number.unit().to_owned(), interval });
    }
    let mut tip_errors_m = BTreeMap::new();
    for (name, set) in [("train", train), ("eval", eval)] {
        errors(name, set, &found.numbers, resolution, &mut tip_errors_m)?;
    }
    let file = NoodleFile {
        numbers,
        segments: resolution.segments,
        frames_a_step: resolution.frames,
        recordings: train.iter().map(|recording| recording.path.display().to_string()).collect(),
        stopped: found.stopped,
        seconds,
        tip_errors_m,
    };
    let path = out.join("result.json");
    write_json(&path, &file)?;
    say!("searched for {} s; result: {}", significant(seconds, 2), path.display())?;
    Ok(found.stopped)
}

/// Predicts recordings and tells how far the tip is off.
fn errors(
    name: &str,
    set: &[Recording],
    numbers: &Numbers,
    resolution: Resolution,
    all: &mut BTreeMap<String, [f64; 3]>,
) -> Result<()> {
    let mut sums = [0.0; 3];
    for recording in set {
        let predicted = predict(recording, numbers, resolution)?;
        let errors = HORIZONS.map(|time| tip_error(recording, &predicted, time));
        let [five, twenty, end] = errors.map(|error| significant(error, 3));
        let path = recording.path.display().to_string();
        say!("{name}: {path}: distance of the tip [m]: {five} over 5 s, {twenty} over 20 s, {end} over all")?;
        (0..3).for_each(|k| sums[k] += errors[k] / set.len() as f64);
        all.insert(path, errors);
    }
    if !set.is_empty() {
        let [five, twenty, end] = sums.map(|error| significant(error, 3));
        say!("{name}: mean [m]: {five} over 5 s, {twenty} over 20 s, {end} over all")?;
    }
    Ok(())
}
