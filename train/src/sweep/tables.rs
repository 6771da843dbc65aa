//! Heat maps of a sweep as text.

use std::collections::BTreeSet;

use anyhow::Result;
use evaluation::ablation::{Architecture, Row, Summary};
use evaluation::guesses::Spread;
use terminal::say;

/// Preconditioner and tolerance of the paper's cell.
pub(crate) const RAW: &str = "raw";
/// See [`RAW`].
pub(crate) const TOLERANCE: f64 = 1e-4;

/// A number of a table: its name, preconditioner and tolerance of its row, what it is, and the digits after the point.
type Figure = (&'static str, &'static str, f64, fn(&Row) -> Option<Spread>, usize);

/// What the tables show.
const FIGURES: [Figure; 5] = [
    ("cg iterations to a zero start, raw 1e-4", RAW, TOLERANCE, |row| row.iteration_ratio, 2),
    ("cg iterations to a zero start, raw 1e-2", RAW, 1e-2, |row| row.iteration_ratio, 2),
    ("cg iterations to a zero start, block-jacobi 1e-2", "block-jacobi", 1e-2, |row| row.iteration_ratio, 2),
    ("speed-up of the solve, guess included, raw 1e-4", RAW, TOLERANCE, |row| row.speed_up, 2),
    ("time of the guess [us a solve]", RAW, TOLERANCE, |row| row.inference_us, 0),
];

/// Prints all tables: medians over the simulations, means over the seeds, in brackets half of what the seeds differ by.
pub(crate) fn print(summary: &Summary) -> Result<()> {
    let grid = &summary.sweep.grid;
    let benchmark = grid.benchmark;
    for source in &summary.sweep.sources {
        let own = summary.cells.iter().filter(|cell| cell.scenario == source.scenario);
        let guesses: BTreeSet<&str> = own.flat_map(|cell| &cell.outcome.rows).map(|row| row.guess.as_str()).collect();
        for (guess, figure) in guesses.iter().flat_map(|guess| FIGURES.iter().map(move |figure| (guess, figure))) {
            let at = |architecture| cell(summary, &source.scenario, guess, figure, architecture);
            say!("\n{}, {guess}: {}", source.scenario, figure.0)?;
            say!("{:>12}{}", "", heads(&grid.widths, |width| format!("width {width}")))?;
            for &gn_blocks in &grid.gn_blocks {
                let row = grid.widths.iter().map(|&width| at(Architecture { gn_blocks, width, ..benchmark }));
                say!("{:>12}{}", format!("{gn_blocks} GN blocks"), row.collect::<String>())?;
            }
            let layers = |&mlp_layers: &u16| at(Architecture { mlp_layers, ..benchmark });
            say!("{:>12}{}", "", heads(&grid.mlp_layers, |layers| format!("{layers} layers")))?;
            say!("{:>12}{}", "benchmark", grid.mlp_layers.iter().map(layers).collect::<String>())?;
        }
    }
    Ok(())
}

fn heads(sizes: &[u16], name: impl Fn(u16) -> String) -> String {
    sizes.iter().map(|&size| format!("{:>16}", name(size))).collect()
}

/// A number of the seeds together, 16 characters wide.
fn cell(summary: &Summary, scenario: &str, guess: &str, figure: &Figure, architecture: Architecture) -> String {
    let &(_, preconditioner, tolerance, of, digits) = figure;
    let is_own = |row: &&Row| row.guess == guess && row.preconditioner == preconditioner && row.tolerance == tolerance;
    let cells = summary.cells.iter().filter(|cell| cell.scenario == scenario && cell.architecture == architecture);
    let rows = cells.filter_map(|cell| cell.outcome.rows.iter().find(is_own));
    let values: Vec<f64> = rows.filter_map(of).map(|spread| spread.median).collect();
    let text = match values[..] {
        [] => "-".to_owned(),
        [one] => format!("{one:.digits$}"),
        _ => {
            let [low, high] = [f64::min, f64::max].map(|pick| values.iter().copied().fold(values[0], pick));
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            format!("{mean:.digits$} ({:.digits$})", 0.5 * (high - low))
        }
    };
    format!("{text:>16}")
}
