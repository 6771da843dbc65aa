//! The chart of the errors over time, and what it says to the paper's claims.

use std::collections::BTreeMap;

use anyhow::Result;
use dataset::Scenario;
use evaluation::guesses::Spread;
use evaluation::paper::motions::{Trace, deviations};
use report::{Axis, Block, Charts, Figure, LineChart, Section as PageSection};

use super::{Key, Nrmse};
use crate::cells::Section as _;
use crate::context::Context;
use crate::sections::paper::{FREE, is_end_to_end};
use crate::show::{band, join, number, of_way};

const INTRODUCTION: &str = "The supplement's comparison: the positions' root mean square error against vanilla \
    position-based dynamics, normalised by the rods' mean length (the paper does not say by what it normalises), for the \
    network as a guess, and for the network and nearest neighbours end to end.";

pub(super) fn section(context: &Context, cells: &[(&Key, &Vec<Trace>)]) -> Result<PageSection> {
    let mut blocks = vec![Block::Paragraph(INTRODUCTION.to_owned())];
    if let Some((key, _)) = cells.first() {
        let [rods, helices] = FREE.map(|scenario| of(cells, scenario).len());
        let charts = FREE.map(|scenario| chart(context, scenario, &of(cells, scenario)));
        blocks.push(Block::Figure(Figure {
            id: "nrmse-over-time".to_owned(),
            title: "Error of the positions over time".to_owned(),
            caption: "Medians over the simulations, with quartiles. Dashed: predictions alone, end to end.".to_owned(),
            charts: Charts::Lines(charts.into_iter().collect::<Result<_>>()?),
            conditions: context
                .conditions("none: positions are compared here")
                .with("simulations", format!("{rods} rods, {helices} helices, {} steps, seed {}", key.steps, key.seed))
                .with("solver", "formulation xpbd; direct, and block-Jacobi conjugate gradients to 1e-6 from guesses"),
        }));
    }
    Ok(PageSection { id: Nrmse::ID.to_owned(), title: "Guess against end to end".to_owned(), blocks })
}

fn of<'a>(cells: &[(&Key, &'a Vec<Trace>)], scenario: Scenario) -> Vec<&'a Vec<Trace>> {
    cells.iter().filter(|(key, _)| key.scenario == scenario).map(|(_, traces)| *traces).collect()
}

pub(super) fn claims(cells: &[(&Key, &Vec<Trace>)]) -> BTreeMap<String, String> {
    let mut words = [String::new(), String::new()];
    for scenario in FREE {
        let all: Vec<_> = of(cells, scenario).into_iter().cloned().collect();
        for way in deviations(&all).into_iter().skip(1) {
            let last = way.last_nrmse.map_or("not finite".to_owned(), |spread| number(spread.median));
            join(&mut words[usize::from(is_end_to_end(&way.name))], &format!("{scenario}, {}: {last}", way.name));
        }
    }
    let [guess, end_to_end] = words.map(|words| format!("after the last frame, {words}"));
    [("nrmse-guess".to_owned(), guess), ("nrmse-end-to-end".to_owned(), end_to_end)].into()
}

fn chart(context: &Context, scenario: Scenario, cells: &[&Vec<Trace>]) -> Result<LineChart> {
    let ways = cells.first().map_or(&[][..], |traces| &traces[..]);
    let series = ways.iter().enumerate().skip(1).map(|(way, Trace { name, .. })| {
        let steps = cells.iter().map(|traces| traces[way].nrmse.len()).max().unwrap_or(0);
        let at = |step: usize| {
            let errors = cells.iter().filter_map(|traces| traces[way].nrmse.get(step).copied());
            (step as f64 + 1.0, Spread::of(errors))
        };
        of_way(band(name.clone(), (0..steps).map(at), 1.0))
    });
    Ok(LineChart {
        title: scenario.to_string(),
        x: Axis::linear("frame"),
        // Predictions alone may run away as far as numbers go.
        y: Axis { range: Some([1e-12, 1e3]), ..Axis::log("NRMSE") },
        series: series.collect(),
        references: vec![context.library.training_end(scenario)?],
        ..LineChart::default()
    })
}
