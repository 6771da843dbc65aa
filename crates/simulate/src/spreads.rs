//! What tables of spreads have in common: their columns in files, and starts that were dropped.

use std::fmt::Write as _;

use anyhow::Result;
use catalogue::NetworkOf;
use evaluation::guesses::Spread;
use terminal::say;

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
