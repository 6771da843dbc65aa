//! Scenes by name: files, those that come with the program, and random ones.

use std::path::Path;

use anyhow::{Error, Result, anyhow, bail};
use clap::CommandFactory;
use cosserat::scene::sampling::{Family, Parameters};
use cosserat::scene::{self, Scene, SceneError};

use crate::cli::{Cli, OfScene};
use crate::converted::{is_mjcf, load};

/// Names of random scenes.
const RANDOM: [(&str, Family); 4] = [
    ("random-rod", Family::Rod),
    ("random-helix", Family::Helix),
    ("random-knot", Family::Knot),
    ("random-tree", Family::Tree),
];

/// The names of random scenes, in words.
pub(crate) fn random_names() -> String {
    RANDOM.map(|(name, _)| name).join(", ")
}

/// Whether a scene that comes with the program, or is drawn at random, has this name.
pub(crate) fn is_known(name: &str) -> bool {
    RANDOM.iter().any(|&(random, _)| random == name) || scene::is_builtin(name)
}

/// The scene file, builtin or random scene of this name.
pub(crate) fn named(name: &str, of: &OfScene) -> Result<Scene> {
    let OfScene { seed, index, set } = of;
    let (seed, index) = (*seed, *index);
    if let Some((_, family)) = RANDOM.into_iter().find(|&(random, _)| random == name) {
        if let Some(setting) = set.first() {
            bail!("--set {setting}: {name} is drawn at random, without a file whose keys could be changed");
        }
        let scene = Parameters::sample(family, seed.unwrap_or(0), index.unwrap_or(0)).scene()?;
        return Ok(Scene { name: name.to_owned(), ..scene });
    }
    for (flag, given) in [("--seed", seed.is_some()), ("--index", index.is_some())] {
        if given {
            bail!("{flag} needs a random scene ({}), but the scene is {name}", random_names());
        }
    }
    if is_mjcf(name) {
        return load(name, set);
    }
    let is_file = name.ends_with(".toml") || name.contains(['/', '\\']);
    let found = if is_file { scene::load_set(name, set) } else { scene::builtin_set(name, set) };
    found.map_err(|error| match error {
        SceneError::Read { file, source } if file == name => {
            let is_missing = source.kind() == std::io::ErrorKind::NotFound;
            let hint = if is_missing { " (`simulate list` shows the scenes that come with the program)" } else { "" };
            anyhow!("cannot read the scene {file}: {source}{hint}")
        }
        SceneError::Read { file, source } => anyhow!("cannot read {file}: {source}"),
        SceneError::UnknownBuiltin { name, .. } => unknown(&name),
        setting @ SceneError::Setting { .. } => anyhow!("--set {setting}"),
        other @ (SceneError::Invalid { .. } | SceneError::BuiltinSize { .. }) => other.into(),
    })
}

/// Similarity, of 0 to 1, from which a name is taken for a slip of the pen.
pub(crate) const ALIKE: f64 = 0.7;

/// The error of a scene that does not exist: what may have been meant, and where to look.
fn unknown(name: &str) -> Error {
    if Path::new(name).is_file() {
        return anyhow!("{name} is a file, but the name of a scene's file ends in .toml");
    }
    let cli = Cli::command();
    let commands = cli.get_subcommands().map(|command| (command.get_name(), "the command "));
    let scenes = scene::builtins().into_iter().map(|builtin| (builtin.name, ""));
    let random = RANDOM.map(|(name, _)| (name, ""));
    let known: Vec<_> = scenes.chain(random).chain(commands).collect();
    let nearest = scene::nearest(name, known.iter().map(|(known, _)| *known), ALIKE);
    let meant = nearest.and_then(|nearest| known.iter().find(|(known, _)| *known == nearest));
    let meant = meant.map(|(known, what)| format!("; did you mean {what}`{known}`?")).unwrap_or_default();
    anyhow!("there is no scene `{name}`{meant} (`simulate list` shows all; the name of a file ends in .toml)")
}
