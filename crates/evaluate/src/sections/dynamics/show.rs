//! Pictures of the dynamic results, and how far each way is from the direct solver's motion.

use std::collections::BTreeMap;

use dataset::Scenario;
use evaluation::paper::DIRECT;
use evaluation::paper::motions::{Deviation, Trace, deviations};
use report::{Axis, Block, Charts, Figure, LineChart, Section as PageSection, Series, Table};
use scene::sampling::{Parameters, supplement};

use super::{Dynamics, FRAMES, Key, parameters, scenario_of};
use crate::cells::Section as _;
use crate::context::Context;
use crate::sections::paper::{FREE, is_end_to_end};
use crate::show::{columns, number, spread};

const INTRODUCTION: &str = "The supplement's dynamic results: the bending rod at several angles (a), segments (b), lengths \
    (c) and Young's moduli (d), the helix at several shapes (e), segments (f) and moduli (g). The paper shows pictures; here \
    the motion from the network's guess is also compared with the direct solver's, number by number.";

pub(super) fn section(context: &Context, cells: &[(&Key, &Vec<Trace>)]) -> PageSection {
    let mut blocks = vec![Block::Paragraph(INTRODUCTION.to_owned())];
    if let Some((key, _)) = cells.first() {
        let conditions = context
            .conditions("none: positions are compared here")
            .with("scenes", format!("the supplement's, {} steps of 0.02 s", key.steps))
            .with("solver", "formulation xpbd; direct, and block-Jacobi conjugate gradients to 1e-8 from guesses");
        for (figure, _) in supplement() {
            let own = cells.iter().filter(|(key, _)| key.figure.starts_with(figure));
            let charts: Vec<LineChart> = own.map(|(key, traces)| chart(key, traces)).collect();
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
        let rows = of_scenarios(cells).into_iter().map(|(scenario, way)| {
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
            columns: columns(&[
                "scenes, way",
                "#scenes",
                "#error after the last step, median and quartiles",
                "#largest distance of any segment",
                "#not finite",
            ]),
            rows: rows.collect(),
            conditions,
        }));
    }
    PageSection { id: Dynamics::ID.to_owned(), title: "Dynamic results".to_owned(), blocks }
}

pub(super) fn claims(cells: &[(&Key, &Vec<Trace>)]) -> BTreeMap<String, String> {
    let of_guesses = of_scenarios(cells).into_iter();
    let of_guesses = of_guesses.filter(|(_, way)| way.name.starts_with("gn") && !is_end_to_end(&way.name));
    let words = of_guesses.map(|(scenario, way)| format!("{scenario}, {}: {}", way.name, number(way.distance)));
    let words = words.collect::<Vec<_>>().join("; ");
    let what = "largest distance of any segment from the direct solver's motion, relative to the length";
    [("dynamic-distance".to_owned(), format!("{what}: {words}"))].into()
}

/// How far each way is from the first, for each scenario: planar scenes have more ways.
fn of_scenarios(cells: &[(&Key, &Vec<Trace>)]) -> Vec<(Scenario, Deviation)> {
    let of = |scenario: Scenario| {
        let is_own = |key: &Key| parameters(key).is_some_and(|parameters| scenario_of(parameters) == scenario);
        let own = cells.iter().filter(|(key, _)| is_own(key)).map(|(_, traces)| traces.to_vec());
        deviations(&own.collect::<Vec<_>>()).into_iter().map(move |way| (scenario, way))
    };
    FREE.into_iter().flat_map(of).collect()
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
    LineChart {
        title: caption(key),
        x: Axis::linear("x [m]"),
        y: Axis::linear("z [m]"),
        series,
        equal_units: true,
        ..LineChart::default()
    }
}
