//! Where learned guesses come from, as flags.

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;

use crate::name::{GuessName, LearnedName};

/// Where learned guesses learned.
#[derive(Args, Clone, Debug, Default)]
pub struct Sources {
    /// Folder of the data sets for knn; they are generated there on first use [default: data].
    #[arg(long, value_name = "DIR")]
    pub data: Option<PathBuf>,
    /// Checkpoint of your own training for gn (recipe paper), gn-best (best) or gn-step (step), PATH.toml with PATH.safetensors,
    /// in the place of the network of its scenario that is built in.
    #[arg(long, value_name = "PATH")]
    pub checkpoint: Option<PathBuf>,
}

/// Checks that what `--data` and `--checkpoint` name is read by a guess that was asked for.
pub(crate) fn check_sources(args: &Sources, names: &[GuessName]) -> Result<()> {
    let is_knn = |name: &GuessName| *name == GuessName::Learned(LearnedName::Knn);
    let is_network = |name: &GuessName| name.recipe().is_some();
    for (flag, given, guesses, is_read) in [
        ("--data", args.data.is_some(), "knn", names.iter().any(is_knn)),
        ("--checkpoint", args.checkpoint.is_some(), "gn, gn-best or gn-step", names.iter().any(is_network)),
    ] {
        if given && !is_read {
            let asked: Vec<String> = names.iter().map(GuessName::to_string).collect();
            let asked = if asked.is_empty() { "none".to_owned() } else { asked.join(", ") };
            bail!("{flag} needs the guess {guesses}, but asked for: {asked}");
        }
    }
    Ok(())
}
