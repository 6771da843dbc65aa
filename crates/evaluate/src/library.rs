//! The guesses of all scenarios, loaded when they are first asked for.

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use anyhow::{Context as _, Result};
use catalogue::{Guess, GuessName, Network, Recipe, Sources, Training, built_in, fitting};
use cosserat::scene::Scene;
use dataset::Scenario;
use report::Reference;

/// Guesses with what they have learned, by name.
pub(crate) type Guesses = Vec<(GuessName, Guess)>;

/// Which learned guesses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Learned {
    /// Networks, which are part of the program.
    Networks,
    /// Nearest neighbours, whose data set is generated on first use, and networks.
    All,
}

/// All learned guesses.
pub(crate) struct Library {
    /// Folder of the data sets.
    data: PathBuf,
    /// Hash of all networks.
    pub(crate) networks_blake3: String,
    loaded: RefCell<Vec<(Scenario, Learned, Rc<Guesses>)>>,
}

impl Library {
    pub(crate) fn new(data: &Path) -> Self {
        let mut hasher = blake3::Hasher::new();
        for (name, weights) in built_in() {
            hasher.update(name.as_bytes()).update(blake3::hash(weights).as_bytes());
        }
        let networks_blake3 = hasher.finalize().to_hex().to_string();
        Self { data: data.to_owned(), networks_blake3, loaded: RefCell::default() }
    }

    /// The learned guesses of a scenario; of networks, those that there are.
    pub(crate) fn guesses(&self, scenario: Scenario, which: Learned) -> Result<Rc<Guesses>> {
        let mut loaded = self.loaded.borrow_mut();
        if let Some((.., guesses)) = loaded.iter().find(|(of, kind, _)| (*of, *kind) == (scenario, which)) {
            return Ok(guesses.clone());
        }
        let mut names = networks_of(scenario);
        let mut sources = Sources::default();
        if which == Learned::All {
            names.insert(0, GuessName::Knn);
            sources.data = Some(self.data.clone());
        }
        let training = Training::of(&sources, &names, &[scenario], true)?.remove(0);
        let guesses = Rc::new(catalogue::load(names, &training)?);
        loaded.push((scenario, which, guesses.clone()));
        Ok(guesses)
    }

    /// The learned guesses that fit a scene best.
    pub(crate) fn for_scene(&self, scene: &Scene, which: Learned) -> Result<Rc<Guesses>> {
        self.guesses(fitting(scene), which)
    }

    /// Reads the paper's network of a scenario.
    pub(crate) fn paper_network<T>(&self, scenario: Scenario, read: impl FnOnce(&Network) -> T) -> Result<T> {
        let name = GuessName::Network(Recipe::Paper);
        let networks = self.guesses(scenario, Learned::Networks)?;
        let network = networks.iter().find(|(own, _)| *own == name).and_then(|(_, guess)| guess.network());
        network.map(read).with_context(|| format!("no network of the paper's for {scenario} is built in"))
    }

    /// Where the training data of a scenario's networks end in a chart over steps, by the paper's network.
    pub(crate) fn training_end(&self, scenario: Scenario) -> Result<Reference> {
        let steps = self.paper_network(scenario, |network| network.card().training.steps)?;
        let x = steps.context("a card that says no steps")? as f64;
        Ok(Reference::Vertical { x, label: "training data of gn end".to_owned() })
    }

    /// The networks: their names, what they are, the revisions that trained them, and their hashes.
    pub(crate) fn origins(&self) -> Result<Vec<[String; 2]>> {
        let mut origins = Vec::new();
        for scenario in Scenario::ALL {
            let guesses = self.guesses(scenario, Learned::Networks)?;
            for (name, network) in guesses.iter().filter_map(|(name, guess)| Some((name, guess.network()?))) {
                let (origin, revision) = (&network.origin, network.card().git_revision.as_deref().unwrap_or("unknown"));
                let words =
                    format!("{}, revision {revision}, weights BLAKE3 {}", origin.network, origin.weights_blake3);
                origins.push([format!("{scenario}, {name}"), words]);
            }
        }
        Ok(origins)
    }
}

/// Names of a scenario's networks, as far as there are some.
fn networks_of(scenario: Scenario) -> Vec<GuessName> {
    let is_there = |recipe: &Recipe| built_in().any(|(name, _)| name == format!("{scenario}-{}", recipe.name()));
    Recipe::ALL.into_iter().filter(is_there).map(GuessName::Network).collect()
}
