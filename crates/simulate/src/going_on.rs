//! Snapshots as files: where a run goes on as if it had not ended.

use std::collections::BTreeMap;
use std::fmt::{self, Write};
use std::path::Path;

use anyhow::{Context, Result, bail};
use export::{read_words, write_words};
use rod::Model;
use scene::Scene;
use solver::snapshot::Snapshot;

/// Name of a snapshot's file.
pub(crate) const SNAPSHOT: &str = "snapshot.safetensors";

/// The keys of its header.
const SCENE: &str = "scene";
const TIME: &str = "time_s";
const MODEL: &str = "model_blake3";

/// Writes a snapshot of a run of the scene to its folder.
pub(crate) fn write_snapshot(directory: &Path, scene: &Scene, snapshot: &Snapshot) -> Result<()> {
    let of = [(SCENE, scene.name.clone()), (TIME, format!("{:?}", snapshot.time())), (MODEL, hash(&scene.model))];
    let of: BTreeMap<String, String> = of.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
    write_words(&directory.join(SNAPSHOT), &of, snapshot.words())?;
    Ok(())
}

/// The snapshot in a run's folder, `None` if that run left none. `what` names the folder in errors.
///
/// # Errors
/// If it cannot be read, or is of another model than the scene's.
pub(crate) fn read_snapshot(directory: &Path, scene: &Scene, what: &str) -> Result<Option<Snapshot>> {
    let path = directory.join(SNAPSHOT);
    if !path.exists() {
        return Ok(None);
    }
    let (of, words) = read_words(&path).with_context(|| what.to_owned())?;
    if of.get(MODEL) != Some(&hash(&scene.model)) {
        bail!(
            "{what}: its {SNAPSHOT} is of another model ({}) than the scene {}; with FOLDER@K the run begins anew with \
             frame K",
            of.get(SCENE).map_or("?", String::as_str),
            scene.name
        );
    }
    Ok(Some(Snapshot::from_words(words)))
}

/// BLAKE3 of the segments' lengths and radii.
pub(crate) fn hash_of_segments(model: &Model) -> String {
    let mut hash = blake3::Hasher::new();
    for number in model.segments.iter().flat_map(|segment| [segment.length, segment.radius]) {
        hash.update(&number.to_le_bytes());
    }
    hash.finalize().to_hex().to_string()
}

/// BLAKE3 of all that a model says.
fn hash(model: &Model) -> String {
    struct Hash(blake3::Hasher);

    impl Write for Hash {
        fn write_str(&mut self, text: &str) -> fmt::Result {
            self.0.update(text.as_bytes());
            Ok(())
        }
    }

    let mut hash = Hash(blake3::Hasher::new());
    // Numbers are written with all their digits; a hash takes any text.
    let _ = write!(hash, "{model:?}");
    hash.0.finalize().to_hex().to_string()
}
