//! COPINGNet's networks: those built into the program, and those in files.

use std::path::Path;

use anyhow::{Context, Result, bail};
use copingnet::{Card, Checkpoint, CheckpointError, Features, GnGuess, GnStepGuess, Head, NetworkConfig, Trained};
use cosserat::guess::InitialGuess;
use dataset::Scenario;
use graph::{Graph, Normal};

use crate::name::{GuessName, Recipe};
use crate::origin::Origin;

/// Checkpoints of the folder `checkpoints`: name, card, weights.
macro_rules! built_in {
    ($($name:literal),+) => {
        [$((
            $name,
            include_bytes!(concat!("../../../checkpoints/", $name, ".toml")),
            include_bytes!(concat!("../../../checkpoints/", $name, ".safetensors")),
        )),+]
    };
}

/// One a scenario and recipe, by both names.
static BUILT_IN: [(&str, &[u8], &[u8]); 10] = built_in![
    "rod-paper",
    "rod-best",
    "rod-step",
    "helix-paper",
    "helix-best",
    "helix-step",
    "knot-paper",
    "knot-best",
    "tree-paper",
    "tree-best"
];

/// Names ("rod-paper") and weights' files of the networks in the program.
pub fn built_in() -> impl Iterator<Item = (&'static str, &'static [u8])> {
    BUILT_IN.iter().map(|&(name, _, weights)| (name, weights))
}

/// A network ready for use.
#[derive(Clone, Debug)]
pub struct Network {
    trained: Trained,
    sizes: NetworkConfig,
    card: Card,
    /// Where it comes from.
    pub origin: Origin,
}

impl Network {
    /// The network of a scenario and recipe: `own`, that of `--checkpoint`, if it is one, else the one that is built in,
    /// or where there is none (starts of whole steps of knots and trees) that of rods.
    pub(crate) fn load(recipe: Recipe, scenario: Scenario, own: Option<&Self>) -> Result<Self> {
        let (scenario, recipe) = (scenario.name(), recipe.name());
        if let Some(own) = own.filter(|own| own.card.scenario == scenario && own.card.recipe == recipe) {
            return Ok(own.clone());
        }
        let named = |name: String| BUILT_IN.iter().find(|built_in| built_in.0 == name);
        let built_in = [scenario, Scenario::Rod.name()].into_iter().find_map(|of| named(format!("{of}-{recipe}")));
        let (name, card, weights) = built_in.with_context(|| format!("no network {scenario}-{recipe} is built in"))?;
        Self::read(Path::new(name), card, weights, "built in").context("built in")
    }

    fn read(name: &Path, card: &[u8], weights: &[u8], place: &str) -> Result<Self, CheckpointError> {
        let weights_blake3 = blake3::hash(weights).to_hex().to_string();
        let Checkpoint { card, encoding, weights } = Checkpoint::from_bytes(name, card, weights)?;
        let Card { scenario, recipe, training, .. } = &card;
        if (recipe.as_str() == Recipe::Step.name()) != (encoding.head == Head::Turns) {
            let allowed = "\"step\" with head \"turns\", and with no other";
            return Err(CheckpointError::value(name, "recipe", format!("{recipe:?}"), allowed));
        }
        let trained = match training.epochs {
            0 => "untrained".to_owned(),
            epochs => format!("trained for {epochs} epochs"),
        };
        let network = format!("recipe {recipe}, scenario {scenario}, {trained}, {place}");
        let origin = Origin { network, weights_blake3 };
        Ok(Self { trained: Trained::new(&weights, encoding), sizes: *weights.config(), card, origin })
    }

    /// What its checkpoint says of it.
    pub fn card(&self) -> &Card {
        &self.card
    }

    /// Its sizes.
    pub fn sizes(&self) -> &NetworkConfig {
        &self.sizes
    }

    /// Whether what it predicts for a planar scene has the symmetry of the plane, by features in body frames.
    pub(crate) fn knows_planes(&self) -> bool {
        self.trained.encoding().features != Features::Paper
    }

    /// Whether it starts linear solves, not whole steps.
    pub(crate) fn helps_solves(&self) -> bool {
        self.trained.encoding().head != Head::Turns
    }

    /// The guess of one connected set of segments, restricted to a plane if one is given.
    pub(crate) fn guess(&self, graph: Graph, plane: Option<Normal>) -> Box<dyn InitialGuess> {
        if self.helps_solves() {
            Box::new(self.projection(graph, plane))
        } else {
            Box::new(GnStepGuess::new(&self.trained, graph, plane))
        }
    }

    /// The prediction in the projection's place, of a network for linear solves.
    pub(crate) fn projection(&self, graph: Graph, plane: Option<Normal>) -> GnGuess {
        GnGuess::new(&self.trained, graph, plane)
    }
}

/// The network of `--checkpoint`.
///
/// # Errors
/// If it is for none of these guesses and scenarios, cannot be read, or is damaged.
pub(crate) fn own(path: &Path, names: &[GuessName], scenarios: &[Scenario]) -> Result<Network> {
    let contents = Checkpoint::contents(path);
    let network =
        contents.and_then(|[card, weights]| Network::read(path, &card, &weights, &path.display().to_string()));
    let network = network.context("--checkpoint")?;
    let scenarios: Vec<&str> = scenarios.iter().map(|scenario| scenario.name()).collect();
    let is_asked = |recipe: &Recipe| names.contains(&GuessName::Network(*recipe));
    let recipes = Recipe::ALL.into_iter().filter(is_asked).map(Recipe::name).collect();
    for (key, value, allowed, hint) in [
        ("scenario", &network.card.scenario, scenarios, "unless --scenario says otherwise"),
        ("recipe", &network.card.recipe, recipes, "(gn takes paper, gn-best best, gn-step step)"),
    ] {
        if !allowed.contains(&value.as_str()) {
            let (path, allowed) = (path.display(), allowed.join(" or "));
            bail!("--checkpoint {path}: {key} = {value:?}, but it must be {allowed} {hint}");
        }
    }
    Ok(network)
}
