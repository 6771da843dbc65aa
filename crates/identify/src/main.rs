//! `identify`: from recordings of a cable to its numbers. See `identify --help`.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};
use clap::{Parser, Subcommand};
use identify::cable::{Cable, Resolution};
use identify::confidence::{Known, known};
use identify::fit::{Search, fit};
use identify::noodle;
use identify::page::{self, Predicted};
use identify::parameter::{Parameter, Parameters};
use identify::playback::play;
use identify::predict::{Prediction, predict};
use identify::recording::{Reading, Recording, files, read_all};
use identify::result::{CableFile, values};
use identify::scene;
use report::{Conditions, significant};
use terminal::{Progress, complain, positive, say, threads};

mod branched_command;
mod hanging_command;
mod noodle_command;

/// Exit code of bad input.
const BAD_INPUT: u8 = 2;

/// Identifies a cable between two grips from recordings of markers along it, and predicts further recordings. It may have branches;
/// or one clamp holds it, whose pose is recorded.
#[derive(Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    /// Recordings to identify the cable on: files, or folders of files that end in .pkl or .csv.
    recordings: Vec<PathBuf>,
    /// Recordings to predict with what was found: of them the first two frames and the grips are used, nothing else.
    #[arg(long, num_args = 1..)]
    eval: Vec<PathBuf>,
    /// Takes the parameters from the result.json of another identification instead of searching for them.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["hold", "free"])]
    from: Option<PathBuf>,
    /// The folder to write to.
    #[arg(long, default_value = "out/identify")]
    out: PathBuf,
    /// Segments between two markers; of a noodle, segments in all.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=100))]
    segments: Option<u16>,
    /// Steps from frame to frame.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1000))]
    steps: Option<u16>,
    /// Frames a second of files that do not say it.
    #[arg(long, default_value = "100", value_parser = positive)]
    rate: f64,
    /// Unit of length of the files [m]: 0.001 for millimetres.
    #[arg(long, default_value = "1", value_parser = positive)]
    unit_m: f64,
    /// Holds a parameter at a value, as in twist=0.7, instead of searching for it.
    #[arg(long, value_name = "NAME=VALUE")]
    hold: Vec<String>,
    /// Searches for a further parameter: drag-across, drag-along.
    #[arg(long, value_name = "NAME")]
    free: Vec<Parameter>,
    /// Threads; the result is the same on any number.
    #[arg(long, value_parser = threads)]
    threads: Option<usize>,
    /// No progress.
    #[arg(long)]
    quiet: bool,
}

#[derive(Subcommand)]
enum Command {
    Hanging(hanging_command::Hanging),
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

/// Recordings with their cables.
struct Set {
    name: &'static str,
    recordings: Vec<Recording>,
    cables: Vec<Cable>,
}

impl Set {
    fn read(name: &'static str, places: &[PathBuf], reading: Reading, segments: usize) -> Result<Self> {
        let (read, faults) = read_all(&files(places)?, reading);
        for fault in &faults {
            complain(format_args!("{fault}"));
        }
        let (mut recordings, mut cables) = (Vec::new(), Vec::new());
        for recording in read {
            match Cable::new(&recording, segments) {
                Ok(cable) => {
                    cables.push(cable);
                    recordings.push(recording);
                }
                Err(error) => complain(format_args!("{}: {error}", recording.path.display())),
            }
        }
        if recordings.is_empty() {
            bail!("none of the recordings to {} is of use", if name == "train" { "identify" } else { "predict" });
        }
        Ok(Self { name, recordings, cables })
    }

    fn predicted<'a>(&'a self, predictions: &'a [Prediction]) -> Predicted<'a> {
        Predicted { name: self.name, recordings: &self.recordings, predictions }
    }
}

fn run(cli: &Cli) -> Result<ExitCode> {
    if let Some(Command::Hanging(hanging)) = &cli.command {
        return hanging.run().map(|()| ExitCode::SUCCESS);
    }
    if let Some(count) = cli.threads {
        rayon::ThreadPoolBuilder::new().num_threads(count).build_global()?;
    }
    if let Some(train) = noodle_command::noodles(&cli.recordings)? {
        let unknown = [
            (cli.from.is_some(), "--from"),
            (cli.steps.is_some(), "--steps"),
            (cli.unit_m.to_bits() != 1f64.to_bits(), "--unit-m"),
            (!cli.hold.is_empty(), "--hold"),
            (!cli.free.is_empty(), "--free"),
        ];
        if let Some((_, option)) = unknown.iter().find(|(is_given, _)| *is_given) {
            bail!("{option}: not for recordings of a noodle");
        }
        let eval = match cli.eval[..] {
            [] => Vec::new(),
            _ => noodle_command::noodles(&cli.eval)?.context("--eval: there must be recordings of a noodle")?,
        };
        let usual = noodle::Resolution::default();
        let resolution = noodle::Resolution { segments: cli.segments.map_or(usual.segments, usize::from), ..usual };
        let stopped = noodle_command::run(&train, &eval, resolution, &cli.out, cli.quiet)?;
        return Ok(if stopped { ExitCode::from(terminal::INTERRUPTED) } else { ExitCode::SUCCESS });
    }
    let all: Vec<PathBuf> = cli.recordings.iter().chain(&cli.eval).cloned().collect();
    if branched_command::are_branched(&all)? {
        if !(cli.hold.is_empty() && cli.free.is_empty()) {
            bail!("--hold and --free: not for recordings of a cable with branches");
        }
        let reading = Reading { rate: cli.rate, unit: cli.unit_m };
        let (from, finely) = (cli.from.as_deref(), [cli.segments, cli.steps]);
        let stopped = branched_command::run([&cli.recordings, &cli.eval], from, reading, finely, &cli.out, cli.quiet)?;
        return Ok(if stopped { ExitCode::from(terminal::INTERRUPTED) } else { ExitCode::SUCCESS });
    }
    let earlier = cli.from.as_deref().map(CableFile::read).transpose().map_err(|message| anyhow!(message))?;
    let usual = earlier.as_ref().map_or(Resolution::default(), CableFile::resolution);
    let resolution = Resolution {
        segments: cli.segments.map_or(usual.segments, usize::from),
        steps: cli.steps.map_or(usual.steps, usize::from),
    };
    let reading = Reading { rate: cli.rate, unit: cli.unit_m };
    let read = |name, places: &[PathBuf]| match places {
        [] => Ok(None),
        places => Set::read(name, places, reading, resolution.segments).map(Some),
    };
    let (train, eval) = (read("train", &cli.recordings)?, read("eval", &cli.eval)?);
    std::fs::create_dir_all(&cli.out).with_context(|| format!("--out: cannot create {}", cli.out.display()))?;
    let (file, parameters, known) = match (earlier, &train) {
        (Some(file), _) => {
            let parameters = file.parameters().map_err(|message| anyhow!(message))?;
            let known = file.known();
            (file, parameters, known)
        }
        (None, Some(train)) => identified(cli, train, resolution)?,
        (None, None) => {
            bail!("there are no recordings to identify a cable on; --from FILE predicts with one that is known")
        }
    };
    say!("{}", page::lines(&known))?;
    let sets: Vec<&Set> = train.iter().chain(&eval).collect();
    write(cli, &sets, file, &parameters, &known, resolution)
}

/// Searches for the parameters.
fn identified(cli: &Cli, train: &Set, resolution: Resolution) -> Result<(CableFile, Parameters, Vec<Known>)> {
    let mut start = Parameters::default();
    let mut search = Search { steps: resolution.steps, ..Search::default() };
    for &parameter in &cli.free {
        if !search.free.contains(&parameter) {
            search.free.push(parameter);
            start[parameter] = parameter.start();
        }
    }
    for hold in &cli.hold {
        let parts = hold.split_once('=').and_then(|(name, value)| Some((name, value.parse().ok()?)));
        let (name, value) = parts.with_context(|| format!("--hold {hold:?}: it must be NAME=VALUE"))?;
        start.set(name, value).map_err(|message| anyhow!("--hold {message}"))?;
        search.free.retain(|parameter| parameter.name() != name);
    }
    if search.free.is_empty() {
        bail!("all parameters are held");
    }
    let began = Instant::now();
    let before: Vec<usize> = (0..=search.stages.len())
        .map(|stage| search.stages[..stage].iter().map(|stage| stage.iterations).sum())
        .collect();
    let progress = Progress::new(before[search.stages.len()], "iterations", cli.quiet)?;
    let mut done = 0;
    let fit = fit(&train.recordings, &train.cables, &start, &search, &mut |now| {
        let reached = before[now.stage] + now.iteration;
        let go_on = progress.advance_by(reached - done);
        done = reached;
        go_on
    })?;
    progress.finish();
    if fit.stopped {
        say!(
            "stopped after {done} of {} iterations: these are the best parameters so far",
            before[search.stages.len()]
        )?;
    }
    let known = known(&fit);
    if train.recordings.len() <= fit.free.len() {
        say!(
            "no intervals: {} parameters need more recordings than {} for them",
            fit.free.len(),
            train.recordings.len()
        )?;
    }
    let file = CableFile {
        parameters: values(&known),
        segments: resolution.segments,
        steps: resolution.steps,
        huber_m: search.huber,
        stages: search.stages,
        recordings: train.recordings.iter().map(|recording| recording.path.display().to_string()).collect(),
        stopped: fit.stopped,
        seconds: began.elapsed().as_secs_f64(),
        errors_m: Default::default(),
    };
    // What was searched for is kept, whatever becomes of the predictions.
    file.write(&cli.out.join("result.json"))?;
    Ok((file, fit.parameters, known))
}

/// Predicts all sets, and writes what came of it.
fn write(
    cli: &Cli,
    sets: &[&Set],
    mut file: CableFile,
    parameters: &Parameters,
    known: &[Known],
    Resolution { segments, steps }: Resolution,
) -> Result<ExitCode> {
    let mut conditions = Conditions::new("method", "newton, bdf2")
        .with("resolution", format!("{segments} segments between markers, {steps} steps a frame"));
    if file.stopped {
        conditions = conditions.with("search", "stopped before its end");
    }
    let mut all = Vec::new();
    file.errors_m.clear();
    for set in sets {
        let began = Instant::now();
        let predictions = predict(&set.cables, parameters, usize::MAX, steps)?;
        let seconds = began.elapsed().as_secs_f64();
        let recorded: f64 = set.recordings.iter().filter_map(|recording| recording.time.last()).sum();
        let errors = set.predicted(&predictions).errors();
        let mut sorted = errors.clone();
        sorted.sort_by(f64::total_cmp);
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let unsolved: usize = predictions.iter().map(|prediction| prediction.unsolved).sum();
        let [mean, median, worst] =
            [mean, sorted[sorted.len() / 2], sorted[sorted.len() - 1]].map(|error| significant(100.0 * error, 3));
        let speed = significant(recorded / seconds, 2);
        say!(
            "{}: {} recordings, error of a coordinate [cm]: mean {mean}, median {median}, worst {worst}; {speed} times real time{}",
            set.name,
            errors.len(),
            if unsolved > 0 { format!("; {unsolved} steps were not solved") } else { String::new() }
        )?;
        conditions = conditions.with(set.name, format!("{} recordings", errors.len()));
        for (recording, &error) in set.recordings.iter().zip(&errors) {
            file.errors_m.insert(recording.path.display().to_string(), error);
        }
        all.push((predictions, errors));
    }
    file.write(&cli.out.join("result.json"))?;
    let shown: Vec<Predicted> =
        sets.iter().zip(&all).map(|(set, (predictions, _))| set.predicted(predictions)).collect();
    let page = page::write(&cli.out, known, &shown, &conditions)?;
    // What is played and written as a scene is of the last set: that to predict, if there is one.
    if let (Some(set), Some((_, errors))) = (sets.last(), all.last()) {
        let mut order: Vec<usize> = (0..errors.len()).collect();
        order.sort_by(|&a, &b| errors[a].total_cmp(&errors[b]));
        let (median, worst) = (order[order.len() / 2], order[order.len() - 1]);
        let played = |name: &str, k: usize| {
            let (recording, begun) = (&set.recordings[k], set.cables[k].model(parameters));
            play(&cli.out.join(name), recording, &[(0..recording.count()).collect()], begun, steps)
        };
        played("worst.html", worst)?;
        played("median.html", median)?;
        let written = scene::write(
            &cli.out.join("scene"),
            &set.cables[median],
            &set.recordings[median].name(),
            parameters,
            steps,
        )?;
        say!("scene of {}: {}", set.recordings[median].name(), written.display())?;
    }
    say!("page: {}", page.display())?;
    Ok(if file.stopped && cli.from.is_none() { ExitCode::from(terminal::INTERRUPTED) } else { ExitCode::SUCCESS })
}
