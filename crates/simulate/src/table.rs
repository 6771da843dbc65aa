//! What the tables on random scenes, `guesses` and `steps`, have in common: what is loaded before, and where numbers go.

use std::io::Write as _;
use std::path::Path;

use anyhow::{Context, Result, bail};
use catalogue::{Guess, GuessName, Training, load};
use dataset::Scenario;
use serde::Serialize;
use solver::guess::GuessKind;

use crate::Outcome;
use crate::cli::TableArgs;
use crate::spreads::distinct;
use terminal::say;

/// A scenario with the guesses that are measured on it.
pub(crate) type Measured = (Scenario, Vec<(GuessName, Guess)>);

/// The zero start and these guesses, for each scenario that is asked for. Finds out first whether the numbers can be
/// written afterwards.
pub(crate) fn prepare(table: &TableArgs, guesses: &[GuessName]) -> Result<Vec<Measured>> {
    if let Some(file) = &table.csv {
        check_place(file)?;
    }
    let trainings = Training::of(&table.learned, guesses, &distinct(&table.scenario), table.json)?;
    let with_guesses = |training: &Training| {
        let names = std::iter::once(GuessName::Plain(GuessKind::Zero)).chain(guesses.iter().copied());
        Ok((training.scenario, load(names, training)?))
    };
    trainings.iter().map(with_guesses).collect()
}

/// Writes and prints what was measured: `csv` makes the file's text, `print` the tables.
pub(crate) fn finish<R: Serialize>(
    table: &TableArgs,
    report: &R,
    interrupted: bool,
    csv: fn(&R) -> String,
    print: fn(&R) -> Result<()>,
) -> Result<Outcome> {
    if let Some(file) = &table.csv {
        let text = csv(report);
        export::write_atomically(file, |out| out.write_all(text.as_bytes())).context("--csv")?;
    }
    if table.json {
        say!("{}", serde_json::to_string_pretty(report)?)?;
    } else {
        print(report)?;
    }
    Ok(if interrupted { Outcome::Interrupted } else { Outcome::Done })
}

fn check_place(file: &Path) -> Result<()> {
    let parent = file.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if file.is_dir() {
        bail!("--csv: cannot write {}: is a directory", file.display());
    }
    if !parent.is_dir() {
        bail!("--csv: cannot write {}: there is no directory {}", file.display(), parent.display());
    }
    Ok(())
}
