//! The paper's figure on performance: over the number of segments, and where else a guess may begin to pay, over
//! stiffness and tolerance.

mod pays;

use std::collections::BTreeMap;

use anyhow::Result;
use dataset::Scenario;
use evaluation::guesses::Spread;
use evaluation::paper::performance::{self, Point};
use report::{Axis, Block, Charts, Figure, LineChart, Reference, Section as PageSection, Series};
use scene::sampling::{Helix, Parameters, Rod};
use serde::{Deserialize, Serialize};
use solver::linear::precondition::PreconditionerKind;

use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{SEED, motion, solver, with_guesses};
use crate::show::{band, per_cent};

/// What is varied; all else is drawn as in Table 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
enum Varied {
    Segments(usize),
    Modulus(f64),
    Tolerance(f64),
}

impl Varied {
    fn value(self) -> f64 {
        match self {
            Self::Segments(segments) => segments as f64,
            Self::Modulus(value) | Self::Tolerance(value) => value,
        }
    }
}

/// Kinds of figures: what is varied, and on which axis.
const STUDIES: [(&str, &str); 3] =
    [("segments", "segments N"), ("stiffness", "modulus [Pa]"), ("tolerance", "tolerance of conjugate gradients")];

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Key {
    scenario: Scenario,
    varied: Varied,
    preconditioner: String,
    tolerance: f64,
    simulations: usize,
    steps: usize,
    /// Of all, for times: see [`performance::measure`].
    repeats: usize,
    seed: u64,
}

pub(crate) struct Performance;

/// Preconditioners: the paper's reading, and the strongest of ours.
const PRECONDITIONERS: [PreconditionerKind; 2] = [PreconditionerKind::Raw, PreconditionerKind::BlockJacobi];
/// Tolerance where it is not varied: the cell in which the paper's figures can be had.
const TOLERANCE: f64 = 1e-4;

impl Section for Performance {
    type Key = Key;
    type Value = Point;
    const ID: &'static str = "performance";

    fn keys(&self, context: &Context) -> Result<Vec<Key>> {
        let size = context.size;
        let mut keys = Vec::new();
        for scenario in [Scenario::Rod, Scenario::Helix] {
            let all = performance::segments(scenario.family());
            let segments = size.pick(&all[2..=4], all);
            let moduli: &[f64] = size.pick(&[], &[1e3, 1e4, 1e5, 1e6, 1e7, 1e8]);
            let tolerances: &[f64] = size.pick(&[], &[1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8]);
            let varied = segments.iter().map(|&n| Varied::Segments(n));
            let varied = varied.chain(moduli.iter().map(|&y| Varied::Modulus(y)));
            for varied in varied.chain(tolerances.iter().map(|&tolerance| Varied::Tolerance(tolerance))) {
                for preconditioner in PRECONDITIONERS {
                    let simulations = simulations(varied, preconditioner);
                    keys.push(Key {
                        scenario,
                        varied,
                        preconditioner: preconditioner.to_string(),
                        tolerance: if let Varied::Tolerance(tolerance) = varied { tolerance } else { TOLERANCE },
                        simulations: size.pick(2, simulations),
                        steps: size.pick(20, performance::STEPS),
                        repeats: size.pick(1, if preconditioner == PreconditionerKind::Raw { 1 } else { 2 }),
                        seed: SEED,
                    });
                }
            }
        }
        Ok(keys)
    }

    fn seconds(&self, key: &Key) -> f64 {
        let segments = if let Varied::Segments(n) = key.varied { n as f64 } else { 40.0 };
        1e-6 * segments * segments * (key.simulations * key.steps * key.repeats) as f64
    }

    fn measure(&mut self, context: &Context, key: &Key, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Point>> {
        let guesses = context.library.guesses(key.scenario, Learned::Networks)?;
        let preconditioner = key.preconditioner.parse().map_err(anyhow::Error::msg)?;
        let solver = solver(preconditioner, key.tolerance);
        let mut cells = Vec::new();
        for index in 0..key.simulations as u64 {
            let family = key.scenario.family();
            let parameters = match key.varied {
                Varied::Segments(segments) => performance::sample(family, segments, key.seed, index),
                Varied::Modulus(modulus) => stiffened(Parameters::sample(family, key.seed, index), modulus),
                Varied::Tolerance(_) => Parameters::sample(family, key.seed, index),
            };
            let scene = parameters.scene()?;
            let measured = with_guesses(&scene, &guesses, |named| {
                performance::measure(&motion(&scene, key.steps), &solver, named, key.repeats, &mut *go_on)
            })?;
            let Some(cell) = measured else { return Ok(None) };
            cells.push(cell);
        }
        Ok(Some(performance::point(&cells)))
    }

    fn show(&self, context: &Context, cells: &[(&Key, &Point)]) -> Result<PageSection> {
        let mut blocks = vec![Block::Paragraph(INTRODUCTION.to_owned()), Block::Table(pays::table(context, cells))];
        for study in studies(cells) {
            blocks.extend(figure(context, &study).map(Block::Figure));
        }
        Ok(PageSection { id: Self::ID.to_owned(), title: "Performance".to_owned(), blocks })
    }

    fn claims(&self, _: &Context, cells: &[(&Key, &Point)]) -> Result<BTreeMap<String, String>> {
        let mut claims = BTreeMap::new();
        for scenario in [Scenario::Rod, Scenario::Helix] {
            let saved = paper_network(cells, scenario);
            let (Some(first), Some(last)) = (saved.first(), saved.last()) else { continue };
            let text = |saved: &Saved| format!("{} at N = {}", per_cent(saved.projection), saved.segments);
            let all = saved.iter().map(text).collect::<Vec<_>>().join(", ");
            claims.insert(format!("projection-{scenario}"), format!("raw 1e-4: {all}"));
            let mut join = |id: &str, words: String| {
                let words = format!("{scenario}: {words}");
                let known = claims.entry(id.to_owned()).or_default();
                *known = if known.is_empty() { words } else { format!("{known}; {words}") };
            };
            join("projection-growth", format!("{}, {}", text(first), text(last)));
            join("projection-small", text(first));
            let [_, highest] = scenario.ranges().get("segments").copied().unwrap_or([0.0, f64::INFINITY]);
            let beyond: Vec<String> = saved.iter().filter(|saved| saved.segments as f64 > highest).map(text).collect();
            if !beyond.is_empty() {
                join("projection-beyond", beyond.join(", "));
            }
            let total = |saved: &Saved| {
                format!(
                    "N = {}: {} of the projection, {} of all",
                    saved.segments,
                    per_cent(saved.projection),
                    per_cent(saved.total)
                )
            };
            join("whole-converges", format!("{}; {}", total(first), total(last)));
        }
        Ok(claims)
    }
}

/// Shares of time that the paper's network saves at one N: in the plane where rods have one.
struct Saved {
    segments: usize,
    projection: f64,
    total: f64,
}

/// Of all N, with the paper's solver.
fn paper_network(cells: &[(&Key, &Point)], scenario: Scenario) -> Vec<Saved> {
    let is_own = |name: &str| name == "gn" || name == "gn, planar";
    let saved = |(key, point): &(&Key, &Point)| {
        let Varied::Segments(segments) = key.varied else { return None };
        if key.scenario != scenario || key.preconditioner != PreconditionerKind::Raw.name() {
            return None;
        }
        let start = point.starts.iter().rfind(|start| is_own(&start.name))?;
        let run = point.runs.iter().rfind(|run| is_own(&run.name))?;
        Some(Saved { segments, projection: start.projection?.median, total: run.total?.median })
    };
    cells.iter().filter_map(saved).collect()
}

const INTRODUCTION: &str = "The paper's figure on performance: the ratio of iterations (its black curves), the time of \
    inference relative to that of conjugate gradients from zero (purple), the share of the constraint projection's time \
    that is saved (red) and of the whole simulation's (pink). The paper says that the projection's speed-up grows with N \
    up to 50 %, and that it is smaller or negative for few segments. The direct solver and Fischer's projection, which \
    the paper does not have, stand beside. Shares below zero are losses. Simulations are drawn as in Table 1 and seen by no \
    training.";

/// The cells of one figure, from the smallest value to the largest.
struct Study<'a> {
    scenario: Scenario,
    /// What is varied, and on which axis.
    name: &'static str,
    axis: &'static str,
    preconditioner: PreconditionerKind,
    cells: Vec<(&'a Key, &'a Point)>,
}

/// All studies, in the order of the page.
fn studies<'a>(cells: &[(&'a Key, &'a Point)]) -> Vec<Study<'a>> {
    let mut studies = Vec::new();
    for scenario in [Scenario::Rod, Scenario::Helix] {
        for (name, axis) in STUDIES {
            for preconditioner in PRECONDITIONERS {
                let is_own = |(key, _): &&(&Key, &Point)| {
                    key.scenario == scenario
                        && study_of(key.varied) == name
                        && key.preconditioner == preconditioner.name()
                };
                let cells = cells.iter().filter(is_own).copied().collect();
                studies.push(Study { scenario, name, axis, preconditioner, cells });
            }
        }
    }
    studies
}

fn study_of(varied: Varied) -> &'static str {
    match varied {
        Varied::Segments(_) => "segments",
        Varied::Modulus(_) => "stiffness",
        Varied::Tolerance(_) => "tolerance",
    }
}

/// Simulations of a point: the paper's, but fewer where one takes many seconds.
fn simulations(varied: Varied, preconditioner: PreconditionerKind) -> usize {
    match (varied, preconditioner) {
        (Varied::Segments(..=105), _) | (Varied::Segments(_), PreconditionerKind::BlockJacobi) => {
            performance::SIMULATIONS
        }
        _ => 10,
    }
}

/// With another modulus [Pa].
fn stiffened(parameters: Parameters, modulus: f64) -> Parameters {
    match parameters {
        Parameters::Rod(rod) => Parameters::Rod(Rod { youngs_modulus: modulus, ..rod }),
        Parameters::Helix(helix) => Parameters::Helix(Helix { torsion_modulus: modulus, ..helix }),
        other => other,
    }
}

/// Four charts of one study with one preconditioner; none where nothing was measured.
fn figure(context: &Context, study: &Study<'_>) -> Option<Figure> {
    let &Study { scenario, name: study, axis, ref cells, .. } = study;
    let (key, first) = cells.first()?;
    let is_log = study != "segments";
    let chart = |title: &str, label: &str, curves: Vec<Series>| LineChart {
        title: title.to_owned(),
        x: if is_log { Axis::log(axis) } else { Axis::linear(axis) },
        y: Axis::linear(label),
        series: curves,
        references: training_range(scenario, study),
        ..LineChart::default()
    };
    type OfStart = fn(&performance::StartPoint) -> Option<Spread>;
    let starts = |value: OfStart, scale: f64| -> Vec<Series> {
        let names = first.starts.iter().skip(1).map(|start| start.name.clone());
        let curve = |(start, name)| {
            band(
                name,
                cells.iter().map(|(key, point)| (key.varied.value(), point.starts.get(start).and_then(value))),
                scale,
            )
        };
        (1..).zip(names).map(curve).collect()
    };
    let direct = band("direct", cells.iter().map(|(key, point)| (key.varied.value(), point.direct_projection)), 100.0);
    let mut projection = starts(|start| start.projection, 100.0);
    projection.push(direct);
    let names = first.runs.iter().skip(1).map(|run| run.name.clone());
    let total = (1..).zip(names).map(|(run, name)| {
        band(
            name,
            cells.iter().map(|(key, point)| (key.varied.value(), point.runs.get(run).and_then(|run| run.total))),
            100.0,
        )
    });
    let charts = vec![
        chart("iterations, relative to zero", "ratio", starts(|start| start.iteration_ratio, 1.0)),
        chart("time of the guess over cg from zero", "ratio", starts(|start| start.inference_ratio, 1.0)),
        chart("projection: time saved", "per cent", projection),
        chart("whole simulation: time saved", "per cent", total.collect()),
    ];
    let solver = &key.preconditioner;
    let counts: Vec<String> = cells.iter().map(|(key, _)| key.simulations.to_string()).collect();
    let simulations = format!("{} a point, from the left", counts.join(", "));
    let tolerance = if study == "tolerance" { "varied".to_owned() } else { format!("{:e}", key.tolerance) };
    let conditions = context
        .conditions("linear solves and guesses, features, inference and guards included; whole simulation: all stages")
        .with("solver", format!("conjugate gradients, {solver}, tolerance {tolerance}, formulation xpbd"))
        .with(
            "simulations",
            format!("{simulations}; {} steps each, seed {}; medians and quartiles", key.steps, key.seed),
        );
    Some(Figure {
        id: format!("performance-{scenario}-{study}-{solver}"),
        title: format!("{}: performance over {axis}, {solver} conjugate gradients", name_of(scenario)),
        caption: format!("{} Bands are quartiles.", gain(first, cells)),
        charts: Charts::Lines(charts),
        conditions,
    })
}

fn name_of(scenario: Scenario) -> &'static str {
    if scenario == Scenario::Rod { "Bending rod" } else { "Helix" }
}

/// The best of each learned guess over the study, in words.
fn gain(first: &Point, cells: &[(&Key, &Point)]) -> String {
    let mut words = Vec::new();
    for (start, name) in (1..).zip(first.starts.iter().skip(1).map(|start| &start.name)) {
        let best = cells.iter().filter_map(|(key, point)| Some((key, point.starts.get(start)?.projection?.median)));
        if let Some((key, saved)) = best.max_by(|a, b| a.1.total_cmp(&b.1)) {
            words.push(format!(
                "{name} saves at most {} of the projection's time (at {})",
                per_cent(saved),
                key.varied.value()
            ));
        }
    }
    format!("{}.", words.join("; "))
}

/// The training data's ends.
fn training_range(scenario: Scenario, study: &str) -> Vec<Reference> {
    let key = match (study, scenario) {
        ("segments", _) => "segments",
        ("stiffness", Scenario::Rod) => "youngs_modulus_pa",
        ("stiffness", _) => "torsion_modulus_pa",
        _ => return Vec::new(),
    };
    let ends = scenario.ranges().get(key).copied();
    let mark = |[low, high]: [f64; 2]| {
        [(low, "training from"), (high, "to")].map(|(x, label)| Reference::Vertical { x, label: label.to_owned() })
    };
    ends.into_iter().flat_map(mark).collect()
}
