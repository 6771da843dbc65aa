//! The scene of a run, in its folder: its text, and copies of the files that it names.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use export::write_atomically;
use scene::{Scene, SceneError};
use serde_json::Value;

use crate::cli::OfScene;
use crate::files::SUMMARY;
use crate::going_on::scene_of_snapshot;
use crate::scenes::named;

/// Name of the scene's text. It is not `scene.toml`, as a user's own file beside the runs may be.
pub(crate) const SCENE: &str = "run-scene.toml";
/// What names of copies begin with.
const PREFIX: &str = "run-";

/// What is kept of a scene.
pub(crate) struct KeptScene {
    /// Names in the run's folder, and contents.
    files: Vec<(String, Vec<u8>)>,
}

impl KeptScene {
    /// The scene's text and the files that it names, read anew; nothing of a scene without a text.
    ///
    /// # Errors
    /// If one of them cannot be read any more.
    pub(crate) fn of(scene: &Scene) -> Result<Self> {
        let Some(text) = &scene.text else { return Ok(Self { files: Vec::new() }) };
        let mut files = vec![(SCENE.to_owned(), Vec::new())];
        let mut names = Vec::new();
        for path in text.files() {
            let own = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            // It may be the copy of a run already.
            let own = own.strip_prefix(PREFIX).unwrap_or(&own);
            let name = (1..).map(|k| if k == 1 { format!("{PREFIX}{own}") } else { format!("{PREFIX}{k}-{own}") });
            let is_free = |name: &String| files.iter().all(|(known, _)| known != name);
            let name = name.filter(|name| is_free(name)).take(1).collect::<String>();
            let content = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
            names.push((path, name.clone()));
            files.push((name, content));
        }
        files[0].1 = text.with_names(&names).into_bytes();
        Ok(Self { files })
    }

    /// Names in the run's folder.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.files.iter().map(|(name, _)| name.as_str())
    }

    /// Writes all into a run's folder.
    ///
    /// # Errors
    /// If the disk does not take it.
    pub(crate) fn write(&self, directory: &Path) -> Result<()> {
        for (name, content) in &self.files {
            write_atomically(&directory.join(name), |writer| writer.write_all(content))?;
        }
        Ok(())
    }
}

/// The scene that a run has kept in its folder, by its own name, after each of the settings of `--set` has put its value in; `None`
/// where it has kept none.
///
/// # Errors
/// If it is not a scene any more, or a setting is wrong.
pub(crate) fn kept_scene(folder: &Path, set: &[String]) -> Result<Option<Scene>> {
    let file = folder.join(SCENE);
    if !file.is_file() {
        return Ok(None);
    }
    let mut scene = scene::load_set(&file, set).map_err(|error| match error {
        setting @ SceneError::Setting { .. } => anyhow!("--set {setting}"),
        error => error.into(),
    })?;
    let summary = fs::read(folder.join(SUMMARY)).ok();
    let summary: Option<Value> = summary.and_then(|text| serde_json::from_slice(&text).ok());
    let own = summary.as_ref().and_then(|summary| summary["scene"].as_str()).map(str::to_owned);
    // A run that did not come to its end has no summary.
    if let Some(name) = own.or_else(|| scene_of_snapshot(folder)) {
        scene.name = name;
    }
    Ok(Some(scene))
}

/// The scene that arguments name; where they name none, that of the run in the folder `from`, with which they begin, else the
/// `default` one.
///
/// # Errors
/// As [`named`], or the run has kept none.
pub(crate) fn chosen(name: Option<&str>, from: Option<PathBuf>, default: &str, of: &OfScene) -> Result<Scene> {
    let Some(folder) = from.filter(|_| name.is_none()) else {
        return named(name.unwrap_or(default), of);
    };
    if of.seed.or(of.index).is_some() {
        bail!("--seed and --index need the name of a random scene, but none is named: the scene is that of the run");
    }
    let scene = kept_scene(&folder, &of.set).with_context(|| format!("--from {}", folder.display()))?;
    scene.with_context(|| format!("--from {}: there is no {SCENE} in it, so name the scene, too", folder.display()))
}
