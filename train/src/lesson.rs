//! What a network is taught: where its samples come from, its loss, and the scenes that it is measured on.

use std::sync::Arc;

use anyhow::{Context, Result, bail};
use copingnet::{Encoding, Simulated, Weights};
use dataset::{Dataset, MANIFEST};
use graph::Norms;

use crate::data;
use crate::measure::{self, Columns, Measured};
use crate::objective::Objective;
use crate::plan::{Loss, Plan, SetArgs};
use crate::samples::{self, Samples};
use crate::steps::{self, Recorded};

/// Every how many training samples one is looked at for the inputs' sizes.
const WHITENING_EVERY: usize = 10;

/// All that a training takes from its data.
pub(crate) struct Taught {
    pub(crate) lesson: Lesson,
    /// Hash that the data are known by.
    pub(crate) data_blake3: String,
    /// Trajectories to train on, and steps of each.
    pub(crate) size: [usize; 2],
    /// How they were simulated.
    pub(crate) simulated: Simulated,
    /// What inputs and outputs mean.
    pub(crate) encoding: Arc<Encoding>,
    pub(crate) samples: Samples,
}

impl Taught {
    /// Gets the data and encodes the training samples.
    pub(crate) fn prepare(plan: &Plan, set: &SetArgs, quiet: bool) -> Result<Self> {
        let (mut lesson, data_blake3, size) = Lesson::prepare(plan, set, quiet)?;
        let encoding = lesson.encoding(plan);
        let samples = lesson.samples(&encoding);
        Ok(Self { lesson, data_blake3, size, simulated: simulated(plan, set), encoding, samples })
    }
}

/// How the data of a plan are simulated.
fn simulated(plan: &Plan, set: &SetArgs) -> Simulated {
    let [shortest, .., longest] = steps::DTS;
    let of_solves = || [set.config(plan.scenario).0.dt_s; 2];
    Simulated::as_in_the_paper(if plan.is_of_steps() { [shortest, longest] } else { of_solves() })
}

/// A source of samples.
pub(crate) enum Lesson {
    /// Linear solves, from a data set.
    Solves(Box<Dataset>),
    /// Starts of whole steps, simulated for the purpose.
    Steps(Vec<Recorded>),
}

impl Lesson {
    /// Gets the data: reads or makes the data set, or simulates. With them come the hash that they are known by, the number
    /// of trajectories to train on, and of steps of each.
    fn prepare(plan: &Plan, set: &SetArgs, quiet: bool) -> Result<(Self, String, [usize; 2])> {
        if plan.is_of_steps() {
            let [count, steps] = set.whole_steps();
            let recorded = steps::record(plan.scenario, count, steps, &plan.unwhitened(Norms::default()).into())?;
            let hash = steps::blake3(&recorded);
            return Ok((Self::Steps(recorded), hash, [count, steps]));
        }
        let (config, directory) = set.config(plan.scenario);
        if config.steps < 2 {
            bail!("--steps {}: it must be 2 or more, as first and later steps are measured", config.steps);
        }
        let dataset = data::open(&directory, &config, quiet)?;
        let manifest = std::fs::read(directory.join(MANIFEST)).context("--data")?;
        let size = [config.train_trajectories, config.steps];
        Ok((Self::Solves(Box::new(dataset)), blake3::hash(&manifest).to_hex().to_string(), size))
    }

    /// What inputs and outputs mean, by the training samples' sizes.
    fn encoding(&self, plan: &Plan) -> Arc<Encoding> {
        let mut encoding;
        match self {
            Self::Solves(dataset) => {
                encoding = plan.unwhitened(dataset.norms());
                encoding.whitening = samples::whitening(dataset, &Arc::new(encoding.clone()), WHITENING_EVERY);
            }
            Self::Steps(recorded) => {
                encoding = plan.unwhitened(Norms::default());
                let inputs: Vec<_> = recorded.iter().map(|recorded| &recorded.inputs).collect();
                encoding.whitening = samples::fit(plan.features, &inputs);
            }
        }
        Arc::new(encoding)
    }

    /// The training samples; whole steps are used up.
    fn samples(&mut self, encoding: &Arc<Encoding>) -> Samples {
        match self {
            Self::Solves(dataset) => Samples::of_solves(dataset, encoding),
            Self::Steps(recorded) => Samples::of_steps(std::mem::take(recorded), encoding),
        }
    }

    /// The loss.
    pub(crate) fn objective(&self, plan: &Plan, encoding: &Arc<Encoding>) -> Objective<'_> {
        match (plan.loss, self) {
            (Loss::Cg, Self::Solves(dataset)) => Objective::cg(dataset, encoding),
            (Loss::Log, _) => Objective::LogSquare,
            // The plan has no loss through conjugate gradients for whole steps.
            (Loss::Mse, _) | (Loss::Cg, Self::Steps(_)) => Objective::MeanSquare,
        }
    }

    /// What is measured.
    pub(crate) fn columns(&self) -> Columns {
        match self {
            Self::Solves(dataset) => measure::solves::columns(dataset.manifest().config.scenario),
            Self::Steps(_) => measure::steps::columns(),
        }
    }

    /// Measures a network on validation scenes.
    pub(crate) fn measure(&self, plan: &Plan, weights: &Weights, encoding: &Encoding) -> Result<Measured> {
        match self {
            Self::Solves(dataset) => Ok(measure::solves::measure(dataset, plan.scenes, weights, encoding)),
            Self::Steps(_) => measure::steps::measure(plan.scenario, plan.scenes, weights, encoding),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use clap::Parser;
    use copingnet::Checkpoint;

    use super::*;
    use crate::cli::Cli;

    /// What the cards of the shipped networks say is what their commands stand for.
    #[test]
    fn cards_say_what_their_commands_do() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../checkpoints");
        let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let has_weights = |path: &Path| path.with_extension("safetensors").exists();
        let cards: Vec<_> =
            files.filter(|path| path.extension().is_some_and(|end| end == "toml") && has_weights(path)).collect();
        assert!(cards.len() >= 10, "{cards:?}");
        for path in cards {
            let card = Checkpoint::load(&path).unwrap().card;
            for training in card.trainings() {
                // The backend is a feature of the program.
                let command = training.command.replace("--backend flex", "");
                let args = Cli::parse_from(command.split_whitespace()).train;
                let plan = args.plan().unwrap();
                let of_command = (plan.scenario.to_string(), plan.recipe.name());
                assert_eq!((card.scenario.clone(), card.recipe.as_str()), of_command, "{}", path.display());
                assert_eq!(card.simulated, Some(simulated(&plan, &args.set)), "{}", path.display());
                let size = match plan.is_of_steps() {
                    true => args.set.whole_steps(),
                    false => {
                        let config = args.set.config(plan.scenario).0;
                        [config.train_trajectories, config.steps]
                    }
                };
                let [trajectories, steps] = size.map(Some);
                assert_eq!((training.trajectories, training.steps), (trajectories, steps), "{}", path.display());
            }
        }
    }
}
