//! `simulate list`.

use anyhow::Result;

use crate::Outcome;
use terminal::say;

/// Prints the builtin scenes.
pub(crate) fn list() -> Result<Outcome> {
    let builtins = scene::builtins();
    let width = builtins.iter().map(|b| b.name.len()).max().unwrap_or(0);
    for builtin in &builtins {
        say!("{:width$}  {}", builtin.name, builtin.description)?;
    }
    say!("\nAnd random-rod, random-helix: the paper's Table 1, drawn by --seed and --index.")?;
    Ok(Outcome::Done)
}
