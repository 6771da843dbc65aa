//! Guesses by name, those without learning and the learned ones alike, and what they need.

use std::sync::Arc;

use anyhow::{Result, bail};
use graph::{Graph, Normal, planar_normal};
use knn::{Knn, KnnGuess, Params};
use rod::Model;
use scene::Scene;
use solver::component::Members;
use solver::guess::{GuessKind, InitialGuess};
use solver::projection::Projection;
use solver::topology::Topology;

use crate::name::{GuessName, LearnedName, Origin};
#[cfg(feature = "gn")]
use crate::network::Network;
use crate::training::Training;
use terminal::say;

/// A guess with what it has learned, ready for any number of rods.
pub enum Guess {
    /// Without learning.
    Plain(GuessKind),
    /// Learned.
    Learned(Learned),
}

/// What a guess has learned.
pub enum Learned {
    /// Nearest neighbours.
    Knn(Arc<Knn>),
    /// A network.
    #[cfg(feature = "gn")]
    Network(Box<Network>),
}

impl Guess {
    /// Gets what the guess needs: the data set is generated where it is not there yet.
    pub fn load(name: GuessName, training: &Training) -> Result<Self> {
        Ok(match name {
            GuessName::Plain(kind) => Self::Plain(kind),
            GuessName::Learned(LearnedName::Knn) => {
                let knn = Knn::new(&training.dataset()?, Params::default());
                if !training.quiet {
                    say!("knn: {} data points of {}", knn.len(), training.directory().display())?;
                }
                Self::Learned(Learned::Knn(Arc::new(knn)))
            }
            #[cfg(feature = "gn")]
            GuessName::Learned(LearnedName::Network(recipe)) => {
                let network = Network::load(recipe, training.scenario, training.own.as_ref())?;
                if !training.quiet {
                    say!("{name}: {}", network.origin.network)?;
                }
                Self::Learned(Learned::Network(Box::new(network)))
            }
            #[cfg(not(feature = "gn"))]
            GuessName::Learned(LearnedName::Network(_)) => bail!("--guess {name} needs the cargo feature gn"),
        })
    }

    /// Which network it is, if it is one.
    pub fn origin(&self) -> Option<&Origin> {
        match self {
            #[cfg(feature = "gn")]
            Self::Learned(Learned::Network(network)) => Some(&network.origin),
            _ => None,
        }
    }

    /// The network, if it is one.
    #[cfg(feature = "gn")]
    pub fn network(&self) -> Option<&Network> {
        match self {
            Self::Learned(Learned::Network(network)) => Some(network),
            _ => None,
        }
    }

    /// Whether it stays exactly in the plane of a planar scene without being asked to.
    pub fn knows_planes(&self) -> bool {
        match self {
            #[cfg(feature = "gn")]
            Self::Learned(Learned::Network(network)) => network.knows_planes(),
            _ => false,
        }
    }

    /// The plane that it is restricted to without being asked to.
    pub fn own_plane(&self, scene: &Scene) -> Option<Normal> {
        if self.knows_planes() { planar_normal(&scene.model, &scene.state) } else { None }
    }

    /// [`Self::build`] for all sets of a scene.
    pub fn factory(
        &self,
        plane: Option<Normal>,
    ) -> impl Fn(&Model, &Members, &Topology) -> Option<Box<dyn InitialGuess>> + '_ {
        move |model, members, topology| self.build(plane, model, members, topology)
    }

    /// The guess of one connected set of segments, restricted to a plane if one is given; `None` for a zero start.
    pub fn build(
        &self,
        plane: Option<Normal>,
        model: &Model,
        members: &Members,
        topology: &Topology,
    ) -> Option<Box<dyn InitialGuess>> {
        match self {
            Self::Plain(kind) => kind.build(model, members, topology),
            Self::Learned(learned) => {
                let graph = Graph::new(model, members, topology);
                Some(match learned {
                    Learned::Knn(knn) => Box::new(KnnGuess::new(knn.clone(), graph, plane)),
                    #[cfg(feature = "gn")]
                    Learned::Network(network) => network.guess(graph, plane),
                })
            }
        }
    }
}

impl Learned {
    /// The prediction that takes the projection's place in one connected set of segments, restricted to a plane if one
    /// is given.
    pub fn project(
        &self,
        plane: Option<Normal>,
        model: &Model,
        members: &Members,
        topology: &Topology,
    ) -> Box<dyn Projection> {
        let graph = Graph::new(model, members, topology);
        match self {
            Self::Knn(knn) => Box::new(KnnGuess::new(knn.clone(), graph, plane)),
            #[cfg(feature = "gn")]
            Self::Network(network) => Box::new(network.projection(graph, plane)),
        }
    }
}

/// The plane of `--planar` for a scene.
///
/// # Errors
/// If the scene does not stay in one.
pub fn plane(scene: &Scene) -> Result<Normal> {
    match planar_normal(&scene.model, &scene.state) {
        Some(normal) => Ok(normal),
        None => bail!(
            "--planar needs a scene that lies and stays in a plane to which d1 or d2 of all segments is normal, but {} does not",
            scene.name
        ),
    }
}
