//! Standard output and standard error for the programs of the workspace, without panics where nobody reads them.

use std::fmt::Arguments;
use std::io::{self, ErrorKind, Write};

use anyhow::{Context, Result};

/// Prints a line, or several, and flushes them. A reader that has gone away (`simulate list | head -1`) is no error:
/// a run goes on and keeps its files.
///
/// # Errors
/// If standard output takes no more, a full disk for instance.
pub fn print(text: Arguments<'_>) -> Result<()> {
    let mut stdout = io::stdout().lock();
    match writeln!(stdout, "{text}").and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error).context("cannot write to standard output"),
        _ => Ok(()),
    }
}

/// Prints an error to standard error.
pub fn complain(error: Arguments<'_>) {
    // Where standard error is closed, the exit code is all that is left to say.
    let _ = writeln!(io::stderr(), "error: {error}");
}

/// [`print`] with `println!`'s arguments.
#[macro_export]
macro_rules! say {
    ($($argument:tt)*) => { $crate::print(format_args!($($argument)*)) };
}
