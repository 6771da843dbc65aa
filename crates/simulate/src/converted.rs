//! Scenes from MuJoCo's files (MJCF), and `simulate convert`.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Error, Result, anyhow, bail};
use cosserat::scene::{self, Scene, SceneError};
use export::write_atomically;
use mjcf::Converted;
use terminal::{print, warn};

use crate::cli::ConvertArgs;
use crate::outcome::Outcome;

/// Whether a scene's name is that of a file of MuJoCo's.
pub(crate) fn is_mjcf(name: &str) -> bool {
    Path::new(name).extension().is_some_and(|ending| ending.eq_ignore_ascii_case("xml"))
}

/// The scene of a file of MuJoCo's, after each of the settings of `--set` has put its value in the scene's text. What the scene leaves
/// out is told as warnings.
///
/// # Errors
/// If the file cannot be read, or has what a scene cannot express; or a setting is wrong.
pub(crate) fn load(name: &str, set: &[String]) -> Result<Scene> {
    let converted = mjcf::convert(&read(name)?, Path::new(name))?;
    say(&converted);
    scene::parse_set(&converted.toml, name, set).map_err(|error| placed(error, name, &converted))
}

/// Writes a file of MuJoCo's as a scene, or prints it.
pub(crate) fn convert(ConvertArgs { file, out }: &ConvertArgs) -> Result<Outcome> {
    let path = Path::new(file);
    let converted = mjcf::convert_for(&read(file)?, path, &folder_from(path, out.as_deref())?)?;
    scene::parse(&converted.toml, file).map_err(|error| placed(error, file, &converted))?;
    say(&converted);
    match out {
        None => print(format_args!("{}", converted.toml.trim_end()))?,
        Some(out) if out.exists() => bail!("--out {}: it exists already; name another file", out.display()),
        Some(out) => write_atomically(out, |writer| writer.write_all(converted.toml.as_bytes())).context("--out")?,
    }
    Ok(Outcome::Done)
}

fn read(name: &str) -> Result<String> {
    fs::read_to_string(name).map_err(|error| anyhow!("cannot read the scene {name}: {error}"))
}

fn say(converted: &Converted) {
    for warning in &converted.warnings {
        warn(format_args!("{warning}"));
    }
}

/// The folder of a file as it is seen from a scene's: empty if it is the same.
fn folder_from(file: &Path, scene: Option<&Path>) -> Result<PathBuf> {
    let folder = |path: &Path| -> Result<PathBuf> {
        let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        parent.canonicalize().with_context(|| format!("there is no folder {}", parent.display()))
    };
    let Some(scene) = scene else { return Ok(PathBuf::new()) };
    let (own, other) = (folder(file)?, folder(scene).context("--out")?);
    Ok(if own == other { PathBuf::new() } else { own })
}

/// An error of the scene, in terms of the file that it was made from.
fn placed(error: SceneError, name: &str, converted: &Converted) -> Error {
    match error {
        SceneError::Invalid { file, line, message } if file == name => {
            let place = converted.origin(line).map_or_else(|| name.to_owned(), str::to_owned);
            anyhow!("{place}: the scene that it makes is wrong: {message}")
        }
        setting @ SceneError::Setting { .. } => anyhow!("--set {setting}"),
        other => other.into(),
    }
}
