//! A sweep's folder.
//!
//! ```text
//! sweep.toml              what the cells are (sealed)
//! cells/HASH.toml         the outcome of each cell that is done, by the hash of its key
//! training/NAME.*         checkpoint, curves and state of each cell's training
//! summary.toml            what `train sweep merge` makes of all
//! ```

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use evaluation::ablation::{CELLS, Key, Outcome, SCHEMA_VERSION, SWEEP, Sweep};
use export::{Results, seal, unseal, write_atomically};

/// Where a sweep's files are.
pub(crate) struct Folder {
    path: PathBuf,
    /// Outcomes of cells.
    pub(crate) cells: Results<Key, Outcome>,
}

impl Folder {
    pub(crate) fn new(path: &Path) -> Self {
        Self { path: path.to_owned(), cells: Results::new(path.join(CELLS), SCHEMA_VERSION) }
    }

    /// Where a cell's checkpoint is, without ending.
    pub(crate) fn training(&self, key: &Key) -> PathBuf {
        let (scenario, recipe, own) = (&key.source.scenario, &key.budget.recipe, key.architecture);
        let name = format!("gn{}-mlp{}-width{}-seed{}", own.gn_blocks, own.mlp_layers, own.width, key.seed);
        self.path.join("training").join(format!("{scenario}-{recipe}-{name}"))
    }

    /// What is swept here; `None` where nothing is yet.
    pub(crate) fn sweep(&self) -> Result<Option<Sweep>> {
        let file = self.sweep_file();
        match fs::read(&file) {
            Ok(bytes) => Ok(Some(unseal(&file, &bytes, SCHEMA_VERSION)?)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(anyhow!("cannot read {}: {error}", file.display())),
        }
    }

    /// The file that says what is swept here.
    pub(crate) fn sweep_file(&self) -> PathBuf {
        self.path.join(SWEEP)
    }

    /// Sees that nothing else is swept here.
    pub(crate) fn check(&self, sweep: &Sweep) -> Result<()> {
        let Some(found) = self.sweep()? else { return Ok(()) };
        if found == *sweep {
            return Ok(());
        }
        let difference = difference(&found, sweep)?;
        bail!("--out {}: {} is of another sweep, {difference}", self.path.display(), self.sweep_file().display())
    }

    /// Makes the folders, and says in them what is swept.
    pub(crate) fn prepare(&self, sweep: &Sweep) -> Result<()> {
        let training = self.path.join("training");
        fs::create_dir_all(&training)
            .with_context(|| format!("--out: cannot make the folder {}", training.display()))?;
        let text = seal(sweep)?;
        Ok(write_atomically(&self.sweep_file(), |out| out.write_all(text.as_bytes()))?)
    }
}

/// The first line that differs, in words.
pub(crate) fn difference(there: &Sweep, here: &Sweep) -> Result<String> {
    let [there, here] = [seal(there)?, seal(here)?];
    // The checksum in front differs whatever else does.
    let lines = there.lines().zip(here.lines()).skip(1);
    let different = lines.into_iter().find(|(there, here)| there != here);
    Ok(different.map_or("with more of it".to_owned(), |(there, here)| format!("with {there}, not {here}")))
}
