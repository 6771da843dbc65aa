//! The guesses of all scenarios, loaded when they are first asked for.

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use anyhow::Result;
use catalogue::{Guess, GuessName, LearnedName, Origin, Recipe, Sources, Training, built_in, fitting};
use dataset::Scenario;
use scene::Scene;

/// Guesses with what they have learned, by name.
pub(crate) type Guesses = Vec<(GuessName, Guess)>;

/// All learned guesses: nearest neighbours, whose data sets are generated on first use, and the networks.
pub(crate) struct Library {
    /// Folder of the data sets.
    data: PathBuf,
    networks_blake3: String,
    loaded: RefCell<Vec<(Scenario, Rc<Guesses>)>>,
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

    /// Hash of all networks.
    pub(crate) fn networks_blake3(&self) -> &str {
        &self.networks_blake3
    }

    /// The networks in words and by their hashes, for the page.
    pub(crate) fn networks(&self) -> Result<Vec<(String, Origin)>> {
        let mut networks = Vec::new();
        for scenario in Scenario::ALL {
            for (name, guess) in self.network_guesses(scenario)? {
                networks.extend(guess.origin().map(|origin| (format!("{scenario}, {name}"), origin.clone())));
            }
        }
        Ok(networks)
    }

    /// The networks of a scenario.
    pub(crate) fn network_guesses(&self, scenario: Scenario) -> Result<Guesses> {
        self.load(scenario, &networks_of(scenario))
    }

    /// The learned guesses of a scenario: nearest neighbours, then those networks that there are.
    pub(crate) fn guesses(&self, scenario: Scenario) -> Result<Rc<Guesses>> {
        let known = |loaded: &[(Scenario, Rc<Guesses>)]| {
            loaded.iter().find(|(of, _)| *of == scenario).map(|(_, guesses)| guesses.clone())
        };
        if let Some(guesses) = known(&self.loaded.borrow()) {
            return Ok(guesses);
        }
        let mut names = networks_of(scenario);
        // A data set of trees takes gigabytes.
        if scenario != Scenario::Tree {
            names.insert(0, GuessName::Learned(LearnedName::Knn));
        }
        let guesses = Rc::new(self.load(scenario, &names)?);
        self.loaded.borrow_mut().push((scenario, guesses.clone()));
        Ok(guesses)
    }

    fn load(&self, scenario: Scenario, names: &[GuessName]) -> Result<Guesses> {
        let data = names.contains(&GuessName::Learned(LearnedName::Knn)).then(|| self.data.clone());
        let sources = Sources { data, checkpoint: None };
        let training = Training::of(&sources, names, &[scenario], true)?.remove(0);
        catalogue::load(names.iter().copied(), &training)
    }

    /// The learned guesses that fit a scene best.
    pub(crate) fn for_scene(&self, scene: &Scene) -> Result<Rc<Guesses>> {
        self.guesses(fitting(scene))
    }
}

/// Names of a scenario's networks, as far as there are some.
fn networks_of(scenario: Scenario) -> Vec<GuessName> {
    let is_there = |recipe: &Recipe| {
        let name = format!("{scenario}-{}", recipe.name());
        built_in().any(|(built_in, _)| built_in == name)
    };
    Recipe::ALL.into_iter().filter(is_there).map(|recipe| GuessName::Learned(LearnedName::Network(recipe))).collect()
}
