//! The supplement's dynamic results (a) to (g): a guess must not change the motion.

use std::collections::BTreeMap;

use anyhow::{Context as _, Result};
use cosserat::scene::sampling::{Parameters, supplement};
use dataset::Scenario;
use evaluation::paper::DIRECT;
use evaluation::paper::motions::{Trace, by_way, largest, last_nrmse};
use report::{LineChart, Section as PageSection, Series};
use serde::{Deserialize, Serialize};

use crate::blocks::{figure, groups, section, table, values};
use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{BLOCK_JACOBI, is_end_to_end, solver, traces};
use crate::show::{number, picture, spread};

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct DynamicsKey {
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
    type Key = DynamicsKey;
    type Value = Vec<Trace>;
    const ID: &'static str = "dynamics";

    fn keys(&self, context: &Context) -> Result<Vec<DynamicsKey>> {
        let figures = supplement().into_iter().flat_map(|(figure, scenes)| {
            let scenes = context.size.pick(1, scenes.len());
            (0..scenes).map(move |place| DynamicsKey { figure, place, steps: 100 })
        });
        Ok(figures.collect())
    }

    fn seconds(&self, _: &DynamicsKey) -> f64 {
        0.5
    }

    fn measure(
        &mut self,
        context: &Context,
        key: &DynamicsKey,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Vec<Trace>>> {
        let parameters = parameters(key).context("a figure that the supplement does not have")?;
        let guesses = context.library.guesses(scenario_of(key), Learned::Networks)?;
        traces(&parameters.scene()?, &guesses, &solver(BLOCK_JACOBI, 1e-8)?, (key.steps, &FRAMES), go_on)
    }

    fn show(&self, context: &Context, cells: &[(&DynamicsKey, &Vec<Trace>)]) -> Result<PageSection> {
        let steps = cells.first().map_or(0, |(key, _)| key.steps);
        let conditions = context
            .conditions("none: positions are compared here")
            .with("scenes", format!("the supplement's, {steps} steps of 0.02 s"))
            .with("solver", "formulation xpbd; direct, and block-Jacobi conjugate gradients to 1e-8 from guesses");
        let caption = format!("Centrelines in the x-z plane after {FRAMES:?} steps. Solid: direct; dashed: from gn.");
        let of_figure = |(name, own): (char, Vec<(&DynamicsKey, &Vec<Trace>)>)| {
            let [id, title] = [format!("dynamics-{name}"), format!("Dynamic results ({name})")];
            let charts = own.iter().map(|(key, traces)| chart(key, traces)).collect();
            figure([&id, &title, &caption], charts, conditions.clone())
        };
        let mut blocks: Vec<_> = groups(cells, |key| key.figure).into_iter().map(of_figure).collect();
        let row = |(scenario, way): (Scenario, Vec<&Trace>)| {
            vec![
                format!("{scenario}, {}", way[0].name).into(),
                way.len().to_string().into(),
                spread(last_nrmse(&way).as_ref(), 1.0).into(),
                number(largest(&way, |trace| trace.distance)).into(),
                way.iter().filter(|trace| trace.stopped.is_some()).count().to_string().into(),
            ]
        };
        blocks.push(table(
            [
                "dynamics-agreement",
                "How far each way is from the direct solver's motion",
                "Over all scenes of (a) to (g); relative to the rods' mean length.",
            ],
            "scenes, way | #scenes | #error after the last step, median and quartiles | #largest distance of any segment | \
             #not finite",
            of_scenarios(cells).map(row).collect(),
            conditions,
        ));
        Ok(section([Self::ID, "Dynamic results", INTRODUCTION], blocks))
    }

    fn claims(&self, _: &Context, cells: &[(&DynamicsKey, &Vec<Trace>)]) -> Result<BTreeMap<String, String>> {
        let of_guesses =
            of_scenarios(cells).filter(|(_, way)| way[0].name.starts_with("gn") && !is_end_to_end(&way[0].name));
        let words = of_guesses.map(|(scenario, way)| {
            format!("{scenario}, {}: {}", way[0].name, number(largest(&way, |trace| trace.distance)))
        });
        let words = words.collect::<Vec<_>>().join("; ");
        let what = "largest distance of any segment from the direct solver's motion, relative to the length";
        Ok([("dynamic-distance".to_owned(), format!("{what}: {words}"))].into())
    }
}

/// Rods in (a) to (d), then helices.
fn scenario_of(key: &DynamicsKey) -> Scenario {
    if key.figure < 'e' { Scenario::Rod } else { Scenario::Helix }
}

fn parameters(key: &DynamicsKey) -> Option<Parameters> {
    let (_, scenes) = supplement().into_iter().find(|(figure, _)| key.figure == *figure)?;
    scenes.get(key.place).copied()
}

/// The traces of each way, for each scenario: planar scenes have more ways.
fn of_scenarios<'a>(cells: &[(&'a DynamicsKey, &'a Vec<Trace>)]) -> impl Iterator<Item = (Scenario, Vec<&'a Trace>)> {
    let of_scenario =
        |(scenario, own): (Scenario, Vec<_>)| by_way(&values(&own)).into_iter().map(move |way| (scenario, way));
    groups(cells, scenario_of).into_iter().flat_map(of_scenario)
}

/// What tells a scene from the others of its figure.
fn caption(key: &DynamicsKey) -> String {
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

fn chart(key: &DynamicsKey, traces: &[Trace]) -> LineChart {
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
