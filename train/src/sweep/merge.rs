//! `train sweep merge`: the cells of all shards together.

use std::fs;
use std::io::Write;

use anyhow::{Context, Result, anyhow, bail};
use evaluation::ablation::{CellKey, NetworkOutcome, SCHEMA_VERSION, Summary, SweepCell};
use export::{Stored, seal, write_atomically};
use terminal::say;

use super::args::MergeArgs;
use super::folder::Folder;

/// Lost cells that an error names.
const NAMED: usize = 5;
/// File with all cells together: a sealed [`Summary`].
const SUMMARY: &str = "summary.toml";

/// Puts the cells together, writes summary.toml.
pub(crate) fn merge(args: &MergeArgs) -> Result<()> {
    let folders: Vec<Folder> = args.folders.iter().map(|path| Folder::new(path)).collect();
    let (path, first) = args.folders.first().zip(folders.first()).context("no folder is given")?;
    let sweep = first.sweep()?;
    for folder in &folders[1..] {
        folder.sweep()?;
        folder.check(&sweep).map_err(|error| anyhow!("{error} as in {}", first.sweep_file().display()))?;
    }
    let (mut found, damaged, doubled) = gather(&folders)?;
    for damaged in &damaged {
        say!("damaged: {damaged}")?;
    }
    let (mut cells, mut lost) = (Vec::new(), Vec::new());
    for key in sweep.keys() {
        match found.iter().position(|stored| stored.key == key) {
            Some(place) => {
                let CellKey { seed, architecture, source, .. } = key;
                let outcome = found.swap_remove(place).value;
                cells.push(SweepCell { scenario: source.scenario, architecture, seed, outcome });
            }
            None => lost.push(key.to_string()),
        }
    }
    if let Some(foreign) = found.first() {
        bail!("{}: {} is no cell of this sweep", foreign.file.display(), foreign.key);
    }
    let (there, all) = (cells.len(), cells.len() + lost.len());
    let (gone, broken) = (lost.len(), damaged.len());
    say!("{there} of {all} cells; {doubled} doubled with the same weights; {gone} lost, {broken} files damaged")?;
    if gone > 0 && !args.partial {
        let more = if gone > NAMED { "; ..." } else { "" };
        let named = lost[..gone.min(NAMED)].join("; ");
        let damaged = damaged.first().map_or(String::new(), |first| format!("; damaged: {first}"));
        bail!("{gone} of {all} cells are lost (--partial leaves them out): {named}{more}{damaged}");
    }
    let out = args.out.as_ref().unwrap_or(path);
    fs::create_dir_all(out).with_context(|| format!("--out: cannot make the folder {}", out.display()))?;
    let (file, sealed) = (out.join(SUMMARY), seal(&Summary { schema_version: SCHEMA_VERSION, lost, sweep, cells })?);
    write_atomically(&file, |out| out.write_all(sealed.as_bytes()))?;
    say!("wrote {}", file.display())
}

type Found = Stored<CellKey, NetworkOutcome>;

/// The cells in the folders, each once, what is wrong with other files, and the number of cells that were there again.
fn gather(folders: &[Folder]) -> Result<(Vec<Found>, Vec<String>, usize)> {
    let (mut found, mut damaged, mut doubled) = (Vec::<Found>::new(), Vec::new(), 0);
    for folder in folders {
        for stored in folder.cells.all()? {
            let stored = match stored {
                Ok(stored) => stored,
                Err(error) => {
                    damaged.push(error.to_string());
                    continue;
                }
            };
            match found.iter().find(|other| other.key == stored.key) {
                None => found.push(stored),
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
    Ok((found, damaged, doubled))
}

#[cfg(test)]
mod tests;
