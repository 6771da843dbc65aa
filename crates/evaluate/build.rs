//! Builds in which sources the program is made of: of each section of the report a hash of all that decides what it
//! measures, and the revision of the program.

use std::collections::BTreeSet;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs, io};

/// What decides measurements: crates, scenes, and what the sections share.
const DECIDING: [&str; 28] = [
    "crates/names/src",
    "crates/rod/src",
    "crates/collision/src",
    "crates/kernels/src",
    "crates/jointed/src",
    "crates/friction/src",
    "crates/component/src",
    "crates/contact/src",
    "crates/dynamics/src",
    "crates/statics/src",
    "crates/sensitivity/src",
    "crates/scene/src",
    "crates/scene/scenes",
    "crates/cosserat/src",
    "crates/graph/src",
    "crates/dataset/src",
    "crates/knn/src",
    "crates/copingnet/src",
    "crates/catalogue/src",
    "crates/optimise/src",
    "crates/identify/src",
    "crates/correction/src",
    "crates/equilibria/src",
    "crates/evaluation/src",
    "crates/evaluate/src/library.rs",
    "crates/evaluate/src/ways.rs",
    "crates/evaluate/src/sections/paper.rs",
    "Cargo.lock",
];
/// What draws the report, and what it is drawn with.
const DRAWING: [&str; 4] = ["crates/evaluate/src", "crates/report/src", "crates/chart/src", "crates/export/src"];
/// What else a committed report rests on: networks, the sweep's summary, how the program is optimized.
const READ: [&str; 3] = ["checkpoints", "data/sweep.toml", "Cargo.toml"];
/// What else decides what single sections measure.
const OF_SECTIONS: [(&str, &str); 1] = [("laws", "crates/laws/src")];
/// A section measures in `NAME.rs` or `NAME/mod.rs` of this folder; other files below it show what was measured.
const SECTIONS: &str = "crates/evaluate/src/sections";

fn main() -> Result<(), Box<dyn Error>> {
    let root = Path::new(&env::var("CARGO_MANIFEST_DIR")?).join("../..").canonicalize()?;
    let program = [&DECIDING[..], &DRAWING].concat();
    // The output of git; `None` without git, or where it says nothing.
    let git = |arguments: &[&str]| {
        let output = Command::new("git").current_dir(&root).args(arguments).output().ok()?;
        let text = String::from_utf8_lossy(&output.stdout).trim().to_owned();
        (output.status.success() && !text.is_empty()).then_some(text)
    };
    let revision = git(&[&["log", "-1", "--format=%H", "--"], &program[..]].concat());
    // Without a revision nobody can know what it was made of.
    let is_dirty =
        revision.is_none() || git(&[&["status", "--porcelain", "--"], &program[..], &READ].concat()).is_some();
    let revision = revision.unwrap_or("unknown".to_owned()) + if is_dirty { ", dirty" } else { "" };

    let mut shared = blake3::Hasher::new();
    for place in DECIDING {
        hash(&root.join(place), &mut shared)?;
    }
    let mut hashes = String::new();
    for path in entries(&root.join(SECTIONS))? {
        let file = if path.is_dir() { path.join("mod.rs") } else { path.clone() };
        if file.exists() {
            let mut own = shared.clone();
            hash(&file, &mut own)?;
            let name = path.file_stem().unwrap_or_default().to_string_lossy().replace('_', "-");
            for (_, place) in OF_SECTIONS.iter().filter(|(section, _)| *section == name) {
                hash(&root.join(place), &mut own)?;
            }
            hashes.push_str(&format!("(\"{name}\", \"{}\"),\n", own.finalize().to_hex()));
        }
    }
    let text = format!(
        "pub(crate) const ROOT: &str = {root:?};\npub(crate) const REVISION: &str = {revision:?};\n\
         pub(crate) const IS_DIRTY: bool = {is_dirty};\nconst BY_SECTION: &[(&str, &str)] = &[\n{hashes}];\n",
    );
    fs::write(Path::new(&env::var("OUT_DIR")?).join("sources.rs"), text)?;
    for place in program.into_iter().chain(OF_SECTIONS.map(|(_, place)| place)) {
        println!("cargo::rerun-if-changed={}", root.join(place).display());
    }
    // Changes with every commit.
    let log = git(&["rev-parse", "--git-path", "logs/HEAD"]).map(|path| root.join(path));
    if let Some(log) = log.filter(|log| log.exists()) {
        println!("cargo::rerun-if-changed={}", log.display());
    }
    Ok(())
}

/// Adds a file, or all files in a folder in their order: names and contents.
fn hash(path: &Path, hasher: &mut blake3::Hasher) -> Result<(), Box<dyn Error>> {
    if path.is_dir() {
        return entries(path)?.iter().try_for_each(|path| hash(path, hasher));
    }
    let text = fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let name = path.file_name().unwrap_or_default();
    hasher.update(name.as_encoded_bytes()).update(&text);
    Ok(())
}

/// What is in a folder, in order.
fn entries(folder: &Path) -> io::Result<BTreeSet<PathBuf>> {
    fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect()
}
