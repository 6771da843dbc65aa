//! What the page says of the networks, by their cards.

use anyhow::{Context as _, Result};
use catalogue::{GuessName, Network, Recipe};
use dataset::Scenario;
use report::Reference;

use crate::library::{Learned, Library};

impl Library {
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
            for (name, guess) in self.guesses(scenario, Learned::Networks)?.iter() {
                let Some(network) = guess.network() else { continue };
                let revision = network.card().git_revision.as_deref().unwrap_or("unknown");
                let origin = &network.origin;
                let words =
                    format!("{}, revision {revision}, weights BLAKE3 {}", origin.network, origin.weights_blake3);
                origins.push([format!("{scenario}, {name}"), words]);
            }
        }
        Ok(origins)
    }
}
