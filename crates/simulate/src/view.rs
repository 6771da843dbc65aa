//! `simulate view`: several runs in one page.

use std::path::Path;

use anyhow::{Context, Result, bail};
use terminal::say;

use crate::Outcome;
use crate::cli::ViewArgs;
use crate::files::RUN;

/// Writes a page with the runs that `--view` has left in these folders.
pub(crate) fn view(args: &ViewArgs) -> Result<Outcome> {
    let runs = args.runs.iter().map(|directory| read(directory)).collect::<Result<Vec<_>>>()?;
    view::write_page(&args.out, &runs).context("--out")?;
    say!("open {}", args.out.display())?;
    Ok(Outcome::Done)
}

fn read(directory: &Path) -> Result<view::Run> {
    let file = directory.join(RUN);
    if !file.exists() {
        bail!("RUNS: {} has no {RUN}, which a run with --view writes", directory.display());
    }
    view::read_run(&file).context("RUNS")
}
