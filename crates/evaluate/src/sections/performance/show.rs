//! The charts of the figure on performance, where a learned guess begins to pay, and what they say to the paper's claims.

use std::collections::BTreeMap;

use dataset::Scenario;
use evaluation::guesses::Spread;
use evaluation::paper::performance::{Point, StartPoint};
use evaluation::paper::{DIRECT, FISCHER, ZERO};
use report::{Axis, Block, Cell, Charts, Column, Figure, LineChart, Reference, Section as PageSection, Series, Table};
use solver::linear::precondition::PreconditionerKind;

use super::{Key, PRECONDITIONERS, Performance, STUDIES, TOLERANCE};
use crate::cells::Section as _;
use crate::context::Context;
use crate::sections::paper::{FREE, PAPER_GUESSES, solver_words};
use crate::show::{band, join, per_cent};

const INTRODUCTION: &str = "The paper's figure on performance: the ratio of iterations (its black curves), the time of \
    inference relative to that of conjugate gradients from zero (purple), the share of the constraint projection's time \
    that is saved (red) and of the whole simulation's (pink). The paper says that the projection's speed-up grows with N \
    up to 50 %, and that it is smaller or negative for few segments. The direct solver and Fischer's projection, which \
    the paper does not have, stand beside. Shares below zero are losses. Simulations are drawn as in Table 1 and seen by no \
    training.";

pub(super) fn section(context: &Context, cells: &[(&Key, &Point)]) -> PageSection {
    let mut blocks = vec![Block::Paragraph(INTRODUCTION.to_owned()), Block::Table(pays_table(context, cells))];
    for study in studies(cells) {
        blocks.extend(figure(context, &study).map(Block::Figure));
    }
    PageSection { id: Performance::ID.to_owned(), title: "Performance".to_owned(), blocks }
}

/// What the paper's network saves at one N.
struct Saved {
    segments: f64,
    projection: f64,
    total: f64,
}

pub(super) fn claims(cells: &[(&Key, &Point)]) -> BTreeMap<String, String> {
    let mut claims = BTreeMap::new();
    let mut add = |id: &str, words: String| join(claims.entry(id.to_owned()).or_default(), &words);
    for (scenario, guess) in FREE.into_iter().flat_map(|scenario| PAPER_GUESSES.map(|guess| (scenario, guess))) {
        let saved = saved_by(cells, scenario, guess);
        let (Some(first), Some(last)) = (saved.first(), saved.last()) else { continue };
        let at = |saved: &Saved| format!("{} at N = {}", per_cent(saved.projection), saved.segments);
        let all = saved.iter().map(at).collect::<Vec<_>>().join(", ");
        let half = ranges(saved.iter().map(|saved| (saved.segments, saved.projection >= 0.5)));
        let half = half.map_or("50 % nowhere".to_owned(), |ranges| format!("50 % or more at N = {ranges}"));
        add(&format!("projection-{scenario}"), format!("{guess}, raw {TOLERANCE:e}: {all}: {half}"));
        let highest = saved.iter().max_by(|a, b| a.projection.total_cmp(&b.projection)).unwrap_or(last);
        let who = format!("{scenario}, {guess}");
        add("projection-growth", format!("{who}: {}, {}; most {}", at(first), at(last), at(highest)));
        add("projection-small", format!("{who}: {}", at(first)));
        let [_, end] = scenario.ranges().get("segments").copied().unwrap_or([0.0, f64::INFINITY]);
        let beyond: Vec<String> = saved.iter().filter(|saved| saved.segments > end).map(at).collect();
        if !beyond.is_empty() {
            add("projection-beyond", format!("{who}: {}", beyond.join(", ")));
        }
        let total = |saved: &Saved| format!("{} of all and {}", per_cent(saved.total), at(saved));
        add("whole-converges", format!("{who}: {} of the projection; {}", total(first), total(last)));
    }
    claims
}

/// What a guess saves at all N with the paper's solver.
fn saved_by(cells: &[(&Key, &Point)], scenario: Scenario, guess: &str) -> Vec<Saved> {
    let saved = |(key, point): &(&Key, &Point)| {
        let is_own = key.varied == "segments"
            && key.scenario == scenario
            && key.preconditioner == PreconditionerKind::Raw.name();
        let projection = of_projection(point, guess).filter(|_| is_own)?.median;
        Some(Saved { segments: key.value, projection, total: of_whole(point, guess)?.median })
    };
    cells.iter().filter_map(saved).collect()
}

fn start<'a>(point: &'a Point, name: &str) -> Option<&'a StartPoint> {
    point.starts.iter().find(|start| start.name == name)
}

/// Share of the time of the first solves that a way saves, relative to a zero start.
fn of_projection(point: &Point, way: &str) -> Option<Spread> {
    start(point, way)?.projection
}

/// Of the whole simulation's.
fn of_whole(point: &Point, way: &str) -> Option<Spread> {
    point.runs.iter().find(|run| run.name == way)?.total
}

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
    for scenario in FREE {
        for (name, axis) in STUDIES {
            for preconditioner in PRECONDITIONERS {
                let is_own = |(key, _): &&(&Key, &Point)| {
                    key.scenario == scenario && key.varied == name && key.preconditioner == preconditioner.name()
                };
                let cells = cells.iter().filter(is_own).copied().collect();
                studies.push(Study { scenario, name, axis, preconditioner, cells });
            }
        }
    }
    studies
}

/// Four charts of one study with one preconditioner; none where nothing was measured.
fn figure(context: &Context, study: &Study<'_>) -> Option<Figure> {
    let &Study { scenario, name: study, axis, ref cells, .. } = study;
    let (key, first) = cells.first()?;
    let chart = |title: &str, label: &str, series: Vec<Series>| LineChart {
        title: title.to_owned(),
        x: if study == "segments" { Axis::linear(axis) } else { Axis::log(axis) },
        y: Axis::linear(label),
        series,
        references: training_range(scenario, study),
        ..LineChart::default()
    };
    let curves = |names: &[&str], scale: f64, value: fn(&Point, &str) -> Option<Spread>| -> Vec<Series> {
        let at = |name: &&str| band(*name, cells.iter().map(|(key, point)| (key.value, value(point, name))), scale);
        names.iter().map(at).collect()
    };
    let with_direct: Vec<&str> =
        first.starts.iter().map(|start| start.name.as_str()).filter(|name| *name != ZERO).collect();
    let starts: Vec<&str> = with_direct.iter().copied().filter(|name| *name != DIRECT).collect();
    let runs: Vec<&str> = first.runs.iter().map(|run| run.name.as_str()).filter(|name| *name != ZERO).collect();
    let charts = vec![
        chart(
            "iterations, relative to zero",
            "ratio",
            curves(&starts, 1.0, |point, name| start(point, name)?.iteration_ratio),
        ),
        chart(
            "time of the guess over cg from zero",
            "ratio",
            curves(&starts, 1.0, |point, name| start(point, name)?.inference_ratio),
        ),
        chart("projection: time saved", "per cent", curves(&with_direct, 100.0, of_projection)),
        chart("whole simulation: time saved", "per cent", curves(&runs, 100.0, of_whole)),
    ];
    let solver = &key.preconditioner;
    let counts: Vec<String> = cells.iter().map(|(key, _)| key.simulations.to_string()).collect();
    let simulations = format!("{} a point, from the left", counts.join(", "));
    let tolerance = if study == "tolerance" { "varied".to_owned() } else { format!("{:e}", key.tolerance) };
    let conditions = context
        .conditions("linear solves and guesses, features, inference and guards included; whole simulation: all stages")
        .with("solver", solver_words(solver, tolerance))
        .with(
            "simulations",
            format!("{simulations}; {} steps each, seed {}; medians and quartiles", key.steps, key.seed),
        );
    Some(Figure {
        id: format!("performance-{scenario}-{study}-{solver}"),
        title: format!("{}: performance over {axis}, {solver} conjugate gradients", name_of(scenario)),
        caption: format!("{} Bands are quartiles.", gain(&starts, cells)),
        charts: Charts::Lines(charts),
        conditions,
    })
}

fn name_of(scenario: Scenario) -> &'static str {
    if scenario == Scenario::Rod { "Bending rod" } else { "Helix" }
}

/// The best of each guess over the study, in words.
fn gain(starts: &[&str], cells: &[(&Key, &Point)]) -> String {
    let words = starts.iter().filter_map(|name| {
        let all = cells.iter().filter_map(|(key, point)| Some((key, of_projection(point, name)?.median)));
        let (key, saved) = all.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let at = key.value;
        Some(format!("{name} saves at most {} of the projection's time (at {at})", per_cent(saved)))
    });
    format!("{}.", words.collect::<Vec<_>>().join("; "))
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

/// Rivals, and how they are called.
const RIVALS: [(&str, &str); 3] = [(ZERO, "zero"), (FISCHER, "Fischer"), (DIRECT, "direct")];

/// A row a study, a preconditioner and a learned guess.
fn pays_table(context: &Context, cells: &[(&Key, &Point)]) -> Table {
    let mut rows = Vec::new();
    for Study { scenario, axis, preconditioner, cells, .. } in studies(cells) {
        let starts = cells.first().map_or(&[][..], |(_, point)| &point.starts);
        for guess in
            starts.iter().map(|start| start.name.as_str()).filter(|name| ![ZERO, FISCHER, DIRECT].contains(name))
        {
            let mut row: Vec<Cell> = [name_of(scenario), axis, preconditioner.name(), guess].map(Cell::from).to_vec();
            for saved in [of_projection, of_whole] {
                row.extend(RIVALS.map(|(rival, _)| places(&cells, |point| pays(saved, point, guess, rival))));
            }
            rows.push(row);
        }
    }
    let mut columns = ["scene", "over", "solver", "guess"].map(Column::text).to_vec();
    for part in ["solves", "whole"] {
        columns.extend(RIVALS.map(|(_, rival)| Column::text(format!("{part}, against {rival}"))));
    }
    Table {
        id: "performance-pays".to_owned(),
        title: "Where a learned guess pays".to_owned(),
        caption: "Where the median time with the guess, its own time included, is below that of a rival: of the first \
                  linear solves of the steps, and of whole simulations. Bold: everywhere."
            .to_owned(),
        columns,
        rows,
        conditions: context.conditions("as in the figures below").with("values", "those of the figures, no others"),
    }
}

/// Whether a guess saves more than a rival; `None` where one of them was not measured.
fn pays(saved: fn(&Point, &str) -> Option<Spread>, point: &Point, guess: &str, rival: &str) -> Option<bool> {
    let of_rival = if rival == ZERO { 0.0 } else { saved(point, rival)?.median };
    Some(saved(point, guess)?.median > of_rival)
}

/// The values at which something is so, in words.
fn places(cells: &[(&Key, &Point)], is_so: impl Fn(&Point) -> Option<bool>) -> Cell {
    let known = || cells.iter().filter_map(|(key, point)| Some((key.value, is_so(point)?)));
    match ranges(known()) {
        _ if known().next().is_none() => Cell::muted("-"),
        _ if known().all(|(_, is_so)| is_so) => Cell::strong("everywhere"),
        Some(ranges) => ranges.into(),
        None => Cell::muted("nowhere"),
    }
}

/// The values at which something is so, neighbours as ranges; `None` where there are none.
fn ranges(known: impl Iterator<Item = (f64, bool)>) -> Option<String> {
    let known: Vec<(f64, bool)> = known.collect();
    let ranges = known.chunk_by(|a, b| a.1 == b.1).filter(|range| range[0].1).map(|range| match range {
        [(one, _)] => short(*one),
        [(first, _), .., (last, _)] => format!("{} to {}", short(*first), short(*last)),
        [] => String::new(),
    });
    Some(ranges.collect::<Vec<_>>().join(", ")).filter(|text| !text.is_empty())
}

fn short(value: f64) -> String {
    if (1.0..1000.0).contains(&value) { value.to_string() } else { format!("{value:e}") }
}
