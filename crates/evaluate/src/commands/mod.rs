//! What a user measures by hand: ways and guesses on scenes of one's own choice, the stability table, experiments with known
//! results. Each command makes text and tables, prints them, and with `--out` writes them as a page.

pub(crate) mod benchmark;
pub(crate) mod compare;
pub(crate) mod laws;
pub(crate) mod random;
pub(crate) mod stress;

use std::path::PathBuf;

use anyhow::{Context as _, Result};
use catalogue::Row;
use clap::Args;
use report::{Block, Conditions, Page, Section, wrapped};
use terminal::{Progress, say};

use crate::make;
use crate::outcome::Outcome;

/// Characters of a line on the terminal.
const WIDTH: u16 = 120;

/// Where the numbers go.
#[derive(Args, Debug)]
pub(crate) struct OutputArgs {
    /// Write text and tables to this folder, too: a page, index.html, and each table as csv/NAME.csv.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print nothing but errors.
    #[arg(long)]
    quiet: bool,
}

fn at_least_one(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|&count| count > 0).ok_or_else(|| "it must be a whole number of at least 1".to_owned())
}

impl OutputArgs {
    /// Finds out whether the numbers can be written afterwards. Times are told of one thread.
    fn prepare(&self) -> Result<()> {
        if let Some(out) = &self.out {
            std::fs::create_dir_all(out).with_context(|| format!("--out: cannot create {}", out.display()))?;
        }
        Ok(rayon::ThreadPoolBuilder::new().num_threads(1).build_global()?)
    }

    /// Prints a line, or several.
    fn say(&self, text: &str) -> Result<()> {
        if self.quiet { Ok(()) } else { say!("{text}") }
    }

    /// Prints what was measured, and writes it as a page of this id and title.
    fn finish(&self, of: [&str; 2], blocks: Vec<Block>, conditions: Conditions, progress: Progress) -> Result<Outcome> {
        let interrupted = progress.finish();
        for block in &blocks {
            self.say(&match block {
                Block::Table(table) => {
                    let words = [&*table.title, &table.caption].map(|text| wrapped(text, WIDTH));
                    format!("\n{}\n{}", words.join("\n").trim_end(), table.text(WIDTH))
                }
                Block::Paragraph(text) => format!("\n{}", wrapped(text, WIDTH)),
                Block::Figure(_) => continue,
            })?;
        }
        self.write(of, blocks, conditions, interrupted)
    }

    /// Writes what was measured as a page of this id and title.
    fn write(&self, of: [&str; 2], blocks: Vec<Block>, conditions: Conditions, interrupted: bool) -> Result<Outcome> {
        if let Some(out) = &self.out {
            let [id, title] = of.map(str::to_owned);
            let sections = vec![Section { id, title: title.clone(), blocks }];
            make::write(&Page { title, lead: Vec::new(), conditions, sections }, out).context("--out")?;
        }
        Ok(if interrupted { Outcome::Interrupted } else { Outcome::Done })
    }
}

/// What holds for all numbers.
fn conditions() -> Conditions {
    Conditions::new("machine", export::machine()).with("threads", "1").with("program", env!("CARGO_PKG_VERSION"))
}

/// The networks of these rows, by their hashes.
fn with_networks(conditions: Conditions, of: &str, rows: &[Row<'_>]) -> Conditions {
    let origins = rows.iter().filter_map(|row| Some((&row.name, row.guess.origin()?)));
    origins.fold(conditions, |conditions, (name, origin)| {
        conditions
            .with(format!("{of}, {name}"), format!("{}, weights BLAKE3 {}", origin.network, origin.weights_blake3))
    })
}
