//! `simulate view`: several runs in one page.

use anyhow::{Context, Result};
use terminal::say;

use crate::Outcome;
use crate::cli::ViewArgs;
use crate::files::RUN;

/// Writes a page with the runs that `--view` has left in these folders.
pub(crate) fn view(args: &ViewArgs) -> Result<Outcome> {
    let read = |directory: &std::path::PathBuf| {
        view::read_run(&directory.join(RUN)).context("RUNS: each is a folder that `simulate --view` wrote to")
    };
    let runs = args.runs.iter().map(read).collect::<Result<Vec<_>>>()?;
    view::write_page(&args.out, &runs).context("--out")?;
    say!("wrote {}", args.out.display())?;
    Ok(Outcome::Done)
}
