//! `train equilibrium`: the learned start of cables' equilibria ([`equilibria::learned`]).

mod branched;
mod gradient;
mod single;
mod subject;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use copingnet::{Adam, AdamParams, Backend, TrainingState};
use dataset::shuffled;
use equilibria::network::Perceptron;
use evaluation::clock::process_time;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use terminal::{Progress, threads};

use self::branched::Branched;
use self::single::Single;
use self::subject::Subject;
use crate::outcome::Outcome;
use crate::paths::with_ending;
use crate::plan::threads_or_cores;

/// Queries that are solved between two looks at Ctrl-C.
const CHUNK: u64 = 4096;
/// Queries of the validation; their seed is the training's and one.
const VALIDATION: u64 = 4096;
/// Steps over which the step size rises to its full size.
const WARM_UP: u64 = 200;

/// Name of a counter: for how long cores have worked [ms].
const CORE_TIME: &str = "core milliseconds";

/// Trains the learned start of `equilibria`.
///
/// Queries are drawn and solved first, each from twelve starts or more; the network learns the lowest equilibrium of each class of
/// twist.
#[derive(Args, Debug)]
pub(crate) struct EquilibriumArgs {
    /// Cables between two grips, or with three arms between three.
    #[arg(long, value_enum, default_value_t = Cables::Single)]
    cables: Cables,
    /// Random queries [default: 1000000; 120000 of branched cables].
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    queries: Option<u64>,
    /// Times through the samples [default: 80; 30 for branched cables].
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    epochs: Option<u64>,
    /// Size of the two inner layers.
    #[arg(long, default_value_t = 192, value_parser = clap::value_parser!(u16).range(1..=256))]
    width: u16,
    /// Samples in a batch: two a query, four of branched cables.
    #[arg(long, default_value_t = 1024, value_parser = clap::value_parser!(u32).range(1..=65536))]
    batch: u32,
    /// Largest step size of Adam; it falls to nothing as a cosine.
    #[arg(long, default_value_t = 3e-3, value_parser = terminal::positive)]
    learning_rate: f64,
    /// Seed of the queries, the parameters and the samples' order.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(..1 << 40))]
    seed: u64,
    /// Threads [default: one a core]. The weights have the same bits on any number.
    #[arg(long, value_parser = threads)]
    threads: Option<usize>,
    /// What computes the network: ndarray; flex, wgpu or cuda where built with that cargo feature.
    #[arg(long, default_value_t = Backend::default())]
    backend: Backend,
    /// The weights to write, with the command and its core-seconds in FILE.toml; until the training is done its state is in
    /// FILE.state [default: trained/equilibrium.safetensors, or trained/branched.safetensors].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Replace weights that are there already.
    #[arg(long)]
    force: bool,
    /// Goes on with a training that was cut off: the result has the same bits as if it had not been.
    #[arg(long, conflicts_with = "force")]
    resume: bool,
    /// Print nothing but errors.
    #[arg(long)]
    quiet: bool,
}

/// Which cables are learned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Cables {
    Single,
    Branched,
}

impl EquilibriumArgs {
    fn queries(&self) -> u64 {
        let default = if self.cables == Cables::Single { 1_000_000 } else { 120_000 };
        self.queries.unwrap_or(default)
    }

    fn epochs(&self) -> u64 {
        self.epochs.unwrap_or(if self.cables == Cables::Single { 80 } else { 30 })
    }

    fn out(&self) -> PathBuf {
        let default = if self.cables == Cables::Single { "equilibrium" } else { "branched" };
        self.out.clone().unwrap_or_else(|| Path::new("trained").join(default).with_extension("safetensors"))
    }
}

/// A training under way.
struct Course<'a, S: Subject> {
    args: &'a EquilibriumArgs,
    sizes: Vec<[usize; 2]>,
    samples: Vec<S::Sample>,
    parameters: Vec<f32>,
    adam: Adam,
    epoch: u64,
    batch: u64,
    /// For how long cores worked for it in programs that were cut off [ms].
    before: u64,
}

/// Trains as the command line says.
pub(crate) fn run(args: &EquilibriumArgs) -> Result<Outcome> {
    match args.cables {
        Cables::Single => learn::<Single>(args),
        Cables::Branched => learn::<Branched>(args),
    }
}

fn learn<S: Subject>(args: &EquilibriumArgs) -> Result<Outcome> {
    let out = args.out();
    let state = with_ending(&out, ".state");
    if !args.resume {
        check_place(args, &out, &state)?;
    }
    rayon::ThreadPoolBuilder::new().num_threads(threads_or_cores(args.threads)).build_global()?;
    let begin = Instant::now();
    let Some(samples) = draw::<S>(args)? else { return Ok(Outcome::Interrupted) };
    let validation = S::samples(args.seed + 1, 0, VALIDATION.min(args.queries()))?;
    let mut course = Course::<S>::new(args, samples);
    if args.resume {
        course.resume(&state).context("--resume")?;
    }
    if !args.quiet {
        terminal::print(format_args!(
            "{} samples; error of turns [rad], of the validation queries",
            course.samples.len()
        ))?;
        terminal::print(format_args!("epoch      s  loss      median  mean    > .2 %  class %"))?;
    }
    // The rows are the progress; this hears of Ctrl-C.
    let progress = Progress::new(0, "epochs", true)?;
    let device = args.backend.device().autodiff();
    while course.epoch < args.epochs() {
        let loss = course.go(&device, &progress);
        if progress.stopped() {
            course.save(&state)?;
            if !args.quiet {
                terminal::print(format_args!("stopped; go on with --resume ({})", state.display()))?;
            }
            return Ok(Outcome::Interrupted);
        }
        course.save(&state)?;
        if !args.quiet {
            let [median, mean, far, class] = course.validate(&validation)?;
            let (epoch, seconds) = (course.epoch, begin.elapsed().as_secs_f64());
            terminal::print(format_args!(
                "{epoch:5} {seconds:6.0}  {loss:.6}  {median:.4}  {mean:.4}  {far:6.2}  {class:.2}"
            ))?;
        }
    }
    let [median, mean, far, class] = course.validate(&validation)?;
    let training = format!(
        "{}; of {} other queries: median error {median:.4} rad, mean {mean:.4} rad, above 0.2 rad {far:.1} %, right class {class:.1} %",
        course.command(),
        validation.len()
    );
    let bytes = Perceptron::bytes(&course.sizes, &course.parameters, &training)?;
    let card = with_ending(&out, ".toml");
    for (file, bytes) in [(&card, course.card().as_bytes()), (&out, &bytes)] {
        export::write_atomically(file, |file| std::io::Write::write_all(file, bytes)).context("--out")?;
    }
    std::fs::remove_file(&state).context("--out")?;
    if !args.quiet {
        terminal::print(format_args!("wrote {} and {}", out.display(), card.display()))?;
    }
    Ok(Outcome::Done)
}

/// Sees that nothing of worth is there.
fn check_place(args: &EquilibriumArgs, out: &Path, state: &Path) -> Result<()> {
    let folder = out.parent().unwrap_or(Path::new(""));
    std::fs::create_dir_all(folder).with_context(|| format!("--out: cannot make the folder {}", folder.display()))?;
    if state.exists() {
        bail!("{} is the state of a training that was cut off: go on by --resume, or delete it", state.display());
    }
    if out.exists() && !args.force {
        bail!("--out {}: it is there already; give another place, or --force", out.display());
    }
    Ok(())
}

/// The samples of the training; `None` after Ctrl-C.
fn draw<S: Subject>(args: &EquilibriumArgs) -> Result<Option<Vec<S::Sample>>> {
    let queries = args.queries();
    let progress = Progress::new(queries as usize, "queries", args.quiet)?;
    let mut all = Vec::new();
    let mut first = 0;
    while first < queries {
        let count = CHUNK.min(queries - first);
        all.extend(S::samples(args.seed, first, count)?);
        first += count;
        if !progress.advance_by(count as usize) {
            break;
        }
    }
    Ok(if progress.finish() { None } else { Some(all) })
}

impl<'a, S: Subject> Course<'a, S> {
    fn new(args: &'a EquilibriumArgs, samples: Vec<S::Sample>) -> Self {
        let inner = [usize::from(args.width); 2];
        let sizes = Perceptron::layers(S::INPUTS, &inner, S::OUTPUTS);
        let mut rng = ChaCha8Rng::seed_from_u64(args.seed);
        let mut parameters = Vec::new();
        for &[inputs, outputs] in &sizes {
            // Half of the inputs' variance goes on (He et al. 2015); biases begin at zero.
            let bound = (6.0 / inputs as f32).sqrt();
            parameters.extend((0..inputs * outputs).map(|_| rng.random_range(-bound..bound)));
            parameters.resize(parameters.len() + outputs, 0.0);
        }
        let adam = Adam::new(parameters.len());
        Self { args, sizes, samples, parameters, adam, epoch: 0, batch: 0, before: 0 }
    }

    /// What is left of an epoch, or as much of it as there is time for before Ctrl-C. Returns the mean loss.
    fn go(&mut self, device: &burn::tensor::Device, progress: &Progress) -> f64 {
        let size = self.args.batch as usize;
        let order = shuffled(self.samples.len(), self.args.seed, self.epoch);
        let batches = order.len().div_ceil(size) as u64;
        let (mut sum, mut count) = (0.0, 0);
        for batch in order.chunks(size).skip(self.batch as usize) {
            let batch: Vec<&S::Sample> = batch.iter().map(|&k| &self.samples[k]).collect();
            let (loss, gradient) = gradient::gradient::<S>(&self.sizes, &self.parameters, &batch, device);
            let done = self.adam.steps as f64 / (self.args.epochs() * batches) as f64;
            let rise = ((self.adam.steps + 1) as f64 / WARM_UP as f64).min(1.0);
            let rate = self.args.learning_rate * rise * 0.5 * (1.0 + (std::f64::consts::PI * done.min(1.0)).cos());
            let params = AdamParams { beta_1: 0.9, beta_2: 0.99, clip: 1.0 };
            self.adam.step(&params, rate, &gradient, &mut self.parameters);
            (sum, count, self.batch) = (sum + loss, count + 1, self.batch + 1);
            if progress.stopped() {
                break;
            }
        }
        if self.batch == batches {
            (self.epoch, self.batch) = (self.epoch + 1, 0);
        }
        sum / f64::from(count.max(1))
    }

    /// [`Subject::validate`] of the weights as they are.
    fn validate(&self, samples: &[S::Sample]) -> Result<[f64; 4]> {
        Ok(S::validate(&Perceptron::new(&self.sizes, &self.parameters)?, samples))
    }

    /// The command that makes these weights again.
    fn command(&self) -> String {
        let EquilibriumArgs { cables, width, batch, learning_rate, seed, backend, .. } = self.args;
        let (queries, epochs) = (self.args.queries(), self.args.epochs());
        let cables = if *cables == Cables::Single { "" } else { " --cables branched" };
        format!(
            "train equilibrium{cables} --queries {queries} --epochs {epochs} --width {width} --batch {batch} \
             --learning-rate {learning_rate} --seed {seed} --backend {backend}"
        )
    }

    fn fingerprint(&self) -> BTreeMap<String, String> {
        let EquilibriumArgs { cables, width, batch, learning_rate, seed, backend, .. } = self.args;
        let (queries, epochs) = (self.args.queries(), self.args.epochs());
        let settings = [
            ("cables", format!("{cables:?}")),
            ("queries", queries.to_string()),
            ("epochs", epochs.to_string()),
            ("width", width.to_string()),
            ("batch", batch.to_string()),
            ("learning-rate", format!("{learning_rate:?}")),
            ("seed", seed.to_string()),
            ("backend", backend.to_string()),
        ];
        settings.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
    }

    /// What stands beside the weights: the command, and for how many seconds cores have worked for it, where the system tells.
    fn card(&self) -> String {
        let seconds = process_time().map(|now| (Duration::from_millis(self.before) + now).as_secs_f64());
        let seconds = seconds.map_or(String::new(), |seconds| format!("core_seconds = {seconds:.1}\n"));
        format!("command = \"{}\"\n{seconds}", self.command())
    }

    fn save(&self, file: &Path) -> Result<()> {
        let now = process_time().unwrap_or_default().as_millis() as u64;
        let counters =
            [("epoch", self.epoch), ("batch", self.batch), ("steps", self.adam.steps), (CORE_TIME, self.before + now)];
        let tensors = [("parameters", &self.parameters), ("mean", &self.adam.mean), ("square", &self.adam.square)];
        let state = TrainingState {
            fingerprint: self.fingerprint(),
            counters: counters.map(|(key, value)| (key.to_owned(), value)).into(),
            tensors: tensors.map(|(key, values)| (key.to_owned(), values.clone())).into(),
            ..TrainingState::default()
        };
        Ok(state.save(file)?)
    }

    /// Goes on from the state that was kept.
    fn resume(&mut self, file: &Path) -> Result<()> {
        let state = TrainingState::load(file)?;
        state.check_fingerprint(file, &self.fingerprint())?;
        let counter = |key: &str| {
            state.counters.get(key).copied().with_context(|| format!("{}: no counter {key}", file.display()))
        };
        (self.epoch, self.batch, self.adam.steps) = (counter("epoch")?, counter("batch")?, counter("steps")?);
        self.before = counter(CORE_TIME)?;
        for (key, to) in
            [("parameters", &mut self.parameters), ("mean", &mut self.adam.mean), ("square", &mut self.adam.square)]
        {
            match state.tensors.get(key) {
                Some(values) if values.len() == to.len() => to.copy_from_slice(values),
                _ => bail!("{}: tensor {key} has not {} values", file.display(), to.len()),
            }
        }
        Ok(())
    }
}
