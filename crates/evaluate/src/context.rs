//! What all sections share.

use std::path::PathBuf;

use report::Conditions;

use crate::library::Library;

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Size {
    /// Done in minutes.
    Quick,
    /// The report's.
    Full,
}

impl Size {
    /// The first of the two for a quick report, the second for a full one.
    pub(crate) fn pick<T>(self, quick: T, full: T) -> T {
        if self == Self::Quick { quick } else { full }
    }
}

/// What all sections share.
pub(crate) struct Context {
    pub(crate) size: Size,
    /// Which part of the cells is measured, and of how many.
    pub(crate) shard: (usize, usize),
    /// Folder of the cells.
    pub(crate) cells: PathBuf,
    /// Summary of the sweep.
    pub(crate) sweep: PathBuf,
    /// Folder of recordings of real cables.
    pub(crate) recordings: Option<PathBuf>,
    pub(crate) library: Library,
    pub(crate) machine: String,
}

impl Context {
    /// Conditions that begin with what a time includes, to which a section adds its own.
    pub(crate) fn conditions(&self, time: &str) -> Conditions {
        self.without_networks(time).with("networks", &self.library.networks_blake3[..12])
    }

    /// Those of a section that measures no network.
    pub(crate) fn without_networks(&self, time: &str) -> Conditions {
        Conditions::new("time", time).with("machine", &self.machine).with("threads", "1")
    }
}

#[cfg(test)]
impl Context {
    /// For tests, which measure nothing.
    pub(crate) fn for_tests() -> Self {
        let nowhere = PathBuf::from("nowhere");
        Self {
            size: Size::Quick,
            shard: (0, 1),
            library: Library::new(&nowhere),
            cells: nowhere.clone(),
            sweep: nowhere,
            recordings: None,
            machine: String::new(),
        }
    }
}
