//! The scene of a run, in its folder: its text, and copies of the files that it names.

use std::fs;
use std::io::Write;
use std::path::Path;

use anyhow::{Context, Result};
use cosserat::scene::Scene;
use export::write_atomically;

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
