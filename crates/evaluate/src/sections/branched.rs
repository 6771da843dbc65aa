//! Starts for the equilibria of cables with three arms: time, solves, and how often the lowest equilibrium is found.

use anyhow::Result;
use equilibria::Params;
use equilibria::branched::sample::BranchedDistribution;
use equilibria::branched::{BranchedQuery, default_params};
use evaluation::{branched, cables};
use report::{Cell, Section as PageSection};
use serde::{Deserialize, Serialize};

use super::cables::show::{self, COMPARED, LESS, Row};
use crate::blocks::{section, table};
use crate::cells::Section;
use crate::context::Context;

/// A set of random queries.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct BranchedKey {
    /// Of each arm.
    segments: usize,
    queries: usize,
    neighbours: Vec<u64>,
    rounds: usize,
}

pub(crate) struct Branched;

/// Seed of the queries.
const SEED: u64 = 1 << 20;
/// A rival fails in less than this share of the queries.
const FAILED: f64 = 5e-3;
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
        let params = Params { segments: key.segments, ..default_params() };
        let measured = cables::measure(&queries, &ways, &params, &branched::random(), key.rounds, go_on)?;
        Ok(measured.map(|measured| Row::of(&ways, measured)))
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
            &format!("asked for | {COMPARED}"),
            vec![gain("the lowest", rows, OURS, Some(LESS)), gain("any", rows, OURS_FOR_ANY, None)],
            conditions.clone(),
        );
        let all = [
            "branched-all",
            "All starts",
            "With half of the mean's 95 % interval. Solves are linear solves on the arms' own segments. Where the tangent is indefinite it \
             is made stiffer until it is not.",
        ];
        Ok(section([Self::ID, TITLE, INTRODUCTION], vec![gain, show::all(all, rows, conditions)]))
    }
}

fn gain(what: &str, rows: &[Row], own: (&str, usize), less: Option<f64>) -> Vec<Cell> {
    let mut cells: Vec<Cell> = vec![what.into()];
    cells.extend(show::compared(show::pair(rows, own, less, FAILED)));
    cells
}
