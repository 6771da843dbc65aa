//! `evaluate random`: random scenes, and the laws of mechanics that their runs must keep.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context as _, Result, anyhow};
use clap::Args;
use laws::{Case, Checked, Failure, campaign};
use terminal::{Progress, say};

use crate::outcome::Outcome;

#[derive(Args, Debug)]
pub(crate) struct RandomArgs {
    /// How many scenes.
    #[arg(long, default_value = "100", value_parser = clap::value_parser!(u64).range(1..))]
    count: u64,
    /// Seed of the scenes: the same seed draws the same ones.
    #[arg(long, default_value = "1")]
    seed: u64,
    /// The first scene: 0 is the first one of a seed.
    #[arg(long, value_name = "K", default_value = "0")]
    first: u64,
    /// Check this scene instead: a file that this command has written.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["count", "seed", "first"])]
    file: Option<PathBuf>,
    /// Folder of the minimal scenes that break a law.
    #[arg(long, value_name = "DIR", default_value = "out/random")]
    out: PathBuf,
    /// Print nothing but errors and the laws that are broken.
    #[arg(long)]
    quiet: bool,
}

/// Checks the scenes and shows what they break.
pub(crate) fn random(args: &RandomArgs) -> Result<Outcome> {
    let &RandomArgs { count, seed, first, quiet, .. } = args;
    if let Some(path) = &args.file {
        return one(path);
    }
    let progress = Progress::new(usize::try_from(count)?, "scenes", quiet)?;
    // The first thing that could not be written.
    let trouble = Mutex::new(None);
    let tell = |failures: &[Failure]| {
        let mut trouble = trouble.lock().unwrap_or_else(PoisonError::into_inner);
        if let Err(error) = failures.iter().try_for_each(|failure| tell(args, failure)) {
            trouble.get_or_insert(error);
        }
        progress.advance() && trouble.is_none()
    };
    let found = campaign(seed, first..first.saturating_add(count), &tell);
    if let Some(error) = trouble.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error);
    }
    let interrupted = progress.finish();
    if !quiet {
        let laws::Found { failures, scenes, unsolved_scenes, steps, unsolved_steps, contacts } = found;
        say!(
            "{scenes} scenes of seed {seed}, {steps} steps, {contacts} contact forces: {failures} laws broken; {unsolved_steps} \
             steps in {unsolved_scenes} scenes were not solved, as their status says"
        )?;
    }
    Ok(match (found.failures, interrupted) {
        (1.., _) => Outcome::Faulty,
        (0, true) => Outcome::Interrupted,
        (0, false) => Outcome::Done,
    })
}

/// Checks one scene of a file.
fn one(path: &Path) -> Result<Outcome> {
    let report = match laws::check(&Case::load(path)?) {
        Checked::Ran(report) => report,
        Checked::Refused(message) => return Err(anyhow!(message)),
    };
    for violation in &report.violations {
        say!("{violation}")?;
    }
    say!("{} steps, {} not solved: {} laws broken", report.steps, report.unsolved, report.violations.len())?;
    Ok(if report.violations.is_empty() { Outcome::Done } else { Outcome::Faulty })
}

/// A line about a law that is broken, and the minimal scene as a file.
fn tell(args: &RandomArgs, Failure { index, drawn, case, minimal }: &Failure) -> Result<()> {
    let name = format!("{}-{index}-{}", args.seed, drawn.law);
    let path = write(&args.out, &name, case)?;
    say!("seed {}, scene {index}: {drawn}; minimal scene {}: {minimal}\n{}", args.seed, path.display(), case.file())
}

/// Writes a case, and the files that it names beside it under names of its own.
fn write(folder: &Path, name: &str, case: &Case) -> Result<PathBuf> {
    std::fs::create_dir_all(folder).with_context(|| format!("--out: cannot create {}", folder.display()))?;
    let put = |file: &str, text: &str| -> Result<PathBuf> {
        let path = folder.join(file);
        std::fs::write(&path, text).with_context(|| format!("--out: cannot write {}", path.display()))?;
        Ok(path)
    };
    let mut text = case.file();
    for (file, own) in &case.files {
        let other = format!("{name}-{file}");
        put(&other, own)?;
        text = text.replace(&format!("\"{file}\""), &format!("\"{other}\""));
    }
    put(&format!("{name}.toml"), &text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_that_breaks_a_law_is_written_with_its_files_and_read_again() {
        let folder = tempfile::TempDir::new().expect("a folder");
        let case =
            (0..).map(|index| laws::draw(1, index)).find(|case| !case.files.is_empty()).expect("a case with a file");
        let path = write(folder.path(), "1-7-energy", &case).expect("files");
        assert_eq!(path, folder.path().join("1-7-energy.toml"));
        let read = Case::load(&path).expect("the case");
        let [(old, text), (new, same)] = [&case.files[0], &read.files[0]];
        assert_eq!((format!("1-7-energy-{old}"), text), (new.clone(), same));
        assert_eq!(read.text.replace("1-7-energy-", ""), case.text);
    }
}
