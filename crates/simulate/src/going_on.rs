//! Snapshots as files: where a run goes on as if it had not ended.

use std::collections::{BTreeMap, HashSet};
use std::fmt::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use cosserat::motion::{Changing, Driven};
use cosserat::scene::Scene;
use cosserat::simulation::Snapshot;
use cosserat::state::Model;
use export::{RunFolder, read_words, write_words};

use crate::held::Hold;

/// Name of a snapshot's file.
pub(crate) const SNAPSHOT: &str = "snapshot.safetensors";

/// The keys of its header.
const SCENE: &str = "scene";
const TIME: &str = "time_s";
const MODEL: &str = "model_blake3";
const HOLDS: &str = "holds";

/// What the snapshots of a run say beside the simulation's state.
#[derive(Clone, Debug)]
pub(crate) struct Label {
    /// Name of the scene.
    pub(crate) scene: String,
    /// [`hash`] of the scene's model.
    pub(crate) model: String,
    /// What is held otherwise than the scene says since the run began.
    pub(crate) holds: Vec<Hold>,
}

/// Writes a snapshot to a run's folder.
pub(crate) fn write_snapshot(directory: &Path, label: &Label, snapshot: &Snapshot) -> Result<()> {
    let Label { scene, model, holds } = label;
    let holds = serde_json::to_string(holds)?;
    let time = format!("{:?}", snapshot.time());
    let of = [(SCENE, scene.clone()), (TIME, time), (MODEL, model.clone()), (HOLDS, holds)];
    let of: BTreeMap<String, String> = of.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
    write_words(&directory.join(SNAPSHOT), &of, snapshot.words())?;
    Ok(())
}

/// A snapshot with whether it is of a run that did not come to its end.
pub(crate) struct Found {
    pub(crate) snapshot: Snapshot,
    /// What was held otherwise than the scene says.
    pub(crate) holds: Vec<Hold>,
    pub(crate) is_unfinished: bool,
}

/// Where the snapshot of a run's folder is: in that of a run that did not come to its end, if there is one; else in the folder.
pub(crate) fn place_of_snapshot(directory: &Path) -> PathBuf {
    let unfinished = directory.join(RunFolder::UNFINISHED);
    if unfinished.join(SNAPSHOT).exists() { unfinished } else { directory.to_owned() }
}

/// Name of the scene whose snapshot is in a folder.
pub(crate) fn scene_of_snapshot(place: &Path) -> Option<String> {
    read_words(&place.join(SNAPSHOT)).ok().and_then(|(mut of, _)| of.remove(SCENE))
}

/// The snapshot in a run's folder, `None` if that run left none; the last one of a run that was killed comes before that of
/// an earlier run. `what` names the folder in errors.
///
/// # Errors
/// If it cannot be read, or is of another model than the scene's.
pub(crate) fn read_snapshot(directory: &Path, scene: &Scene, what: &str) -> Result<Option<Found>> {
    let place = place_of_snapshot(directory);
    let (path, is_unfinished) = (place.join(SNAPSHOT), place != directory);
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
    let holds = of.get(HOLDS).map_or(Ok(Vec::new()), |text| serde_json::from_str(text));
    let holds = holds.with_context(|| format!("{what}: {SNAPSHOT} is damaged"))?;
    Ok(Some(Found { snapshot: Snapshot::from_words(words), holds, is_unfinished }))
}

/// BLAKE3 of the segments' lengths and radii.
pub(crate) fn hash_of_segments(model: &Model) -> String {
    let mut hash = blake3::Hasher::new();
    for number in model.segments.iter().flat_map(|segment| [segment.length, segment.radius]) {
        hash.update(&number.to_le_bytes());
    }
    hash.finalize().to_hex().to_string()
}

/// BLAKE3 of all that a model says, but for how what is driven or changes does so over time: a run may go on with a longer
/// course, or another one.
pub(crate) fn hash(model: &Model) -> String {
    struct Hash(blake3::Hasher);

    impl Write for Hash {
        fn write_str(&mut self, text: &str) -> fmt::Result {
            self.0.update(text.as_bytes());
            Ok(())
        }
    }

    let mut bare = model.clone();
    let (motions, changes) = (std::mem::take(&mut bare.motions), std::mem::take(&mut bare.changes));
    let is_driven: Vec<bool> =
        bare.contacts.obstacles.iter_mut().map(|obstacle| obstacle.motion.take().is_some()).collect();
    // What changes is in the model as it is at first.
    let changing: HashSet<Changing> = changes.iter().map(|change| change.of).collect();
    let is_first = |of: &Changing| changing.contains(of);
    if is_first(&Changing::Gravity) {
        bare.gravity.fill(0.0);
        bare.lifts.iter().for_each(|lift| bare.loads[lift.load].force.fill(0.0));
    }
    for (i, load) in bare.loads.iter_mut().enumerate() {
        if is_first(&Changing::Force(i)) {
            load.force.fill(0.0);
        }
        if is_first(&Changing::Torque(i)) {
            load.torque.fill(0.0);
        }
    }
    for (i, joint) in bare.joints.iter_mut().enumerate() {
        if is_first(&Changing::Rest(i)) {
            joint.rest_darboux.fill(0.0);
        }
    }
    let driven = motions
        .iter()
        .map(|Driven { body, from, until, moves_along, snaps, .. }| (body, from, until, moves_along, snaps));
    let of: Vec<_> = changes.iter().map(|change| change.of).collect();
    let mut hash = Hash(blake3::Hasher::new());
    // Numbers are written with all their digits; a hash takes any text.
    let _ = write!(hash, "{bare:?}{:?}{of:?}{is_driven:?}", driven.collect::<Vec<_>>());
    hash.0.finalize().to_hex().to_string()
}
