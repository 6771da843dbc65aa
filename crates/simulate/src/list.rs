//! `simulate list`.

use anyhow::Result;
use cosserat::scene;

use crate::named::random_names;
use crate::outcome::Outcome;
use terminal::say;

/// Prints the scenes that come with the program.
pub(crate) fn list() -> Result<Outcome> {
    let builtins = scene::builtins();
    let width = builtins.iter().map(|b| b.name.len()).max().unwrap_or(0);
    for builtin in &builtins {
        say!("{:width$}  {}", builtin.name, builtin.description)?;
    }
    say!("\nHeaps and weaves have any size: heap-1280, weave-50.")?;
    say!("And random scenes, drawn by --seed and --index as in the COPINGNet paper: {}.", random_names())?;
    say!("`simulate NAME --view` writes out/NAME/view.html, a page to watch one.")?;
    Ok(Outcome::Done)
}
