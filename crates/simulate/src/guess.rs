//! Guesses by name, those without learning and the learned ones alike, and what they need.

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use anyhow::{Result, bail};
use graph::{Graph, Normal, planar_normal};
use knn::{Knn, KnnGuess, Params};
use rod::Model;
use scene::Scene;
use serde::Serialize;
use solver::component::Members;
use solver::guess::{GuessKind, InitialGuess};
use solver::projection::Projection;
use solver::topology::Topology;

use crate::cli::LearnedArgs;
#[cfg(feature = "gn")]
use crate::network::Network;
use crate::training::Training;
use terminal::say;

/// How a network was trained.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Recipe {
    /// As in the paper.
    Paper,
    /// Our own way.
    Best,
}

/// A guess that learned from a data set before the first step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LearnedName {
    /// The supplement's nearest neighbours.
    Knn,
    /// COPINGNet; the program has it with the cargo feature `gn` alone.
    Network(Recipe),
}

impl LearnedName {
    /// All of them.
    const ALL: [Self; 3] = [Self::Knn, Self::Network(Recipe::Paper), Self::Network(Recipe::Best)];

    fn name(self) -> &'static str {
        match self {
            Self::Knn => "knn",
            Self::Network(Recipe::Paper) => "gn",
            Self::Network(Recipe::Best) => "gn-best",
        }
    }
}

/// A guess as it stands on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum GuessName {
    /// Without learning.
    Plain(GuessKind),
    /// Learned.
    Learned(LearnedName),
}

impl GuessName {
    /// Whether it starts whole steps.
    pub(crate) fn helps_steps(self) -> bool {
        match self {
            Self::Plain(kind) => kind.helps_steps(),
            Self::Learned(_) => false,
        }
    }

    /// Whether it starts linear solves.
    pub(crate) fn helps_solves(self) -> bool {
        self != Self::Plain(GuessKind::Zero) && !self.helps_steps()
    }

    /// Whether it is a learned one.
    pub(crate) fn is_learned(self) -> bool {
        matches!(self, Self::Learned(_))
    }

    /// The recipe of a network.
    pub(crate) fn recipe(self) -> Option<Recipe> {
        match self {
            Self::Learned(LearnedName::Network(recipe)) => Some(recipe),
            _ => None,
        }
    }
}

impl fmt::Display for GuessName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Plain(kind) => kind.fmt(f),
            Self::Learned(learned) => f.write_str(learned.name()),
        }
    }
}

impl FromStr for GuessName {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        if let Some(learned) = LearnedName::ALL.into_iter().find(|learned| learned.name() == name) {
            return match learned {
                LearnedName::Network(_) if !cfg!(feature = "gn") => {
                    Err("this program was built without networks; build it with `--features gn`".to_owned())
                }
                _ => Ok(Self::Learned(learned)),
            };
        }
        let kind: Result<GuessKind, String> = name.parse();
        let learned = LearnedName::ALL.map(LearnedName::name).join(", ");
        kind.map(Self::Plain).map_err(|expected| format!("{expected}, or a learned one: {learned}"))
    }
}

/// Which network a guess is.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Origin {
    /// Its recipe, its training, and where it comes from, in words.
    pub(crate) network: String,
    /// BLAKE3 hash of its weights' file, as its card has it.
    pub(crate) weights_blake3: String,
}

/// A guess with what it has learned, ready for any number of rods.
pub(crate) enum Guess {
    /// Without learning.
    Plain(GuessKind),
    /// Learned.
    Learned(Learned),
}

/// What a guess has learned.
pub(crate) enum Learned {
    /// Nearest neighbours.
    Knn(Arc<Knn>),
    /// A network.
    #[cfg(feature = "gn")]
    Network(Network),
}

impl Guess {
    /// Gets what the guess needs: the data set is generated where it is not there yet.
    pub(crate) fn load(name: GuessName, training: &Training) -> Result<Self> {
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
                let network = Network::load(recipe, training)?;
                if !training.quiet {
                    say!("{name}: {}", network.origin.network)?;
                }
                Self::Learned(Learned::Network(network))
            }
            #[cfg(not(feature = "gn"))]
            GuessName::Learned(LearnedName::Network(_)) => bail!("--guess {name} needs the cargo feature gn"),
        })
    }

    /// Which network it is, if it is one.
    pub(crate) fn origin(&self) -> Option<&Origin> {
        match self {
            #[cfg(feature = "gn")]
            Self::Learned(Learned::Network(network)) => Some(&network.origin),
            _ => None,
        }
    }

    /// Whether it stays exactly in the plane of a planar scene without being asked to.
    pub(crate) fn knows_planes(&self) -> bool {
        match self {
            #[cfg(feature = "gn")]
            Self::Learned(Learned::Network(network)) => network.knows_planes(),
            _ => false,
        }
    }

    /// The plane that it is restricted to without being asked to.
    pub(crate) fn own_plane(&self, scene: &Scene) -> Option<Normal> {
        if self.knows_planes() { planar_normal(&scene.model, &scene.state) } else { None }
    }

    /// [`Self::build`] for all sets of a scene.
    pub(crate) fn factory(
        &self,
        plane: Option<Normal>,
    ) -> impl Fn(&Model, &Members, &Topology) -> Option<Box<dyn InitialGuess>> + '_ {
        move |model, members, topology| self.build(plane, model, members, topology)
    }

    /// The guess of one connected set of segments, restricted to a plane if one is given; `None` for a zero start.
    pub(crate) fn build(
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
                    Learned::Network(network) => Box::new(network.guess(graph, plane)),
                })
            }
        }
    }
}

impl Learned {
    /// The prediction that takes the projection's place in one connected set of segments, restricted to a plane if one
    /// is given.
    pub(crate) fn project(
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
            Self::Network(network) => Box::new(network.guess(graph, plane)),
        }
    }
}

/// Checks that what `--data` and `--checkpoint` name is read by a guess that was asked for.
pub(crate) fn check_sources(args: &LearnedArgs, names: &[GuessName]) -> Result<()> {
    let is_knn = |name: &GuessName| *name == GuessName::Learned(LearnedName::Knn);
    let is_network = |name: &GuessName| name.recipe().is_some();
    for (flag, given, guesses, is_read) in [
        ("--data", args.data.is_some(), "knn", names.iter().any(is_knn)),
        ("--checkpoint", args.checkpoint.is_some(), "gn or gn-best", names.iter().any(is_network)),
    ] {
        if given && !is_read {
            let asked: Vec<String> = names.iter().map(GuessName::to_string).collect();
            let asked = if asked.is_empty() { "none".to_owned() } else { asked.join(", ") };
            bail!("{flag} needs the guess {guesses}, but asked for: {asked}");
        }
    }
    Ok(())
}

/// The plane of `--planar` for a scene.
///
/// # Errors
/// If the scene does not stay in one.
pub(crate) fn plane(scene: &Scene) -> Result<Normal> {
    match planar_normal(&scene.model, &scene.state) {
        Some(normal) => Ok(normal),
        None => bail!(
            "--planar needs a scene that lies and stays in a plane to which d1 or d2 of all segments is normal, but {} does not",
            scene.name
        ),
    }
}
