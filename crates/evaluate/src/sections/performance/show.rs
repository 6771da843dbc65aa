//! The charts of the figure on performance, where a learned guess begins to pay, and what they say to the paper's claims.

use std::collections::BTreeMap;

use dataset::Scenario;
use evaluation::guesses::Spread;
use evaluation::paper::performance::{Point, StartPoint};
use evaluation::paper::{DIRECT, FISCHER, ZERO};
use report::{Axis, Block, Cell, Reference, Section as PageSection};

use super::key::{ID, PerformanceKey, TOLERANCE};
use crate::blocks::{chart, figure, groups, section as page_section, table};
use crate::context::Context;
use crate::sections::paper::{FREE, PAPER_GUESSES, RAW, solver_words};
use crate::show::{band, join, per_cent};

const INTRODUCTION: &str = "The paper's figure on performance: the ratio of iterations (its black curves), the time of \
    inference relative to that of conjugate gradients from zero (purple), the share of the constraint projection's time \
    that is saved (red) and of the whole simulation's (pink). The paper says that the projection's speed-up grows with N \
    up to 50 %, and that it is smaller or negative for few segments. The direct solver and Fischer's projection, which \
    the paper does not have, stand beside. Shares below zero are losses. Simulations are drawn as in Table 1 and seen by no \
    training.";

/// The cells of one figure, from the smallest value to the largest.
type Study<'a> = [(&'a PerformanceKey, &'a Point)];

pub(super) fn section(context: &Context, cells: &[(&PerformanceKey, &Point)]) -> PageSection {
    let studies = groups(cells, |key| (key.scenario, &key.varied, &key.preconditioner));
    let mut blocks = vec![pays_table(context, studies.iter().map(|(_, study)| &study[..]))];
    blocks.extend(studies.iter().map(|(_, study)| over_values(context, study)));
    page_section([ID, "Performance", INTRODUCTION], blocks)
}

pub(super) fn claims(cells: &[(&PerformanceKey, &Point)]) -> BTreeMap<String, String> {
    let mut claims = BTreeMap::new();
    let mut add = |id: &str, words: String| join(claims.entry(id.to_owned()).or_default(), &words);
    for (scenario, guess) in FREE.into_iter().flat_map(|scenario| PAPER_GUESSES.map(|guess| (scenario, guess))) {
        let of_paper =
            |key: &PerformanceKey| key.varied == "segments" && key.scenario == scenario && key.preconditioner == RAW;
        let saved = cells.iter().filter(|(key, _)| of_paper(key)).filter_map(|(key, point)| {
            Some([key.value, of_projection(point, guess)?.median, of_whole(point, guess)?.median])
        });
        // N, and the shares of the projection's time and of the whole simulation's.
        let saved: Vec<[f64; 3]> = saved.collect();
        let (Some(first), Some(last)) = (saved.first(), saved.last()) else { continue };
        let at = |[n, projection, _]: &[f64; 3]| format!("{} at N = {n}", per_cent(*projection));
        let all = saved.iter().map(at).collect::<Vec<_>>().join(", ");
        let half: Vec<_> = saved.iter().map(|[n, projection, _]| (*n, *projection >= 0.5)).collect();
        let half = ranges(&half).map_or("50 % nowhere".to_owned(), |ranges| format!("50 % or more at N = {ranges}"));
        add(&format!("projection-{scenario}"), format!("{guess}, raw {TOLERANCE:e}: {all}: {half}"));
        let highest = saved.iter().max_by(|a, b| a[1].total_cmp(&b[1])).unwrap_or(last);
        let who = format!("{scenario}, {guess}");
        add("projection-growth", format!("{who}: {}, {}; most {}", at(first), at(last), at(highest)));
        add("projection-small", format!("{who}: {}", at(first)));
        let [_, end] = scenario.ranges().get("segments").copied().unwrap_or([0.0, f64::INFINITY]);
        let beyond: Vec<String> = saved.iter().filter(|[n, ..]| *n > end).map(at).collect();
        if !beyond.is_empty() {
            add("projection-beyond", format!("{who}: {}", beyond.join(", ")));
        }
        let total = |saved: &[f64; 3]| format!("{} of all and {}", per_cent(saved[2]), at(saved));
        add("whole-converges", format!("{who}: {} of the projection; {}", total(first), total(last)));
    }
    claims
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

/// Which share of its time, or the like, a way saves.
type Value = fn(&Point, &str) -> Option<Spread>;

/// The charts of a figure: title, label, ways that are left out, scale and values.
const CHARTS: [(&str, &str, &[&str], f64, Value); 4] = [
    ("iterations, relative to zero", "ratio", &[ZERO, DIRECT], 1.0, |point, way| start(point, way)?.iteration_ratio),
    ("time of the guess over cg from zero", "ratio", &[ZERO, DIRECT], 1.0, |point, way| {
        start(point, way)?.inference_ratio
    }),
    ("projection: time saved", "per cent", &[ZERO], 100.0, of_projection),
    ("whole simulation: time saved", "per cent", &[ZERO], 100.0, of_whole),
];

/// The names of a study's ways, but for these.
fn ways_but<'a>(study: &Study<'a>, left_out: &[&str]) -> Vec<&'a str> {
    let starts = study.iter().take(1).flat_map(|(_, point)| &point.starts).map(|start| start.name.as_str());
    starts.filter(|name| !left_out.contains(name)).collect()
}

/// The figure of a study.
fn over_values(context: &Context, study: &Study<'_>) -> Block {
    let PerformanceKey { scenario, varied, preconditioner, steps, seed, tolerance, .. } = study[0].0;
    let (axis, parameter) = axis(varied);
    let training = parameter.map_or(Vec::new(), |parameter| training_range(*scenario, parameter));
    let axis = if varied == "segments" { Axis::linear(axis) } else { Axis::log(axis) };
    let charts = CHARTS.map(|(title, label, left_out, scale, value)| {
        let at = |way: &str| band(way, study.iter().map(|(key, point)| (key.value, value(point, way))), scale);
        let series = ways_but(study, left_out).into_iter().map(at).collect();
        chart(title, [axis.clone(), Axis::linear(label)], series, training.clone())
    });
    let best = ways_but(study, &[ZERO, DIRECT]).into_iter().filter_map(|way| {
        let all = study.iter().filter_map(|(key, point)| Some((key.value, of_projection(point, way)?.median)));
        let (value, saved) = all.max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(format!("{way} saves at most {} of the projection's time (at {value})", per_cent(saved)))
    });
    let counts: Vec<String> = study.iter().map(|(key, _)| key.simulations.to_string()).collect();
    let simulations =
        format!("{} a point, from the left; {steps} steps each, seed {seed}; medians and quartiles", counts.join(", "));
    let tolerance = if varied == "tolerance" { "varied".to_owned() } else { format!("{tolerance:e}") };
    let conditions = context
        .conditions("linear solves and guesses, features, inference and guards included; whole simulation: all stages")
        .with("solver", solver_words(preconditioner, tolerance))
        .with("simulations", simulations);
    let head = [
        format!("performance-{scenario}-{varied}-{preconditioner}"),
        format!("{}: performance over {}, {preconditioner} conjugate gradients", name_of(*scenario), axis.label),
        format!("{}. Bands are quartiles.", best.collect::<Vec<_>>().join("; ")),
    ];
    figure(head.each_ref().map(String::as_str), charts.into(), conditions)
}

fn name_of(scenario: Scenario) -> &'static str {
    if scenario == Scenario::Rod { "Bending rod" } else { "Helix" }
}

/// What is varied: its name on an axis, and what its name in Table 1 ends with, where it stands there.
fn axis(varied: &str) -> (&'static str, Option<&'static str>) {
    match varied {
        "segments" => ("segments N", Some("segments")),
        "stiffness" => ("modulus [Pa]", Some("modulus_pa")),
        _ => ("tolerance of conjugate gradients", None),
    }
}

/// The training data's ends.
fn training_range(scenario: Scenario, parameter: &str) -> Vec<Reference> {
    let ranges = scenario.ranges().into_iter().filter(|(name, _)| name.ends_with(parameter)).take(1);
    let ends = ranges.flat_map(|(_, [low, high])| [(low, "training from"), (high, "to")]);
    ends.map(|(x, label)| Reference::Vertical { x, label: label.to_owned() }).collect()
}

/// Rivals, and how they are called.
const RIVALS: [(&str, &str); 3] = [(ZERO, "zero"), (FISCHER, "Fischer"), (DIRECT, "direct")];

/// A row a study and a learned guess.
fn pays_table<'a>(context: &Context, studies: impl Iterator<Item = &'a Study<'a>>) -> Block {
    let mut rows = Vec::new();
    for study in studies {
        let PerformanceKey { scenario, varied, preconditioner, .. } = study[0].0;
        for guess in ways_but(study, &[ZERO, FISCHER, DIRECT]) {
            let mut row: Vec<Cell> =
                [name_of(*scenario), axis(varied).0, preconditioner, guess].map(Cell::from).to_vec();
            for saved in [of_projection, of_whole] {
                let pays = |point: &Point, rival| Some(saved(point, guess)?.median > saved(point, rival)?.median);
                row.extend(RIVALS.map(|(rival, _)| places(study, |point| pays(point, rival))));
            }
            rows.push(row);
        }
    }
    let against = ["solves", "whole"].map(|part| RIVALS.map(|(_, rival)| format!("{part}, against {rival}")));
    let headings = format!("scene | over | solver | guess | {}", against.as_flattened().join(" | "));
    let head = [
        "performance-pays",
        "Where a learned guess pays",
        "Where the median time with the guess, its own time included, is below that of a rival: of the first linear solves \
         of the steps, and of whole simulations. Bold: everywhere.",
    ];
    let conditions = context.conditions("as in the figures below").with("values", "those of the figures, no others");
    table(head, &headings, rows, conditions)
}

/// The values at which something is so, in words.
fn places(study: &Study<'_>, is_so: impl Fn(&Point) -> Option<bool>) -> Cell {
    let known: Vec<_> = study.iter().filter_map(|(key, point)| Some((key.value, is_so(point)?))).collect();
    match ranges(&known) {
        _ if known.is_empty() => Cell::muted("-"),
        _ if known.iter().all(|(_, is_so)| *is_so) => Cell::strong("everywhere"),
        Some(ranges) => ranges.into(),
        None => Cell::muted("nowhere"),
    }
}

/// The values at which something is so, neighbours as ranges; `None` where there are none.
fn ranges(known: &[(f64, bool)]) -> Option<String> {
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
