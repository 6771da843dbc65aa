//! `evaluate random`: random scenes, and the laws of mechanics that their runs must keep.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use anyhow::{Context as _, Result};
use clap::Args;
use laws::{Campaign, Case, Failure, Found, Share, campaign};
use report::Block;
use terminal::{Progress, say};

use super::WIDTH;
use crate::Outcome;
use crate::blocks::table;

#[derive(Args, Debug)]
pub(crate) struct RandomArgs {
    /// How many scenes.
    #[arg(long, default_value = "100", value_parser = clap::value_parser!(u64).range(1..))]
    count: u64,
    /// Seed of the scenes: the same seed draws the same ones.
    #[arg(long, default_value = "1")]
    seed: u64,
    /// Only scene K of this seed, from 0; it is also written as it was drawn.
    #[arg(long, value_name = "K", conflicts_with = "count")]
    only: Option<u64>,
    /// Folder of the scenes that break a law, each made as small as it goes.
    #[arg(long, value_name = "DIR", default_value = "out/random")]
    out: PathBuf,
    /// Print nothing but errors and the laws that are broken.
    #[arg(long)]
    quiet: bool,
}

/// Writes a case, and the files that it names beside it under names of its own.
fn write(folder: &Path, name: &str, case: &Case) -> Result<PathBuf> {
    let mut text = case.file();
    std::fs::create_dir_all(folder).with_context(|| format!("--out: cannot create {}", folder.display()))?;
    let put = |file: &str, text: &str| -> Result<PathBuf> {
        let path = folder.join(file);
        std::fs::write(&path, text).with_context(|| format!("--out: cannot write {}", path.display()))?;
        Ok(path)
    };
    for (file, own) in &case.files {
        let other = format!("{name}-{file}");
        put(&other, own)?;
        text = text.replace(&format!("\"{file}\""), &format!("\"{other}\""));
    }
    put(&format!("{name}.toml"), &text)
}

/// Looks at the scenes and shows what they break.
pub(crate) fn random(args: &RandomArgs) -> Result<Outcome> {
    let (first, count) = args.only.map_or((0, args.count), |only| (only, 1));
    let progress = Progress::new(count as usize, "scenes", args.quiet)?;
    if let Some(only) = args.only {
        let path = write(&args.out, &format!("{}-{only}-drawn", args.seed), &laws::draw(args.seed, only))?;
        if !args.quiet {
            say!("scene {only} of seed {}: {}", args.seed, path.display())?;
        }
    }
    // The first thing that could not be written; how many scenes are done.
    let state = Mutex::new((None, 0_u64));
    let tell = |failures: &[Failure]| {
        let told = failures.iter().try_for_each(|failure| tell(args, failure));
        let mut state = match state.lock() {
            Ok(state) => state,
            Err(poisoned) => poisoned.into_inner(),
        };
        let (trouble, done) = &mut *state;
        *done += 1;
        if !args.quiet && count >= 20 && *done % count.div_ceil(10) == 0 && *done < count {
            // Where no bar is seen.
            let _ = say!("{done} of {count} scenes");
        }
        if let Err(error) = told {
            trouble.get_or_insert(error);
        }
        progress.advance() && trouble.is_none()
    };
    let found = campaign(&Campaign { seed: args.seed, first, count, shrinks: true }, &tell)?;
    if let (Some(error), _) = state.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner) {
        return Err(error);
    }
    let interrupted = progress.finish();
    if !args.quiet {
        show(&found, args.seed)?;
    }
    Ok(match (found.failures.is_empty(), interrupted) {
        (false, _) => Outcome::Faulty,
        (true, true) => Outcome::Interrupted,
        (true, false) => Outcome::Done,
    })
}

/// A line about a law that is broken, and its scene as a file.
fn tell(args: &RandomArgs, failure: &Failure) -> Result<()> {
    let Failure { index, broken, case, small } = failure;
    let name = format!("{}-{index}-{}", args.seed, broken.law);
    let path = write(&args.out, &name, case)?;
    say!(
        "seed {}, scene {index}: {} is broken {:.1} times over in step {}: {}; small: {:.1} times over in step {}: {}: {}",
        args.seed,
        broken.law,
        broken.size,
        broken.step,
        broken.words,
        small.size,
        small.step,
        small.words,
        path.display()
    )
}

/// The tables at the end.
fn show(found: &Found, seed: u64) -> Result<()> {
    let conditions = || report::Conditions::new("seed", seed.to_string());
    let per_cent = |part: u64, share: &Share| format!("{:.1}", 100.0 * part as f64 / share.scenes.max(1) as f64);
    let row = |(name, share): (&str, &Share)| {
        let shares = [share.unsolved, share.in_parts, share.broken].map(|part| per_cent(part, share));
        let [unsolved, in_parts, broken] = shares;
        [name.to_owned(), share.scenes.to_string(), unsolved, in_parts, broken].map(report::Cell::from).to_vec()
    };
    let mut rows = vec![row(("all", &found.all))];
    rows.extend(found.features.iter().map(|(name, share)| row((name, share))));
    let [steps, unsolved] = found.steps;
    let caption = format!(
        "{steps} steps, {unsolved} of them not solved; {} contact forces. Unsolved: share of scenes with a step that did not \
         converge.",
        found.contacts
    );
    let headings = "feature | #scenes | #unsolved % | #solved in parts % | #break a law %";
    let features = table(["random", "Scenes by what they have", &caption], headings, rows, conditions());
    let laws = found.by_law().into_iter();
    let laws = laws.map(|(law, count)| [law.to_string(), count.to_string()].map(report::Cell::from).to_vec()).collect();
    let laws = table(["laws", "Scenes that break a law", ""], "law | #scenes", laws, conditions());
    for block in [features, laws] {
        if let Block::Table(table) = block {
            let words = format!("{}\n{}", table.title, table.caption);
            say!("\n{}\n{}", words.trim_end(), table.text(WIDTH))?;
        }
    }
    Ok(())
}
