//! `simulate view`: several runs in one page.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

use anyhow::{Context, Result, bail};
use terminal::say;

use crate::cli::ViewArgs;
use crate::files::{PAGE, RUN};
use crate::outcome::Outcome;

/// How every page that plays runs begins; no other file is written over.
const PAGE_BEGINS: &[u8] = b"<!doctype html>\n<html lang=\"en\" data-state=\"loading\">\n";

/// Writes a page with the runs that `--view` has left in these folders.
pub(crate) fn view(args: &ViewArgs) -> Result<Outcome> {
    if args.out.is_dir() {
        let (folder, page) = (args.out.display(), args.out.join(PAGE));
        bail!("--out: {folder} is a folder; give the page a name, such as {}", page.display());
    }
    if !is_free(&args.out)? {
        bail!("--out: {} is in the way and is no page of runs: move it, or choose another name", args.out.display());
    }
    let runs = args.runs.iter().map(|directory| read(directory)).collect::<Result<Vec<_>>>()?;
    view::write_page(&args.out, &runs).context("--out")?;
    say!("open {}", args.out.display())?;
    Ok(Outcome::Done)
}

/// Whether there is nothing at a path, or an older page of runs.
fn is_free(path: &Path) -> Result<bool> {
    let look = || format!("--out: cannot look at {}", path.display());
    let file = match File::open(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(true),
        file => file.with_context(look)?,
    };
    let mut begin = Vec::new();
    file.take(PAGE_BEGINS.len() as u64).read_to_end(&mut begin).with_context(look)?;
    Ok(begin == PAGE_BEGINS)
}

fn read(directory: &Path) -> Result<view::Run> {
    let file = directory.join(RUN);
    if !file.exists() {
        bail!("{} has no {RUN}, which a run with --view writes", directory.display());
    }
    Ok(view::read_run(&file)?)
}
