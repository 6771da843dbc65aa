//! What is trained, and how: the flags, and the plan that they make.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use copingnet::{Backend, Encoding, Features, Head, NetworkConfig};
use dataset::{Config, Scenario};
use graph::Norms;
use terminal::{positive, threads};

/// Epochs between two measurements.
const MEASURE_EVERY: u64 = 10;

/// Where a data set is, and how large.
#[derive(Args, Clone, Debug)]
pub(crate) struct SetArgs {
    /// Folder of the data sets; that of Table 1 is DIR/SCENARIO, others have their sizes in their names [default: data].
    #[arg(long, value_name = "DIR")]
    pub(crate) data: Option<PathBuf>,
    /// Training trajectories [default: the paper's 256, 20 knots, 100 trees; 768 where whole steps are learned].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(crate) trajectories: Option<u32>,
    /// Steps of a trajectory [default: Table 1's 50; 100 for knots, for trees, and where whole steps are learned].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) steps: Option<u32>,
}

impl SetArgs {
    /// The data set of a scenario, and its folder.
    pub(crate) fn config(&self, scenario: Scenario) -> (Config, PathBuf) {
        let table = Config::table_1(scenario);
        let or = |given: Option<u32>, default| given.map_or(default, |n| n as usize);
        let config = Config {
            train_trajectories: or(self.trajectories, table.train_trajectories),
            steps: or(self.steps, table.steps),
            ..table.clone()
        };
        let name = if config == table {
            scenario.to_string()
        } else {
            format!("{scenario}-{}x{}", config.train_trajectories, config.steps)
        };
        (config, self.data.as_deref().unwrap_or(Path::new("data")).join(name))
    }

    /// Trajectories of whole steps, and steps of each.
    pub(crate) fn whole_steps(&self) -> [usize; 2] {
        let or = |given: Option<u32>, default| given.map_or(default, |n| n as usize);
        [or(self.trajectories, 768), or(self.steps, 100)]
    }
}

/// What to train, and how.
#[derive(Args, Debug)]
pub(crate) struct TrainArgs {
    /// Which of the paper's scenarios: rod, helix (Table 1), knot, tree.
    #[arg(long, default_value_t = Scenario::Rod)]
    pub(crate) scenario: Scenario,
    /// paper: the paper's network, features and loss. best: features in body frames, scans along the rod, and the loss
    /// through six iterations of conjugate gradients. step: a small network for starts of whole steps (guess gn-step),
    /// on the paper's rods or helices and slack ones at time steps of 0.02 to 0.1 s. The flags below change single parts of a
    /// recipe.
    #[arg(long, value_enum, default_value_t = Recipe::Paper)]
    pub(crate) recipe: Recipe,
    /// GN blocks M [default: 3; recipe step: 1].
    #[arg(long, value_parser = clap::value_parser!(u16).range(0..=64))]
    pub(crate) gn_blocks: Option<u16>,
    /// Linear layers of every perceptron [default: 2].
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=64))]
    pub(crate) mlp_layers: Option<u16>,
    /// Latent size l [default: 32; recipe step: 16].
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) width: Option<u16>,
    /// Scans along the rod in each block, outwards and as many inwards [default: 0; recipe best: 16,
    /// step: 4].
    #[arg(long, value_parser = clap::value_parser!(u16).range(0..=256))]
    pub(crate) scans: Option<u16>,
    /// Inputs: paper (world axes), body-frame (body axes, with the right-hand side) [default: the recipe's].
    #[arg(long, value_enum)]
    pub(crate) features: Option<FeaturesArg>,
    /// Outputs: full (dp and dlambda), semi (turns, from which statics makes the rest; body-frame only, and not for knots,
    /// which are held at both ends) [default: the recipe's].
    #[arg(long, value_enum)]
    pub(crate) head: Option<HeadArg>,
    /// mse: MSE(V) + MSE(E). cg: logarithm of the residual after six iterations of block-Jacobi conjugate gradients from
    /// the guess. log: logarithm of each sample's squared error. [default: the recipe's]
    #[arg(long, value_enum)]
    pub(crate) loss: Option<Loss>,
    /// Times through the training samples [default: 600; recipe step: 100].
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub(crate) epochs: Option<u64>,
    /// Samples in a batch [default: 128; 32 knots, 16 trees].
    #[arg(long, value_parser = whole)]
    pub(crate) batch: Option<usize>,
    /// Step size of Adam [default: 1e-3; recipes best and step: 2e-3].
    #[arg(long, value_parser = positive, allow_hyphen_values = true)]
    pub(crate) learning_rate: Option<f64>,
    /// How the step size goes on: constant (the paper's), or cosine: down to nothing at the end [default: the recipe's].
    #[arg(long, value_enum)]
    pub(crate) schedule: Option<Schedule>,
    /// Seed of the parameters and of the samples' order.
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    pub(crate) seed: u64,
    /// Threads [default: one a core]. The weights have the same bits on any number.
    #[arg(long, value_parser = threads)]
    pub(crate) threads: Option<usize>,
    /// What computes the network: ndarray; flex, wgpu or cuda where built with that cargo feature.
    #[arg(long, default_value_t = Backend::default())]
    pub(crate) backend: Backend,
    #[command(flatten)]
    pub(crate) set: SetArgs,
    /// Where the checkpoint goes: PATH.toml and PATH.safetensors, the curves PATH.csv and PATH.svg, and until the
    /// training is done its state, PATH.state [default: trained/SCENARIO-RECIPE].
    #[arg(long, value_name = "PATH", value_parser = place)]
    pub(crate) out: Option<PathBuf>,
    /// Begin with the weights of this checkpoint (PATH.toml with PATH.safetensors) instead of random ones. It must have
    /// been trained on the same data, with the same features, head and sizes.
    #[arg(long, value_name = "PATH", value_parser = place, conflicts_with = "resume")]
    pub(crate) from: Option<PathBuf>,
    /// Replace a checkpoint that is there already.
    #[arg(long)]
    pub(crate) force: bool,
    /// Epochs between two measurements.
    #[arg(long, default_value_t = MEASURE_EVERY, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) measure_every: u64,
    /// Goes on with a training that was cut off: the result has the same bits as if it had not been.
    #[arg(long)]
    pub(crate) resume: bool,
    /// A network after a fifteenth of the epochs, with a falling step size, measured on fewer scenes: usable, and for the
    /// paper's rods done in under three minutes on two cores.
    #[arg(long, conflicts_with = "epochs")]
    pub(crate) quick: bool,
    /// Print nothing but errors.
    #[arg(long)]
    pub(crate) quiet: bool,
}

/// A set of defaults.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Recipe {
    Paper,
    Best,
    Step,
}

impl Recipe {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Best => "best",
            Self::Step => "step",
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum FeaturesArg {
    Paper,
    BodyFrame,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum HeadArg {
    Full,
    Semi,
}

/// What is made small.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Loss {
    Mse,
    Cg,
    Log,
}

impl Loss {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Mse => "mse",
            Self::Cg => "cg",
            Self::Log => "log",
        }
    }
}

/// How Adam's step size goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Schedule {
    Constant,
    Cosine,
}

impl Schedule {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Cosine => "cosine",
        }
    }
}

impl Plan {
    /// Whether it is for starts of whole steps.
    pub(crate) fn is_of_steps(&self) -> bool {
        self.head == Head::Turns
    }

    /// What inputs and outputs mean, as long as the inputs' sizes are not known.
    pub(crate) fn unwhitened(&self, norms: Norms) -> Encoding {
        let Self { features, head, .. } = *self;
        Encoding { features, head, norms, whitening: features.unwhitened() }
    }

    /// All that a training's result depends on: a resumed one must agree.
    pub(crate) fn fingerprint(&self) -> BTreeMap<String, String> {
        let Self { scenario, recipe, features, head, network, loss, epochs, batch, learning_rate, schedule, .. } = self;
        let settings = [
            ("scenario", scenario.to_string()),
            ("recipe", recipe.name().to_owned()),
            ("features", format!("{features:?}")),
            ("head", format!("{head:?}")),
            ("network", format!("{network:?}")),
            ("loss", loss.name().to_owned()),
            ("epochs", epochs.to_string()),
            ("batch", batch.to_string()),
            ("learning-rate", format!("{learning_rate:?}")),
            ("schedule", schedule.name().to_owned()),
            ("seed", self.seed.to_string()),
            ("backend", self.backend.to_string()),
            ("measure-every", self.measure_every.to_string()),
            ("scenes", self.scenes.to_string()),
        ];
        settings.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
    }
}

/// A training with all choices made.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) scenario: Scenario,
    pub(crate) recipe: Recipe,
    pub(crate) features: Features,
    pub(crate) head: Head,
    pub(crate) network: NetworkConfig,
    pub(crate) loss: Loss,
    pub(crate) epochs: u64,
    pub(crate) batch: usize,
    pub(crate) learning_rate: f64,
    pub(crate) schedule: Schedule,
    pub(crate) seed: u64,
    pub(crate) backend: Backend,
    pub(crate) measure_every: u64,
    pub(crate) threads: usize,
    /// Validation scenes to measure on.
    pub(crate) scenes: usize,
    pub(crate) out: PathBuf,
}

impl TrainArgs {
    /// What the command line without other flags stands for.
    pub(crate) fn new(scenario: Scenario, recipe: Recipe, set: SetArgs) -> Self {
        Self {
            scenario,
            recipe,
            gn_blocks: None,
            mlp_layers: None,
            width: None,
            scans: None,
            features: None,
            head: None,
            loss: None,
            epochs: None,
            batch: None,
            learning_rate: None,
            schedule: None,
            seed: 0,
            threads: None,
            backend: Backend::default(),
            set,
            out: None,
            from: None,
            force: false,
            measure_every: MEASURE_EVERY,
            resume: false,
            quick: false,
            quiet: false,
        }
    }

    /// Fills in the recipe's choices.
    ///
    /// # Errors
    /// If flags contradict each other.
    pub(crate) fn plan(&self) -> Result<Plan> {
        let recipe = self.recipe;
        // The paper's and our own differ in single parts; starts of whole steps have inputs and outputs of their own.
        let features = match (self.features, recipe) {
            (None, Recipe::Step) => Features::History,
            (Some(FeaturesArg::Paper), _) | (None, Recipe::Paper) => Features::Paper,
            (Some(FeaturesArg::BodyFrame), _) | (None, Recipe::Best) => Features::BodyFrame,
        };
        let is_knot = self.scenario == Scenario::Knot;
        let head = match (self.head, features) {
            (None, Features::History) => Head::Turns,
            (Some(HeadArg::Full), _) | (None, Features::Paper) => Head::Full,
            (None, Features::BodyFrame) if is_knot => Head::Full,
            (Some(HeadArg::Semi), _) | (None, Features::BodyFrame) => Head::Semi,
        };
        if recipe == Recipe::Step && !self.scenario.teaches_steps() {
            bail!(
                "--recipe step needs the scenario rod or helix: in free motion, held at one place; not {}",
                self.scenario
            );
        }
        if recipe == Recipe::Step && (self.features.is_some() || self.head.is_some()) {
            bail!("--features and --head change the recipes paper and best, but the recipe is step");
        }
        if let (Recipe::Step, Some(data)) = (recipe, &self.set.data) {
            bail!("--data {}: recipe step has no data set, it simulates what it learns from", data.display());
        }
        if is_knot && head == Head::Semi {
            bail!(
                "--head semi needs rods that are held at one place, but a knot is held at both ends; use --head full"
            );
        }
        if !head.fits(features) {
            bail!("--head {} needs --features body-frame, but the features are the paper's", head.name());
        }
        let of = |paper: usize, best: usize, step: usize| match recipe {
            Recipe::Paper => paper,
            Recipe::Best => best,
            Recipe::Step => step,
        };
        let loss = self.loss.unwrap_or(match recipe {
            Recipe::Paper => Loss::Mse,
            Recipe::Best => Loss::Cg,
            Recipe::Step => Loss::Log,
        });
        if loss == Loss::Cg && recipe == Recipe::Step {
            bail!("--loss cg is about linear solves, but recipe step is about whole steps; use log or mse");
        }
        let is_paper = recipe == Recipe::Paper;
        let paper = NetworkConfig::default();
        let or = |given: Option<u16>, default: usize| given.map_or(default, usize::from);
        let network = features.configure(
            head,
            NetworkConfig {
                gn_blocks: or(self.gn_blocks, of(3, 3, 1)),
                mlp_layers: or(self.mlp_layers, paper.mlp_layers),
                width: or(self.width, of(32, 32, 16)),
                scans: or(self.scans, of(0, 16, 4)),
                ..paper
            },
        );
        let default_schedule = if !is_paper || self.quick { Schedule::Cosine } else { Schedule::Constant };
        let epochs = of(600, 600, 100) as u64;
        let name = || format!("{}-{}", self.scenario, self.recipe.name());
        Ok(Plan {
            scenario: self.scenario,
            recipe: self.recipe,
            features,
            head,
            network,
            loss,
            epochs: self.epochs.unwrap_or(if self.quick { epochs / 15 } else { epochs }),
            // Few knots and large trees: smaller batches make more steps of them.
            batch: self.batch.unwrap_or(match self.scenario {
                Scenario::Rod | Scenario::Helix => 128,
                Scenario::Knot => 32,
                Scenario::Tree => 16,
            }),
            learning_rate: self.learning_rate.unwrap_or(if is_paper { 1e-3 } else { 2e-3 }),
            schedule: self.schedule.unwrap_or(default_schedule),
            seed: self.seed,
            backend: self.backend,
            measure_every: self.measure_every,
            scenes: match self.scenario {
                // A tree's solves take a thousand times as long as a rod's.
                Scenario::Tree => 4,
                Scenario::Knot => 10,
                Scenario::Rod | Scenario::Helix if self.quick => 12,
                Scenario::Rod | Scenario::Helix => 30,
            },
            threads: threads_or_cores(self.threads),
            out: self.out.clone().unwrap_or_else(|| PathBuf::from("trained").join(name())),
        })
    }
}

/// The number asked for, or one a core.
pub(crate) fn threads_or_cores(asked: Option<usize>) -> usize {
    asked.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, |n| n.get()))
}

/// A path with a file name; an ending of the checkpoint's own files is taken off.
fn place(text: &str) -> Result<PathBuf, String> {
    const ENDINGS: [&str; 2] = [".toml", ".safetensors"];
    let text = ENDINGS.iter().find_map(|ending| text.strip_suffix(ending)).unwrap_or(text);
    if let Some(ending) = ENDINGS.iter().find(|ending| text.ends_with(**ending)) {
        return Err(format!("it must not end in {ending} twice"));
    }
    let path = PathBuf::from(text);
    if text.ends_with(['/', '\\']) || path.file_name().is_none() {
        return Err("it must end in a name, such as trained/rod".to_owned());
    }
    Ok(path)
}

/// A whole number from 1 to 65536.
pub(crate) fn whole(text: &str) -> Result<usize, String> {
    match usize::from_str(text) {
        Ok(value @ 1..=65536) => Ok(value),
        _ => Err("it must be a whole number from 1 to 65536".to_owned()),
    }
}
