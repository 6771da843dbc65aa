//! What the programs of the workspace share on the command line: flags, standard output and standard error without
//! panics where nobody reads them, and a progress bar.

mod flags;
mod lines;
mod progress;

use std::fmt::Arguments;
use std::io::{self, ErrorKind, Write};

use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

pub use flags::{positive, shard, threads};
pub use progress::Progress;

/// Exit code of a program that was stopped by Ctrl-C, its results kept.
pub const INTERRUPTED: u8 = 130;

/// Prints a line, or several, without blanks at their ends, and flushes them. A reader that has gone away (`simulate list | head -1`) is no error:
/// a run goes on and keeps its files.
///
/// # Errors
/// If standard output takes no more, a full disk for instance.
pub fn print(text: Arguments<'_>) -> Result<()> {
    let text = text.to_string();
    let lines: Vec<&str> = text.split('\n').map(str::trim_end).collect();
    let mut stdout = io::stdout().lock();
    match writeln!(stdout, "{}", lines.join("\n")).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error).context("cannot write to standard output"),
        _ => Ok(()),
    }
}

/// Prints an error to standard error.
pub fn complain(error: Arguments<'_>) {
    // Where standard error is closed, the exit code is all that is left to say.
    let _ = writeln!(io::stderr(), "error: {error}");
}

/// Prints a warning to standard error.
pub fn warn(warning: Arguments<'_>) {
    // Where standard error is closed, the exit code is all that is left to say.
    let _ = writeln!(io::stderr(), "warning: {warning}");
}

/// A bar of `length` things called `unit` with an estimate of the time left, invisible when `quiet` or not on a terminal.
///
/// # Errors
/// If `unit` has braces.
pub fn bar(length: usize, unit: &str, quiet: bool) -> Result<ProgressBar> {
    let target = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
    let bar = ProgressBar::with_draw_target(Some(length as u64), target);
    let template = format!("{{bar:30}} {{pos}}/{{len}} {unit}, {{elapsed}} gone, {{eta}} left");
    bar.set_style(ProgressStyle::with_template(&template)?);
    Ok(bar)
}

/// [`print`] with `println!`'s arguments.
#[macro_export]
macro_rules! say {
    ($($argument:tt)*) => { $crate::print(format_args!($($argument)*)) };
}
