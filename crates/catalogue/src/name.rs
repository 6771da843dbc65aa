//! The guesses by name, those without learning and the learned ones alike.

use std::fmt;
use std::str::FromStr;

use names::names;
use serde::Serialize;
use solver::guess::GuessKind;

/// How a network was trained.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Recipe {
    /// As in the paper.
    Paper,
    /// Our own way.
    Best,
    /// For starts of whole steps.
    Step,
}

names!(Recipe { Paper = "paper", Best = "best", Step = "step" });

/// A guess that learned from a data set before the first step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LearnedName {
    /// The supplement's nearest neighbours.
    Knn,
    /// COPINGNet; the program has it with the cargo feature `gn` alone.
    Network(Recipe),
}

impl LearnedName {
    /// All of them.
    const ALL: [Self; 4] =
        [Self::Knn, Self::Network(Recipe::Paper), Self::Network(Recipe::Best), Self::Network(Recipe::Step)];

    fn name(self) -> &'static str {
        match self {
            Self::Knn => "knn",
            Self::Network(Recipe::Paper) => "gn",
            Self::Network(Recipe::Best) => "gn-best",
            Self::Network(Recipe::Step) => "gn-step",
        }
    }
}

/// Which network a guess is.
#[derive(Clone, Debug, Serialize)]
pub struct Origin {
    /// Its recipe, its training, and where it comes from, in words.
    pub network: String,
    /// BLAKE3 hash of its weights' file, as its card has it.
    pub weights_blake3: String,
}

/// A guess as it stands on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GuessName {
    /// Without learning.
    Plain(GuessKind),
    /// Learned.
    Learned(LearnedName),
}

impl GuessName {
    /// Whether it starts whole steps.
    pub fn helps_steps(self) -> bool {
        match self {
            Self::Plain(kind) => kind.helps_steps(),
            Self::Learned(_) => self.recipe() == Some(Recipe::Step),
        }
    }

    /// Whether it starts linear solves.
    pub fn helps_solves(self) -> bool {
        self != Self::Plain(GuessKind::Zero) && !self.helps_steps()
    }

    /// Whether it is a learned one.
    pub fn is_learned(self) -> bool {
        matches!(self, Self::Learned(_))
    }

    /// The recipe of a network.
    pub fn recipe(self) -> Option<Recipe> {
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
