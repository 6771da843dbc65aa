//! The supplement's dynamic results (a) to (g): a guess must not change the motion.

use std::collections::BTreeMap;

use anyhow::{Context as _, Result};
use dataset::Scenario;
use evaluation::paper::motions::{self, Agreement, Trace, agreement};
use report::{
    Aspect, Axis, Block, Charts, Column, Figure, LineChart, LineStyle, Section as PageSection, Series, Table,
};
use scene::sampling::{Parameters, supplement};
use serde::{Deserialize, Serialize};
use solver::linear::precondition::PreconditionerKind;

use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{motion, solver, with_predictions};
use crate::show::{number, spread};

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Key {
    figure: String,
    place: usize,
    steps: usize,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Value {
    traces: Vec<Trace>,
}

pub(crate) struct Dynamics;

/// Frames whose centrelines are drawn.
const FRAMES: [usize; 5] = [0, 10, 20, 35, 50];

impl Section for Dynamics {
    type Key = Key;
    type Value = Value;
    const ID: &'static str = "dynamics";

    fn keys(&self, context: &Context) -> Result<Vec<Key>> {
        let figures = supplement().into_iter().flat_map(|(figure, scenes)| {
            let scenes = context.size.pick(1, scenes.len());
            (0..scenes).map(move |place| (figure, place))
        });
        Ok(figures.map(|(figure, place)| Key { figure: figure.to_string(), place, steps: 100 }).collect())
    }

    fn seconds(&self, _: &Key) -> f64 {
        0.5
    }

    fn measure(&mut self, context: &Context, key: &Key, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Value>> {
        let parameters = parameters(key).context("a figure that the supplement does not have")?;
        let (scene, guesses) =
            (parameters.scene()?, context.library.guesses(scenario_of(parameters), Learned::Networks)?);
        let solver = solver(PreconditionerKind::BlockJacobi, 1e-8);
        let traces = with_predictions(&scene, &guesses, &solver, |ways| {
            motions::measure(&motion(&scene, key.steps), &FRAMES, ways, go_on)
        })?;
        Ok(traces.map(|traces| Value { traces }))
    }

    fn show(&self, context: &Context, cells: &[(&Key, &Value)]) -> Result<PageSection> {
        let Some((key, _)) = cells.first() else { return Ok(page(Vec::new())) };
        let conditions = context
            .conditions("none: positions are compared here")
            .with("scenes", format!("the supplement's, {} steps of 0.02 s", key.steps))
            .with("solver", "formulation xpbd; direct, and block-Jacobi conjugate gradients to 1e-8 from guesses");
        let mut blocks = vec![Block::Paragraph(INTRODUCTION.to_owned())];
        for (figure, _) in supplement() {
            let of_figure = || cells.iter().filter(|(key, _)| key.figure.starts_with(figure));
            let charts: Vec<LineChart> = of_figure().map(|(key, value)| chart(key, value)).collect();
            if charts.is_empty() {
                continue;
            }
            blocks.push(Block::Figure(Figure {
                id: format!("dynamics-{figure}"),
                title: format!("Dynamic results ({figure})"),
                caption: format!(
                    "Centrelines in the x-z plane after {FRAMES:?} steps. Solid: direct; dashed: from gn."
                ),
                charts: Charts::Lines(charts),
                conditions: conditions.clone(),
            }));
        }
        let rows = agreements(cells).into_iter().map(|(scenario, way)| {
            vec![
                format!("{scenario}, {}", way.name).into(),
                way.scenes.to_string().into(),
                spread(way.last_nrmse.as_ref(), 1.0).into(),
                number(way.distance).into(),
                way.stopped.to_string().into(),
            ]
        });
        blocks.push(Block::Table(Table {
            id: "dynamics-agreement".to_owned(),
            title: "How far each way is from the direct solver's motion".to_owned(),
            caption: "Over all scenes of (a) to (g); relative to the rods' mean length.".to_owned(),
            columns: vec![
                Column::text("scenes, way"),
                Column::number("scenes"),
                Column::number("error after the last step, median and quartiles"),
                Column::number("largest distance of any segment"),
                Column::number("not finite"),
            ],
            rows: rows.collect(),
            conditions,
        }));
        Ok(page(blocks))
    }

    fn claims(&self, _: &Context, cells: &[(&Key, &Value)]) -> Result<BTreeMap<String, String>> {
        let mut words = Vec::new();
        for (scenario, way) in agreements(cells) {
            if way.name.starts_with("gn") && !way.name.ends_with("end to end") {
                words.push(format!("{scenario}, {}: {}", way.name, number(way.distance)));
            }
        }
        let words = words.join("; ");
        let words =
            format!("largest distance of any segment from the direct solver's motion, relative to the length: {words}");
        Ok([("dynamic-distance".to_owned(), words)].into())
    }
}

fn page(blocks: Vec<Block>) -> PageSection {
    PageSection { id: Dynamics::ID.to_owned(), title: "Dynamic results".to_owned(), blocks }
}

const INTRODUCTION: &str = "The supplement's dynamic results: the bending rod at several angles (a), segments (b), lengths \
    (c) and Young's moduli (d), the helix at several shapes (e), segments (f) and moduli (g). The paper shows pictures; here \
    the motion from the network's guess is also compared with the direct solver's, number by number.";

/// How far each way is from the first, for each scenario: planar scenes have more ways.
fn agreements(cells: &[(&Key, &Value)]) -> Vec<(Scenario, Agreement)> {
    let mut agreements = Vec::new();
    for scenario in [Scenario::Rod, Scenario::Helix] {
        let own = cells
            .iter()
            .filter(|(key, _)| parameters(key).is_some_and(|parameters| scenario_of(parameters) == scenario));
        let all: Vec<_> = own.map(|(_, value)| value.traces.clone()).collect();
        agreements.extend(agreement(&all).into_iter().map(|way| (scenario, way)));
    }
    agreements
}

fn scenario_of(parameters: Parameters) -> Scenario {
    if matches!(parameters, Parameters::Rod(_)) { Scenario::Rod } else { Scenario::Helix }
}

fn parameters(key: &Key) -> Option<Parameters> {
    let (_, scenes) = supplement().into_iter().find(|(figure, _)| key.figure.starts_with(*figure))?;
    scenes.get(key.place).copied()
}

/// What tells a scene from the others of its figure.
fn caption(key: &Key) -> String {
    match (parameters(key), key.figure.as_str()) {
        (Some(Parameters::Rod(rod)), "a") => format!("{} degrees", rod.angle_deg),
        (Some(Parameters::Rod(rod)), "b") => format!("N = {}", rod.segments),
        (Some(Parameters::Rod(rod)), "c") => format!("{} m", rod.length),
        (Some(Parameters::Rod(rod)), _) => format!("Y = {} Pa", number(rod.youngs_modulus)),
        (Some(Parameters::Helix(helix)), "e") => {
            format!("{} m, {} m, {} turns", helix.helix_radius, helix.helix_height, helix.winding)
        }
        (Some(Parameters::Helix(helix)), "f") => format!("N = {}", helix.segments),
        (Some(Parameters::Helix(helix)), _) => format!("T = {} Pa", number(helix.torsion_modulus)),
        _ => String::new(),
    }
}

fn chart(key: &Key, value: &Value) -> LineChart {
    let mut series = Vec::new();
    for (name, style) in [("direct", LineStyle::Solid), ("gn", LineStyle::Dashed)] {
        let Some(trace) = value.traces.iter().find(|trace| trace.name == name) else { continue };
        for snapshot in &trace.snapshots {
            for rod in &snapshot.rods {
                let points = rod.iter().map(|[x, _, z]| (*x, *z));
                let name = format!("{name}, step {}", snapshot.step);
                let colour = Some(format!("step {}", snapshot.step));
                series.push(Series { style, colour, markers: false, ..Series::new(name, points) });
            }
        }
    }
    LineChart {
        title: caption(key),
        x: Axis::linear("x [m]"),
        y: Axis::linear("z [m]"),
        series,
        aspect: Aspect::Equal,
        ..LineChart::default()
    }
}
