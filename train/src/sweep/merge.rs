//! `train sweep merge`: the cells of all shards together.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use evaluation::ablation::{Key, Outcome, SCHEMA_VERSION, SUMMARY, Summary, Sweep, SweepCell};
use export::{Stored, seal, write_atomically};
use terminal::say;

use super::args::MergeArgs;
use super::folder::{Folder, difference};

/// Lost cells that an error names.
const NAMED: usize = 5;

/// Puts the cells together, writes summary.toml.
pub(crate) fn merge(args: &MergeArgs) -> Result<()> {
    let sweep = common(&args.folders)?;
    let gathered = Gathered::new(&sweep, &args.folders)?;
    for damaged in &gathered.damaged {
        say!("damaged: {damaged}")?;
    }
    let all = gathered.outcomes.len();
    let lost: Vec<String> =
        gathered.outcomes.iter().filter(|(_, outcome)| outcome.is_none()).map(|(key, _)| key.to_string()).collect();
    say!(
        "{} of {all} cells; {} doubled with the same weights; {} lost, {} files damaged",
        all - lost.len(),
        gathered.doubled,
        lost.len(),
        gathered.damaged.len()
    )?;
    if !lost.is_empty() && !args.partial {
        let more = if lost.len() > NAMED { "; ..." } else { "" };
        let named = lost.iter().take(NAMED).map(String::as_str).collect::<Vec<_>>().join("; ");
        let damaged = gathered.damaged.first().map_or(String::new(), |first| format!("; damaged: {first}"));
        bail!("{} of {all} cells are lost (--partial leaves them out): {named}{more}{damaged}", lost.len());
    }
    let cell = |(key, outcome): (Key, Option<Outcome>)| {
        let Key { seed, architecture, source, .. } = key;
        outcome.map(|outcome| SweepCell { scenario: source.scenario, architecture, seed, outcome })
    };
    let cells = gathered.outcomes.into_iter().filter_map(cell).collect();
    let summary = Summary { schema_version: SCHEMA_VERSION, lost, sweep, cells };
    let out = args.out.as_ref().or(args.folders.first()).context("no folder is given")?;
    fs::create_dir_all(out).with_context(|| format!("--out: cannot make the folder {}", out.display()))?;
    let (file, sealed) = (out.join(SUMMARY), seal(&summary)?);
    write_atomically(&file, |out| out.write_all(sealed.as_bytes()))?;
    say!("wrote {}", file.display())
}

/// The sweep that all folders are of.
fn common(folders: &[PathBuf]) -> Result<Sweep> {
    let mut first: Option<(PathBuf, Sweep)> = None;
    for folder in folders {
        let folder = Folder::new(folder);
        let file = folder.sweep_file();
        let Some(sweep) = folder.sweep()? else {
            bail!("{} is not there: this is no folder of a sweep", file.display())
        };
        match &first {
            Some((other, same)) if *same != sweep => {
                let difference = difference(&sweep, same)?;
                bail!("{} is of another sweep than {}, {difference}", file.display(), other.display())
            }
            Some(_) => {}
            None => first = Some((file, sweep)),
        }
    }
    Ok(first.context("no folder is given")?.1)
}

/// What is in the folders.
struct Gathered {
    /// All cells of the sweep, in its order.
    outcomes: Vec<(Key, Option<Outcome>)>,
    /// What is wrong with files.
    damaged: Vec<String>,
    /// Cells that were there once more.
    doubled: usize,
}

impl Gathered {
    fn new(sweep: &Sweep, folders: &[PathBuf]) -> Result<Self> {
        let (mut found, mut damaged, mut doubled) = (BTreeMap::<String, Stored<Key, Outcome>>::new(), Vec::new(), 0);
        for folder in folders {
            for stored in Folder::new(folder).cells.all()? {
                let stored = match stored {
                    Ok(stored) => stored,
                    Err(error) => {
                        damaged.push(error.to_string());
                        continue;
                    }
                };
                // The name is the key's hash.
                let name = name(&stored.file);
                match found.get(&name) {
                    None => drop(found.insert(name, stored)),
                    Some(other) if other.value.weights_blake3 == stored.value.weights_blake3 => doubled += 1,
                    Some(other) => bail!(
                        "{} and {} are the same cell ({}) with different weights: delete one of them",
                        other.file.display(),
                        stored.file.display(),
                        stored.key
                    ),
                }
            }
        }
        // Keys are alike in all folders, wherever they are.
        let cells = Folder::new(Path::new("")).cells;
        let take = |key: Key| Ok((found.remove(&name(&cells.file(&key)?)).map(|stored| stored.value), key));
        let outcomes = sweep.keys().into_iter().map(take).collect::<Result<Vec<_>>>()?;
        if let Some(foreign) = found.values().next() {
            bail!("{}: {} is no cell of this sweep", foreign.file.display(), foreign.key);
        }
        Ok(Self { outcomes: outcomes.into_iter().map(|(outcome, key)| (key, outcome)).collect(), damaged, doubled })
    }
}

fn name(file: &Path) -> String {
    file.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests;
