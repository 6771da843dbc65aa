//! The scene that arguments choose: by its name, or that of a run's folder.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use cosserat::scene::{self, Scene, SceneError};
use serde_json::Value;

use crate::cli::OfScene;
use crate::files::SUMMARY;
use crate::going_on::scene_of_snapshot;
use crate::kept_scene::SCENE;
use crate::named::named;

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
