//! One training from its data to its checkpoint.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fmt::Arguments;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use copingnet::{Card, Checkpoint, Encoding, Measured as Figure, Training, TrainingState, Weights};

use crate::cli::{Plan, TrainArgs};
use crate::curves::{self, Row};
use crate::lesson::Lesson;
use crate::measure::{Columns, Measured};
use crate::trainer::Trainer;

/// How a training ended.
pub(crate) enum Outcome {
    Done,
    Interrupted,
}

/// Trains as the command line says.
pub(crate) fn run(cli: &TrainArgs) -> Result<Outcome> {
    let plan = cli.plan()?;
    let say = |text: Arguments<'_>| if cli.quiet { Ok(()) } else { terminal::print(text) };
    say(format_args!(
        "{} {}: {} parameters, {} epochs, seed {}, {} on {} threads",
        plan.scenario,
        plan.recipe.name(),
        Weights::zeros(plan.network).values().len(),
        plan.epochs,
        plan.seed,
        plan.backend,
        plan.threads
    ))?;
    if !cli.resume {
        check_place(&plan, cli.force)?;
    }
    rayon::ThreadPoolBuilder::new().num_threads(plan.threads).build_global()?;
    let stopped = Arc::new(AtomicBool::new(false));
    let flag = stopped.clone();
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).context("cannot listen to Ctrl-C")?;
    let (mut lesson, data_blake3) = Lesson::prepare(&plan, &cli.set, cli.quiet)?;
    let encoding = lesson.encoding(&plan);
    let samples = lesson.samples(&encoding);
    let mut trainer = Trainer::new(&plan, &samples, lesson.objective(&plan, &encoding));
    if let Some(path) = &cli.from {
        trainer.weights = weights_from(path, &plan, &encoding, &data_blake3).context("--from")?;
    }
    let mut course = Course::new(&plan, &lesson, encoding, trainer, data_blake3);
    if cli.resume {
        course.resume().context("--resume")?;
        say(format_args!("resumed after {} epochs", course.epoch))?;
    }
    say(format_args!("{} samples; on {} validation scenes, {}", samples.len(), plan.scenes, course.columns.about))?;
    say(format_args!("{} score  loss     nodes/s  left", curves::header(&course.columns)))?;
    while course.epoch < plan.epochs {
        let nodes_per_second = course.epoch(&stopped);
        let is_due = course.epoch.is_multiple_of(plan.measure_every) || course.epoch == plan.epochs;
        if course.batch == 0 && is_due {
            course.measure()?;
            if let Some(row) = course.rows.last() {
                let (text, left) = (row.text(), course.left().as_secs());
                say(format_args!(
                    "{text} {:.3}  {:.6} {nodes_per_second:8.0} {}:{:02}",
                    row.measured.score,
                    row.loss,
                    left / 60,
                    left % 60
                ))?;
            }
        }
        if stopped.load(Ordering::Relaxed) && course.epoch < plan.epochs {
            course.save_state()?;
            say(format_args!("stopped; go on with --resume ({})", course.state_file().display()))?;
            return Ok(Outcome::Interrupted);
        }
    }
    course.checkpoint()?.save(&plan.out)?;
    std::fs::remove_file(course.state_file()).context("--out")?;
    if course.trainer.left_out > 0 {
        say(format_args!("{} times a sample was left out: its loss was not finite", course.trainer.left_out))?;
    }
    say(format_args!("wrote {}.toml, .safetensors, .csv and .svg", plan.out.display()))?;
    Ok(Outcome::Done)
}

/// The weights of a checkpoint to go on from.
fn weights_from(path: &Path, plan: &Plan, encoding: &Encoding, data_blake3: &str) -> Result<Weights> {
    let Checkpoint { card, encoding: own, weights } = Checkpoint::load(path)?;
    if *weights.config() != plan.network || (own.features, own.head) != (encoding.features, encoding.head) {
        bail!("{}: the network has other features, head or sizes than this training", path.display());
    }
    if own != *encoding || card.data_blake3.as_deref() != Some(data_blake3) {
        bail!("{}: data_blake3 = {:?}, but it must be \"{data_blake3}\"", path.display(), card.data_blake3);
    }
    Ok(weights)
}

/// Makes the folder of the checkpoint, and sees that nothing of worth is there.
fn check_place(plan: &Plan, may_replace: bool) -> Result<()> {
    let folder = plan.out.parent().unwrap_or(Path::new(""));
    std::fs::create_dir_all(folder).with_context(|| format!("--out: cannot make the folder {}", folder.display()))?;
    let [state, card] = [".state", ".toml"].map(|ending| with_ending(&plan.out, ending));
    if state.exists() {
        bail!("{} is the state of a training that was cut off: go on by --resume, or delete it", state.display());
    }
    if card.exists() && !may_replace {
        bail!("--out {}: {} is there already; give another place, or --force", plan.out.display(), card.display());
    }
    Ok(())
}

/// A training under way.
struct Course<'a> {
    plan: &'a Plan,
    lesson: &'a Lesson,
    columns: Columns,
    encoding: Arc<Encoding>,
    trainer: Trainer<'a>,
    data_blake3: String,
    /// Epochs done, and batches of the next one.
    epoch: u64,
    batch: u64,
    /// Loss summed over the samples of the epoch so far.
    loss: f64,
    best: Vec<f32>,
    rows: Vec<Row>,
    /// Time spent before this program began, and since.
    before: Duration,
    begin: Instant,
    /// Epochs that were done when this program began.
    first: u64,
}

impl<'a> Course<'a> {
    fn new(
        plan: &'a Plan,
        lesson: &'a Lesson,
        encoding: Arc<Encoding>,
        trainer: Trainer<'a>,
        data_blake3: String,
    ) -> Self {
        Self {
            plan,
            lesson,
            columns: lesson.columns(),
            encoding,
            best: trainer.weights.values().to_vec(),
            trainer,
            data_blake3,
            epoch: 0,
            batch: 0,
            loss: 0.0,
            rows: Vec::new(),
            before: Duration::ZERO,
            begin: Instant::now(),
            first: 0,
        }
    }

    /// What is left of an epoch, or as much of it as there is time for before `stopped`. Returns the nodes per second.
    fn epoch(&mut self, stopped: &AtomicBool) -> f64 {
        let (begin, mut nodes) = (Instant::now(), 0);
        let order = self.trainer.order(self.epoch);
        for batch in order.chunks(self.plan.batch).skip(self.batch as usize) {
            let (loss, count) = self.trainer.step(batch);
            self.loss += loss * batch.len() as f64;
            nodes += count;
            self.batch += 1;
            if stopped.load(Ordering::Relaxed) {
                break;
            }
        }
        if self.batch == self.trainer.batches() {
            (self.epoch, self.batch) = (self.epoch + 1, 0);
        }
        nodes as f64 / begin.elapsed().as_secs_f64()
    }

    /// Measures, keeps the best, and writes everything down.
    fn measure(&mut self) -> Result<()> {
        let measured = self.lesson.measure(self.plan, &self.trainer.weights, &self.encoding)?;
        let loss = self.loss / self.trainer.samples() as f64 / self.epochs_since_last();
        self.loss = 0.0;
        let is_best = self.rows.iter().all(|row| measured.score < row.measured.score);
        self.rows.push(Row { epoch: self.epoch, seconds: self.seconds(), loss, measured });
        if is_best {
            self.best.copy_from_slice(self.trainer.weights.values());
            self.checkpoint()?.save(&self.plan.out)?;
        }
        curves::write(&self.plan.out, &self.columns, &self.rows)?;
        self.save_state()
    }

    fn epochs_since_last(&self) -> f64 {
        (self.epoch - self.rows.last().map_or(0, |row| row.epoch)).max(1) as f64
    }

    fn seconds(&self) -> f64 {
        (self.before + self.begin.elapsed()).as_secs_f64()
    }

    fn left(&self) -> Duration {
        let done = self.epoch - self.first;
        self.begin.elapsed().mul_f64((self.plan.epochs - self.epoch) as f64 / done.max(1) as f64)
    }

    fn checkpoint(&self) -> Result<Checkpoint> {
        let plan = self.plan;
        let best = self.rows.iter().min_by(|a, b| a.measured.score.total_cmp(&b.measured.score));
        let mut weights = Weights::zeros(plan.network);
        weights.values_mut().copy_from_slice(&self.best);
        let card = Card {
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
            git_revision: export::git_revision(),
            scenario: plan.scenario.to_string(),
            recipe: plan.recipe.name().to_owned(),
            data_blake3: Some(self.data_blake3.clone()),
            training: Training {
                seed: plan.seed,
                epochs: best.map_or(0, |row| row.epoch) as usize,
                batch: plan.batch,
                loss: plan.loss.name().to_owned(),
                learning_rate: plan.learning_rate,
                schedule: plan.schedule.name().to_owned(),
                backend: plan.backend.to_string(),
                threads: plan.threads,
                seconds: self.seconds(),
                command: command(),
            },
            measured: best.map_or_else(Vec::new, |row| figures(&self.columns, &row.measured, plan.scenes)),
        };
        Ok(Checkpoint { card, encoding: (*self.encoding).clone(), weights })
    }

    fn state_file(&self) -> PathBuf {
        with_ending(&self.plan.out, ".state")
    }

    fn save_state(&self) -> Result<()> {
        let adam = &self.trainer.adam;
        let counters = [
            ("epoch", self.epoch),
            ("batch", self.batch),
            ("steps", adam.steps),
            ("milliseconds", (self.seconds() * 1e3) as u64),
            ("left_out", self.trainer.left_out),
        ];
        let tensors = [
            ("parameters", self.trainer.weights.values()),
            ("mean", &adam.mean),
            ("square", &adam.square),
            ("best", &self.best),
        ];
        let mut rows: Vec<Vec<f64>> = self.rows.iter().map(Row::numbers).collect();
        rows.push(vec![self.loss]);
        let state = TrainingState {
            fingerprint: self.fingerprint(),
            counters: counters.map(|(key, value)| (key.to_owned(), value)).into(),
            tensors: tensors.map(|(key, values)| (key.to_owned(), values.to_vec())).into(),
            rows,
        };
        Ok(state.save(&self.state_file())?)
    }

    fn fingerprint(&self) -> BTreeMap<String, String> {
        let mut fingerprint = self.plan.fingerprint();
        fingerprint.insert("data".to_owned(), self.data_blake3.clone());
        fingerprint
    }

    fn resume(&mut self) -> Result<()> {
        let file = self.state_file();
        let mut state = TrainingState::load(&file)?;
        state.check_fingerprint(&file, &self.fingerprint())?;
        let counter = |key: &str| {
            state.counters.get(key).copied().with_context(|| format!("{}: no counter {key}", file.display()))
        };
        (self.epoch, self.batch, self.first) = (counter("epoch")?, counter("batch")?, counter("epoch")?);
        self.trainer.adam.steps = counter("steps")?;
        self.trainer.left_out = counter("left_out")?;
        self.before = Duration::from_millis(counter("milliseconds")?);
        let mut take = |key: &str, to: &mut [f32]| match state.tensors.remove(key) {
            Some(values) if values.len() == to.len() => {
                to.copy_from_slice(&values);
                Ok(())
            }
            found => bail!(
                "{}: tensor {key} has {} values, but it must have {}",
                file.display(),
                found.map_or(0, |values| values.len()),
                to.len()
            ),
        };
        take("parameters", self.trainer.weights.values_mut())?;
        take("mean", &mut self.trainer.adam.mean)?;
        take("square", &mut self.trainer.adam.square)?;
        take("best", &mut self.best)?;
        let damaged = || format!("{}: rows that no training writes", file.display());
        let loss = state.rows.pop().with_context(damaged)?;
        self.loss = *loss.first().with_context(damaged)?;
        self.rows = state
            .rows
            .iter()
            .map(|row| Row::from_numbers(row, &self.columns))
            .collect::<Option<_>>()
            .with_context(damaged)?;
        Ok(())
    }
}

/// What the card says of the measured ratios.
fn figures(columns: &Columns, measured: &Measured, scenes: usize) -> Vec<Figure> {
    let mut figures = Vec::new();
    for part in 0..2 {
        for (pair, ratios) in columns.pairs.iter().zip(&measured.pairs) {
            let steps =
                format!("{} {}; {} of {scenes} validation scenes", columns.parts[part], pair.head, columns.about);
            let (preconditioner, tolerance) = (pair.solver.to_owned(), pair.tolerances[part]);
            figures.push(Figure { preconditioner, tolerance, steps, ratio: ratios[part] });
        }
    }
    figures
}

/// The command line, without the way to the program.
fn command() -> String {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    format!("train {}", arguments.join(" ")).trim_end().to_owned()
}

/// A path with more after its last name.
pub(crate) fn with_ending(path: &Path, ending: &str) -> PathBuf {
    let mut name: OsString = path.into();
    name.push(ending);
    name.into()
}
