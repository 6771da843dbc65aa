//! What learned guesses come from: the paper's data sets, generated on first use.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::Args;
use cosserat::scene::Scene;
use dataset::{Config, Dataset, MANIFEST, Scenario, generate, open_as};
use terminal::say;

use crate::fitting::fitting;
use crate::name::GuessName;
#[cfg(feature = "gn")]
use crate::network::Network;

/// Folder of the data sets, one a scenario.
const DATA: &str = "data";

/// Where learned guesses learned.
#[derive(Args, Clone, Debug, Default)]
pub struct Sources {
    /// Folder of the data sets for knn; they are generated there on first use [default: data].
    #[arg(long, value_name = "DIR")]
    pub data: Option<PathBuf>,
    /// Checkpoint of your own training for gn (recipe paper), gn-best (best) or gn-step (step), PATH.toml with PATH.safetensors,
    /// in the place of the network of its scenario that is built in.
    #[arg(long, value_name = "PATH")]
    pub checkpoint: Option<PathBuf>,
}

/// Which scenario, and where what was learned from it is.
#[derive(Clone, Debug)]
pub struct Training {
    /// Which scenes were learned from.
    pub scenario: Scenario,
    /// Where the data set is.
    pub(crate) directory: PathBuf,
    /// A network of one's own in the place of one that is built in.
    #[cfg(feature = "gn")]
    pub own: Option<Network>,
    /// Whether nothing may be printed.
    pub quiet: bool,
}

impl Training {
    /// Of each of these scenarios, for the guesses that are asked for.
    ///
    /// # Errors
    /// If what the arguments name is for none of them, or is no checkpoint.
    pub fn of(args: &Sources, names: &[GuessName], scenarios: &[Scenario], quiet: bool) -> Result<Vec<Self>> {
        let asked = names.iter().map(GuessName::to_string).collect::<Vec<_>>().join(", ");
        let asked = if asked.is_empty() { "none" } else { &asked };
        if args.data.is_some() && !names.contains(&GuessName::Knn) {
            bail!("--data needs the guess knn, but asked for: {asked}");
        }
        if args.checkpoint.is_some() && !names.iter().any(|name| matches!(name, GuessName::Network(_))) {
            bail!("--checkpoint needs the guess gn, gn-best or gn-step, but asked for: {asked}");
        }
        #[cfg(feature = "gn")]
        let own = args.checkpoint.as_ref().map(|path| crate::network::own(path, names, scenarios)).transpose()?;
        let data = args.data.as_deref().unwrap_or(Path::new(DATA));
        let training = |&scenario: &Scenario| Self {
            scenario,
            directory: data.join(scenario.name()),
            #[cfg(feature = "gn")]
            own: own.clone(),
            quiet,
        };
        Ok(scenarios.iter().map(training).collect())
    }

    /// For a scene: of the scenario asked for, else of the one that is most like it ([`fitting`]).
    ///
    /// # Errors
    /// As [`Self::of`], or if a learned guess is asked for, whose inputs do not tell what the scene has.
    pub fn for_scene(
        args: &Sources,
        names: &[GuessName],
        scenario: Option<Scenario>,
        scene: &Scene,
        quiet: bool,
    ) -> Result<Self> {
        let training = Self::of(args, names, &[scenario.unwrap_or_else(|| fitting(scene))], quiet)?.remove(0);
        if let Some(what) = scene.model.beyond_the_paper()
            && let Some(name) = names.iter().find(|name| name.is_learned())
        {
            let (card, scene) = (training.card(*name)?, &scene.name);
            bail!("--guess {name} learned from the paper's rods{card}, but {scene} has {what}; take another guess");
        }
        Ok(training)
    }

    /// What the card of a network says of its data, in words; of what has none, nothing.
    fn card(&self, name: GuessName) -> Result<String> {
        #[cfg(feature = "gn")]
        if let GuessName::Network(recipe) = name
            && let Some(simulated) = &Network::load(recipe, self.scenario, self.own.as_ref())?.card().simulated
        {
            return Ok(format!(" ({simulated})"));
        }
        let _ = name;
        Ok(String::new())
    }

    /// Opens the data set; generates it, or what is missing of it, if it is not complete.
    pub fn dataset(&self) -> Result<Dataset> {
        let config = Config::table_1(self.scenario);
        let Self { scenario, directory, quiet, .. } = self;
        if !directory.join(MANIFEST).exists() {
            let count = config.train_trajectories + config.validation_trajectories;
            if !quiet {
                let place = directory.display();
                say!(
                    "generating the paper's data set ({scenario}) in {place}: {count} trajectories, once and for all"
                )?;
            }
            let begin = Instant::now();
            let bar = terminal::bar(count, "trajectories", *quiet)?;
            generate(directory, &config, None, &|made| bar.set_position(made.done as u64)).context("--data")?;
            bar.finish_and_clear();
            if !quiet {
                say!("generated in {:.1} s", begin.elapsed().as_secs_f64())?;
            }
        }
        open_as(directory, &config).context("--data")
    }
}
