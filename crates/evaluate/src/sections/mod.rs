//! The sections of the report, a file each: what a section measures, and in a file below it how that is shown.

mod ablation;
pub(crate) mod claims;
mod dynamics;
mod knot;
mod long_term;
mod needs;
mod nrmse;
pub(crate) mod paper;
mod performance;
mod precision;
mod speedups;
pub(crate) mod stability;
mod temporal;

use crate::cells::{Cells, Job, Section};

/// A section on the command line.
pub(crate) struct Named {
    /// Its name, as a command, too.
    pub(crate) name: &'static str,
    /// What it is.
    pub(crate) about: &'static str,
    job: fn() -> Box<dyn Job>,
}

const fn named(name: &'static str, about: &'static str, job: fn() -> Box<dyn Job>) -> Named {
    Named { name, about, job }
}

fn cells<S: Section + 'static>(section: S) -> Box<dyn Job> {
    Box::new(Cells::new(section))
}

/// All sections, in the order of the page.
pub(crate) static SECTIONS: [Named; 11] = [
    named("precision", "Error against run time", || cells(precision::Precision::default())),
    named("needs", "What each scene needs, and what is chosen for it", || cells(needs::Scenes)),
    named("performance", "Over the number of segments, stiffness and tolerance", || cells(performance::Performance)),
    named("temporal", "Iterations over the frames", || cells(temporal::Temporal)),
    named("long-term", "Length over a long time", || cells(long_term::LongTerm)),
    named("dynamics", "The supplement's motions", || cells(dynamics::Dynamics)),
    named("nrmse", "Error over time, guesses against end-to-end predictions", || cells(nrmse::Nrmse)),
    named("speedups", "Collisions, knot and trees", || cells(speedups::Speedups)),
    named("knot", "The knot, solved and predicted", || cells(knot::Knot)),
    named("ablation", "Networks of other sizes", || Box::new(ablation::Ablation::default())),
    named("stability", "Stiff and extreme cases", || cells(stability::Stability::default())),
];

/// All sections, or those of these names.
pub(crate) fn jobs(only: &[String]) -> Vec<Box<dyn Job>> {
    let is_asked = |section: &&Named| only.is_empty() || only.iter().any(|name| name == section.name);
    SECTIONS.iter().filter(is_asked).map(|section| (section.job)()).collect()
}
