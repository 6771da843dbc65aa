//! Builds in which sources the program is made of: of each section of the report a hash of all that decides what it
//! measures, and the revision that it is of. What draws the report is not part of it.

use std::error::Error;
use std::path::Path;
use std::process::Command;
use std::{env, fs};

/// What decides measurements: crates, scenes, and what the sections share.
const DECIDING: [&str; 14] = [
    "crates/rod/",
    "crates/collision/",
    "crates/solver/",
    "crates/scene/",
    "crates/graph/",
    "crates/dataset/",
    "crates/knn/",
    "crates/copingnet/",
    "crates/catalogue/",
    "crates/evaluation/",
    "scenes/",
    "crates/evaluate/src/library.rs",
    "crates/evaluate/src/ways.rs",
    "crates/evaluate/src/sections/paper.rs",
];
/// Of that, what decides these sections alone.
const ONLY: [(&str, &[&str]); 9] = [
    ("crates/evaluation/src/ablation", &[]),
    ("crates/evaluation/src/needs", &["needs"]),
    ("crates/evaluation/src/stress", &["stability"]),
    ("crates/evaluation/src/paper", &PAPER),
    ("crates/evaluate/src/sections/paper", &PAPER),
    // Training alone: what comes of it are the networks, which have hashes of their own.
    ("crates/copingnet/src/backend", &[]),
    ("crates/copingnet/src/cg_loss", &[]),
    ("crates/copingnet/src/network", &[]),
    ("crates/copingnet/src/tensors", &[]),
];
const PAPER: [&str; 7] = ["performance", "temporal", "long-term", "dynamics", "nrmse", "speedups", "knot"];
/// Other people's crates that decide measurements, as the lock file has them.
const DEPENDENCIES: [&str; 6] = ["faer", "nalgebra", "pulp", "rand", "rand_chacha", "rayon"];
/// What draws the report, and what it is drawn with.
const DRAWING: [&str; 3] = ["crates/evaluate/", "crates/report/", "crates/export/"];
/// A section measures in `NAME.rs` or `NAME/mod.rs` of this folder; what shows it is below.
const SECTIONS: &str = "crates/evaluate/src/sections/";

fn main() -> Result<(), Box<dyn Error>> {
    let root = Path::new(&env::var("CARGO_MANIFEST_DIR")?).join("../..").canonicalize()?;
    let git = |arguments: &[&str]| {
        let output = Command::new("git").current_dir(&root).args(arguments).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let status = git(&["status", "--porcelain", "--untracked-files=all", "--no-renames"]).unwrap_or_default();
    let changed: Vec<&str> = status.lines().filter_map(|line| line.get(3..)).filter(|path| is_source(path)).collect();
    let mut all = Vec::new();
    for place in ["crates", "scenes"] {
        collect(&root, place, &mut all)?;
    }
    let locked = locked(&fs::read_to_string(root.join("Cargo.lock"))?);
    let sources = |decides: &dyn Fn(&str) -> bool| -> Result<String, Box<dyn Error>> {
        let files: Vec<&str> = all.iter().map(String::as_str).filter(|path| decides(path)).collect();
        let mut hasher = blake3::Hasher::new();
        hasher.update(locked.as_bytes());
        for file in &files {
            hasher.update(file.as_bytes()).update(deciding_text(&fs::read_to_string(root.join(file))?).as_bytes());
        }
        let revision = git(&[&["log", "-1", "--format=%H", "--"], &files[..]].concat());
        let revision = revision.map(|text| text.trim().to_owned()).filter(|text| !text.is_empty());
        let (revision, hash) = (revision.unwrap_or_else(|| "unknown".to_owned()), hasher.finalize().to_hex());
        let is_dirty = changed.iter().any(|path| decides(path));
        Ok(format!("Sources {{ blake3: \"{hash}\", revision: \"{revision}\", is_dirty: {is_dirty} }}"))
    };
    let starts = |path: &str, places: &[&str]| places.iter().any(|place| path.starts_with(place));
    let mut sections = String::new();
    for file in all.iter().filter(|file| file.starts_with(SECTIONS)) {
        let own = file[SECTIONS.len()..].trim_end_matches(".rs").trim_end_matches("/mod");
        let name = own.replace('_', "-");
        let is_for = |path: &str| {
            ONLY.iter().all(|(start, sections)| !path.starts_with(start) || sections.contains(&name.as_str()))
        };
        if !["mod", "paper", "claims"].contains(&own) && !own.contains('/') {
            let own = sources(&|path| path == file || (starts(path, &DECIDING) && is_for(path)))?;
            sections.push_str(&format!("(\"{name}\", {own}),\n"));
        }
    }
    let program = sources(&|path| starts(path, &DECIDING) || starts(path, &DRAWING))?;
    let text = format!(
        "pub(crate) const ROOT: &str = {:?};\npub(crate) static BY_SECTION: &[(&str, Sources)] = &[\n{sections}];\n\
         pub(crate) static PROGRAM: Sources = {program};\n",
        root.display().to_string()
    );
    fs::write(Path::new(&env::var("OUT_DIR")?).join("sources.rs"), text)?;
    for place in DECIDING.iter().chain(&DRAWING).chain(&["Cargo.lock"]).map(|place| root.join(place)) {
        if place.exists() {
            println!("cargo::rerun-if-changed={}", place.display());
        }
    }
    // Changes with every commit.
    let log = git(&["rev-parse", "--git-path", "logs/HEAD"]).map(|path| root.join(path.trim()));
    if let Some(log) = log.filter(|log| log.exists()) {
        println!("cargo::rerun-if-changed={}", log.display());
    }
    Ok(())
}

/// Whether a path below the root is of a source, tests and manifests left out.
fn is_source(path: &str) -> bool {
    let is_left_out = |part: &str| ["tests", "benches", "examples", "target", "tests.rs", "Cargo.toml"].contains(&part);
    (path.ends_with(".rs") || path.ends_with(".toml")) && !path.split('/').any(is_left_out)
}

/// Adds the sources in a place below `root`, in order.
fn collect(root: &Path, place: &str, files: &mut Vec<String>) -> Result<(), Box<dyn Error>> {
    let path = root.join(place);
    if path.is_dir() {
        let entries = fs::read_dir(&path)?.map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()));
        let mut names = entries.collect::<Result<Vec<String>, Box<dyn Error>>>()?;
        names.sort();
        for name in names {
            collect(root, &format!("{place}/{name}"), files)?;
        }
    } else if is_source(place) {
        files.push(place.to_owned());
    }
    Ok(())
}

/// A file without what decides nothing: comments on lines of their own, blank lines, and tests, which stand last.
fn deciding_text(text: &str) -> String {
    let code = text.split("#[cfg(test)]\nmod ").next().unwrap_or(text);
    let lines = code.lines().filter(|line| !line.trim().is_empty());
    lines.filter(|line| !line.trim_start().starts_with("//")).flat_map(|line| [line, "\n"]).collect()
}

/// Of the lock file, the versions of [`DEPENDENCIES`].
fn locked(text: &str) -> String {
    let is_own = |package: &&str| DEPENDENCIES.iter().any(|name| package.contains(&format!("\nname = \"{name}\"\n")));
    text.split("[[package]]").filter(is_own).collect()
}
