//! Progress on the terminal, and Ctrl-C.

use std::io::{self, IsTerminal};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressStyle};

use crate::lines::Lines;

/// How long further Ctrl-C count as the first: nobody who presses it twice in a hurry wants to lose the results.
const PATIENCE: Duration = Duration::from_secs(1);

/// Whether the user asked to stop: whatever is running, and whatever comes after it.
static STOPPED: AtomicBool = AtomicBool::new(false);

/// A bar that ends early where the user asks to stop.
pub struct Progress {
    bar: ProgressBar,
    lines: Option<Lines>,
}

impl Progress {
    /// A [`bar`](crate::bar). Ctrl-C asks to stop and keeps the results; once more, after a second, gives them up.
    pub fn new(length: usize, unit: &str, quiet: bool) -> Result<Self> {
        let bar = crate::bar(length, unit, quiet)?;
        let mut first: Option<Instant> = None;
        let listening = ctrlc::set_handler(move || {
            STOPPED.store(true, Ordering::Relaxed);
            if first.get_or_insert_with(Instant::now).elapsed() > PATIENCE {
                std::process::exit(i32::from(crate::INTERRUPTED));
            }
        });
        match listening {
            // Since an earlier bar of this program.
            Err(ctrlc::Error::MultipleHandlers) => {}
            other => other.context("cannot listen to Ctrl-C")?,
        }
        Ok(Self { bar, lines: None })
    }

    /// The same with a line every ten seconds where standard error is not a terminal, as in a job's log.
    ///
    /// # Errors
    /// As [`Progress::new`].
    pub fn with_lines(length: usize, unit: &str, quiet: bool) -> Result<Self> {
        let progress = Self::new(length, unit, quiet)?;
        let lines = (!quiet && !io::stderr().is_terminal()).then(|| Lines::new(length, unit));
        Ok(Self { lines, ..progress })
    }

    /// One of them done. Returns whether to go on.
    pub fn advance(&self) -> bool {
        self.advance_by(1)
    }

    /// So many of them done. Returns whether to go on.
    pub fn advance_by(&self, count: usize) -> bool {
        self.bar.inc(count as u64);
        if let Some(lines) = &self.lines {
            lines.advance_by(count);
        }
        !self.stopped()
    }

    /// Says what goes on now that is not counted, such as "writing a.csv".
    pub fn beside(&self, what: &str) {
        if let Some(lines) = &self.lines {
            lines.beside(what);
        }
        if !self.bar.is_hidden()
            && let Ok(style) = ProgressStyle::with_template("{msg}, {elapsed} gone in all")
        {
            self.bar.set_style(style);
            self.bar.set_message(what.to_owned());
        }
    }

    /// Does something without the bar, such as printing a line.
    pub fn aside<R>(&self, work: impl FnOnce() -> R) -> R {
        self.bar.suspend(work)
    }

    /// Whether the user asked to stop.
    pub fn stopped(&self) -> bool {
        STOPPED.load(Ordering::Relaxed)
    }

    /// Takes the bar away and returns whether the user asked to stop.
    pub fn finish(self) -> bool {
        self.bar.finish_and_clear();
        self.stopped()
    }
}
