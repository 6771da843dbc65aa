//! Cables with branches on the command line.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};
use export::write_json;
use identify::branched::{BranchedCable, Errors, ITERATIONS, Number, Numbers, Tree, fit, predict};
use identify::cable::Resolution;
use identify::predict::Prediction;
use identify::recording::{Reading, Recording, files, is_flat, read_flat};
use identify::result::Value;
use report::significant;
use serde::Serialize;
use terminal::{Progress, complain, say};

/// All that is needed to repeat an identification of a cable with branches.
#[derive(Serialize)]
struct BranchedFile {
    numbers: BTreeMap<String, Value>,
    /// Markers of the parent.
    parent_markers: usize,
    /// The parent's marker where each branch begins, and the branch's first marker.
    branches: Vec<[usize; 2]>,
    segments: usize,
    steps: usize,
    recordings: Vec<String>,
    stopped: bool,
    seconds: f64,
    errors_m: BTreeMap<String, ErrorsFile>,
}

/// Errors of a coordinate [m].
#[derive(Serialize)]
struct ErrorsFile {
    mean: f64,
    /// Of the parent, then of each branch.
    rods: Vec<f64>,
    root_mean_square: f64,
}

/// Recordings with their cables.
pub(crate) struct Set {
    recordings: Vec<Recording>,
    cables: Vec<BranchedCable>,
}

/// Whether the recordings at these places are of a cable with branches, by the first of them.
///
/// # Errors
/// If there are none.
pub(crate) fn are_branched(places: &[PathBuf]) -> Result<bool> {
    Ok(files(places)?.first().is_some_and(|path| is_flat(path)))
}

/// Reads recordings; those with faults are named and left out.
fn read(places: &[PathBuf], reading: Reading) -> Result<Vec<Recording>> {
    let mut all: Vec<Recording> = Vec::new();
    for path in files(places)? {
        match read_flat(&path, reading) {
            Ok(recording) => all.push(recording),
            Err(error) => complain(format_args!("{error}")),
        }
    }
    Ok(all)
}

impl Set {
    fn new(read: Vec<Recording>, tree: &Tree, parts: usize) -> Result<Self> {
        let (mut recordings, mut cables) = (Vec::new(), Vec::new());
        for recording in read {
            let checked = tree.checked(recording).map_err(anyhow::Error::from).and_then(|recording| {
                let cable = BranchedCable::new(&recording, tree, parts);
                Ok((cable.map_err(|error| anyhow!("{}: {error}", recording.path.display()))?, recording))
            });
            match checked {
                Ok((cable, recording)) => {
                    cables.push(cable);
                    recordings.push(recording);
                }
                Err(error) => complain(format_args!("{error}")),
            }
        }
        if recordings.is_empty() {
            bail!("none of the recordings is of use");
        }
        Ok(Self { recordings, cables })
    }
}

/// Identifies a cable with branches, predicts, prints and writes `result.json`. Returns whether it was stopped.
///
/// # Errors
/// If no recording is of use, a model is not valid or a file cannot be written.
pub(crate) fn run(
    train: &[PathBuf],
    eval: &[PathBuf],
    reading: Reading,
    Resolution { segments, steps }: Resolution,
    out: &Path,
    quiet: bool,
) -> Result<bool> {
    std::fs::create_dir_all(out).with_context(|| format!("--out: cannot create {}", out.display()))?;
    let train = read(train, reading)?;
    let tree = Tree::of(&train).map_err(|message| anyhow!(message))?;
    say!("parent: markers 0 to {}", tree.parent - 1)?;
    for (k, branch) in tree.branches.iter().enumerate() {
        let (first, last) = (branch.markers.start, branch.markers.end - 1);
        say!("branch {}: markers {first} to {last}, from marker {}", k + 1, branch.junction)?;
    }
    let train = Set::new(train, &tree, segments)?;
    let eval = match eval {
        [] => None,
        eval => Some(Set::new(read(eval, reading)?, &tree, segments)?),
    };
    let began = Instant::now();
    let progress = Progress::new(ITERATIONS, "iterations", quiet)?;
    let mut done = 0;
    let found = fit(&train.recordings, &train.cables, &tree, steps, &mut |now| {
        let go_on = progress.advance_by(now - done);
        done = now;
        go_on
    })?;
    progress.finish();
    let seconds = began.elapsed().as_secs_f64();
    let (count, all) = (train.recordings.len(), Number::all(tree.branches.len()));
    if count <= all.len() {
        say!("no intervals: {} numbers need more recordings than {count} for them", all.len())?;
    }
    let mut numbers = BTreeMap::new();
    for (&number, &interval) in all.iter().zip(&found.intervals) {
        let value = found.numbers.get(number);
        let told = interval
            .map_or_else(String::new, |[low, high]| format!("{} to {}", significant(low, 3), significant(high, 3)));
        say!("{:<14} {:>9} {:<8} {told}", number.name(), significant(value, 3), number.unit())?;
        numbers.insert(number.name(), Value { value, unit: number.unit().to_owned(), interval });
    }
    let mut errors_m = BTreeMap::new();
    for (name, set) in [("train", Some(&train)), ("eval", eval.as_ref())] {
        if let Some(set) = set {
            errors(name, set, &tree, &found.numbers, steps, &mut errors_m)?;
        }
    }
    let file = BranchedFile {
        numbers,
        parent_markers: tree.parent,
        branches: tree.branches.iter().map(|branch| [branch.junction, branch.markers.start]).collect(),
        segments,
        steps,
        recordings: train.recordings.iter().map(|recording| recording.path.display().to_string()).collect(),
        stopped: found.stopped,
        seconds,
        errors_m,
    };
    let path = out.join("result.json");
    write_json(&path, &file)?;
    say!("searched for {} s; result: {}", significant(seconds, 2), path.display())?;
    Ok(found.stopped)
}

/// Predicts recordings and tells how far off they are.
fn errors(
    name: &str,
    set: &Set,
    tree: &Tree,
    numbers: &Numbers,
    steps: usize,
    all: &mut BTreeMap<String, ErrorsFile>,
) -> Result<()> {
    let began = Instant::now();
    let predictions: Vec<Prediction> = predict(&set.cables, numbers, usize::MAX, steps)?;
    let seconds = began.elapsed().as_secs_f64();
    let recorded: f64 = set.recordings.iter().filter_map(|recording| recording.time.last()).sum();
    let cm = |error: f64| significant(100.0 * error, 3);
    let mut mean = vec![0.0; tree.branches.len() + 3];
    let told = |errors: &[f64]| {
        let rods: Vec<_> = errors[2..].iter().map(|&error| cm(error)).collect();
        format!("{} (parent, branches: {}), root mean square {}", cm(errors[0]), rods.join(", "), cm(errors[1]))
    };
    for (recording, prediction) in set.recordings.iter().zip(&predictions) {
        let errors = Errors::of(recording, tree, prediction);
        let row: Vec<f64> =
            [errors.mean, errors.root_mean_square].into_iter().chain(errors.rods.iter().copied()).collect();
        say!("{name}: {}: {} cm", recording.name(), told(&row))?;
        mean.iter_mut().zip(&row).for_each(|(mean, error)| *mean += error / predictions.len() as f64);
        let Errors { mean, rods, root_mean_square } = errors;
        all.insert(recording.path.display().to_string(), ErrorsFile { mean, rods, root_mean_square });
    }
    let unsolved: usize = predictions.iter().map(|prediction| prediction.unsolved).sum();
    say!(
        "{name}: {} recordings, error of a coordinate: {} cm; {} times real time{}",
        predictions.len(),
        told(&mean),
        significant(recorded / seconds, 2),
        if unsolved > 0 { format!("; {unsolved} steps were not solved") } else { String::new() }
    )?;
    Ok(())
}
