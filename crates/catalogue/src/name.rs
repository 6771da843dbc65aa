//! The guesses by name, those without learning and the learned ones alike.

use std::fmt;
use std::str::FromStr;

use cosserat::guess::GuessKind;
use names::names;

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

/// A guess as it stands on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GuessName {
    /// Without learning.
    Plain(GuessKind),
    /// The supplement's nearest neighbours.
    Knn,
    /// COPINGNet; the program has it with the cargo feature `gn` alone.
    Network(Recipe),
}

/// The learned ones with their names in flags.
const LEARNED: [(&str, GuessName); 4] = [
    ("knn", GuessName::Knn),
    ("gn", GuessName::Network(Recipe::Paper)),
    ("gn-best", GuessName::Network(Recipe::Best)),
    ("gn-step", GuessName::Network(Recipe::Step)),
];

impl GuessName {
    /// Whether it starts whole steps.
    pub fn helps_steps(self) -> bool {
        match self {
            Self::Plain(kind) => kind.helps_steps(),
            _ => self == Self::Network(Recipe::Step),
        }
    }

    /// Whether it starts linear solves.
    pub fn helps_solves(self) -> bool {
        self != Self::Plain(GuessKind::Zero) && !self.helps_steps()
    }

    /// Whether it learned from a data set before the first step.
    pub fn is_learned(self) -> bool {
        !matches!(self, Self::Plain(_))
    }
}

impl fmt::Display for GuessName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Plain(kind) => kind.fmt(f),
            _ => LEARNED.iter().filter(|(_, learned)| learned == self).try_for_each(|(name, _)| f.write_str(name)),
        }
    }
}

impl FromStr for GuessName {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        match LEARNED.into_iter().find(|(own, _)| *own == name) {
            Some((_, Self::Network(_))) if !cfg!(feature = "gn") => {
                Err("this program was built without networks; build it with `--features gn`".to_owned())
            }
            Some((_, learned)) => Ok(learned),
            None => name.parse().map(Self::Plain).map_err(|expected: String| {
                let learned = LEARNED.map(|(name, _)| name).join(", ");
                format!("{expected}, or a learned one: {learned}")
            }),
        }
    }
}
