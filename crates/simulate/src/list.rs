//! `simulate list`.

use anyhow::Result;

use crate::Outcome;
use crate::scenes::random_names;
use terminal::say;

/// Prints the builtin scenes.
pub(crate) fn list() -> Result<Outcome> {
    let builtins = scene::builtins();
    let width = builtins.iter().map(|b| b.name.len()).max().unwrap_or(0);
    for builtin in &builtins {
        say!("{:width$}  {}", builtin.name, builtin.description)?;
    }
    say!("\nAnd {}: the paper's random scenes, drawn by --seed and --index.", random_names())?;
    Ok(Outcome::Done)
}
