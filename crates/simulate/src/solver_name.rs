//! A linear solver as it stands on the command line.

use std::fmt;
use std::str::FromStr;

use cosserat::simulation::SolverKind;

/// A linear solver as it stands on the command line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) enum SolverName {
    /// Chosen for the scene.
    #[default]
    Auto,
    /// This one.
    Fixed(SolverKind),
}

impl fmt::Display for SolverName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Fixed(kind) => kind.fmt(f),
        }
    }
}

impl FromStr for SolverName {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        if name == "auto" {
            return Ok(Self::Auto);
        }
        let kind: Result<SolverKind, String> = name.parse();
        kind.map(Self::Fixed).map_err(|expected| expected.replacen("one of ", "one of auto, ", 1))
    }
}
