//! A sweep's folder.
//!
//! ```text
//! sweep.toml              what the cells are (sealed)
//! cells/HASH.toml         the outcome of each cell that is done, by the hash of its key
//! training/NAME.*         checkpoint, curves and state of each cell's training
//! summary.toml            what `train sweep merge` makes of all
//! ```

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use evaluation::ablation::{CellKey, NetworkOutcome, SCHEMA_VERSION, Sweep};
use export::{Results, seal, unseal, write_atomically};

/// Where a sweep's files are.
pub(crate) struct Folder {
    path: PathBuf,
    /// Outcomes of cells.
    pub(crate) cells: Results<CellKey, NetworkOutcome>,
}

impl Folder {
    pub(crate) fn new(path: &Path) -> Self {
        Self { path: path.to_owned(), cells: Results::new(path.join("cells"), SCHEMA_VERSION) }
    }

    /// Where the checkpoints are.
    pub(crate) fn trainings(&self) -> PathBuf {
        self.path.join("training")
    }

    /// The file that says what is swept here.
    pub(crate) fn sweep_file(&self) -> PathBuf {
        self.path.join("sweep.toml")
    }

    /// What is swept here.
    pub(crate) fn sweep(&self) -> Result<Sweep> {
        let file = self.sweep_file();
        let bytes = fs::read(&file).with_context(|| format!("{}: this is no folder of a sweep", file.display()))?;
        Ok(unseal(&file, &bytes, SCHEMA_VERSION)?)
    }

    /// Sees that nothing else is swept here; the error ends with the first line that differs.
    pub(crate) fn check(&self, sweep: &Sweep) -> Result<()> {
        let file = self.sweep_file();
        if !file.exists() || self.sweep()? == *sweep {
            return Ok(());
        }
        let [there, here] = [seal(&self.sweep()?)?, seal(sweep)?];
        // The checksum in front differs whatever else does.
        let mut lines = there.lines().zip(here.lines()).skip(1);
        let different = lines.find(|(there, here)| there != here);
        let words = different.map_or("more of it".to_owned(), |(there, here)| format!("{there}, not {here}"));
        bail!("{} is of another sweep, with {words}", file.display())
    }

    /// Makes the folders, and says in them what is swept.
    pub(crate) fn prepare(&self, sweep: &Sweep) -> Result<()> {
        let training = self.trainings();
        fs::create_dir_all(&training)
            .with_context(|| format!("--out: cannot make the folder {}", training.display()))?;
        let text = seal(sweep)?;
        Ok(write_atomically(&self.sweep_file(), |out| out.write_all(text.as_bytes()))?)
    }
}
