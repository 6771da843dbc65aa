//! The supplement's dynamic results (a) to (g): a guess must not change the motion.

use std::collections::BTreeMap;

use anyhow::{Context as _, Result};
use dataset::Scenario;
use evaluation::paper::DIRECT;
use evaluation::paper::motions::{Deviation, Trace, deviations};
use report::{Block, Charts, Figure, LineChart, Section as PageSection, Series, Table};
use scene::sampling::{Parameters, supplement};
use serde::{Deserialize, Serialize};
use solver::linear::precondition::PreconditionerKind;

use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{FREE, is_end_to_end, solver, traces};
use crate::show::{columns, number, picture, spread};

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Key {
    figure: char,
    place: usize,
    steps: usize,
}

pub(crate) struct Dynamics;

/// Frames whose centrelines are drawn.
const FRAMES: [usize; 5] = [0, 10, 20, 35, 50];

const INTRODUCTION: &str = "The supplement's dynamic results: the bending rod at several angles (a), segments (b), lengths \
    (c) and Young's moduli (d), the helix at several shapes (e), segments (f) and moduli (g). The paper shows pictures; here \
    the motion from the network's guess is also compared with the direct solver's, number by number.";

impl Section for Dynamics {
    type Key = Key;
    type Value = Vec<Trace>;
    const ID: &'static str = "dynamics";

    fn keys(&self, context: &Context) -> Result<Vec<Key>> {
        let figures = supplement().into_iter().flat_map(|(figure, scenes)| {
            let scenes = context.size.pick(1, scenes.len());
            (0..scenes).map(move |place| Key { figure, place, steps: 100 })
        });
        Ok(figures.collect())
    }

    fn seconds(&self, _: &Key) -> f64 {
        0.5
    }

    fn measure(&mut self, context: &Context, key: &Key, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Vec<Trace>>> {
        let parameters = parameters(key).context("a figure that the supplement does not have")?;
        let guesses = context.library.guesses(scenario_of(parameters), Learned::Networks)?;
        let solver = solver(PreconditionerKind::BlockJacobi, 1e-8);
        traces(&parameters.scene()?, &guesses, &solver, (key.steps, &FRAMES), go_on)
    }

    fn show(&self, context: &Context, cells: &[(&Key, &Vec<Trace>)]) -> Result<PageSection> {
        let mut blocks = vec![Block::Paragraph(INTRODUCTION.to_owned())];
        if let Some((key, _)) = cells.first() {
            let conditions = context
                .conditions("none: positions are compared here")
                .with("scenes", format!("the supplement's, {} steps of 0.02 s", key.steps))
                .with("solver", "formulation xpbd; direct, and block-Jacobi conjugate gradients to 1e-8 from guesses");
            for own in cells.chunk_by(|(a, _), (b, _)| a.figure == b.figure) {
                let figure = own[0].0.figure;
                blocks.push(Block::Figure(Figure {
                    id: format!("dynamics-{figure}"),
                    title: format!("Dynamic results ({figure})"),
                    caption: format!(
                        "Centrelines in the x-z plane after {FRAMES:?} steps. Solid: direct; dashed: from gn."
                    ),
                    charts: Charts::Lines(own.iter().map(|(key, traces)| chart(key, traces)).collect()),
                    conditions: conditions.clone(),
                }));
            }
            let row = |(scenario, way): (Scenario, Deviation)| {
                vec![
                    format!("{scenario}, {}", way.name).into(),
                    way.scenes.to_string().into(),
                    spread(way.last_nrmse.as_ref(), 1.0).into(),
                    number(way.distance).into(),
                    way.stopped.len().to_string().into(),
                ]
            };
            blocks.push(Block::Table(Table {
                id: "dynamics-agreement".to_owned(),
                title: "How far each way is from the direct solver's motion".to_owned(),
                caption: "Over all scenes of (a) to (g); relative to the rods' mean length.".to_owned(),
                columns: columns(&[
                    "scenes, way",
                    "#scenes",
                    "#error after the last step, median and quartiles",
                    "#largest distance of any segment",
                    "#not finite",
                ]),
                rows: of_scenarios(cells).into_iter().map(row).collect(),
                conditions,
            }));
        }
        Ok(PageSection { id: Self::ID.to_owned(), title: "Dynamic results".to_owned(), blocks })
    }

    fn claims(&self, _: &Context, cells: &[(&Key, &Vec<Trace>)]) -> Result<BTreeMap<String, String>> {
        let of_guesses = of_scenarios(cells).into_iter();
        let of_guesses = of_guesses.filter(|(_, way)| way.name.starts_with("gn") && !is_end_to_end(&way.name));
        let words = of_guesses.map(|(scenario, way)| format!("{scenario}, {}: {}", way.name, number(way.distance)));
        let words = words.collect::<Vec<_>>().join("; ");
        let what = "largest distance of any segment from the direct solver's motion, relative to the length";
        Ok([("dynamic-distance".to_owned(), format!("{what}: {words}"))].into())
    }
}

fn scenario_of(parameters: Parameters) -> Scenario {
    if matches!(parameters, Parameters::Rod(_)) { Scenario::Rod } else { Scenario::Helix }
}

fn parameters(key: &Key) -> Option<Parameters> {
    let (_, scenes) = supplement().into_iter().find(|(figure, _)| key.figure == *figure)?;
    scenes.get(key.place).copied()
}

/// How far each way is from the first, for each scenario: planar scenes have more ways.
fn of_scenarios(cells: &[(&Key, &Vec<Trace>)]) -> Vec<(Scenario, Deviation)> {
    let of = |scenario: Scenario| {
        let is_own = |key: &Key| parameters(key).is_some_and(|parameters| scenario_of(parameters) == scenario);
        let own: Vec<_> = cells.iter().filter(|(key, _)| is_own(key)).map(|(_, traces)| *traces).collect();
        deviations(&own).into_iter().map(move |way| (scenario, way))
    };
    FREE.into_iter().flat_map(of).collect()
}

/// What tells a scene from the others of its figure.
fn caption(key: &Key) -> String {
    let values = parameters(key).map_or(Vec::new(), |parameters| varied(key.figure, &parameters));
    match (key.figure, &values[..]) {
        ('a', [angle]) => format!("{angle} degrees"),
        ('b' | 'f', [segments]) => format!("N = {segments}"),
        ('c', [length]) => format!("{length} m"),
        ('d', [modulus]) => format!("Y = {} Pa", number(*modulus)),
        ('g', [modulus]) => format!("T = {} Pa", number(*modulus)),
        (_, [radius, height, winding]) => format!("{radius} m, {height} m, {winding} turns"),
        _ => String::new(),
    }
}

/// What a figure of the supplement varies; of shapes, radius and height [m] and winding.
pub(crate) fn varied(figure: char, parameters: &Parameters) -> Vec<f64> {
    match (figure, parameters) {
        ('a', Parameters::Rod(rod)) => vec![rod.angle_deg],
        ('b', Parameters::Rod(rod)) => vec![rod.segments as f64],
        ('c', Parameters::Rod(rod)) => vec![rod.length],
        ('d', Parameters::Rod(rod)) => vec![rod.youngs_modulus],
        ('e', Parameters::Helix(helix)) => vec![helix.helix_radius, helix.helix_height, helix.winding],
        ('f', Parameters::Helix(helix)) => vec![helix.segments as f64],
        ('g', Parameters::Helix(helix)) => vec![helix.torsion_modulus],
        _ => Vec::new(),
    }
}

fn chart(key: &Key, traces: &[Trace]) -> LineChart {
    let mut series = Vec::new();
    for (name, dashed) in [(DIRECT, false), ("gn", true)] {
        let own = traces.iter().filter(|trace| trace.name == name);
        for snapshot in own.flat_map(|trace| &trace.snapshots) {
            let colour = format!("step {}", snapshot.step);
            series.extend(snapshot.rods.iter().map(|rod| {
                let points = rod.iter().map(|[x, _, z]| (*x, *z));
                let named = Series::new(format!("{name}, {colour}"), points);
                Series { dashed, colour: Some(colour.clone()), markers: false, ..named }
            }));
        }
    }
    picture(caption(key), ["x [m]", "z [m]"], series)
}
