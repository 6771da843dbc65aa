//! Guesses by name, those without learning and the learned ones alike, and what they need.

use std::fmt;
use std::str::FromStr;
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

use crate::output::say;
use crate::training::Training;

/// A guess that learns from a data set before the first step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LearnedName {
    /// The supplement's nearest neighbours.
    Knn,
}

impl LearnedName {
    /// All of them.
    const ALL: [Self; 1] = [Self::Knn];

    fn name(self) -> &'static str {
        match self {
            Self::Knn => "knn",
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
            Self::Learned(LearnedName::Knn) => false,
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
            return Ok(Self::Learned(learned));
        }
        let kind: Result<GuessKind, String> = name.parse();
        let learned = LearnedName::ALL.map(LearnedName::name).join(", ");
        kind.map(Self::Plain).map_err(|expected| format!("{expected}, or a learned one: {learned}"))
    }
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
        })
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
            Self::Learned(Learned::Knn(knn)) => {
                Some(Box::new(KnnGuess::new(knn.clone(), Graph::new(model, members, topology), plane)))
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
        match self {
            Self::Knn(knn) => Box::new(KnnGuess::new(knn.clone(), Graph::new(model, members, topology), plane)),
        }
    }
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
