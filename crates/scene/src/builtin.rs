//! The scenes that come with the program: the files of this crate's `scenes/`, embedded, and heaps and weaves of other sizes.

use std::borrow::Cow;
use std::num::NonZeroUsize;
use std::ops::RangeInclusive;

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
    "zip-line",
    "winch",
    "block-and-tackle",
    "elevator",
    "tendon-robot",
    "bowden-cable",
    "bent-wire",
    "spaghetti",
    "eel",
    "hose",
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
    "heap-20",
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

/// Scenes of any size: `NAME-SIZE` is the file with its numbers scaled.
const FAMILIES: [Family; 2] = [
    Family {
        name: "heap",
        listed: &[("heap-5", 5), ("heap-20", 20), ("heap-80", 80), ("heap-320", 320)],
        file: "heap-20",
        sizes: 1..=100_000,
        sized: heap,
    },
    Family { name: "weave", listed: &[("weave-20", 20)], file: "weave-20", sizes: 2..=1_000, sized: weave },
];

/// Scenes that differ in size only.
struct Family {
    name: &'static str,
    /// Its file.
    file: &'static str,
    /// Names and sizes that are listed.
    listed: &'static [(&'static str, usize)],
    sizes: RangeInclusive<usize>,
    /// What is replaced in the file.
    sized: fn(usize) -> Vec<(&'static str, String)>,
}

/// So many cables.
fn heap(count: usize) -> Vec<(&'static str, String)> {
    vec![("\"20 cables", format!("\"{count} cables")), ("count = 20", format!("count = {count}"))]
}

/// So many yarns each way, as far apart as in the file, above a ball that grows with the patch.
fn weave(yarns: usize) -> Vec<(&'static str, String)> {
    let meshes = yarns - 1;
    let [radius, size] = [0.03, 0.095].map(|length| length * meshes as f64 / 19.0);
    vec![
        ("20 by 20 yarns", format!("{yarns} by {yarns} yarns")),
        ("radius_m = 0.03 ", format!("radius_m = {radius:.6} ")),
        ("0.033]", format!("{:.6}]", radius + 0.003)),
        ("[0.095, 0.095]", format!("[{size:.6}, {size:.6}]")),
        ("[19, 19]", format!("[{meshes}, {meshes}]")),
    ]
}

impl Family {
    /// The scene of a size that has no file.
    fn text(&self, size: usize) -> Option<String> {
        let (_, text) = FILES.iter().find(|(known, _)| *known == self.file)?;
        let replace = |text: String, (from, to): (&str, String)| text.replacen(from, &to, 1);
        Some((self.sized)(size).into_iter().fold((*text).to_owned(), replace))
    }
}

/// The names of all files, and of the listed sizes of families.
fn names() -> impl Iterator<Item = &'static str> {
    FILES.iter().flat_map(|&(name, _)| {
        let family = FAMILIES.iter().find(|family| name == family.file);
        let own = family.is_none().then_some(name);
        own.into_iter().chain(family.into_iter().flat_map(|family| family.listed.iter().map(|&(name, _)| name)))
    })
}

/// All builtin scenes: the paper's first, then cases with a known answer, then stress cases. Heaps and weaves of other sizes have names, too: `heap-1280`, `weave-50`.
pub fn builtins() -> Vec<Builtin> {
    #[derive(Default, Deserialize)]
    struct Head {
        description: String,
    }
    let head = |text: &str| toml::from_str::<Head>(text).unwrap_or_default();
    let described = |name| {
        let description = text(name).map(|text| head(&text).description).unwrap_or_default();
        Builtin { name, description }
    };
    names().map(described).collect()
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
    parse_set(&text(name)?, &format!("scenes/{name}.toml"), settings)
}

/// The builtin scene called `name` with every segment cut into `factor` parts: see [`parse_refined`].
///
/// # Errors
/// As [`builtin`], or it has too many segments.
pub fn builtin_refined(name: &str, factor: NonZeroUsize) -> Result<Scene, SceneError> {
    parse_refined(&text(name)?, &format!("scenes/{name}.toml"), factor)
}

/// Whether there is a builtin scene called `name`.
pub fn is_builtin(name: &str) -> bool {
    text(name).is_ok()
}

/// The text of the builtin scene called `name`.
fn text(name: &str) -> Result<Cow<'static, str>, SceneError> {
    if let Some((_, text)) = FILES.iter().find(|(known, _)| *known == name) {
        return Ok(Cow::Borrowed(text));
    }
    for family in &FAMILIES {
        let size = name.strip_prefix(family.name).and_then(|rest| rest.strip_prefix('-'));
        let Some(Ok(size)) = size.map(str::parse) else { continue };
        if !family.sizes.contains(&size) {
            let [least, largest] = [*family.sizes.start(), *family.sizes.end()];
            return Err(SceneError::BuiltinSize { name: name.to_owned(), kind: family.name, least, largest });
        }
        if let Some(text) = family.text(size) {
            return Ok(Cow::Owned(text));
        }
    }
    let known: Vec<&str> = names().collect();
    let meant = nearest(name, known.iter().copied(), ALIKE)
        .map(|known| format!("; did you mean `{known}`?"))
        .unwrap_or_default();
    Err(SceneError::UnknownBuiltin { name: name.to_owned(), meant, known: known.join(", ") })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn families_have_all_sizes() {
        for (name, rods) in [("heap-1", 1), ("heap-20", 20), ("heap-37", 37), ("weave-2", 4), ("weave-20", 40)] {
            let scene = builtin(name).unwrap();
            assert_eq!(scene.rods.len(), rods, "{name}");
            assert!(builtins().iter().all(|builtin| builtin.name != "heap-37"));
        }
        let text = text("weave-50").unwrap();
        for expected in ["50 by 50 yarns", "0.077368 }", "0.080368]", "[0.245000, 0.245000]", "[49, 49]"] {
            assert!(text.contains(expected), "{expected}: {text}");
        }
        for name in ["heap-0", "weave-1", "heap-100001"] {
            let error = builtin(name).unwrap_err().to_string();
            assert!(error.contains(name) && error.contains("000"), "{error}");
        }
        for name in ["heap-", "heap-x", "heap", "heap--5"] {
            assert!(matches!(builtin(name), Err(SceneError::UnknownBuiltin { .. })), "{name}");
        }
    }

    /// A replaced number that is not found would leave the size of the file.
    #[test]
    fn what_families_replace_is_there() {
        for family in &FAMILIES {
            let text = text(family.file).unwrap();
            for (from, _) in (family.sized)(7) {
                assert_eq!(text.matches(from).count(), 1, "{}: {from}", family.name);
            }
        }
    }
}
