//! The sections of the report, a file each.

mod ablation;
pub(crate) mod claims;
mod dynamics;
mod knot;
mod long_term;
mod needs;
mod nrmse;
mod paper;
mod performance;
mod precision;
mod speedups;
pub(crate) mod stability;
mod temporal;

use clap::ValueEnum;
use clap::builder::PossibleValue;

use crate::cells::{Cells, Job};

/// Names of the sections on the command line, in the order of the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Name {
    Precision,
    Needs,
    Performance,
    Temporal,
    LongTerm,
    Dynamics,
    Nrmse,
    Speedups,
    Knot,
    Ablation,
    Stability,
}

impl ValueEnum for Name {
    fn value_variants<'a>() -> &'a [Self] {
        &[
            Self::Precision,
            Self::Needs,
            Self::Performance,
            Self::Temporal,
            Self::LongTerm,
            Self::Dynamics,
            Self::Nrmse,
            Self::Speedups,
            Self::Knot,
            Self::Ablation,
            Self::Stability,
        ]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.name()).help(self.about()))
    }
}

impl Name {
    /// Its name, what it is, and where its page goes if it is made alone.
    const fn words(self) -> [&'static str; 3] {
        match self {
            Self::Precision => ["precision", "Error against run time", "out/precision"],
            Self::Needs => ["needs", "What each scene needs, and what is chosen for it", "out/needs"],
            Self::Performance => {
                ["performance", "Over the number of segments, stiffness and tolerance", "out/performance"]
            }
            Self::Temporal => ["temporal", "Iterations over the frames", "out/temporal"],
            Self::LongTerm => ["long-term", "Length over a long time", "out/long-term"],
            Self::Dynamics => ["dynamics", "The supplement's motions", "out/dynamics"],
            Self::Nrmse => ["nrmse", "Error over time, guesses against end-to-end predictions", "out/nrmse"],
            Self::Speedups => ["speedups", "Collisions, knot and trees", "out/speedups"],
            Self::Knot => ["knot", "The knot, solved and predicted", "out/knot"],
            Self::Ablation => ["ablation", "Networks of other sizes", "out/ablation"],
            Self::Stability => ["stability", "Stiff and extreme cases", "out/stability"],
        }
    }

    pub(crate) fn name(self) -> &'static str {
        self.words()[0]
    }

    pub(crate) fn about(self) -> &'static str {
        self.words()[1]
    }

    pub(crate) fn folder(self) -> &'static str {
        self.words()[2]
    }
}

/// All sections, or those of these names.
pub(crate) fn jobs(only: &[Name]) -> Vec<Box<dyn Job>> {
    let job = |name: &Name| -> Box<dyn Job> {
        match name {
            Name::Precision => Box::new(Cells::new(precision::Precision::default())),
            Name::Needs => Box::new(Cells::new(needs::Scenes)),
            Name::Performance => Box::new(Cells::new(performance::Performance)),
            Name::Temporal => Box::new(Cells::new(temporal::Temporal)),
            Name::LongTerm => Box::new(Cells::new(long_term::LongTerm)),
            Name::Dynamics => Box::new(Cells::new(dynamics::Dynamics)),
            Name::Nrmse => Box::new(Cells::new(nrmse::Nrmse)),
            Name::Speedups => Box::new(Cells::new(speedups::Speedups)),
            Name::Knot => Box::new(Cells::new(knot::Knot)),
            Name::Ablation => Box::new(ablation::Ablation::default()),
            Name::Stability => Box::new(Cells::new(stability::Stability::default())),
        }
    };
    Name::value_variants().iter().filter(|name| only.is_empty() || only.contains(name)).map(job).collect()
}
