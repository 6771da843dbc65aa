//! Starts for the equilibria of cables between two grips: time, solves, and how often the lowest equilibrium is found.

pub(crate) mod show;

use anyhow::Result;
use equilibria::sample::Distribution;
use equilibria::{Params, Query};
use evaluation::cables::{self, LEARNED_QUICKLY, PathStep};
use report::{Cell, Section as PageSection};
use serde::{Deserialize, Serialize};

use self::show::{COMPARED, LESS, Row};
use crate::blocks::{section, table};
use crate::cells::Section;
use crate::context::Context;
use crate::show::number;

/// A set of random queries.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct CablesKey {
    set: String,
    segments: usize,
    /// Distances of the grips over the length.
    distance: [f64; 2],
    /// Largest curvature at rest times the length.
    curvature: f64,
    /// Largest weight that is carried, over B / L^2.
    carried: f64,
    queries: usize,
    neighbours: usize,
    rounds: usize,
    /// Whether paths are measured, too.
    has_paths: bool,
}

/// All ways on a set, and on paths.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Answered {
    ways: Vec<Row>,
    paths: Vec<Row>,
}

pub(crate) struct Cables;

/// Seed of the queries.
const SEED: u64 = 1;
/// Steps of the second grip on paths: its distance over the length, and its turn [degrees].
const STEPS: [(f64, f64); 2] = [(0.02, 5.0), (0.1, 20.0)];
/// Queries of a path.
const LENGTH: usize = 10;
/// A rival fails in less than this share of the queries.
const FAILED: f64 = 1e-3;
/// The learned start that is held against others.
const OURS: (&str, usize) = ("learned, one or two proposals", 11);
const OURS_FOR_ANY: (&str, usize) = ("learned, one proposal", 11);

const INTRODUCTION: &str = "Which shape does a cable take between two grips? Asked without a history, the start of the search decides \
    how long the answer takes, and which of several equilibria it is. Every start is brought to the same tolerance, 1e-8. The lowest \
    equilibrium is the lowest of all ways and of 30 random starts, to 1e-6 of its energy.";

impl CablesKey {
    fn distribution(&self) -> Distribution {
        let Self { distance, curvature, carried, .. } = *self;
        Distribution { distance, curvature, carried, ..Distribution::default() }
    }
}

impl Section for Cables {
    type Key = CablesKey;
    type Value = Answered;
    const ID: &'static str = "cables";

    fn keys(&self, context: &Context) -> Result<Vec<CablesKey>> {
        let [queries, neighbours, rounds] = context.size.pick([60, 200, 1], [3000, 20_000, 5]);
        let distance = Distribution::default().distance;
        let plain = |set: &str, segments: usize| CablesKey {
            set: set.to_owned(),
            segments,
            distance,
            curvature: 0.0,
            carried: 0.0,
            queries,
            neighbours,
            rounds,
            has_paths: false,
        };
        if queries < 3000 {
            return Ok(vec![CablesKey { has_paths: true, ..plain("30 segments", 30) }]);
        }
        Ok(vec![
            plain("30 segments", 30),
            CablesKey { has_paths: true, ..plain("50 segments", 50) },
            plain("100 segments", 100),
            CablesKey { distance: [0.1, 0.4], ..plain("slack", 50) },
            CablesKey { curvature: 4.0, ..plain("bent at rest", 50) },
            CablesKey { carried: 50.0, ..plain("with a weight", 50) },
            CablesKey { distance: [0.95, 0.99], ..plain("outside of the training", 50) },
            CablesKey { neighbours: 100_000, ..plain("more neighbours", 50) },
        ])
    }

    fn seconds(&self, key: &CablesKey) -> f64 {
        let way = 25e-6 * key.segments as f64 / 50.0;
        way * key.queries as f64 * (35 * key.rounds + 40) as f64 + 3e-5 * key.neighbours as f64
    }

    fn measure(&mut self, _: &Context, key: &CablesKey, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Answered>> {
        let distribution = key.distribution();
        let queries: Vec<Query> = (0..key.queries as u64).map(|k| distribution.query(SEED, k)).collect();
        let ways = cables::ways(&distribution, key.segments, key.neighbours as u64)?;
        let params = Params { segments: key.segments, ..Params::default() };
        let measured = cables::measure(&queries, &ways, &params, &cables::random(), key.rounds, &mut *go_on)?;
        let Some(measured) = measured else { return Ok(None) };
        let ways = Row::of(&ways, measured);
        let paths = if key.has_paths { paths(key, &queries, go_on)? } else { Some(Vec::new()) };
        Ok(paths.map(|paths| Answered { ways, paths }))
    }

    fn show(&self, context: &Context, cells: &[(&CablesKey, &Answered)]) -> Result<PageSection> {
        let Some((first, _)) = cells.first() else { return Ok(section([Self::ID, TITLE, INTRODUCTION], Vec::new())) };
        let conditions = context
            .without_networks("of the thread; look-ups, inference and answers included")
            .with("queries", format!("{} of each set, seed {SEED}", first.queries))
            .with("rounds", format!("{}, in turns; the best of each counts", first.rounds));
        let mut blocks = vec![table(
            [
                "cables-gain",
                "The learned start beside the fastest without learning",
                "The rival is the fastest start without learning that finds the lowest equilibrium at most half a per cent less \
                 often than the learned one, which proposes one or two. For any equilibrium: the fastest of all without \
                 learning, over the learned start with one proposal. Times in us a query.",
            ],
            &format!("set | #distance of grips | #segments | {COMPARED} | #for any equilibrium"),
            cells.iter().map(|(key, answered)| gain(key, answered)).collect(),
            conditions.clone(),
        )];
        blocks.push(table(
            [
                "cables-break-even",
                "After how many queries training has paid",
                "Core-seconds of the training, in which its queries are drawn and solved, over what an answer saves beside the fastest start \
                 without learning that finds the lowest equilibrium at most half a per cent less often.",
            ],
            "set | #segments | network | #training [core-s] | #learned [us] | #lowest % | rival | #rival [us] | #saved [us] | #queries until it has paid",
            cells.iter().flat_map(|(key, answered)| break_even(key, answered)).collect(),
            conditions.clone().with("core-seconds", "of the machine on which the networks were trained, as their files say"),
        ));
        for (number, (key, answered)) in cells.iter().enumerate() {
            let id = format!("cables-{}", number + 1);
            let title = format!("All starts: {}", key.set);
            let caption = "With half of the mean's 95 % interval. Solves are linear solves on the cable's own segments. Where the tangent is \
                 indefinite it is made stiffer until it is not; a start at which it is indefinite is one that Newton's method without \
                 this would lead anywhere.";
            let conditions = conditions
                .clone()
                .with("segments", key.segments.to_string())
                .with("distance of the grips over the length", format!("{} to {}", key.distance[0], key.distance[1]))
                .with("curvature at rest times the length, at most", key.curvature.to_string())
                .with("weight that is carried over B / L^2, at most", key.carried.to_string());
            blocks.push(show::all([&id, &title, caption], &answered.ways, conditions.clone()));
            if key.has_paths {
                let caption =
                    "The second grip goes and turns in random directions. Lowest: the lower one of both ways.";
                blocks.push(show::all(["cables-paths", "On a path", caption], &answered.paths, conditions));
            }
        }
        Ok(section([Self::ID, TITLE, INTRODUCTION], blocks))
    }
}

const TITLE: &str = "Starts for the equilibria of cables";

/// The previous answer as a start.
fn paths(key: &CablesKey, queries: &[Query], go_on: &mut dyn FnMut() -> bool) -> Result<Option<Vec<Row>>> {
    let first = &queries[..queries.len() / LENGTH];
    let mut rows = Vec::new();
    for (distance, degrees) in STEPS {
        let step = PathStep { distance, angle: degrees.to_radians() };
        let Some([previous, curves]) = cables::measure_paths(first, step, LENGTH, key.segments, &mut *go_on)? else {
            return Ok(None);
        };
        let words = format!("steps of {distance} L and {degrees} degrees");
        let row = |name: &str, levels: &[usize], measured| {
            let start = format!("{name}, {words}");
            Row { start, levels: levels.to_vec(), measured }
        };
        rows.extend([row("previous answer", &[], previous), row("two curves, both twists", &[11], curves)]);
    }
    Ok(Some(rows))
}

fn gain(key: &CablesKey, Answered { ways, .. }: &Answered) -> Vec<Cell> {
    let distance = format!("{} to {}", key.distance[0], key.distance[1]);
    let mut cells: Vec<Cell> = vec![key.set.as_str().into(), distance.into(), key.segments.to_string().into()];
    let for_any = show::pair(ways, OURS_FOR_ANY, None, FAILED);
    cells.extend(show::compared(show::pair(ways, OURS, Some(LESS), FAILED)));
    cells.push(for_any.map_or(Cell::muted("-"), show::ratio));
    cells
}

/// For how many seconds cores worked for a network, by the card that `train equilibrium` writes beside it.
fn core_seconds(card: &str) -> Option<f64> {
    card.parse::<toml::Table>().ok()?.get("core_seconds")?.as_float()
}

/// A row for each network.
fn break_even(key: &CablesKey, Answered { ways, .. }: &Answered) -> Vec<Vec<Cell>> {
    let shipped = core_seconds(include_str!("../../../../../checkpoints/equilibrium.safetensors.toml"));
    let quick = core_seconds(include_str!("../../../../../checkpoints/equilibrium-quick.safetensors.toml"));
    let networks = [("shipped", OURS, shipped), ("trained in seconds", (LEARNED_QUICKLY, OURS.1), quick)];
    let row = |(name, way, seconds): (&str, (&str, usize), Option<f64>)| {
        let [own, rival] = show::pair(ways, way, Some(LESS), FAILED)?;
        let saved = rival.time() - own.time();
        let paid = seconds.filter(|_| saved > 0.0).map_or("never".to_owned(), |seconds| number(seconds * 1e6 / saved));
        let texts = [
            key.set.clone(),
            key.segments.to_string(),
            name.to_owned(),
            seconds.map_or("-".to_owned(), number),
            number(own.time()),
            show::percent(own.measured.lowest),
            rival.start.clone(),
            number(rival.time()),
            number(saved),
            paid,
        ];
        Some(texts.into_iter().map(Cell::from).collect())
    };
    networks.into_iter().filter_map(row).collect()
}
