//! A scene file with how it is to be solved.

use std::fmt;
use std::path::Path;

use cosserat::simulation::{Formulation, Integrator, Settings, SolverKind, StepParams};
use thiserror::Error;

/// Formulation, integrator and linear solver of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Method {
    /// Formulation.
    pub formulation: Formulation,
    /// Integrator.
    pub integrator: Integrator,
    /// Linear solver.
    pub solver: SolverKind,
}

/// Relative tolerance of a step.
const TOLERANCE: f64 = 1e-6;

impl Method {
    /// To a tolerance that keeps laws sharp; all else as `simulate` has it by default.
    pub fn settings(&self) -> Settings {
        let Self { formulation, integrator, solver } = *self;
        Settings {
            step: StepParams {
                formulation,
                integrator,
                relative_tolerance: TOLERANCE,
                motion_tolerance: TOLERANCE,
                ..StepParams::DEFAULT
            },
            solver,
        }
    }
}

/// As flags of `simulate`.
impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { formulation, integrator, solver } = self;
        write!(f, "--formulation {formulation} --integrator {integrator} --solver {solver} --tolerance {TOLERANCE:e}")
    }
}

/// A scene file, the files that it names, and how it is solved.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// The scene file's text.
    pub text: String,
    /// Names and texts of the files beside it that it names: meshes, motions, curves.
    pub files: Vec<(String, String)>,
    /// How it is solved.
    pub method: Method,
}

/// Begin of the first line of a case that is written as a file.
const HEAD: &str = "# simulate THIS ";

/// A file that is no case.
#[derive(Debug, Error)]
pub enum CaseError {
    /// It, or one that it names, cannot be read.
    #[error("cannot read {file}: {source}")]
    Read {
        /// The file.
        file: String,
        /// Why not.
        source: std::io::Error,
    },
    /// Its first line does not say how it is solved.
    #[error(
        "{0}:1: the first line must be `# simulate THIS --formulation F --integrator I --solver S`, with `--tolerance {TOLERANCE:e}` or without"
    )]
    NoMethod(String),
}

impl Case {
    /// The text with the method in its first line.
    pub fn file(&self) -> String {
        format!("{HEAD}{}\n{}", self.method, self.text)
    }

    /// Reads such a text from a file, and the files that it names from the folder of `path` on.
    ///
    /// # Errors
    /// If a file cannot be read, or the first line says no method.
    pub fn load(path: &Path) -> Result<Self, CaseError> {
        let read = |path: &Path| {
            let file = path.display().to_string();
            std::fs::read_to_string(path).map_err(|source| CaseError::Read { file, source })
        };
        let whole = read(path)?;
        let (first, text) = whole.split_once('\n').unwrap_or((&whole, ""));
        let method = Method::of_line(first).ok_or_else(|| CaseError::NoMethod(path.display().to_string()))?;
        let folder = path.parent().unwrap_or(Path::new("."));
        let named = text.split('"').filter(|name| [".obj", ".csv"].iter().any(|end| name.ends_with(end)));
        let files = named.map(|name| Ok((name.to_owned(), read(&folder.join(name))?))).collect::<Result<_, _>>()?;
        Ok(Self { text: text.to_owned(), files, method })
    }
}

impl Method {
    /// The method in the first line of a file.
    fn of_line(line: &str) -> Option<Self> {
        let mut words = line.strip_prefix(HEAD)?.split_whitespace();
        let mut method = Self::default();
        while let (Some(flag), Some(value)) = (words.next(), words.next()) {
            match flag {
                "--formulation" => method.formulation = value.parse().ok()?,
                "--integrator" => method.integrator = value.parse().ok()?,
                "--solver" => method.solver = value.parse().ok()?,
                "--tolerance" if value.parse() == Ok(TOLERANCE) => {}
                _ => return None,
            }
        }
        Some(method)
    }
}
