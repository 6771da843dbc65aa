//! `correction`: what a network adds to the prediction of a real cable. See `correction --help`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Result, anyhow, bail};
use clap::Parser;
use correction::applicability::{Applicability, GAIN, Worth};
use correction::correction::Correction;
use correction::film::{Film, Guess, Markers};
use correction::inputs;
use correction::network::Shape;
use correction::noodle;
use correction::training::{ASIDE, Plan, train};
use identify::branched::Tree;
use identify::cable::Cable;
use identify::kind::{Clamped, Kind, Plain, Read};
use identify::metric::mean_error;
use identify::noodle::Noodle;
use identify::predict::{Prediction, predict};
use identify::recording::{ALIKE, Reading, Recording};
use identify::result::CableFile;
use report::significant;
use terminal::{INTERRUPTED, Progress, complain, positive, say, threads, warn};

/// Exit code of bad input.
const BAD_INPUT: u8 = 2;

/// Learns what to add to the prediction of a cable, with branches or without, or of a noodle that `identify` has identified, from the
/// recordings it was identified on.
#[derive(Parser)]
#[command(version)]
struct Cli {
    /// The result.json of an identification.
    result: PathBuf,
    /// Recordings to predict: of them the first two frames and the grips, or the way of the clamp, are used, nothing else.
    #[arg(long, num_args = 1..)]
    eval: Vec<PathBuf>,
    /// Takes a correction from a file instead of training one.
    #[arg(long, value_name = "FILE")]
    from: Option<PathBuf>,
    /// The file to write.
    #[arg(long, default_value = "out/correction.toml")]
    out: PathBuf,
    /// The network: graph, perceptron or recurrent.
    #[arg(long, default_value = "perceptron")]
    kind: inputs::Kind,
    /// What is corrected: physics, or blend, which leaves the simulation out, to compare.
    #[arg(long, default_value = "physics")]
    guess: Guess,
    /// Width of all layers; the usual one of the kind unless given.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    width: Option<u16>,
    /// GN blocks of a graph network.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=16))]
    blocks: Option<u16>,
    /// Networks whose mean counts; each keeps another seventh of the recordings aside, of a noodle of each recording, to choose its epoch.
    #[arg(long, default_value = "3", value_parser = clap::value_parser!(u16).range(1..=16))]
    members: u16,
    /// Times that the recordings are gone through; as usual for the kind unless given.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    epochs: Option<u16>,
    /// Seed of weights and order.
    #[arg(long, default_value = "1")]
    seed: u64,
    /// Adds the correction to all motions, also to those that it is not expected to apply to.
    #[arg(long)]
    all_motions: bool,
    /// Frames a second of files that do not say it; those of the identification unless given.
    #[arg(long, value_parser = positive)]
    rate: Option<f64>,
    /// Unit of length of the files [m], 0.001 for millimetres; that of the identification unless given.
    #[arg(long, value_parser = positive)]
    unit_m: Option<f64>,
    /// Threads; the result is the same on any number.
    #[arg(long, value_parser = threads)]
    threads: Option<usize>,
    /// No progress.
    #[arg(long)]
    quiet: bool,
}

fn main() -> ExitCode {
    match run(&Cli::parse()) {
        Ok(code) => code,
        Err(error) => {
            complain(format_args!("{error:#}"));
            ExitCode::from(BAD_INPUT)
        }
    }
}

/// Recordings of a kind of rod, each with what is known of it.
fn read<K: Kind>(cli: &Cli, places: &[PathBuf], rod: &CableFile) -> Result<(K, Read<K::Specimen>)> {
    let known = rod.reading().map_err(|message| anyhow!("the result: {message}"))?;
    let reading = Reading { rate: cli.rate.unwrap_or(known.rate), unit: cli.unit_m.unwrap_or(known.unit), ..known };
    let (kind, [read, _]) = K::read([places, &[]], reading, rod.segments)?;
    read.bad.iter().for_each(|fault| complain(format_args!("{fault}")));
    if read.good.is_empty() {
        bail!("none of the recordings is of use");
    }
    Ok((kind, read))
}

/// A recording with what is known of it and its simulation.
type Simulated<S> = (Recording, S, Prediction);

/// Recordings with what is known of each and its simulation.
fn simulated<K: Kind>(cli: &Cli, places: &[PathBuf], rod: &CableFile) -> Result<(K, Vec<Simulated<K::Specimen>>)> {
    let (kind, read) = read::<K>(cli, places, rod)?;
    let (recordings, specimens): (Vec<_>, Vec<_>) = read.good.into_iter().unzip();
    let rods = recordings.first().map(|recording| kind.ways(recording));
    if rod.rods.len() > 1 && rods.is_some_and(|rods| rods != rod.rods) {
        bail!("{}: it is of a {} with other branches than these recordings'", cli.result.display(), rod.kind);
    }
    let numbers = rod.numbers(kind.start(&specimens)).map_err(|message| anyhow!(message))?;
    let predictions = predict(&specimens, &numbers, usize::MAX, rod.steps)?;
    let unsolved: usize = predictions.iter().map(|prediction| prediction.unsolved).sum();
    if unsolved > 0 {
        warn(format_args!("{unsolved} steps of the predictions were not solved: their errors are doubtful"));
    }
    let each = recordings.into_iter().zip(specimens).zip(predictions);
    Ok((kind, each.map(|((recording, specimen), prediction)| (recording, specimen, prediction)).collect()))
}

/// Recordings beside their guesses, and how errors of predictions are told.
fn films(cli: &Cli, places: &[PathBuf], rod: &CableFile, guess: Guess) -> Result<(Vec<(Recording, Film)>, Metric)> {
    match rod.kind.as_str() {
        Plain::NAME if guess == Guess::Blend => {
            let film = |(recording, _): (Recording, Cable)| {
                let film = Film::blended(&recording);
                (recording, film)
            };
            Ok((read::<Plain>(cli, places, rod)?.1.good.into_iter().map(film).collect(), Metric::Cable))
        }
        Plain::NAME => {
            let film = |(recording, _, prediction): (Recording, Cable, Prediction)| {
                let film = Film::simulated(&recording, &prediction);
                (recording, film)
            };
            Ok((simulated::<Plain>(cli, places, rod)?.1.into_iter().map(film).collect(), Metric::Cable))
        }
        Tree::NAME if guess == Guess::Physics => {
            let (tree, simulated) = simulated::<Tree>(cli, places, rod)?;
            let film = |(recording, _, prediction): (Recording, _, Prediction)| {
                let film = Film::with(&recording, Markers::of_tree(&tree), &prediction);
                (recording, film)
            };
            Ok((simulated.into_iter().map(film).collect(), Metric::Branched(tree)))
        }
        Clamped::NAME if guess == Guess::Physics => {
            let film = |(recording, noodle, prediction): (Recording, Noodle, Prediction)| {
                let recording = noodle::held(&recording, &noodle);
                let film = Film::simulated(&recording, &prediction);
                (recording, film)
            };
            Ok((simulated::<Clamped>(cli, places, rod)?.1.into_iter().map(film).collect(), Metric::Noodle))
        }
        kind => bail!("{}: a {kind} has no correction of {guess}", cli.result.display()),
    }
}

/// How errors of predictions are told.
enum Metric {
    Cable,
    Branched(Tree),
    Noodle,
}

impl Metric {
    /// Errors over recordings by their names [m]: means, and what is none.
    fn errors(&self, recordings: &[Recording], predictions: &[Prediction]) -> Vec<(String, f64)> {
        let each = |(recording, prediction): (&Recording, &Prediction)| match self {
            Self::Cable => vec![("a coordinate".to_owned(), mean_error(recording, prediction))],
            Self::Branched(tree) => tree.errors(recording, prediction),
            Self::Noodle => noodle::errors(recording, prediction),
        };
        let all: Vec<Vec<(String, f64)>> = recordings.iter().zip(predictions).map(each).collect();
        let mean = |k: usize| {
            // Where all that an error is of was lost there is none.
            let known: Vec<f64> = all.iter().map(|errors| errors[k].1).filter(|error| !error.is_nan()).collect();
            known.iter().sum::<f64>() / known.len() as f64
        };
        let names = all.first().into_iter().flatten().map(|(name, _)| name.clone());
        let mut sums: Vec<(String, f64)> = names.enumerate().map(|(k, name)| (name, mean(k))).collect();
        if let Self::Branched(tree) = self {
            sums.extend(tree.errors_over_all(recordings, predictions));
        }
        sums
    }
}

fn run(cli: &Cli) -> Result<ExitCode> {
    if let Some(count) = cli.threads {
        rayon::ThreadPoolBuilder::new().num_threads(count).build_global()?;
    }
    let cable = CableFile::read(&cli.result).map_err(|message| anyhow!(message))?;
    let (correction, stopped) = match &cli.from {
        Some(path) => (Correction::read(path).map_err(|message| anyhow!(message))?, false),
        None => trained(cli, &cable)?,
    };
    if !cli.eval.is_empty() {
        evaluate(cli, &cable, &correction)?;
    }
    Ok(if stopped { ExitCode::from(INTERRUPTED) } else { ExitCode::SUCCESS })
}

fn trained(cli: &Cli, cable: &CableFile) -> Result<(Correction, bool)> {
    let places: Vec<PathBuf> = cable.recordings.iter().map(PathBuf::from).collect();
    let (mut films, metric) = films(cli, &places, cable, cli.guess)?;
    if cli.kind == inputs::Kind::Graph && matches!(metric, Metric::Branched(_)) {
        bail!("--kind graph: a cable with branches has a correction by a perceptron or a recurrent network alone");
    }
    if cable.kind == Clamped::NAME {
        // Its recordings are few, and long.
        films = films.iter().flat_map(|(recording, film)| film.parts(recording, ASIDE)).collect();
    }
    let markers = films[0].0.count();
    if let Some((other, _)) = films.iter().find(|(recording, _)| recording.count() != markers) {
        bail!("{}: {} markers, but the first recording has {markers}", other.path.display(), other.count());
    }
    let interval = films[0].1.interval();
    if let Some((other, film)) = films.iter().find(|(_, film)| (film.interval() / interval - 1.0).abs() > ALIKE) {
        let (path, own) = (other.path.display(), film.interval());
        bail!(
            "{path}: {own} s from frame to frame, but the first recording has {interval} s: sample all of them alike"
        );
    }
    let usual = Shape::of(cli.kind);
    let shape = Shape {
        width: cli.width.map_or(usual.width, usize::from),
        blocks: cli.blocks.filter(|_| cli.kind == inputs::Kind::Graph).map_or(usual.blocks, usize::from),
        ..usual
    };
    let plan = Plan {
        guess: cli.guess,
        kind: cli.kind,
        shape,
        members: cli.members.into(),
        epochs: cli.epochs.map_or(cli.kind.epochs(), usize::from),
        seed: cli.seed,
    };
    let progress = Progress::new(plan.all_epochs(), "epochs", cli.quiet)?;
    let began = Instant::now();
    let found =
        train(&films, &plan, &mut |_| progress.advance()).ok_or_else(|| anyhow!("there is nothing to learn"))?;
    progress.finish();
    for (member, [guess, corrected]) in found.aside.iter().enumerate() {
        let [guess, corrected] = [guess, corrected].map(|error| significant(100.0 * error, 3));
        say!("network {member}: error of a coordinate of what it kept aside [cm]: {guess}, corrected {corrected}")?;
    }
    let Applicability { like_m, like_gain, other_gain, .. } = &found.correction.applicability;
    let percent = |gain: f64| significant(100.0 * gain, 2);
    match like_gain {
        None => say!(
            "what it takes of the error is not known, and so it applies to nothing: there was one recording to learn from"
        )?,
        Some(gain) => say!(
            "of motions like those in training it takes {} % of the error{}; like: ways of grips within {} cm",
            percent(*gain),
            if *gain > 0.0 { "" } else { ", and so it applies to none" },
            percent(*like_m)
        )?,
    }
    match other_gain {
        None => say!("what it takes of others is not known: training had too few kinds of motion")?,
        Some(gain) => say!(
            "of motions of other kinds it takes {} %{}",
            percent(*gain),
            if *gain < GAIN { ": it does not apply to them" } else { "" }
        )?,
    }
    let (seconds, bound) =
        (significant(began.elapsed().as_secs_f64(), 2), significant(100.0 * found.correction.bound, 2));
    say!("trained in {seconds} s; a coordinate is corrected by {bound} cm at most")?;
    if let Some(folder) = cli.out.parent().filter(|folder| *folder != Path::new("")) {
        std::fs::create_dir_all(folder).map_err(|error| anyhow!("--out: {}: {error}", folder.display()))?;
    }
    found.correction.write(&cli.out)?;
    say!("correction: {}", cli.out.display())?;
    Ok((found.correction, found.stopped))
}

fn evaluate(cli: &Cli, cable: &CableFile, correction: &Correction) -> Result<()> {
    let (films, metric) = films(cli, &cli.eval, cable, correction.guess)?;
    for (recording, film) in &films {
        correction.check(film).map_err(|message| anyhow!("{}: {message}", recording.path.display()))?;
    }
    let began = Instant::now();
    let all: Vec<&Film> = films.iter().map(|(_, film)| film).collect();
    let worths = correction.worths(&all);
    let corrected: Vec<Prediction> = match cli.all_motions {
        true => all.iter().map(|film| film.corrected(&correction.add(film))).collect(),
        false => correction.predictions(&all),
    };
    let recorded: f64 = films.iter().filter_map(|(recording, _)| recording.time.last()).sum();
    let speed = significant(recorded / began.elapsed().as_secs_f64(), 2);
    let uncorrected: Vec<Prediction> = films.iter().map(|(_, film)| film.uncorrected()).collect();
    let recordings: Vec<Recording> = films.iter().map(|(recording, _)| recording.clone()).collect();
    warn_of_others(cli, &films, &worths, &correction.applicability);
    say!("eval: {} recordings, corrected at {speed} times real time; errors [cm]:", films.len())?;
    let name = correction.guess;
    let [before, after] = [&uncorrected, &corrected].map(|predictions| metric.errors(&recordings, predictions));
    for ((what, before), (_, after)) in before.iter().zip(&after) {
        let [before, after] = [before, after].map(|error| significant(100.0 * error, 3));
        say!("  {what}: {name} {before}, corrected {after}")?;
    }
    Ok(())
}

/// Warns of motions to which a correction does not apply.
fn warn_of_others(cli: &Cli, films: &[(Recording, Film)], worth: &[Worth], applicability: &Applicability) {
    let others = films.iter().zip(worth).filter(|(_, worth)| !worth.applies);
    let is_far = worth.iter().any(|worth| !worth.applies && !worth.is_like);
    let cm = |metres: f64| significant(100.0 * metres, 2);
    let names: Vec<String> =
        others.map(|((recording, _), worth)| format!("{} ({} cm)", recording.name(), cm(worth.distance))).collect();
    if names.is_empty() {
        return;
    }
    let gain = match applicability.other_gain {
        _ if !is_far => "it took nothing of the error of recordings that it did not learn from".to_owned(),
        Some(gain) => format!("it is expected to take {} % of the error", significant(100.0 * gain, 2)),
        None => "what it takes of the error is not known".to_owned(),
    };
    warn(format_args!(
        "the correction does not apply to {} of {} recordings and is {}: {gain}{}: {}",
        names.len(),
        films.len(),
        if cli.all_motions { "added all the same" } else { "left out" },
        if is_far {
            let middle = |mut distances: Vec<f64>| {
                distances.sort_by(f64::total_cmp);
                cm(distances.get(distances.len() / 2).copied().unwrap_or(f64::NAN))
            };
            format!(
                ", as the ways of the grips are farther from the nearest in training, {} cm in the middle, than those from each other ({} cm, at most {} cm)",
                middle(worth.iter().map(|worth| worth.distance).collect()),
                middle(applicability.distances()),
                cm(applicability.like_m)
            )
        } else {
            String::new()
        },
        names.join(", ")
    ));
}
