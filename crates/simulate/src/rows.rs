//! The guesses of a table, a row each.

use std::fmt::Write as _;

use anyhow::Result;
use evaluation::guesses::Spread;
use graph::Normal;
use rod::Model;
use serde::Serialize;
use solver::component::Members;
use solver::guess::InitialGuess;
use solver::topology::Topology;

use crate::guess::{Guess, GuessName, Origin};
use crate::training::Training;
use terminal::say;

/// A row of a table: its name, the guess, and whether it is restricted to the scene's plane.
pub(crate) struct Row<'a> {
    /// What the table calls it.
    pub(crate) name: String,
    /// The guess's own name.
    pub(crate) guess_name: GuessName,
    guess: &'a Guess,
    planar: bool,
}

impl<'a> Row<'a> {
    /// The guess in a scene that stays in this plane, if it stays in one.
    pub(crate) fn factory(
        &self,
        plane: Option<Normal>,
    ) -> impl Fn(&Model, &Members, &Topology) -> Option<Box<dyn InitialGuess>> + use<'a> {
        self.guess.factory(plane.filter(|_| self.planar))
    }
}

/// Which network stands behind a row.
#[derive(Debug, Serialize)]
pub(crate) struct NetworkOf {
    /// Name of the row.
    pub(crate) guess: String,
    /// The network.
    #[serde(flatten)]
    pub(crate) origin: Origin,
}

/// The networks of those rows that have one.
pub(crate) fn networks(rows: &[Row<'_>]) -> Vec<NetworkOf> {
    let of = |row: &Row<'_>| {
        let origin = row.guess.origin()?.clone();
        Some(NetworkOf { guess: row.name.clone(), origin })
    };
    rows.iter().filter_map(of).collect()
}

/// Says how many starts of which guesses were dropped, if any were; of each cell the guess, the starts dropped and the
/// solves.
pub(crate) fn say_dropped<'a>(cells: impl Iterator<Item = (&'a str, u64, u64)>) -> Result<()> {
    let mut sums: Vec<(&str, u64, u64)> = Vec::new();
    for (guess, dropped, solves) in cells {
        match sums.iter_mut().find(|(name, ..)| *name == guess) {
            Some(sum) => (sum.1, sum.2) = (sum.1 + dropped, sum.2 + solves),
            None => sums.push((guess, dropped, solves)),
        }
    }
    let line = |(guess, dropped, solves): &(&str, u64, u64)| format!("{guess} {dropped} of {solves}");
    let lines: Vec<String> = sums.iter().filter(|(_, dropped, _)| *dropped > 0).map(line).collect();
    if lines.is_empty() {
        return Ok(());
    }
    say!("Starts dropped, since their rounding errors would show: {}", lines.join("; "))
}

/// Gets what these guesses need, each once.
pub(crate) fn load(names: impl IntoIterator<Item = GuessName>, training: &Training) -> Result<Vec<(GuessName, Guess)>> {
    let mut guesses: Vec<(GuessName, Guess)> = Vec::new();
    for name in names {
        if guesses.iter().all(|(other, _)| *other != name) {
            guesses.push((name, Guess::load(name, training)?));
        }
    }
    Ok(guesses)
}

/// The rows of a table; where scenes are planar, the learned ones that know nothing of it by themselves a second time.
pub(crate) fn rows(guesses: &[(GuessName, Guess)], are_planar: bool) -> Vec<Row<'_>> {
    let mut rows = Vec::new();
    for (guess_name, guess) in guesses {
        let guess_name = *guess_name;
        let knows_planes = guess.knows_planes();
        rows.push(Row { name: guess_name.to_string(), guess_name, guess, planar: knows_planes });
        if are_planar && guess_name.is_learned() && !knows_planes {
            rows.push(Row { name: format!("{guess_name}, planar"), guess_name, guess, planar: true });
        }
    }
    rows
}

/// Each once, in their order.
pub(crate) fn distinct<T: Copy + PartialEq>(values: &[T]) -> Vec<T> {
    let mut distinct = Vec::new();
    for &value in values {
        if !distinct.contains(&value) {
            distinct.push(value);
        }
    }
    distinct
}

/// Names of the columns of these spreads in a file of comma-separated values.
pub(crate) fn spread_names(spreads: &[&str]) -> String {
    let parts = ["mean", "lower_quartile", "median", "upper_quartile"];
    let names: Vec<String> = spreads.iter().flat_map(|spread| parts.map(|part| format!("{spread}_{part}"))).collect();
    names.join(",")
}

/// Appends the columns of spreads; empty where nothing was counted.
pub(crate) fn push_spreads(text: &mut String, spreads: &[Option<Spread>]) {
    for spread in spreads {
        match spread {
            Some(Spread { mean, lower, median, upper }) => {
                // Writing to a string cannot fail.
                let _ = write!(text, ",{mean:.6e},{lower:.6e},{median:.6e},{upper:.6e}");
            }
            None => text.push_str(",,,,"),
        }
    }
}

/// The network of a row and its weights' hash, as two columns; empty where the row has none.
pub(crate) fn network_columns(networks: &[NetworkOf], guess: &str) -> String {
    let network = networks.iter().find(|network| network.guess == guess);
    network.map_or(",".to_owned(), |NetworkOf { origin, .. }| {
        format!("\"{}\",{}", origin.network.replace('"', "\"\""), origin.weights_blake3)
    })
}
