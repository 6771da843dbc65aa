//! Generation: shard by shard, resumable, in parts.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use crate::DatasetError;
use crate::config::{Config, Plan};
use crate::manifest::{Entry, MANIFEST, Manifest, Numbers, ShardInfo, read_sealed};
use crate::record::{Record, record};
use crate::{SCHEMA_VERSION, write};

/// How far a generation is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Trajectories done, those found from before included.
    pub done: usize,
    /// Trajectories of this part in all.
    pub total: usize,
}

/// What a generation came to.
#[derive(Clone, Debug, PartialEq)]
pub struct Generated {
    /// Shards written by this call.
    pub written: usize,
    /// Shards of this part that were there, whole.
    pub kept: usize,
    /// The manifest, if all shards of all parts are there now.
    pub manifest: Option<Manifest>,
}

/// Generates the data set, or part `i` of `n` of it, in `directory`, which is created.
///
/// Trajectories are simulated on rayon's current thread pool; the files have the same bits on any number of threads and
/// in any number of parts. Every file appears complete or not at all. Shards that are there, with the checksum they were
/// written with, are kept, so that the same call resumes what was cut off. Whichever part finds all shards there
/// writes the manifest.
///
/// # Errors
/// If a setting is not allowed, the directory holds another data set, a trajectory cannot be recorded, or a file cannot
/// be written.
pub fn generate(
    directory: &Path,
    config: &Config,
    part: Option<(usize, usize)>,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Generated, DatasetError> {
    config.check()?;
    let (part, parts) = part.unwrap_or((0, 1));
    if part >= parts {
        let value = format!("{part}/{parts}");
        return Err(DatasetError::Setting { key: "part", value, allowed: "i/n with i from 0 to n - 1" });
    }
    std::fs::create_dir_all(directory).map_err(DatasetError::io("create the directory", directory))?;
    let plans = config.shards();
    check_directory(directory, config)?;
    let own = || plans.iter().skip(part).step_by(parts);
    let total = own().map(|plan| plan.trajectories).sum();
    let done = AtomicUsize::new(0);
    let advance = |n: usize| {
        let done = done.fetch_add(n, Ordering::Relaxed) + n;
        progress(Progress { done, total });
    };
    let mut generated = Generated { written: 0, kept: 0, manifest: None };
    for plan in own() {
        if finished(directory, plan)?.is_some() {
            generated.kept += 1;
            advance(plan.trajectories);
            continue;
        }
        let trajectory = |k: usize| {
            let record = simulate(config, plan.first + k as u64);
            advance(1);
            record
        };
        let records: Vec<Record> = (0..plan.trajectories).into_par_iter().map(trajectory).collect::<Result<_, _>>()?;
        write_shard(directory, config, plan, &records)?;
        generated.written += 1;
    }
    let mut entries = Vec::with_capacity(plans.len());
    for plan in &plans {
        // Own shards were hashed or written a moment ago; those of other parts, by them.
        match entry(directory, plan)? {
            Some(entry) if directory.join(plan.file()).exists() => entries.push(entry),
            _ => return Ok(generated),
        }
    }
    generated.manifest = Some(write_manifest(directory, config, &entries)?);
    Ok(generated)
}

fn simulate(config: &Config, index: u64) -> Result<Record, DatasetError> {
    let scene = config.scenario.sample(config.seed, index).scene();
    let scene = scene.map_err(|error| DatasetError::Trajectory { index, message: error.to_string() })?;
    record(&scene, index, config.step(), config.dt_s, config.steps)
}

fn write_shard(directory: &Path, config: &Config, plan: &Plan, records: &[Record]) -> Result<(), DatasetError> {
    let file = directory.join(plan.file());
    let bytes = write::shard(records).map_err(|error| {
        let cause = std::io::Error::other(error.to_string());
        DatasetError::Io { action: "write", file: file.clone(), cause }
    })?;
    export::write_atomically(&file, |out| std::io::Write::write_all(out, &bytes))?;
    let unconverged = records.iter().map(|record| record.unconverged).sum();
    let norms = records.iter().fold(graph::Norms::default(), |norms, record| norms.union(record.norms));
    let entry = Entry {
        schema_version: SCHEMA_VERSION,
        program_version: env!("CARGO_PKG_VERSION").to_owned(),
        config: config.clone(),
        norms: norms.into(),
        shard: ShardInfo {
            file: plan.file(),
            split: plan.split,
            first_trajectory: plan.first,
            bytes: bytes.len(),
            blake3: blake3::hash(&bytes).to_hex().to_string(),
            numbers: Numbers::new(write::counts(records), unconverged),
        },
    };
    write_toml(&directory.join(plan.entry_file()), &entry)
}

fn write_toml<T: serde::Serialize>(file: &Path, value: &T) -> Result<(), DatasetError> {
    export::write_atomically(file, |out| std::io::Write::write_all(out, export::seal(value)?.as_bytes()))?;
    Ok(())
}

/// The manifest that is there, if it lists the same shards; else a new one.
fn write_manifest(directory: &Path, config: &Config, entries: &[Entry]) -> Result<Manifest, DatasetError> {
    let manifest = Manifest::of(config, entries, export::git_revision());
    if let Ok(there) = Manifest::read(directory)
        && there == (Manifest { git_revision: there.git_revision.clone(), ..manifest.clone() })
    {
        return Ok(there);
    }
    write_toml(&directory.join(MANIFEST), &manifest)?;
    Ok(manifest)
}

/// The entry of a shard, if it has one that can be read.
fn entry(directory: &Path, plan: &Plan) -> Result<Option<Entry>, DatasetError> {
    let file = directory.join(plan.entry_file());
    match read_sealed::<Entry>(&file) {
        Ok(entry) => Ok(Some(entry)),
        Err(DatasetError::Io { cause, .. }) if cause.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(error @ DatasetError::Io { .. }) => Err(error),
        // Damaged: the shard is generated again.
        Err(_) => Ok(None),
    }
}

/// The entry of a shard whose file is there and whole.
fn finished(directory: &Path, plan: &Plan) -> Result<Option<Entry>, DatasetError> {
    let Some(entry) = entry(directory, plan)? else { return Ok(None) };
    let file = directory.join(plan.file());
    if !file.exists() {
        return Ok(None);
    }
    let map = crate::map::Map::open(&file)?;
    let is_whole = blake3::hash(map.bytes()).to_hex().as_str() == entry.shard.blake3;
    Ok(is_whole.then_some(entry))
}

/// Refuses a directory with shards of another data set, of whatever part.
fn check_directory(directory: &Path, config: &Config) -> Result<(), DatasetError> {
    let listing = std::fs::read_dir(directory).map_err(DatasetError::io("read", directory))?;
    let mut names = Vec::new();
    for item in listing {
        let name = item.map_err(DatasetError::io("read", directory))?.file_name();
        names.extend(name.into_string().ok().filter(|name| name.ends_with(".toml")));
    }
    names.sort_unstable();
    for name in names {
        let file = directory.join(&name);
        let read = if name == MANIFEST {
            read_sealed::<Manifest>(&file).map(|manifest| (manifest.config, manifest.program_version))
        } else {
            read_sealed::<Entry>(&file).map(|entry| (entry.config, entry.program_version))
        };
        let (found, version) = match read {
            Ok(read) => read,
            // Of another format: not ours to write over. Anything else is damaged, and is generated again.
            Err(error @ DatasetError::Value { .. }) if error.is_other_schema() => return Err(error),
            Err(_) => continue,
        };
        let own = env!("CARGO_PKG_VERSION");
        if version != own {
            let allowed = format!("{own}, or the directory another one: programs differ in their rounding");
            return Err(DatasetError::value(&file, "program_version", version, allowed));
        }
        if let Some((key, value, wanted)) = difference(&found, config) {
            let allowed = format!("{wanted} to go on in this directory");
            return Err(DatasetError::value(&file, format!("config.{key}"), value, allowed));
        }
    }
    Ok(())
}

/// The first setting in which two configurations differ, and its two values.
fn difference(found: &Config, wanted: &Config) -> Option<(String, String, String)> {
    let [found, wanted] = [found, wanted].map(|config| toml::Table::try_from(config).unwrap_or_default());
    let differs = |(key, value): (&String, &toml::Value)| {
        let other = wanted.get(key)?;
        (other != value).then(|| (key.clone(), value.to_string(), other.to_string()))
    };
    found.iter().find_map(differs)
}
