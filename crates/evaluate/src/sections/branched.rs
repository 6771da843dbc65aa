//! Starts for the equilibria of cables with three arms: time, solves, and how often the lowest equilibrium is found.

use anyhow::Result;
use equilibria::branched::BranchedQuery;
use equilibria::branched::sample::BranchedDistribution;
use evaluation::branched::{self, StarWay};
use evaluation::cables::Measured;
use report::{Block, Cell, Section as PageSection};
use serde::{Deserialize, Serialize};

use crate::blocks::{section, table};
use crate::cells::Section;
use crate::context::Context;
use crate::show::number;

/// A set of random queries.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct BranchedKey {
    /// Of each arm.
    segments: usize,
    queries: usize,
    neighbours: Vec<u64>,
    rounds: usize,
}

/// A way as it was measured.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Row {
    start: String,
    levels: Vec<usize>,
    measured: Measured,
}

pub(crate) struct Branched;

/// Seed of the queries.
const SEED: u64 = 1 << 20;
/// By how much less often a rival may find the lowest equilibrium.
const LESS: f64 = 0.005;
/// The learned start that is held against others.
const OURS: (&str, usize) = ("learned, proposals: 4", 7);
const OURS_FOR_ANY: (&str, usize) = ("learned, proposals: 1", 7);

const TITLE: &str = "Starts for the equilibria of branched cables";
const INTRODUCTION: &str = "Which shape do three cables that meet at a junction take between three grips? Every start is brought to \
    the same tolerance, 1e-8. The lowest equilibrium is the lowest of all ways and of 30 random starts, to 1e-6 of its energy.";

impl Section for Branched {
    type Key = BranchedKey;
    type Value = Vec<Row>;
    const ID: &'static str = "branched";

    fn keys(&self, context: &Context) -> Result<Vec<BranchedKey>> {
        let [queries, rounds] = context.size.pick([40, 1], [2000, 3]);
        let neighbours = context.size.pick(vec![100], vec![20_000, 100_000]);
        Ok(vec![BranchedKey { segments: 20, queries, neighbours, rounds }])
    }

    fn seconds(&self, key: &BranchedKey) -> f64 {
        150e-6 * key.queries as f64 * (130 * key.rounds + 10) as f64 + key.neighbours.iter().sum::<u64>() as f64 * 3e-4
    }

    fn measure(&mut self, _: &Context, key: &BranchedKey, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Vec<Row>>> {
        let distribution = BranchedDistribution::default();
        let queries: Vec<BranchedQuery> = (0..key.queries as u64).map(|k| distribution.query(SEED, k)).collect();
        let ways = branched::ways(key.segments, &key.neighbours)?;
        let measured = branched::measure(&queries, &ways, key.segments, key.rounds, go_on)?;
        let row = |(way, measured): (&StarWay, Measured)| Row {
            start: way.name.clone(),
            levels: way.levels.clone(),
            measured,
        };
        Ok(measured.map(|measured| ways.iter().zip(measured).map(row).collect()))
    }

    fn show(&self, context: &Context, cells: &[(&BranchedKey, &Vec<Row>)]) -> Result<PageSection> {
        let Some((key, rows)) = cells.first() else { return Ok(section([Self::ID, TITLE, INTRODUCTION], Vec::new())) };
        let conditions = context
            .without_networks("of the thread; look-ups, inference and answers included")
            .with("queries", format!("{}, seed {SEED}", key.queries))
            .with("segments of an arm", key.segments.to_string())
            .with("rounds", format!("{}, in turns; the best of each counts", key.rounds));
        let gain = table(
            [
                "branched-gain",
                "The learned start beside the fastest without learning",
                "The rival is the fastest start without learning that finds the lowest equilibrium at most half a per cent less \
                 often than the learned one, which proposes up to four. For any equilibrium: the learned start with one proposal \
                 and the fastest of all without learning. Times in us a query.",
            ],
            "asked for | #learned [us] | #lowest % | rival | coarse levels | #rival [us] | #lowest % | #rival, to learned",
            vec![gain("the lowest", rows, OURS, Some(LESS)), gain("any", rows, OURS_FOR_ANY, None)],
            conditions.clone(),
        );
        let all = [
            "branched-all",
            "All starts",
            "With half of the mean's 95 % interval. Solves are linear solves on the arms' own segments.",
        ];
        Ok(section([Self::ID, TITLE, INTRODUCTION], vec![gain, table_of(all, rows, conditions)]))
    }
}

fn levels(row: &Row) -> String {
    let levels: Vec<String> = row.levels.iter().map(ToString::to_string).collect();
    if levels.is_empty() { "-".to_owned() } else { levels.join(", ") }
}

fn percent(share: f64) -> String {
    format!("{:.2}", 100.0 * share)
}

/// A learned start beside the fastest without learning that finds the lowest as often but for `less`, or as rarely as it likes.
fn gain(what: &str, rows: &[Row], (name, level): (&str, usize), less: Option<f64>) -> Vec<Cell> {
    let time = |row: &Row| row.measured.query_us[0];
    let own = rows.iter().find(|row| row.start == name && row.levels == [level]);
    let pair = own.and_then(|own| {
        let least = less.map_or(0.0, |less| own.measured.lowest - less);
        let fits = |row: &&Row| {
            !row.start.starts_with("learned") && row.measured.lowest >= least && row.measured.failed < 5e-3
        };
        Some((own, rows.iter().filter(fits).min_by(|a, b| time(a).total_cmp(&time(b)))?))
    });
    let mut cells: Vec<Cell> = vec![what.into()];
    let Some((own, rival)) = pair else {
        cells.extend((0..7).map(|_| Cell::muted("-")));
        return cells;
    };
    let texts = [
        number(time(own)),
        percent(own.measured.lowest),
        rival.start.clone(),
        levels(rival),
        number(time(rival)),
        percent(rival.measured.lowest),
        number(time(rival) / time(own)),
    ];
    cells.extend(texts.into_iter().map(Cell::from));
    cells
}

fn table_of(head: [&str; 3], rows: &[Row], conditions: report::Conditions) -> Block {
    let with_interval = |[mean, half]: [f64; 2]| format!("{} +- {}", number(mean), number(half));
    let row = |row: &Row| {
        let Measured { query_us, solves, coarse_solves, failed, lowest } = &row.measured;
        let texts = [
            row.start.clone(),
            levels(row),
            with_interval(*query_us),
            with_interval(*solves),
            number(*coarse_solves),
            percent(*failed),
            percent(*lowest),
        ];
        texts.into_iter().map(Cell::from).collect()
    };
    let headings = "start | coarse levels | #time [us] | #solves | #coarse solves | #failed % | #lowest %";
    table(head, headings, rows.iter().map(row).collect(), conditions)
}
