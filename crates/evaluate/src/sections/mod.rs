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
mod stability;
mod temporal;

use clap::ValueEnum;

use crate::cells::{Cells, Job};

/// Names of the sections on the command line, in the order of the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Name {
    /// Error against run time.
    Precision,
    /// What each scene needs, and what is chosen for it.
    Needs,
    /// Over the number of segments, stiffness and tolerance.
    Performance,
    /// Iterations over the frames.
    Temporal,
    /// Length over a long time.
    LongTerm,
    /// The supplement's motions.
    Dynamics,
    /// Error over time, guesses against end-to-end predictions.
    Nrmse,
    /// Collisions, knot and trees.
    Speedups,
    /// The knot, solved and predicted.
    Knot,
    /// Networks of other sizes.
    Ablation,
    /// Stiff and extreme cases.
    Stability,
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
