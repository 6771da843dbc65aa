//! A training under way: epochs, measurements, the state that is kept.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use copingnet::{Card, Checkpoint, Leg, Measured as Figure, Training, TrainingState, Weights};

use crate::curves::{self, Row};
use crate::lesson::Taught;
use crate::measure::{Columns, Measured};
use crate::outcome::Outcome;
use crate::paths::with_ending;
use crate::plan::Plan;
use crate::trainer::Trainer;

/// A training under way.
pub(crate) struct Course<'a> {
    plan: &'a Plan,
    taught: &'a Taught,
    pub(crate) columns: Columns,
    trainer: Trainer<'a>,
    /// Epochs done, and batches of the next one.
    pub(crate) epoch: u64,
    batch: u64,
    /// Loss summed over the samples of the epoch so far.
    loss: f64,
    best: Vec<f32>,
    /// Trainings before this one, whose weights it began with.
    legs: Vec<Leg>,
    pub(crate) rows: Vec<Row>,
    /// Time spent before this program began, and since.
    before: Duration,
    begin: Instant,
    /// Epochs that were done when this program began.
    first: u64,
}

impl<'a> Course<'a> {
    /// A training that begins with random weights.
    pub(crate) fn new(plan: &'a Plan, taught: &'a Taught) -> Self {
        let objective = taught.lesson.objective(plan, &taught.encoding);
        let trainer = Trainer::new(plan, &taught.samples, objective);
        Self {
            plan,
            taught,
            columns: taught.lesson.columns(),
            best: trainer.weights.values().to_vec(),
            legs: Vec::new(),
            trainer,
            epoch: 0,
            batch: 0,
            loss: 0.0,
            rows: Vec::new(),
            before: Duration::ZERO,
            begin: Instant::now(),
            first: 0,
        }
    }

    /// Begins with the weights that these trainings have left.
    pub(crate) fn begin_with(&mut self, weights: Weights, legs: Vec<Leg>) {
        self.best.copy_from_slice(weights.values());
        self.trainer.weights = weights;
        self.legs = legs;
    }

    /// Trains to the end and saves the checkpoint, or until `stopped`. After each measurement `report` hears of it, and
    /// of the nodes that were visited in a second. The state stays: it is the caller's to remove ([`Self::state_file`]).
    pub(crate) fn train(
        &mut self,
        stopped: &AtomicBool,
        mut report: impl FnMut(&Self, f64) -> Result<()>,
    ) -> Result<Outcome> {
        while self.epoch < self.plan.epochs {
            let nodes_per_second = self.epoch(stopped);
            let is_due = self.epoch.is_multiple_of(self.plan.measure_every) || self.epoch == self.plan.epochs;
            if self.batch == 0 && is_due {
                self.measure()?;
                report(self, nodes_per_second)?;
            }
            if stopped.load(Ordering::Relaxed) && self.epoch < self.plan.epochs {
                self.save_state()?;
                return Ok(Outcome::Interrupted);
            }
        }
        self.checkpoint()?.save(&self.plan.out)?;
        Ok(Outcome::Done)
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
        let measured = self.taught.lesson.measure(self.plan, &self.trainer.weights, &self.taught.encoding)?;
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

    /// Time spent on the training [s].
    pub(crate) fn seconds(&self) -> f64 {
        (self.before + self.begin.elapsed()).as_secs_f64()
    }

    /// Time that the rest will take, going by this program's own part.
    pub(crate) fn left(&self) -> Duration {
        let done = self.epoch - self.first;
        self.begin.elapsed().mul_f64((self.plan.epochs - self.epoch) as f64 / done.max(1) as f64)
    }

    /// The best measurement.
    pub(crate) fn best_row(&self) -> Option<&Row> {
        self.rows.iter().min_by(|a, b| a.measured.score.total_cmp(&b.measured.score))
    }

    /// Samples that were left out because their loss was not finite.
    pub(crate) fn left_out(&self) -> u64 {
        self.trainer.left_out
    }

    /// The best weights with their card.
    pub(crate) fn checkpoint(&self) -> Result<Checkpoint> {
        let plan = self.plan;
        let best = self.best_row();
        let mut weights = Weights::zeros(plan.network);
        weights.values_mut().copy_from_slice(&self.best);
        let card = Card {
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
            git_revision: export::git_revision(),
            scenario: plan.scenario.to_string(),
            recipe: plan.recipe.name().to_owned(),
            data_blake3: Some(self.taught.data_blake3.clone()),
            simulated: Some(self.taught.simulated.clone()),
            training: Training {
                seed: plan.seed,
                trajectories: Some(self.taught.size[0]),
                steps: Some(self.taught.size[1]),
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
            before: self.legs.clone(),
            measured: best.map_or_else(Vec::new, |row| figures(&self.columns, &row.measured, plan.scenes)),
        };
        Ok(Checkpoint { card, encoding: (*self.taught.encoding).clone(), weights })
    }

    /// Where the state is kept.
    pub(crate) fn state_file(&self) -> PathBuf {
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
            before: self.legs.clone(),
            counters: counters.map(|(key, value)| (key.to_owned(), value)).into(),
            tensors: tensors.map(|(key, values)| (key.to_owned(), values.to_vec())).into(),
            rows,
        };
        Ok(state.save(&self.state_file())?)
    }

    fn fingerprint(&self) -> BTreeMap<String, String> {
        let mut fingerprint = self.plan.fingerprint();
        fingerprint.insert("data".to_owned(), self.taught.data_blake3.clone());
        fingerprint
    }

    /// Goes on from the state that was kept.
    ///
    /// # Errors
    /// If there is none, or it is damaged or of other settings.
    pub(crate) fn resume(&mut self) -> Result<()> {
        let file = self.state_file();
        let mut state = TrainingState::load(&file)?;
        state.check_fingerprint(&file, &self.fingerprint())?;
        self.legs = std::mem::take(&mut state.before);
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
