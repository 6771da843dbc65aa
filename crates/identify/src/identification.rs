//! An identification on the command line, the same for all kinds of recordings.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};
use identify::cable::Resolution;
use identify::confidence::{Known, known, without_each};
use identify::conformal::Regions;
use identify::fit::{Iteration, Of, Search, fit, fit_finer};
use identify::kind::{Kind, Read};
use identify::metric::{Errors, mean_change};
use identify::page::{self, Predicted, Shown};
use identify::playback::play;
use identify::predict::{Prediction, predict, predict_each};
use identify::quantity::Quantity;
use identify::recording::{Reading, Recording};
use identify::result::CableFile;
use identify::specimen::{Numbers, Specimen};
use identify::table;
use report::{Conditions, significant};
use terminal::{Progress, complain, say, warn};

use crate::Cli;

/// Most iterations of the last stage where more is searched for in it than before.
const WITH_LATER: usize = 8;

/// Recordings with what is identified of each.
struct Set<S> {
    name: &'static str,
    recordings: Vec<Recording>,
    specimens: Vec<S>,
}

/// What came of the predictions of a set.
struct Outcome {
    predictions: Vec<Prediction>,
    /// Errors of each recording by their names [m].
    errors: Vec<Vec<(String, f64)>>,
    /// Steps that were not solved.
    unsolved: usize,
    /// Time that predicting took [s].
    seconds: f64,
}

impl<S: Specimen> Set<S> {
    /// The recordings that are of use; what is wrong with the others is told. None where no recording was named.
    fn new(name: &'static str, read: Read<S>, places: &[PathBuf]) -> Result<Option<Self>> {
        read.bad.iter().for_each(|error| complain(format_args!("{error}")));
        if places.is_empty() {
            return Ok(None);
        }
        if read.good.is_empty() {
            bail!("none of the recordings to {} is of use", if name == "train" { "identify" } else { "predict" });
        }
        let (recordings, specimens) = read.good.into_iter().unzip();
        Ok(Some(Self { name, recordings, specimens }))
    }
}

/// Identifies recordings of a kind, or takes the result of an earlier identification, predicts, and writes what came of it.
///
/// # Errors
/// If no recording is of use, an option does not fit, a model is not valid or a file cannot be written.
pub(crate) fn run<K: Kind>(cli: &Cli) -> Result<ExitCode> {
    let earlier =
        cli.from.as_deref().map(CableFile::read).transpose().map_err(|message| anyhow!("--from: {message}"))?;
    let usual = earlier.as_ref().map_or(K::PREDICTION, CableFile::resolution);
    let resolution = Resolution {
        segments: cli.segments.map_or(usual.segments, usize::from),
        steps: cli.steps.map_or(usual.steps, usize::from),
    };
    let reading = reading(cli, earlier.as_ref())?;
    let (kind, [train, eval]) = K::read([&cli.recordings, &cli.eval], reading, resolution.segments)?;
    let train = Set::new("train", train, &cli.recordings)?;
    let eval = Set::new("eval", eval, &cli.eval)?;
    std::fs::create_dir_all(&cli.out).with_context(|| format!("--out: cannot create {}", cli.out.display()))?;
    let start = kind.start(train.as_ref().map_or(&[], |train| &train.specimens));
    let (file, numbers, known) = match (earlier, &train) {
        (Some(file), _) => {
            let file = of_set(file, &kind, train.iter().chain(&eval).next(), resolution)?;
            let numbers = file.numbers(start).map_err(|message| anyhow!("--from: {message}"))?;
            let known = file.known(&numbers);
            (file, numbers, known)
        }
        (None, Some(train)) => identified(cli, &kind, train, start, resolution)?,
        (None, None) => {
            bail!("there are no recordings to identify on; --from FILE predicts with what is known")
        }
    };
    let sets: Vec<Set<K::Specimen>> = train.into_iter().chain(eval).collect();
    if let Some(regions) = &file.regions {
        for set in sets.iter().filter(|set| regions_of(&file, set).is_none()) {
            let (known, free) = (regions.markers(), free_markers(set).len());
            warn(format_args!(
                "{}: regions are known of {known} markers, but these recordings have {free} free ones: they are left out",
                set.name
            ));
        }
    }
    let outcomes =
        sets.iter().map(|set| predicted(&kind, set, &numbers, resolution.steps)).collect::<Result<Vec<Outcome>>>()?;
    let warnings = warnings(&file, &known, &sets, &outcomes);
    // What makes the rest doubtful comes first.
    warnings.iter().try_for_each(|warning| say!("warning: {warning}"))?;
    say!("{}", page::lines(&known))?;
    for (set, outcome) in sets.iter().zip(&outcomes) {
        tell(&kind, set, outcome, regions_of(&file, set))?;
    }
    let file = CableFile { warnings, ..file };
    let code = write(cli, &kind, &sets, &outcomes, file, &numbers, &known, resolution)?;
    if let Some(times) = cli.refine {
        let Resolution { segments, steps } = resolution;
        let times = usize::from(times);
        let (_, finer) = K::read([&cli.recordings, &cli.eval], reading, segments * times)?;
        for ((set, outcome), finer) in sets.iter().zip(&outcomes).zip(finer.iter().filter(|read| !read.good.is_empty()))
        {
            let segments: Vec<_> = finer.good.iter().map(|(_, specimen)| specimen.clone()).collect();
            change(
                set,
                outcome,
                &format!("steps by {times}"),
                &predict(&set.specimens, &numbers, usize::MAX, steps * times)?,
            )?;
            change(set, outcome, &format!("segments by {times}"), &predict(&segments, &numbers, usize::MAX, steps)?)?;
        }
    }
    Ok(code)
}

/// The regions of the markers of a set; none where it has other markers than they are of.
fn regions_of<'a, S: Specimen>(file: &'a CableFile, set: &Set<S>) -> Option<&'a Regions> {
    file.regions.as_ref().filter(|regions| regions.markers() == free_markers(set).len())
}

/// How files are read: as the command line says, else as those of an earlier result were.
fn reading(cli: &Cli, earlier: Option<&CableFile>) -> Result<Reading> {
    let usual =
        earlier.map_or(Ok(Reading::default()), CableFile::reading).map_err(|message| anyhow!("--from: {message}"))?;
    if let Some(told) = cli.grips.filter(|told| earlier.is_some() && *told != usual.grips) {
        bail!("--grips {told}: the result of --from is of grips at {}", usual.grips);
    }
    Ok(Reading {
        rate: cli.rate.unwrap_or(usual.rate),
        unit: cli.unit_m.unwrap_or(usual.unit),
        grips: cli.grips.unwrap_or(usual.grips),
    })
}

/// An earlier result for a set that is predicted as finely as told. Refuses that of another kind of recordings, and of a cable with other
/// branches.
fn of_set<K: Kind>(
    mut file: CableFile,
    kind: &K,
    set: Option<&Set<K::Specimen>>,
    resolution: Resolution,
) -> Result<CableFile> {
    if file.kind != K::NAME {
        bail!("--from: it is of a {}, but these recordings are of a {}", file.kind, K::NAME);
    }
    let rods = set.and_then(|set| set.recordings.first()).map(|recording| kind.ways(recording));
    if file.rods.len() > 1 && rods.is_some_and(|rods| rods != file.rods) {
        bail!("--from: it is of a {} with other branches than these recordings'", file.kind);
    }
    (file.segments, file.steps) = (resolution.segments, resolution.steps);
    Ok(file)
}

/// Tells by how much finer predictions of a set are others than what came of it.
fn change<S: Specimen>(set: &Set<S>, outcome: &Outcome, refined: &str, finer: &[Prediction]) -> Result<()> {
    let free = free_markers(set);
    let (mut change, mut before, mut after) = (0.0, 0.0, 0.0);
    for ((recording, one), other) in set.recordings.iter().zip(&outcome.predictions).zip(finer) {
        let error = |prediction| Errors::of(recording, &free, prediction).mean(0..recording.count());
        change += mean_change(recording, &free, [one, other]);
        before += error(one);
        after += error(other);
    }
    let cm = |sum: f64| significant(100.0 * sum / set.recordings.len() as f64, 3);
    let [change_cm, before_cm, after_cm] = [change, before, after].map(cm);
    let share = significant(100.0 * change / before, 2);
    let unsolved: usize = finer.iter().map(|prediction| prediction.unsolved).sum();
    if unsolved > 0 {
        warn(format_args!("{}, {refined}: {unsolved} steps were not solved", set.name));
    }
    say!(
        "{}, {refined}: predictions change by {change_cm} cm of a coordinate, {share} % of their error, which goes from \
         {before_cm} to {after_cm} cm",
        set.name
    )?;
    Ok(())
}

/// What to search for, and where from: what is held and free as the command line says.
fn search<K: Kind>(
    cli: &Cli,
    kind: &K,
    start: &mut <K::Specimen as Specimen>::Numbers,
) -> Result<Search<Of<K::Specimen>>> {
    let mut search = kind.search();
    let later = search.later.len();
    for (flag, name) in cli.free.iter().map(|name| ("--free", name)).chain(cli.law.iter().map(|name| ("--law", name))) {
        let one = || start.named(name).map(|quantity| vec![quantity]);
        let group = start.groups().into_iter().find(|(own, _)| own == name).map(|(_, own)| own);
        let quantities = group.map_or_else(one, Ok).map_err(|message| anyhow!("{flag} {message}"))?;
        for quantity in quantities {
            is_searched(quantity, flag)?;
            if search.free.contains(&quantity) {
                continue;
            }
            // What something is expected of comes later.
            let list = if quantity.prior().is_some() { &mut search.later } else { &mut search.free };
            if !list.contains(&quantity) {
                list.push(quantity);
                start[quantity] = quantity.start();
            }
        }
    }
    if let (true, Some(last)) = (search.later.len() > later, search.stages.last_mut()) {
        // More numbers take longer to find.
        last.iterations = last.iterations.max(WITH_LATER);
    }
    for hold in &cli.hold {
        let parts = hold.split_once('=').and_then(|(name, value)| Some((name, value.parse().ok()?)));
        let (name, value) = parts.with_context(|| format!("--hold {hold:?}: it must be NAME=VALUE"))?;
        let quantity = start.set(name, value).map_err(|message| anyhow!("--hold {message}"))?;
        is_searched(quantity, "--hold")?;
        for list in [&mut search.free, &mut search.later] {
            list.retain(|quantity| quantity.to_string() != name);
        }
    }
    if search.free.is_empty() {
        // What an expectation holds is searched for from the start then.
        std::mem::swap(&mut search.free, &mut search.later);
    }
    if search.free.is_empty() {
        bail!("all parameters are held");
    }
    start.check().map_err(|message| anyhow!(message))?;
    Ok(search)
}

/// Refuses to hold or to free what follows from the other numbers.
fn is_searched<Q: Quantity>(quantity: Q, flag: &str) -> Result<()> {
    if quantity.is_averaged() {
        bail!("{flag} {quantity}: it is not searched for, but is where recordings have the marker in the mean");
    }
    Ok(())
}

type Identified<S> = (CableFile, <S as Specimen>::Numbers, Vec<Known<Of<S>>>);

/// Searches for the numbers.
fn identified<K: Kind>(
    cli: &Cli,
    kind: &K,
    train: &Set<K::Specimen>,
    mut start: <K::Specimen as Specimen>::Numbers,
    resolution: Resolution,
) -> Result<Identified<K::Specimen>> {
    let searched = K::SEARCH.min(resolution);
    let mut search = Search { steps: searched.steps, ..search(cli, kind, &mut start)? };
    let reading = reading(cli, None)?;
    let mut coarser: Option<Vec<K::Specimen>> = None;
    if searched == resolution {
        search.finer = 0;
    } else {
        let (_, [read, _]) = K::read([&cli.recordings, &[]], reading, searched.segments)?;
        coarser = Some(read.good.into_iter().map(|(_, specimen)| specimen).collect());
    }
    let began = Instant::now();
    let progress = Progress::new(search.iterations(), "iterations", cli.quiet)?;
    let mut done = 0;
    let mut watch = |now: &Iteration| {
        let go_on = progress.advance_by(now.done - done);
        done = now.done;
        go_on
    };
    let own = (train.specimens.as_slice(), resolution.steps);
    let fit = match &coarser {
        None => fit(&train.recordings, own.0, &start, &search, &mut watch)?,
        Some(coarser) => fit_finer(&train.recordings, coarser, own, &start, &search, &mut watch)?,
    };
    progress.finish();
    if fit.stopped {
        say!("stopped after {done} of {} iterations: these are the best parameters so far", search.iterations())?;
    }
    let known = known(&fit);
    let units = fit.normals.iter().flatten().count();
    if units <= fit.free.len() {
        say!("no intervals: {} parameters need more recordings than {units} for them", fit.free.len())?;
    }
    let mut file = CableFile::new(K::NAME, &search, [searched, resolution], reading);
    file.note(&known);
    file.free = fit.free.iter().map(ToString::to_string).collect();
    file.rods = train.recordings.first().map_or_else(Vec::new, |recording| kind.ways(recording));
    file.recordings = train.recordings.iter().map(|recording| recording.path.display().to_string()).collect();
    (file.stopped, file.seconds) = (fit.stopped, began.elapsed().as_secs_f64());
    say!("searched for {} s", significant(file.seconds, 2))?;
    // A search that was stopped has not looked at all recordings.
    if let (false, Some(without)) = (fit.stopped, without_each(&fit)) {
        let copies: Vec<_> = train.specimens.iter().zip(&without).collect();
        let predictions = predict_each(&copies, usize::MAX, resolution.steps)?;
        file.regions = Regions::of(&train.recordings, &free_markers(train), &predictions);
    }
    // What was searched for is kept, whatever becomes of the predictions.
    file.write(&cli.out.join("result.json"))?;
    Ok((file, fit.parameters, known))
}

/// The markers that are predicted of the recordings of a set.
fn free_markers<S: Specimen>(set: &Set<S>) -> Vec<usize> {
    set.specimens.first().map_or_else(Vec::new, Specimen::free)
}

/// Predicts a set.
fn predicted<K: Kind>(
    kind: &K,
    set: &Set<K::Specimen>,
    numbers: &<K::Specimen as Specimen>::Numbers,
    steps: usize,
) -> Result<Outcome> {
    let began = Instant::now();
    let predictions = predict(&set.specimens, numbers, usize::MAX, steps)?;
    let seconds = began.elapsed().as_secs_f64();
    let each = set.recordings.iter().zip(&predictions);
    let errors: Vec<_> = each.map(|(recording, prediction)| kind.errors(recording, prediction)).collect();
    let unsolved = predictions.iter().map(|prediction| prediction.unsolved).sum();
    Ok(Outcome { predictions, errors, unsolved, seconds })
}

/// What makes a result doubtful: parameters at their bounds, and steps that were not solved.
fn warnings<S: Specimen>(
    file: &CableFile,
    known: &[Known<Of<S>>],
    sets: &[Set<S>],
    outcomes: &[Outcome],
) -> Vec<String> {
    let is_free = |known: &&Known<Of<S>>| file.free.contains(&known.parameter.to_string());
    let at_bound = known.iter().filter(is_free).filter(|known| known.parameter.is_at_bound(known.value)).map(|known| {
        let [least, most] = known.parameter.bounds();
        format!(
            "{} ended at its bound, {} of {} to {} {}: the recordings do not determine it",
            known.parameter,
            significant(known.value, 3),
            significant(least, 3),
            significant(most, 3),
            known.parameter.unit()
        )
    });
    let unsolved = sets.iter().zip(outcomes).filter(|(_, outcome)| outcome.unsolved > 0).map(|(set, outcome)| {
        format!(
            "{} steps of the predictions of {} were not solved: their errors are doubtful",
            outcome.unsolved, set.name
        )
    });
    let stopped = file.stopped.then(|| "the search was stopped before its end".to_owned());
    stopped.into_iter().chain(at_bound).chain(unsolved).collect()
}

/// Tells how far off the predictions of a set are.
fn tell<K: Kind>(kind: &K, set: &Set<K::Specimen>, outcome: &Outcome, regions: Option<&Regions>) -> Result<()> {
    let Outcome { predictions, errors, unsolved, seconds } = outcome;
    let recorded: f64 = set.recordings.iter().filter_map(|recording| recording.time.last()).sum();
    let speed = significant(recorded / seconds, 2);
    let unsolved = if *unsolved > 0 { format!("; {unsolved} steps were not solved") } else { String::new() };
    say!("{}: {} recordings, predicted at {speed} times real time{unsolved}; errors [cm]:", set.name, errors.len())?;
    for (k, (name, _)) in errors.iter().flatten().take(errors[0].len()).enumerate() {
        let mut sorted: Vec<f64> = errors.iter().map(|own| own[k].1).filter(|error| !error.is_nan()).collect();
        sorted.sort_by(f64::total_cmp);
        if sorted.is_empty() {
            say!("  {name}: its marker was lost in all of them")?;
            continue;
        }
        let mean = sorted.iter().sum::<f64>() / sorted.len() as f64;
        let [mean, median, worst] =
            [mean, sorted[sorted.len() / 2], sorted[sorted.len() - 1]].map(|error| significant(100.0 * error, 3));
        say!("  {name}: mean {mean}, median {median}, worst {worst}")?;
    }
    for (name, error) in kind.errors_over_all(&set.recordings, predictions) {
        say!("  {name}: {}", significant(100.0 * error, 3))?;
    }
    if let Some(regions) = regions {
        let held = regions.held(&set.recordings, &free_markers(set), predictions);
        let [least, most] = [f64::min as fn(f64, f64) -> f64, f64::max]
            .map(|end| significant(100.0 * held.tenths.iter().copied().fold(held.all, end), 3));
        say!(
            "  {} % of the markers lie in their {} % regions; in tenths of the time {least} to {most} %",
            significant(100.0 * held.all, 3),
            100.0 * regions.coverage
        )?;
    }
    Ok(())
}

/// Writes what came of predictions.
#[expect(clippy::too_many_arguments)]
fn write<K: Kind>(
    cli: &Cli,
    kind: &K,
    sets: &[Set<K::Specimen>],
    outcomes: &[Outcome],
    mut file: CableFile,
    numbers: &<K::Specimen as Specimen>::Numbers,
    known: &[Known<Of<K::Specimen>>],
    Resolution { segments, steps }: Resolution,
) -> Result<ExitCode> {
    let mut conditions = Conditions::new("method", "newton, bdf2")
        .with("resolution", format!("--segments {segments}, {steps} steps a frame"));
    if file.stopped {
        conditions = conditions.with("search", "stopped before its end");
    }
    file.errors_m.clear();
    for (set, outcome) in sets.iter().zip(outcomes) {
        conditions = conditions.with(set.name, format!("{} recordings", set.recordings.len()));
        for (recording, errors) in set.recordings.iter().zip(&outcome.errors) {
            // Where all that an error is of was lost there is none.
            let errors: BTreeMap<String, f64> = errors.iter().filter(|(_, error)| error.is_finite()).cloned().collect();
            file.errors_m.insert(recording.path.display().to_string(), errors);
        }
    }
    file.write(&cli.out.join("result.json"))?;
    let free: Vec<Vec<usize>> = sets.iter().map(free_markers).collect();
    let shown: Vec<Shown<'_>> = sets
        .iter()
        .zip(outcomes)
        .zip(&free)
        .map(|((set, outcome), free)| Shown {
            predicted: Predicted {
                name: set.name,
                recordings: &set.recordings,
                free,
                predictions: &outcome.predictions,
            },
            errors: &outcome.errors,
            regions: regions_of(&file, set),
        })
        .collect();
    let page = page::write(&cli.out, &file.warnings, known, &shown, &conditions)?;
    // What is played and written as a scene is of the last set: that to predict, if there is one.
    if let (Some(set), Some(outcome)) = (sets.last(), outcomes.last()) {
        let mut order: Vec<usize> = (0..outcome.errors.len()).collect();
        let rank = |k: usize| outcome.errors[k].first().map_or(f64::NAN, |(_, error)| *error);
        order.sort_by(|&a, &b| rank(a).total_cmp(&rank(b)));
        let (median, worst) = (order[order.len() / 2], order[order.len() - 1]);
        for (name, k) in [("worst.html", worst), ("median.html", median)] {
            let recording = &set.recordings[k];
            play(&cli.out.join(name), recording, &kind.ways(recording), set.specimens[k].model(numbers)?, steps)?;
        }
        let name = set.recordings[median].name();
        let tables = cli.out.join("predictions");
        std::fs::create_dir_all(&tables).with_context(|| format!("cannot create {}", tables.display()))?;
        let mut names: BTreeMap<String, usize> = BTreeMap::new();
        for (recording, prediction) in set.recordings.iter().zip(&outcome.predictions) {
            // Files of different folders may have the same name.
            let times = names.entry(recording.name()).or_default();
            *times += 1;
            let name = if *times == 1 { recording.name() } else { format!("{}-{times}", recording.name()) };
            let path = tables.join(format!("{name}.csv"));
            table::write(&path, recording, &free_markers(set), prediction, regions_of(&file, set))?;
        }
        let scene = kind.scene(&cli.out.join("scene"), &set.specimens[median], &name, numbers, steps)?;
        say!("scene of {name}: {}", scene.display())?;
    }
    say!("page: {}", page.display())?;
    let stopped = file.stopped && cli.from.is_none();
    Ok(if stopped { ExitCode::from(terminal::INTERRUPTED) } else { ExitCode::SUCCESS })
}
