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

/// All learned guesses.
pub(crate) struct Library {
    sources: Sources,
    quiet: bool,
    networks_blake3: String,
    loaded: RefCell<Vec<(Scenario, Rc<Guesses>)>>,
}

impl Library {
    pub(crate) fn new(data: &Path, quiet: bool) -> Self {
        let mut hasher = blake3::Hasher::new();
        for (name, weights) in built_in() {
            hasher.update(name.as_bytes()).update(blake3::hash(weights).as_bytes());
        }
        let networks_blake3 = hasher.finalize().to_hex().to_string();
        let sources = Sources { data: Some(PathBuf::from(data)), checkpoint: None };
        Self { sources, quiet, networks_blake3, loaded: RefCell::default() }
    }

    /// Hash of all networks.
    pub(crate) fn networks_blake3(&self) -> &str {
        &self.networks_blake3
    }

    /// The networks in words and by their hashes, for the page.
    pub(crate) fn networks(&self) -> Result<Vec<(String, Origin)>> {
        let mut networks = Vec::new();
        for scenario in Scenario::ALL {
            for (name, guess) in self.guesses(scenario)?.iter() {
                networks.extend(guess.origin().map(|origin| (format!("{scenario}, {name}"), origin.clone())));
            }
        }
        Ok(networks)
    }

    /// The learned guesses of a scenario: nearest neighbours, then those networks that there are.
    pub(crate) fn guesses(&self, scenario: Scenario) -> Result<Rc<Guesses>> {
        let known = |loaded: &[(Scenario, Rc<Guesses>)]| {
            loaded.iter().find(|(of, _)| *of == scenario).map(|(_, guesses)| guesses.clone())
        };
        if let Some(guesses) = known(&self.loaded.borrow()) {
            return Ok(guesses);
        }
        let names = learned(scenario);
        let training = Training::of(&self.sources, &names, &[scenario], self.quiet)?.remove(0);
        let guesses = Rc::new(catalogue::load(names, &training)?);
        self.loaded.borrow_mut().push((scenario, guesses.clone()));
        Ok(guesses)
    }

    /// The learned guesses that fit a scene best.
    pub(crate) fn for_scene(&self, scene: &Scene) -> Result<Rc<Guesses>> {
        self.guesses(fitting(scene))
    }
}

/// Names of a scenario's learned guesses.
fn learned(scenario: Scenario) -> Vec<GuessName> {
    let networks = Recipe::ALL.into_iter().filter(|recipe| {
        let name = format!("{scenario}-{}", recipe.name());
        built_in().any(|(built_in, _)| built_in == name)
    });
    let all = std::iter::once(LearnedName::Knn).chain(networks.map(LearnedName::Network));
    all.map(GuessName::Learned).collect()
}
