//! The scenes that come with the program: the files of this crate's `scenes/`, embedded.

use std::num::NonZeroUsize;

use serde::Deserialize;

use crate::error::nearest;
use crate::{Scene, SceneError, parse_refined, parse_set};

/// Name and first words of a builtin scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Builtin {
    /// Name to give to [`builtin`].
    pub name: &'static str,
    /// What it shows.
    pub description: String,
}

macro_rules! files {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("../scenes/", $name, ".toml")))),*]
    };
}

/// Name and text of each file.
const FILES: &[(&str, &str)] = files![
    "bending-rod",
    "helix",
    "helix-on-plane",
    "two-rods",
    "two-arms",
    "drum",
    "suture",
    "crane",
    "knot",
    "small-cantilever",
    "elastica",
    "heavy-cantilever",
    "roll-up",
    "bend-45",
    "pendulum",
    "torsion-bar",
    "euler-buckling",
    "michell-ring",
    "strip",
    "thin-heavy-rod",
    "slack-rod",
    "stiff-rod",
    "tip-mass",
    "free-spin",
    "clamped-ends",
    "hung-cable",
    "plucked-string",
    "all-clamped",
    "heavy-ring",
    "branch",
    "tree",
    "tree-10",
    "tree-20",
    "tree-40",
    "tree-70",
    "net",
    "net-on-sphere",
    "hair",
    "heap-5",
    "heap-20",
    "heap-80",
    "heap-320",
    "tower",
    "weave-20",
    "long-chain",
    "tiny-rod",
    "folded-rope",
    "plectoneme",
    "capstan",
    "atwood",
    "slalom",
    "collision",
    "coiling",
    "packing",
];

/// Similarity, of 0 to 1, from which a name is taken for a slip of the pen.
const ALIKE: f64 = 0.7;

/// All builtin scenes: the paper's first, then cases with a known answer, then stress cases.
pub fn builtins() -> Vec<Builtin> {
    #[derive(Default, Deserialize)]
    struct Head {
        description: String,
    }
    let head = |text| toml::from_str::<Head>(text).unwrap_or_default();
    FILES.iter().map(|&(name, text)| Builtin { name, description: head(text).description }).collect()
}

/// The builtin scene called `name`.
///
/// # Errors
/// There is none of that name; the error lists those that exist.
pub fn builtin(name: &str) -> Result<Scene, SceneError> {
    builtin_refined(name, NonZeroUsize::MIN)
}

/// The builtin scene called `name` after each of the `settings` has put its value in: see [`parse_set`].
///
/// # Errors
/// As [`builtin`] and [`parse_set`].
pub fn builtin_set(name: &str, settings: &[String]) -> Result<Scene, SceneError> {
    parse_set(text(name)?, &format!("scenes/{name}.toml"), settings)
}

/// The builtin scene called `name` with every segment cut into `factor` parts: see [`parse_refined`].
///
/// # Errors
/// As [`builtin`], or it has too many segments.
pub fn builtin_refined(name: &str, factor: NonZeroUsize) -> Result<Scene, SceneError> {
    parse_refined(text(name)?, &format!("scenes/{name}.toml"), factor)
}

/// The text of the builtin scene called `name`.
fn text(name: &str) -> Result<&'static str, SceneError> {
    match FILES.iter().find(|(known, _)| *known == name) {
        Some((_, text)) => Ok(text),
        None => {
            let meant = nearest(name, FILES.iter().map(|(known, _)| *known), ALIKE)
                .map(|known| format!("; did you mean `{known}`?"))
                .unwrap_or_default();
            let known = FILES.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
            Err(SceneError::UnknownBuiltin { name: name.to_owned(), meant, known })
        }
    }
}
