//! `correction`: what a network adds to the prediction of a real cable. See `correction --help`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Result, anyhow, bail};
use clap::Parser;
use correction::correction::Correction;
use correction::film::{Film, Guess};
use correction::inputs;
use correction::network::Shape;
use correction::noodle;
use correction::training::{ASIDE, Plan, train};
use identify::cable::Cable;
use identify::kind::{Clamped, Kind, Plain, Read};
use identify::metric::mean_error;
use identify::noodle::Noodle;
use identify::predict::{Prediction, predict};
use identify::recording::{Grips, Reading, Recording};
use identify::result::CableFile;
use report::significant;
use terminal::{INTERRUPTED, Progress, complain, positive, say, threads};

/// Exit code of bad input.
const BAD_INPUT: u8 = 2;

/// Learns what to add to the prediction of a cable or a noodle that `identify` has identified, from the recordings it was identified on.
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
    /// Frames a second of files that do not say it.
    #[arg(long, default_value = "100", value_parser = positive)]
    rate: f64,
    /// Unit of length of the files [m]: 0.001 for millimetres.
    #[arg(long, default_value = "1", value_parser = positive)]
    unit_m: f64,
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
    let grips = rod.grips.parse::<Grips>();
    let grips = grips.map_err(|message| anyhow!("the result: grips: {message}"))?;
    let reading = Reading { rate: cli.rate, unit: cli.unit_m, grips };
    let (kind, [read, _]) = K::read([places, &[]], reading, rod.segments)?;
    read.bad.iter().for_each(|fault| complain(format_args!("{fault}")));
    if read.good.is_empty() {
        bail!("none of the recordings is of use");
    }
    Ok((kind, read))
}

/// Recordings with what is known of each and its simulation.
fn simulated<K: Kind>(
    cli: &Cli,
    places: &[PathBuf],
    rod: &CableFile,
) -> Result<Vec<(Recording, K::Specimen, Prediction)>> {
    let (kind, read) = read::<K>(cli, places, rod)?;
    let (recordings, specimens): (Vec<_>, Vec<_>) = read.good.into_iter().unzip();
    let numbers = rod.numbers(kind.start(&specimens)).map_err(|message| anyhow!(message))?;
    let predictions = predict(&specimens, &numbers, usize::MAX, rod.steps)?;
    let each = recordings.into_iter().zip(specimens).zip(predictions);
    Ok(each.map(|((recording, specimen), prediction)| (recording, specimen, prediction)).collect())
}

/// Recordings beside their guesses.
fn films(cli: &Cli, places: &[PathBuf], rod: &CableFile, guess: Guess) -> Result<Vec<(Recording, Film)>> {
    match rod.kind.as_str() {
        Plain::NAME if guess == Guess::Blend => {
            let film = |(recording, _): (Recording, Cable)| {
                let film = Film::blended(&recording);
                (recording, film)
            };
            Ok(read::<Plain>(cli, places, rod)?.1.good.into_iter().map(film).collect())
        }
        Plain::NAME => {
            let film = |(recording, _, prediction): (Recording, Cable, Prediction)| {
                let film = Film::simulated(&recording, &prediction);
                (recording, film)
            };
            Ok(simulated::<Plain>(cli, places, rod)?.into_iter().map(film).collect())
        }
        Clamped::NAME if guess == Guess::Physics => {
            let film = |(recording, noodle, prediction): (Recording, Noodle, Prediction)| {
                let recording = noodle::held(&recording, &noodle);
                let film = Film::simulated(&recording, &prediction);
                (recording, film)
            };
            Ok(simulated::<Clamped>(cli, places, rod)?.into_iter().map(film).collect())
        }
        kind => bail!("{}: a {kind} has no correction of {guess}", cli.result.display()),
    }
}

/// Errors of a prediction by their names [m].
fn errors(rod: &CableFile, recording: &Recording, prediction: &Prediction) -> Vec<(String, f64)> {
    match rod.kind.as_str() {
        Clamped::NAME => noodle::errors(recording, prediction),
        _ => vec![("a coordinate".to_owned(), mean_error(recording, prediction))],
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
    let mut films = films(cli, &places, cable, cli.guess)?;
    if cable.kind == Clamped::NAME {
        // Its recordings are few, and long.
        films = films.iter().flat_map(|(recording, film)| film.parts(recording, ASIDE)).collect();
    }
    let markers = films[0].0.count();
    if let Some((other, _)) = films.iter().find(|(recording, _)| recording.count() != markers) {
        bail!("{}: {} markers, but the first recording has {markers}", other.path.display(), other.count());
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
    let progress = Progress::new(plan.members * plan.epochs, "epochs", cli.quiet)?;
    let began = Instant::now();
    let found =
        train(&films, &plan, &mut |_| progress.advance()).ok_or_else(|| anyhow!("there is nothing to learn"))?;
    progress.finish();
    for (member, [guess, corrected]) in found.aside.iter().enumerate() {
        let [guess, corrected] = [guess, corrected].map(|error| significant(100.0 * error, 3));
        say!("network {member}: error of a coordinate of what it kept aside [cm]: {guess}, corrected {corrected}")?;
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
    let films = films(cli, &cli.eval, cable, correction.guess)?;
    if let Some((other, _)) = films.iter().find(|(recording, _)| recording.count() != correction.reader.markers) {
        let (path, found, asked) = (other.path.display(), other.count(), correction.reader.markers);
        bail!("{path}: {found} markers, but the correction is of a cable with {asked}");
    }
    let began = Instant::now();
    let corrected: Vec<Prediction> = films.iter().map(|(_, film)| film.corrected(&correction.add(film))).collect();
    let recorded: f64 = films.iter().filter_map(|(recording, _)| recording.time.last()).sum();
    let speed = significant(recorded / began.elapsed().as_secs_f64(), 2);
    let of = |own: &Prediction, recording: &Recording| errors(cable, recording, own);
    let before: Vec<_> = films.iter().map(|(recording, film)| of(&film.uncorrected(), recording)).collect();
    let after: Vec<_> = films.iter().zip(&corrected).map(|((recording, _), own)| of(own, recording)).collect();
    say!("eval: {} recordings, corrected at {speed} times real time; errors [cm]:", films.len())?;
    let name = correction.guess;
    for (k, (what, _)) in before.iter().flatten().take(before[0].len()).enumerate() {
        let mean = |errors: &[Vec<(String, f64)>]| {
            significant(100.0 * errors.iter().map(|own| own[k].1).sum::<f64>() / errors.len() as f64, 3)
        };
        say!("  {what}: {name} {}, corrected {}", mean(&before), mean(&after))?;
    }
    Ok(())
}
