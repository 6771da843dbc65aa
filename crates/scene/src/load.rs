//! Scenes from files.

use std::path::Path;

use crate::checked::Scene;
use crate::error::SceneError;
use crate::set::parse_set;

/// Reads the scene file at `path`.
///
/// # Errors
/// The file cannot be read, or what [`parse`](crate::parse) finds wrong.
pub fn load(path: impl AsRef<Path>) -> Result<Scene, SceneError> {
    load_set(path, &[])
}

/// The scene file at `path` after each of the `settings` has put its value in: see [`parse_set`].
///
/// # Errors
/// The file cannot be read, or as [`parse_set`].
pub fn load_set(path: impl AsRef<Path>, settings: &[String]) -> Result<Scene, SceneError> {
    let file = path.as_ref().display().to_string();
    match std::fs::read_to_string(&path) {
        Ok(text) => parse_set(&text, &file, settings),
        Err(source) => Err(SceneError::Read { file, source }),
    }
}
