//! Cables with branches on the command line.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};
use export::write_json;
use identify::branched::{BranchedCable, Errors, ITERATIONS, Number, Numbers, Tree, fit, predict};
use identify::cable::Resolution;
use identify::playback::play;
use identify::predict::Prediction;
use identify::recording::{Reading, Recording, files, is_flat, read_flat};
use identify::result::Value;
use report::significant;
use serde::{Deserialize, Serialize};
use terminal::{Progress, complain, say};

/// All that is needed to repeat an identification of a cable with branches.
#[derive(Deserialize, Serialize)]
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
#[derive(Deserialize, Serialize)]
struct ErrorsFile {
    mean: f64,
    /// Of the parent, then of each branch.
    rods: Vec<f64>,
    root_mean_square: f64,
}

impl BranchedFile {
    fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).with_context(|| format!("--from: {}", path.display()))?;
        serde_json::from_str(&text)
            .with_context(|| format!("--from: {}: no result of a cable with branches", path.display()))
    }

    /// The rods of the recordings' cable, if they are as here.
    fn tree(&self, recordings: &[Recording]) -> Result<Tree> {
        let tree = Tree::of(recordings).map_err(|message| anyhow!(message))?;
        if tree.parent != self.parent_markers || branches(&tree) != self.branches {
            bail!("it is of a cable with other branches than these recordings'");
        }
        Ok(tree)
    }

    fn numbers(&self) -> Result<Numbers> {
        let mut numbers = Numbers::start(self.branches.len(), 0.0);
        for number in Number::all(self.branches.len()) {
            let (name, [least, most]) = (number.name(), number.bounds());
            let value = self.numbers.get(&name).with_context(|| format!("there is no {name}"))?.value;
            if !(least..=most).contains(&value) {
                bail!("{name} = {value}, but it must be {least} to {most} {}", number.unit());
            }
            numbers.set(number, value);
        }
        Ok(numbers)
    }
}

/// The parent's marker where each branch begins, and the branch's first marker.
fn branches(tree: &Tree) -> Vec<[usize; 2]> {
    tree.branches.iter().map(|branch| [branch.junction, branch.markers.start]).collect()
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

/// Identifies a cable with branches, or takes the result of an earlier identification, predicts, prints and writes `result.json` and pages
/// that play the worst recording and the one in the middle beside their predictions.
/// Returns whether the search was stopped.
///
/// # Errors
/// If no recording is of use, the earlier result is of another cable, a model is not valid or a file cannot be written.
pub(crate) fn run(
    [train, eval]: [&[PathBuf]; 2],
    from: Option<&Path>,
    reading: Reading,
    [segments, steps]: [Option<u16>; 2],
    out: &Path,
    quiet: bool,
) -> Result<bool> {
    std::fs::create_dir_all(out).with_context(|| format!("--out: cannot create {}", out.display()))?;
    let place = || format!("--from: {}", from.unwrap_or(out).display());
    let earlier = from.map(BranchedFile::read).transpose()?;
    let [train, eval] = [read(train, reading)?, read(eval, reading)?];
    let told = if train.is_empty() { &eval } else { &train };
    let tree = match &earlier {
        Some(file) => file.tree(told).with_context(place)?,
        None => Tree::of(&train).map_err(|message| anyhow!(message))?,
    };
    say!("parent: markers 0 to {}", tree.parent - 1)?;
    for (k, branch) in tree.branches.iter().enumerate() {
        let (first, last) = (branch.markers.start, branch.markers.end - 1);
        say!("branch {}: markers {first} to {last}, from marker {}", k + 1, branch.junction)?;
    }
    let usual = earlier
        .as_ref()
        .map_or(Resolution::default(), |file| Resolution { segments: file.segments, steps: file.steps });
    let resolution = Resolution {
        segments: segments.map_or(usual.segments, usize::from),
        steps: steps.map_or(usual.steps, usize::from),
    };
    let set = |recordings: Vec<Recording>| match recordings.is_empty() {
        true => Ok(None),
        false => Set::new(recordings, &tree, resolution.segments).map(Some),
    };
    let (train, eval) = (set(train)?, set(eval)?);
    let (mut file, numbers) = match (earlier, &train) {
        (Some(file), _) => {
            let numbers = file.numbers().with_context(place)?;
            (file, numbers)
        }
        (None, Some(train)) => identified(train, &tree, resolution, quiet)?,
        (None, None) => bail!("none of the recordings is of use"),
    };
    file.errors_m.clear();
    for number in Number::all(tree.branches.len()) {
        let Some(Value { value, interval, .. }) = file.numbers.get(&number.name()) else { continue };
        let told = interval
            .map_or_else(String::new, |[low, high]| format!("{} to {}", significant(low, 3), significant(high, 3)));
        say!("{:<14} {:>9} {:<8} {told}", number.name(), significant(*value, 3), number.unit())?;
    }
    let mut last = None;
    for (name, set) in [("train", &train), ("eval", &eval)] {
        if let Some(set) = set {
            last = Some((set, errors(name, set, &tree, &numbers, resolution.steps, &mut file.errors_m)?));
        }
    }
    let path = out.join("result.json");
    write_json(&path, &file)?;
    say!("result: {}", path.display())?;
    if let Some((set, errors)) = last {
        let mut order: Vec<usize> = (0..errors.len()).collect();
        order.sort_by(|&a, &b| errors[a].total_cmp(&errors[b]));
        for (name, k) in [("median.html", order[order.len() / 2]), ("worst.html", order[order.len() - 1])] {
            let (recording, path) = (&set.recordings[k], out.join(name));
            play(&path, recording, &tree.ways(), set.cables[k].model(&numbers), resolution.steps)?;
            say!("{} beside its prediction: {}", recording.name(), path.display())?;
        }
    }
    Ok(file.stopped && from.is_none())
}

/// Searches for the numbers.
fn identified(
    train: &Set,
    tree: &Tree,
    Resolution { segments, steps }: Resolution,
    quiet: bool,
) -> Result<(BranchedFile, Numbers)> {
    let began = Instant::now();
    let progress = Progress::new(ITERATIONS, "iterations", quiet)?;
    let mut done = 0;
    let found = fit(&train.recordings, &train.cables, tree, steps, &mut |now| {
        let go_on = progress.advance_by(now - done);
        done = now;
        go_on
    })?;
    progress.finish();
    let seconds = began.elapsed().as_secs_f64();
    let (count, all) = (train.recordings.len(), Number::all(tree.branches.len()));
    say!("searched for {} s", significant(seconds, 2))?;
    if count <= all.len() {
        say!("no intervals: {} numbers need more recordings than {count} for them", all.len())?;
    }
    let value = |(&number, &interval): (&Number, &Option<[f64; 2]>)| {
        let unit = number.unit().to_owned();
        (number.name(), Value { value: found.numbers.get(number), unit, interval })
    };
    let file = BranchedFile {
        numbers: all.iter().zip(&found.intervals).map(value).collect(),
        parent_markers: tree.parent,
        branches: branches(tree),
        segments,
        steps,
        recordings: train.recordings.iter().map(|recording| recording.path.display().to_string()).collect(),
        stopped: found.stopped,
        seconds,
        errors_m: BTreeMap::new(),
    };
    Ok((file, found.numbers))
}

/// Predicts recordings and tells how far off they are. Returns the mean error of each [m].
fn errors(
    name: &str,
    set: &Set,
    tree: &Tree,
    numbers: &Numbers,
    steps: usize,
    all: &mut BTreeMap<String, ErrorsFile>,
) -> Result<Vec<f64>> {
    let began = Instant::now();
    let predictions: Vec<Prediction> = predict(&set.cables, numbers, usize::MAX, steps)?;
    let seconds = began.elapsed().as_secs_f64();
    let recorded: f64 = set.recordings.iter().filter_map(|recording| recording.time.last()).sum();
    let cm = |error: f64| significant(100.0 * error, 3);
    let (mut mean, mut own) = (vec![0.0; tree.branches.len() + 3], Vec::with_capacity(predictions.len()));
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
        own.push(mean);
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
    Ok(own)
}
