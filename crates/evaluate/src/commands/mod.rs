//! What a user measures by hand: ways and guesses on scenes of one's own choice, the stability table. Each command makes
//! text and tables, prints them, and with `--out` writes them as a page.

pub(crate) mod compare;
pub(crate) mod guesses;
pub(crate) mod steps;
pub(crate) mod stress;

use std::path::PathBuf;

use anyhow::{Context as _, Result, bail};
use catalogue::{GuessName, Row, Sources, Training, load};
use clap::Args;
use dataset::{Config, Scenario};
use report::{Block, Conditions, Page, Section, wrapped};
use scene::Scene;
use solver::guess::GuessKind;
use terminal::{Progress, say};

use crate::Outcome;
use crate::library::Guesses;

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

/// Random scenes to measure on.
#[derive(Args, Debug)]
pub(crate) struct ScenesArgs {
    /// Which random scenes: rod, helix, knot, tree (`steps`: rod, helix).
    #[arg(long, value_delimiter = ',', default_value = "rod,helix")]
    scenario: Vec<Scenario>,
    /// Simulations of each kind of scenes (for `steps`, at each time step and tolerance).
    #[arg(long, default_value = "50", value_parser = at_least_one, allow_hyphen_values = true)]
    simulations: usize,
    /// Steps of each. In `guesses` the rod is struck after step 60.
    #[arg(long, default_value = "100", value_parser = at_least_one, allow_hyphen_values = true)]
    steps: usize,
    /// Seed of the scenes. Those that learned guesses know have seed 0.
    #[arg(long, default_value = "1")]
    seed: u64,
    #[command(flatten)]
    learned: Sources,
    #[command(flatten)]
    output: OutputArgs,
}

fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count) if count > 0 => Ok(count),
        _ => Err("it must be a whole number of at least 1".to_owned()),
    }
}

impl OutputArgs {
    /// Finds out whether the numbers can be written afterwards. Times are told of one thread.
    fn prepare(&self) -> Result<()> {
        if let Some(out) = &self.out {
            std::fs::create_dir_all(out).with_context(|| format!("--out: cannot create {}", out.display()))?;
        }
        Ok(rayon::ThreadPoolBuilder::new().num_threads(1).build_global()?)
    }

    /// Prints a line before the measurement.
    fn say(&self, line: &str) -> Result<()> {
        if self.quiet { Ok(()) } else { say!("{line}") }
    }

    /// Prints what was measured, and writes it.
    fn finish(&self, section: Section, conditions: Conditions, progress: Progress) -> Result<Outcome> {
        let interrupted = progress.finish();
        if !self.quiet {
            for block in &section.blocks {
                match block {
                    Block::Table(table) => say!("\n{}\n{}", table.title, table.text(WIDTH))?,
                    Block::Paragraph(text) => {
                        say!("\n{}", wrapped(text, WIDTH))?;
                    }
                    _ => {}
                }
            }
        }
        if let Some(out) = &self.out {
            let (title, lead) = (section.title.clone(), Vec::new());
            Page { title, lead, conditions, sections: vec![section] }.write(out).context("--out")?;
        }
        Ok(if interrupted { Outcome::Interrupted } else { Outcome::Done })
    }
}

impl ScenesArgs {
    /// The zero start and these guesses, for each scenario that is asked for.
    fn load(&self, guesses: &[GuessName]) -> Result<Vec<(Scenario, Guesses)>> {
        if self.seed == Config::table_1(Scenario::Rod).seed {
            bail!(
                "--seed {}, but it must differ from the data sets' seed: learned guesses have seen those scenes",
                self.seed
            );
        }
        self.output.prepare()?;
        let scenarios: Vec<Scenario> = Scenario::ALL.into_iter().filter(|one| self.scenario.contains(one)).collect();
        let trainings = Training::of(&self.learned, guesses, &scenarios, self.output.quiet)?;
        let with_guesses = |training: &Training| {
            let names = std::iter::once(GuessName::Plain(GuessKind::Zero)).chain(guesses.iter().copied());
            Ok((training.scenario, load(names, training)?))
        };
        trainings.iter().map(with_guesses).collect()
    }

    /// Measures scenes of one kind, slack variants of Table 1's or those themselves; what Ctrl-C cut off is left out.
    fn measure<T>(
        &self,
        scenario: Scenario,
        is_slack: bool,
        progress: &Progress,
        mut measure: impl FnMut(&Scene) -> Result<T>,
    ) -> Result<Vec<T>> {
        let mut measured = Vec::new();
        for index in 0..self.simulations as u64 {
            let parameters = scenario.sample(self.seed, index);
            let slack = if is_slack { parameters.slack() } else { None };
            let one = measure(&slack.unwrap_or(parameters).scene()?)?;
            if progress.stopped() {
                break;
            }
            measured.push(one);
        }
        Ok(measured)
    }

    /// What holds for all numbers on these scenes.
    fn conditions(&self) -> Conditions {
        conditions()
            .with("scenes", format!("random ones of the paper's Table 1, seed {}", self.seed))
            .with("steps", self.steps.to_string())
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
