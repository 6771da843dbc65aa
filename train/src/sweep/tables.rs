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

/// A number of a table: its name, where it stands, and the digits after the point.
struct Figure {
    name: &'static str,
    preconditioner: &'static str,
    tolerance: f64,
    of: fn(&Row) -> Option<Spread>,
    digits: usize,
}

/// What the tables show.
const FIGURES: [Figure; 5] = [
    Figure {
        name: "cg iterations to a zero start, raw 1e-4",
        preconditioner: RAW,
        tolerance: TOLERANCE,
        of: |row| row.iteration_ratio,
        digits: 2,
    },
    Figure {
        name: "cg iterations to a zero start, raw 1e-2",
        preconditioner: RAW,
        tolerance: 1e-2,
        of: |row| row.iteration_ratio,
        digits: 2,
    },
    Figure {
        name: "cg iterations to a zero start, block-jacobi 1e-2",
        preconditioner: "block-jacobi",
        tolerance: 1e-2,
        of: |row| row.iteration_ratio,
        digits: 2,
    },
    Figure {
        name: "speed-up of the solve, guess included, raw 1e-4",
        preconditioner: RAW,
        tolerance: TOLERANCE,
        of: |row| row.speed_up,
        digits: 2,
    },
    Figure {
        name: "time of the guess [us a solve]",
        preconditioner: RAW,
        tolerance: TOLERANCE,
        of: |row| row.inference_us,
        digits: 0,
    },
];

/// Prints all tables: medians over the simulations, means over the seeds, in brackets half of what the seeds differ by.
pub(crate) fn print(summary: &Summary) -> Result<()> {
    let grid = &summary.sweep.grid;
    let benchmark = grid.benchmark;
    for source in &summary.sweep.sources {
        let own = summary.cells.iter().filter(|cell| cell.scenario == source.scenario);
        let guesses: BTreeSet<&str> = own.flat_map(|cell| &cell.outcome.rows).map(|row| row.guess.as_str()).collect();
        for guess in guesses {
            for figure in &FIGURES {
                let at = |architecture| cell(summary, &source.scenario, guess, figure, architecture);
                say!("\n{}, {guess}: {}", source.scenario, figure.name)?;
                let head: String =
                    grid.widths.iter().map(|width| format!("{:>16}", format!("width {width}"))).collect();
                say!("{:>12}{head}", "")?;
                for &gn_blocks in &grid.gn_blocks {
                    let row = grid.widths.iter().map(|&width| at(Architecture { gn_blocks, width, ..benchmark }));
                    say!("{:>12}{}", format!("{gn_blocks} GN blocks"), row.collect::<String>())?;
                }
                let layers = |&mlp_layers: &u16| at(Architecture { mlp_layers, ..benchmark });
                let head: String = grid.mlp_layers.iter().map(|n| format!("{:>16}", format!("{n} layers"))).collect();
                say!("{:>12}{head}", "")?;
                say!("{:>12}{}", "benchmark", grid.mlp_layers.iter().map(layers).collect::<String>())?;
            }
        }
    }
    Ok(())
}

/// A number of the seeds together, 16 characters wide.
fn cell(summary: &Summary, scenario: &str, guess: &str, figure: &Figure, architecture: Architecture) -> String {
    let is_own = |row: &&Row| {
        row.guess == guess && row.preconditioner == figure.preconditioner && row.tolerance == figure.tolerance
    };
    let cells = summary.cells.iter().filter(|cell| cell.scenario == scenario && cell.architecture == architecture);
    let rows = cells.filter_map(|cell| cell.outcome.rows.iter().find(is_own));
    let values: Vec<f64> = rows.filter_map(|row| (figure.of)(row)).map(|spread| spread.median).collect();
    let text = match values[..] {
        [] => "-".to_owned(),
        [one] => format!("{one:.*}", figure.digits),
        _ => {
            let [low, high] = [values.iter().copied().reduce(f64::min), values.iter().copied().reduce(f64::max)];
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let half = 0.5 * (high.unwrap_or(mean) - low.unwrap_or(mean));
            format!("{mean:.*} ({half:.*})", figure.digits, figure.digits)
        }
    };
    format!("{text:>16}")
}
