//! A scene file with how it is to be solved.

use std::fmt;
use std::path::Path;

use solver::formulation::{Formulation, Tangent};
use solver::integrator::Integrator;
use solver::linear::solvers::SolverKind;
use solver::simulation::Settings;
use solver::step::StepParams;
use thiserror::Error;

/// Formulation, integrator and linear solver of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Way {
    /// Formulation.
    pub formulation: Formulation,
    /// Integrator.
    pub integrator: Integrator,
    /// Linear solver.
    pub solver: SolverKind,
}

impl Way {
    /// All else as `simulate` has it by default.
    pub fn settings(&self) -> Settings {
        let Self { formulation, integrator, solver } = *self;
        Settings { step: StepParams { formulation, integrator, tangent: Tangent::Auto, ..StepParams::DEFAULT }, solver }
    }
}

/// As flags of `simulate`.
impl fmt::Display for Way {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { formulation, integrator, solver } = self;
        write!(f, "--formulation {formulation} --integrator {integrator} --solver {solver}")
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
    pub way: Way,
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
    #[error("{0}:1: the first line must be `# simulate THIS --formulation F --integrator I --solver S`")]
    NoWay(String),
}

impl Case {
    /// The text with the way in its first line.
    pub fn file(&self) -> String {
        format!("{HEAD}{}\n{}", self.way, self.text)
    }

    /// The case of a text that [`Case::file`] made and that names no files; `file` stands in the error.
    ///
    /// # Errors
    /// If the first line says no way.
    pub fn parse(whole: &str, file: &str) -> Result<Self, CaseError> {
        let (first, text) = whole.split_once('\n').unwrap_or((whole, ""));
        let way = way(first).ok_or_else(|| CaseError::NoWay(file.to_owned()))?;
        Ok(Self { text: text.to_owned(), files: Vec::new(), way })
    }

    /// Reads such a text from a file, and the files that it names from the folder of `path` on.
    ///
    /// # Errors
    /// If a file cannot be read, or the first line says no way.
    pub fn load(path: &Path) -> Result<Self, CaseError> {
        let read = |path: &Path| {
            let file = path.display().to_string();
            std::fs::read_to_string(path).map_err(|source| CaseError::Read { file, source })
        };
        let case = Self::parse(&read(path)?, &path.display().to_string())?;
        let folder = path.parent().unwrap_or(Path::new("."));
        let named = case.text.split('"').filter(|name| [".obj", ".stl", ".csv"].iter().any(|end| name.ends_with(end)));
        let files = named.map(|name| Ok((name.to_owned(), read(&folder.join(name))?))).collect::<Result<_, _>>()?;
        Ok(Self { files, ..case })
    }
}

/// The way in the first line of a file.
fn way(line: &str) -> Option<Way> {
    let mut words = line.strip_prefix(HEAD)?.split_whitespace();
    let mut way = Way::default();
    while let (Some(flag), Some(value)) = (words.next(), words.next()) {
        match flag {
            "--formulation" => way.formulation = value.parse().ok()?,
            "--integrator" => way.integrator = value.parse().ok()?,
            "--solver" => way.solver = value.parse().ok()?,
            _ => return None,
        }
    }
    Some(way)
}
