//! The sections of the report, a file each.

mod precision;

use clap::ValueEnum;

use crate::cells::{Cells, Job};

/// Names of the sections on the command line, in the order of the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Name {
    /// Error against run time.
    Precision,
}

/// All sections, or those of these names.
pub(crate) fn jobs(only: &[Name]) -> Vec<Box<dyn Job>> {
    let job = |name: &Name| -> Box<dyn Job> {
        match name {
            Name::Precision => Box::new(Cells::new(precision::Precision::default())),
        }
    };
    Name::value_variants().iter().filter(|name| only.is_empty() || only.contains(name)).map(job).collect()
}
