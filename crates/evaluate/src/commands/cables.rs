//! `evaluate cables`: starts for the equilibria of cables between two grips.

use anyhow::{Result, ensure};
use clap::Args;
use equilibria::Query;
use equilibria::sample::Distribution;
use evaluation::cables::{self, Measured, PathStep};
use report::{Block, Cell, Conditions};
use terminal::Progress;

use super::{OutputArgs, at_least_one, conditions};
use crate::Outcome;
use crate::blocks::table;
use crate::show::number;

/// Steps of the second grip: its distance over the length, and its turn [degrees].
const PATHS: [(f64, f64); 2] = [(0.02, 5.0), (0.1, 20.0)];
/// Queries of a path.
const STEPS: usize = 10;

#[derive(Args, Debug)]
pub(crate) struct CablesArgs {
    /// Random queries.
    #[arg(long, default_value = "3000", value_parser = at_least_one)]
    queries: usize,
    /// Seed of the queries.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Equal segments in which each cable is cut.
    #[arg(long, default_value_t = 50, value_parser = clap::value_parser!(u16).range(20..=1000))]
    segments: u16,
    /// Smallest and largest distance of the grips over the length.
    #[arg(long, num_args = 2, value_names = ["LEAST", "MOST"], default_values_t = Distribution::default().distance)]
    distance: Vec<f64>,
    /// Largest curvature at rest times the length.
    #[arg(long, default_value_t = 0.0)]
    curvature: f64,
    /// Largest weight that is carried, over B / L^2.
    #[arg(long, default_value_t = 0.0)]
    carried: f64,
    /// Answers among which neighbours are looked for.
    #[arg(long, default_value = "20000", value_parser = at_least_one)]
    neighbours: usize,
    /// Rounds in which all ways take turns; the best of each counts.
    #[arg(long, default_value = "5", value_parser = at_least_one)]
    rounds: usize,
    #[command(flatten)]
    output: OutputArgs,
}

const HEADINGS: &str = "start | coarse levels | #time [us] | #solves | #coarse solves | #failed % | #lowest %";

/// Measures all ways and shows a row each.
pub(crate) fn cables(args: &CablesArgs) -> Result<Outcome> {
    let [least, most] = [args.distance[0], args.distance[1]];
    let is_range = 0.0 < least && least <= most && most < 1.0;
    ensure!(is_range, "--distance {least} {most}, but it must be two numbers between 0 and 1, the larger one last");
    let CablesArgs { curvature, carried, .. } = *args;
    for (flag, value) in [("--curvature", curvature), ("--carried", carried)] {
        ensure!((0.0..=1e3).contains(&value), "{flag} {value}, but it must be a number from 0 to 1000");
    }
    args.output.prepare()?;
    let segments = usize::from(args.segments);
    let distribution = Distribution { distance: [least, most], curvature, carried, ..Distribution::default() };
    let queries: Vec<Query> = (0..args.queries as u64).map(|k| distribution.query(args.seed, k)).collect();
    let ways = cables::ways(&distribution, segments, args.neighbours as u64)?;
    let progress = Progress::new(ways.len() * args.rounds + PATHS.len() * STEPS, "ways", args.output.quiet)?;
    let conditions = conditions()
        .with("queries", args.queries.to_string())
        .with("seed", args.seed.to_string())
        .with("segments", segments.to_string())
        .with("distance over length", format!("{least} to {most}"))
        .with("largest curvature times length", curvature.to_string())
        .with("largest carried weight, B / L^2", carried.to_string())
        .with("neighbours", args.neighbours.to_string())
        .with("rounds", args.rounds.to_string());
    let mut blocks = Vec::new();
    if let Some(measured) = cables::measure(&queries, &ways, segments, args.rounds, || progress.advance())? {
        let row = |(way, own): (&cables::Way, &Measured)| {
            let levels: Vec<String> = way.levels.iter().map(ToString::to_string).collect();
            row(&way.name, if levels.is_empty() { "-".to_owned() } else { levels.join(", ") }, own)
        };
        let caption = "Time of a query on one thread, look-ups and answers included, and linear solves on the cable's own segments, \
                       both with half of the mean's 95 % interval. Tolerance 1e-8. Lowest: to 1e-6 of the energy, among all ways \
                       and 30 random starts.";
        let rows = ways.iter().zip(&measured).map(row).collect();
        let title = format!("{} queries, {segments} segments", args.queries);
        blocks.push(table(["cables-starts", &title, caption], HEADINGS, rows, conditions.clone()));
        blocks.extend(paths(args, &queries, &conditions, &progress)?);
    }
    args.output.finish(["cables", "Equilibria of cables"], blocks, conditions, progress)
}

/// The previous answer as a start.
fn paths(args: &CablesArgs, queries: &[Query], conditions: &Conditions, progress: &Progress) -> Result<Option<Block>> {
    let segments = usize::from(args.segments);
    let first = &queries[..queries.len().min(args.queries / STEPS + 1)];
    let mut rows = Vec::new();
    for (distance, degrees) in PATHS {
        let step = PathStep { distance, angle: degrees.to_radians() };
        let Some(measured) = cables::measure_paths(first, step, STEPS, segments, || progress.advance())? else {
            return Ok(None);
        };
        let words = format!("steps of {distance} L and {degrees} degrees");
        for (name, levels, own) in
            [("previous answer", "-", &measured[0]), ("two curves, both twists", "11", &measured[1])]
        {
            rows.push(row(&format!("{name}, {words}"), levels.to_owned(), own));
        }
    }
    let title = format!("{} paths of {STEPS} queries", first.len());
    let caption = "The second grip goes and turns in random directions. Lowest: the lower one of both ways.";
    Ok(Some(table(["cables-paths", &title, caption], HEADINGS, rows, conditions.clone())))
}

fn row(name: &str, levels: String, own: &Measured) -> Vec<Cell> {
    let with_interval =
        |[mean, half]: [f64; 2], unit: f64| format!("{} +- {}", number(mean * unit), number(half * unit));
    let percent = |share: f64| format!("{:.2}", 100.0 * share);
    let cells = [
        name.to_owned(),
        levels,
        with_interval(own.seconds, 1e6),
        with_interval(own.solves, 1.0),
        number(own.coarse_solves),
        percent(own.failed),
        percent(own.lowest),
    ];
    cells.into_iter().map(Cell::from).collect()
}
