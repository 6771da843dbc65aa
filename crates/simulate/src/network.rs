//! COPINGNet's networks: those built into the program, and those in files.

use anyhow::{Context, Result, bail};
use copingnet::{Card, Checkpoint, Features, GnGuess, GnStepGuess, Head, Trained};
use dataset::Scenario;
use graph::{Graph, Normal};
use solver::guess::InitialGuess;

use crate::cli::LearnedArgs;
use crate::guess::{GuessName, Recipe};
use crate::training::Training;

/// A checkpoint in the program.
struct BuiltIn {
    name: &'static str,
    card: &'static [u8],
    weights: &'static [u8],
}

/// A file of the folder `checkpoints`.
macro_rules! file {
    ($name:literal, $end:literal) => {
        include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../checkpoints/", $name, $end))
    };
}

/// A checkpoint of the folder `checkpoints`.
macro_rules! built_in {
    ($name:literal) => {
        BuiltIn { name: $name, card: file!($name, ".toml"), weights: file!($name, ".safetensors") }
    };
}

/// One a scenario and recipe, by both names.
static BUILT_IN: [BuiltIn; 6] = [
    built_in!("rod-paper"),
    built_in!("rod-best"),
    built_in!("rod-step"),
    built_in!("helix-paper"),
    built_in!("helix-best"),
    built_in!("helix-step"),
];

impl Recipe {
    /// Its name in files.
    fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Best => "best",
            Self::Step => "step",
        }
    }
}

/// A network ready for use.
pub(crate) struct Network {
    trained: Trained,
    /// Where it comes from, in words.
    pub(crate) origin: String,
}

impl Network {
    /// The network of a scenario and recipe: that of `--checkpoint` if it is one, else the one that is built in.
    pub(crate) fn load(recipe: Recipe, training: &Training) -> Result<Self> {
        let (scenario, recipe) = (training.scenario.name(), recipe.name());
        if let Some(path) = &training.checkpoint {
            let own = Checkpoint::load(path).context("--checkpoint")?;
            if own.card.scenario == scenario && own.card.recipe == recipe {
                return Ok(Self::new(&own, &path.display().to_string()));
            }
        }
        let name = format!("{scenario}-{recipe}");
        let Some(built_in) = BUILT_IN.iter().find(|built_in| built_in.name == name) else {
            bail!("no network {name} is built in");
        };
        let checkpoint = Checkpoint::from_bytes(&name, built_in.card, built_in.weights).context("built in")?;
        Ok(Self::new(&checkpoint, "built in"))
    }

    fn new(Checkpoint { card, encoding, weights }: &Checkpoint, place: &str) -> Self {
        let Card { scenario, recipe, training, .. } = card;
        let trained = match training.epochs {
            0 => "untrained".to_owned(),
            epochs => format!("trained for {epochs} epochs"),
        };
        let origin = format!("recipe {recipe}, scenario {scenario}, {trained}, {place}");
        Self { trained: Trained::new(weights, encoding.clone()), origin }
    }

    /// Whether what it predicts for a planar scene has the symmetry of the plane, by features in body frames.
    pub(crate) fn knows_planes(&self) -> bool {
        self.trained.encoding().features != Features::Paper
    }

    /// The guess of one connected set of segments, restricted to a plane if one is given.
    pub(crate) fn guess(&self, graph: Graph, plane: Option<Normal>) -> Box<dyn InitialGuess> {
        match self.trained.encoding().head {
            Head::Turns => Box::new(GnStepGuess::new(&self.trained, graph, plane)),
            Head::Full | Head::Semi => Box::new(self.projection(graph, plane)),
        }
    }

    /// The prediction in the projection's place, of a network for linear solves.
    pub(crate) fn projection(&self, graph: Graph, plane: Option<Normal>) -> GnGuess {
        GnGuess::new(&self.trained, graph, plane)
    }
}

/// Checks that the checkpoint of `--checkpoint`, if there is one, is for one of these guesses and scenarios.
///
/// # Errors
/// If it is not, cannot be read, or is damaged.
pub(crate) fn check(args: &LearnedArgs, names: &[GuessName], scenarios: &[Scenario]) -> Result<()> {
    let Some(path) = &args.checkpoint else { return Ok(()) };
    let card = Checkpoint::load(path).context("--checkpoint")?.card;
    let scenarios: Vec<&str> = scenarios.iter().map(|scenario| scenario.name()).collect();
    let recipes: Vec<&str> = names.iter().filter_map(|name| name.recipe()).map(Recipe::name).collect();
    let path = path.display();
    if !scenarios.contains(&card.scenario.as_str()) {
        bail!(
            "--checkpoint {path}: scenario = {:?}, but it must be {} unless --scenario says otherwise",
            card.scenario,
            scenarios.join(" or ")
        );
    }
    if !recipes.contains(&card.recipe.as_str()) {
        bail!(
            "--checkpoint {path}: recipe = {:?}, but it must be {} (gn takes paper, gn-best best, gn-step step)",
            card.recipe,
            recipes.join(" or ")
        );
    }
    Ok(())
}
