//! Guesses by name, those without learning and the learned ones alike, and what they need.

use std::sync::Arc;

use anyhow::{Context, Result};
use cosserat::guess::{GuessKind, InitialGuess, Members, Topology};
use cosserat::internals::dynamics::projection::Projection;
use cosserat::scene::Scene;
use cosserat::state::Model;
use graph::{Graph, Normal, planar_normal};
use knn::{Knn, KnnGuess, Params};
use terminal::say;

use crate::name::GuessName;
#[cfg(feature = "gn")]
use crate::network::Network;
use crate::origin::Origin;
use crate::training::Training;

/// A guess with what it has learned, ready for any number of rods.
pub enum Guess {
    /// Without learning.
    Plain(GuessKind),
    /// Nearest neighbours.
    Knn(Arc<Knn>),
    /// A network.
    #[cfg(feature = "gn")]
    Network(Box<Network>),
}

impl Guess {
    /// Gets what the guess needs: the data set is generated where it is not there yet.
    pub fn load(name: GuessName, training: &Training) -> Result<Self> {
        let (guess, source) = match name {
            GuessName::Plain(kind) => return Ok(Self::Plain(kind)),
            GuessName::Knn => {
                let knn = Knn::new(&training.dataset()?, Params::default());
                let source = format!("{} data points of {}", knn.len(), training.directory.display());
                (Self::Knn(Arc::new(knn)), source)
            }
            #[cfg(feature = "gn")]
            GuessName::Network(recipe) => {
                let network = Network::load(recipe, training.scenario, training.own.as_ref())?;
                let source = network.origin.network.clone();
                (Self::Network(Box::new(network)), source)
            }
            #[cfg(not(feature = "gn"))]
            GuessName::Network(_) => anyhow::bail!("--guess {name} needs the cargo feature gn"),
        };
        if !training.quiet {
            say!("{name}: {source}")?;
        }
        Ok(guess)
    }

    /// Which network it is, if it is one.
    pub fn origin(&self) -> Option<&Origin> {
        match self {
            #[cfg(feature = "gn")]
            Self::Network(network) => Some(&network.origin),
            _ => None,
        }
    }

    /// The network, if it is one.
    #[cfg(feature = "gn")]
    pub fn network(&self) -> Option<&Network> {
        match self {
            Self::Network(network) => Some(network),
            _ => None,
        }
    }

    /// What the card of a network says of how its data were simulated.
    #[cfg(feature = "gn")]
    pub(crate) fn simulated(&self) -> Option<&copingnet::Simulated> {
        self.network()?.card().simulated.as_ref()
    }

    /// Whether it stays exactly in the plane of a planar scene without being asked to.
    pub fn knows_planes(&self) -> bool {
        match self {
            #[cfg(feature = "gn")]
            Self::Network(network) => network.knows_planes(),
            _ => false,
        }
    }

    /// The guess of each connected set of segments, restricted to a plane if one is given; `None` for a zero start.
    pub fn factory(
        &self,
        plane: Option<Normal>,
    ) -> impl Fn(&Model, &Members, &Topology) -> Option<Box<dyn InitialGuess>> {
        move |model, members, topology| match self {
            Self::Plain(kind) => kind.build(model, members, topology),
            Self::Knn(knn) => Some(Box::new(KnnGuess::new(knn.clone(), Graph::new(model, members, topology), plane))),
            #[cfg(feature = "gn")]
            Self::Network(network) => Some(network.guess(Graph::new(model, members, topology), plane)),
        }
    }

    /// The predictions that take the projection's place, one for each connected set of segments, restricted to a plane if
    /// one is given; `None` for a guess that is not a learned one of linear solves.
    pub fn projection(&self, plane: Option<Normal>) -> Option<Projections<'_>> {
        match self {
            Self::Plain(_) => None,
            Self::Knn(knn) => Some(Box::new(move |model, members, topology| {
                Box::new(KnnGuess::new(knn.clone(), Graph::new(model, members, topology), plane))
            })),
            #[cfg(feature = "gn")]
            Self::Network(network) => network.helps_solves().then_some(Box::new(move |model, members, topology| {
                Box::new(network.projection(Graph::new(model, members, topology), plane))
            })),
        }
    }
}

/// What makes the predictions of each connected set of segments.
pub type Projections<'a> = Box<dyn Fn(&Model, &Members, &Topology) -> Box<dyn Projection> + 'a>;

/// The plane of `--planar` for a scene.
///
/// # Errors
/// If the scene does not stay in one.
pub fn plane(scene: &Scene) -> Result<Normal> {
    let needs = "--planar needs a scene that lies and stays in a plane to which d1 or d2 of all segments is normal";
    planar_normal(&scene.model, &scene.state).with_context(|| format!("{needs}, but {} does not", scene.name))
}

/// A row of a table: its name, the guess, and whether it is restricted to the scene's plane.
pub struct Row<'a> {
    /// What the table calls it.
    pub name: String,
    /// The guess's own name.
    pub guess_name: GuessName,
    /// The guess.
    pub guess: &'a Guess,
    planar: bool,
}

impl<'a> Row<'a> {
    /// The guess in a scene that stays in this plane, if it stays in one.
    pub fn factory(
        &self,
        plane: Option<Normal>,
    ) -> impl Fn(&Model, &Members, &Topology) -> Option<Box<dyn InitialGuess>> + use<'a> {
        self.guess.factory(plane.filter(|_| self.planar))
    }

    /// As [`Guess::projection`], in a scene that stays in this plane, if it stays in one.
    pub fn projection(&self, plane: Option<Normal>) -> Option<Projections<'a>> {
        self.guess.projection(plane.filter(|_| self.planar))
    }
}

/// Gets what these guesses need, each once.
pub fn load(names: impl IntoIterator<Item = GuessName>, training: &Training) -> Result<Vec<(GuessName, Guess)>> {
    let mut guesses: Vec<(GuessName, Guess)> = Vec::new();
    for name in names {
        if guesses.iter().all(|(other, _)| *other != name) {
            guesses.push((name, Guess::load(name, training)?));
        }
    }
    Ok(guesses)
}

/// The rows of a table; where scenes are planar, the learned ones that know nothing of it by themselves a second time.
pub fn rows(guesses: &[(GuessName, Guess)], are_planar: bool) -> Vec<Row<'_>> {
    let mut rows = Vec::new();
    for (guess_name, guess) in guesses {
        let (guess_name, knows_planes) = (*guess_name, guess.knows_planes());
        rows.push(Row { name: guess_name.to_string(), guess_name, guess, planar: knows_planes });
        if are_planar && guess_name.is_learned() && !knows_planes {
            rows.push(Row { name: format!("{guess_name}, planar"), guess_name, guess, planar: true });
        }
    }
    rows
}
