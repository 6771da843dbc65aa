//! `correction`: what a network adds to the prediction of a real cable. See `correction --help`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Result, anyhow, bail};
use clap::Parser;
use correction::correction::Correction;
use correction::film::{Film, Guess};
use correction::inputs::Kind;
use correction::network::Shape;
use correction::training::{Plan, train};
use identify::cable::Cable;
use identify::metric::mean_error;
use identify::predict::predict;
use identify::recording::{Reading, Recording, files, read_all};
use identify::result::CableFile;
use report::significant;
use terminal::{INTERRUPTED, Progress, complain, positive, say, threads};

/// Exit code of bad input.
const BAD_INPUT: u8 = 2;

/// Learns what to add to the prediction of a cable that `identify` has identified, from the recordings it was identified on.
#[derive(Parser)]
#[command(version)]
struct Cli {
    /// The result.json of an identification.
    result: PathBuf,
    /// Recordings to predict: of them the first two frames and the grips are used, nothing else.
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
    kind: Kind,
    /// What is corrected: physics, or blend, which leaves the simulation out, to compare.
    #[arg(long, default_value = "physics")]
    guess: Guess,
    /// Width of all layers; the usual one of the kind unless given.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    width: Option<u16>,
    /// GN blocks of a graph network.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=16))]
    blocks: Option<u16>,
    /// Networks whose mean counts; each keeps another seventh of the recordings aside, to choose its epoch.
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

/// Recordings beside their guesses.
fn films(cli: &Cli, places: &[PathBuf], cable: &CableFile, guess: Guess) -> Result<Vec<(Recording, Film)>> {
    let (recordings, faults) = read_all(&files(places)?, Reading { rate: cli.rate, unit: cli.unit_m });
    faults.iter().for_each(|fault| complain(format_args!("{fault}")));
    if recordings.is_empty() {
        bail!("none of the recordings is of use");
    }
    let parameters = cable.parameters().map_err(|message| anyhow!(message))?;
    let predictions = match guess {
        Guess::Blend => None,
        Guess::Physics => {
            let cables = recordings.iter().map(|recording| Cable::new(recording, cable.segments));
            Some(predict(&cables.collect::<Result<Vec<_>, _>>()?, &parameters, usize::MAX, cable.steps)?)
        }
    };
    let film = |(k, recording): (usize, Recording)| {
        let film = match &predictions {
            None => Film::blended(&recording),
            Some(predictions) => Film::simulated(&recording, &predictions[k]),
        };
        (recording, film)
    };
    Ok(recordings.into_iter().enumerate().map(film).collect())
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
    let films = films(cli, &places, cable, cli.guess)?;
    let markers = films[0].0.count();
    if let Some((other, _)) = films.iter().find(|(recording, _)| recording.count() != markers) {
        bail!("{}: {} markers, but the first recording has {markers}", other.path.display(), other.count());
    }
    let usual = Shape::of(cli.kind);
    let shape = Shape {
        width: cli.width.map_or(usual.width, usize::from),
        blocks: cli.blocks.filter(|_| cli.kind == Kind::Graph).map_or(usual.blocks, usize::from),
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
    let mut errors = Vec::new();
    for (recording, film) in &films {
        let guess = mean_error(recording, &film.uncorrected());
        errors.push([guess, mean_error(recording, &film.corrected(&correction.add(film)))]);
    }
    let recorded: f64 = films.iter().filter_map(|(recording, _)| recording.time.last()).sum();
    let speed = significant(recorded / began.elapsed().as_secs_f64(), 2);
    let mean = |k: usize| 100.0 * errors.iter().map(|error| error[k]).sum::<f64>() / errors.len() as f64;
    let [guess, corrected] = [0, 1].map(|k| significant(mean(k), 3));
    let name = correction.guess;
    say!(
        "eval: {} recordings, error of a coordinate [cm]: {name} {guess}, corrected {corrected}; corrections at {speed} times real time",
        errors.len()
    )?;
    Ok(())
}
