//! The tables of `simulate guesses`, and what they say in words.

use anyhow::Result;
use comfy_table::{CellAlignment, Table};
use evaluation::guesses::{BUCKETS, Cell, DIRECT, EVERY, IMPULSE_AFTER, IMPULSE_SPEED, IMPULSE_STEPS, Spread};

use crate::compare::{PRECONDITIONERS, TOLERANCES};
use crate::guesses::{Report, Standing};
use crate::spreads::say_dropped;
use terminal::say;

/// Columns of a table, and cells of a guess in a bucket.
const COLUMNS: usize = PRECONDITIONERS.len() * TOLERANCES.len();

/// Prints the tables of all scenarios, and the words.
pub(crate) fn print(report: &Report) -> Result<()> {
    say!(
        "The paper's random scenes (Table 1) of seed {}; the data sets have seed {}. Formulation xpbd, exact motion, first\n\
         outer iteration of each of {} steps (of the later ones every {EVERY}th); after step {IMPULSE_AFTER} the rod is struck: its tip gets\n\
         {IMPULSE_SPEED} m/s, and the {IMPULSE_STEPS} steps after it are told apart.\n\
         Per cent of the zero start: sum over a simulation's solves divided by the zero start's sum on the same systems;\n\
         median over the simulations, and its quartiles. Times of guesses include all that they do and learn.",
        report.seed,
        report.data_seed,
        report.steps
    )?;
    for standing in report.standings.iter().filter(|standing| standing.simulations > 0) {
        for bucket in BUCKETS {
            let cells: Vec<&Cell> = standing.cells.iter().filter(|cell| cell.bucket == bucket).collect();
            if cells.iter().any(|cell| cell.solves > 0) {
                say!("\n{}, {bucket}: iterations", title(standing))?;
                say!("{}", table(&cells, |cell| cell.iterations, |cell| cell.iteration_ratio, true))?;
                say!("\n{}, {bucket}: time of guess and solve", title(standing))?;
                say!("{}", table(&cells, |cell| cell.time_us, |cell| cell.time_ratio, false))?;
            }
        }
    }
    for standing in report.standings.iter().filter(|standing| standing.simulations > 0) {
        say!("\n{}: who needs least (median)", title(standing))?;
        say!("{}", winners(standing))?;
        say!("{}", words(standing))?;
        say_dropped(standing.cells.iter().map(|cell| (cell.guess.as_str(), cell.dropped, cell.solves)))?;
    }
    Ok(())
}

fn title(standing: &Standing) -> String {
    format!("{}, {} simulations", standing.scenario, standing.simulations)
}

/// One row a guess: the zero start in numbers, the others in per cent of it.
fn table(
    cells: &[&Cell],
    number: impl Fn(&Cell) -> Option<Spread>,
    ratio: impl Fn(&Cell) -> Option<Spread>,
    quartiles: bool,
) -> Table {
    let mut table = Table::new();
    table.load_style(comfy_table::presets::NOTHING);
    let mut header = vec!["%".to_owned()];
    for preconditioner in PRECONDITIONERS {
        for (t, tolerance) in TOLERANCES.into_iter().enumerate() {
            let name = if t == 0 { preconditioner.name() } else { "" };
            header.push(format!("{name}\n{tolerance:e}"));
        }
    }
    table.set_header(header);
    for (k, row) in cells.chunks(COLUMNS).enumerate() {
        let name = match (k, quartiles) {
            (0, true) => "zero, count".to_owned(),
            (0, false) => "zero, us".to_owned(),
            _ => row[0].guess.clone(),
        };
        let text = |cell: &&Cell| match (k, if k == 0 { number(cell) } else { ratio(cell) }) {
            (_, None) => "-".to_owned(),
            (0, Some(spread)) => format!("{:.0}", spread.median),
            (_, Some(spread)) => {
                let [lower, median, upper] = [spread.lower, spread.median, spread.upper].map(|x| 100.0 * x);
                if quartiles { format!("{median:.0} {lower:.0}-{upper:.0}") } else { format!("{median:.0}") }
            }
        };
        let texts: Vec<String> = row.iter().map(text).collect();
        if texts.iter().any(|text| text != "-") {
            table.add_row(std::iter::once(name).chain(texts));
        }
    }
    for column in table.column_iter_mut() {
        column.set_padding((0, 1));
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// The cell with the smallest median of each column of a bucket; of equal ones the first.
fn best<'a>(cells: &[&'a Cell], ratio: impl Fn(&Cell) -> Option<Spread>) -> Vec<&'a Cell> {
    let median = |cell: &Cell| ratio(cell).map_or(f64::INFINITY, |spread| spread.median);
    let column = |column: usize| cells.iter().copied().skip(column).step_by(COLUMNS);
    (0..COLUMNS).filter_map(|k| column(k).min_by(|a, b| median(a).total_cmp(&median(b)))).collect()
}

/// Of each bucket, which guess (or the direct solve) needs least, and where.
fn winners(standing: &Standing) -> Table {
    let mut table = Table::new();
    table.load_style(comfy_table::presets::NOTHING);
    for bucket in BUCKETS {
        let cells: Vec<&Cell> = standing.cells.iter().filter(|cell| cell.bucket == bucket).collect();
        if cells.iter().any(|cell| cell.solves > 0) {
            table.add_row([bucket, "iterations", &lines(&best(&cells, |cell| cell.iteration_ratio))]);
            table.add_row(["", "time", &lines(&best(&cells, |cell| cell.time_ratio))]);
        }
    }
    for column in table.column_iter_mut() {
        column.set_padding((0, 2));
    }
    table
}

/// A line for each guess among the best: its name and its columns.
fn lines(best: &[&Cell]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for cell in best {
        if !names.contains(&cell.guess.as_str()) {
            names.push(&cell.guess);
        }
    }
    let line = |name: &&str| {
        let own: Vec<&Cell> = best.iter().copied().filter(|cell| cell.guess == *name).collect();
        format!("{name}: {}", places(&own))
    };
    names.iter().map(line).collect::<Vec<_>>().join("\n")
}

/// Columns in words: "everywhere", or the preconditioners with their tolerances.
fn places(cells: &[&Cell]) -> String {
    if cells.len() == COLUMNS {
        return "everywhere".to_owned();
    }
    let of = |name: &'static str| {
        let own = cells.iter().filter(|cell| cell.preconditioner == name);
        let tolerances: Vec<String> = own.map(|cell| format!("{:e}", cell.tolerance)).collect();
        match tolerances.len() {
            0 => None,
            count if count == TOLERANCES.len() => Some(name.to_owned()),
            _ => Some(format!("{name} {}", tolerances.join(" "))),
        }
    };
    PRECONDITIONERS.iter().filter_map(|preconditioner| of(preconditioner.name())).collect::<Vec<_>>().join(", ")
}

/// How the direct solve, Fischer's projection and networks do, in words.
fn words(standing: &Standing) -> String {
    let buckets = BUCKETS.map(|bucket| standing.cells.iter().filter(|cell| cell.bucket == bucket).collect::<Vec<_>>());
    let measured: Vec<_> = buckets.into_iter().filter(|cells| cells.iter().any(|cell| cell.solves > 0)).collect();
    let total = measured.len() * COLUMNS;
    let count = |is: &dyn Fn(&Cell) -> bool, ratio: &dyn Fn(&Cell) -> Option<Spread>| {
        measured.iter().flat_map(|cells| best(cells, ratio)).filter(|cell| is(cell)).count()
    };
    let fastest = count(&|cell| cell.guess == DIRECT, &|cell| cell.time_ratio);
    let mut words = format!(
        "The direct solve takes less time than conjugate gradients from any start in {fastest} of {total} cells."
    );
    let is_fischer = |cell: &Cell| cell.guess.starts_with("fischer");
    if standing.cells.iter().any(is_fischer) {
        let fischer = count(&is_fischer, &|cell| cell.iteration_ratio);
        words += &format!("\nFischer's projection needs the fewest iterations in {fischer} of {total} cells.");
    }
    let mut networks: Vec<&str> = Vec::new();
    for cell in &standing.cells {
        if cell.guess.starts_with("gn") && !networks.contains(&cell.guess.as_str()) {
            networks.push(&cell.guess);
        }
    }
    for name in networks {
        let less = |ratio: &dyn Fn(&Cell) -> Option<Spread>| {
            let own = measured.iter().flatten().filter(|cell| cell.guess == name);
            own.filter(|cell| ratio(cell).is_some_and(|spread| spread.median < 1.0)).count()
        };
        let (iterations, time) = (less(&|cell| cell.iteration_ratio), less(&|cell| cell.time_ratio));
        words += &format!(
            "\n{name} needs fewer iterations than the zero start in {iterations} of {total} cells, less time in {time}."
        );
    }
    words
}
