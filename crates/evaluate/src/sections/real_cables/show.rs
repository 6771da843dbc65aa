//! Real cables: tables and figures.

use correction::inputs::Kind;
use correction::network::Shape;
use report::{Axis, Block, Cell, Conditions, LineChart, Section as PageSection, Series};

use super::key::{CableKey, Errors, FEWER, Measured, Method};
use crate::blocks::{chart, figure, section, table};
use crate::context::Context;
use crate::show::number;

type Cells<'a> = [(&'a CableKey, &'a Measured)];

const INTRODUCTION: &str = "Recordings of cables between two arms, by motion capture: twelve numbers of the cable are identified on \
    some, and others are predicted in one run each, of which nothing is known but the first two frames and the markers in the grips. Errors are means \
    of the absolute error of a coordinate over all markers, those in the grips included, and all frames: the metric of DEFORM (Chen et al. 2024). A \
    correction is a network that says what to add to the simulated markers; it learns from the same recordings that the cable was \
    identified on.";

const LIMITS: &str = "What the recordings do not tell: masses and forces (only ratios to the mass are identified), what the grips do about \
    their own direction, and what other motions would be like: the recordings of a cable repeat similar motions, in both parts, which flatters \
    every method here; the rows of other motions say by how much. The settings of the search were chosen while looking at these cables.";

/// Errors that were published for the cables of the DEFORM data set [cm]: Chen et al. 2024, table of the paper.
const PUBLISHED: [(&str, [f64; 3]); 5] = [
    ("XPBD, as published", [4.00, 3.85, 3.80]),
    ("Bi-LSTM, as published", [1.98, 1.75, 1.10]),
    ("discrete elastic rods, as published", [1.96, 1.91, 1.86]),
    ("the same, identified, as published", [1.54, 1.77, 1.42]),
    ("DEFORM, as published", [1.01, 0.97, 0.77]),
];
const PUBLISHED_CABLES: [&str; 3] = ["DLO1", "DLO2", "DLO3"];

/// What rows are called: of a method, and of which of its errors.
const NAMES: [(Method, usize, &str); 15] = [
    (Method::Blend, 0, "first shape, carried along with the grips"),
    (Method::WithoutPhysics(Kind::Perceptron), 0, "perceptron without a simulation"),
    (Method::WithoutPhysics(Kind::Recurrent), 0, "recurrent network without a simulation"),
    (Method::Identified, 0, "identified"),
    (Method::Refined(4, 1), 0, "identified; four times the steps"),
    (Method::Refined(1, 4), 0, "identified; four times the segments"),
    (Method::Inside { moments: false }, 0, "identified with curvatures along the cable"),
    (Method::Inside { moments: true }, 0, "identified with curvatures along the cable and moments inside"),
    (Method::By(Kind::Graph), 0, "corrected by a graph network"),
    (Method::By(Kind::Recurrent), 0, "corrected by a recurrent network"),
    (Method::Corrected(1), 0, "corrected by a perceptron, seed 1"),
    (Method::Corrected(2), 0, "corrected by a perceptron, seed 2"),
    (Method::Corrected(3), 0, "corrected by a perceptron, seed 3"),
    (Method::Inside { moments: false }, 1, "with curvatures along the cable, corrected by a perceptron"),
    (Method::Inside { moments: true }, 1, "with curvatures and moments, corrected by a perceptron"),
];

/// What is told of the motions that recordings to learn from do not have.
const OTHERS: [(Method, &str); 2] = [(Method::OtherMotions, "other kinds"), (Method::FasterMotions, "faster half")];

/// What is drawn over time.
const DRAWN: [Method; 4] =
    [Method::Blend, Method::WithoutPhysics(Kind::Perceptron), Method::Identified, Method::Corrected(1)];

fn name(method: Method) -> &'static str {
    NAMES.iter().find(|(own, ..)| *own == method).map_or("", |(_, _, name)| name)
}

fn of<'a>(cells: &Cells<'a>, cable: &str, method: Method) -> Option<&'a Measured> {
    cells.iter().find(|(key, _)| key.cable == cable && key.method == method).map(|(_, measured)| *measured)
}

fn told(error: Option<f64>) -> Cell {
    error.map_or_else(|| Cell::muted("-"), |error| number(error).into())
}

pub(super) fn page_section(context: &Context, cells: &Cells<'_>) -> PageSection {
    let mut cables: Vec<&str> = Vec::new();
    for (key, _) in cells {
        if cables.last() != Some(&key.cable.as_str()) {
            cables.push(&key.cable);
        }
    }
    let recordings = cells.iter().map(|(_, measured)| measured.recordings).next().unwrap_or_default();
    let conditions = context
        .without_networks("as each table says")
        .with("recordings of a cable", format!("{} to learn from, {} to predict", recordings[0], recordings[1]))
        .with(
            "method",
            "newton, bdf2; 5 segments between markers, two steps a frame; with curvatures inside 3 segments, a step",
        );
    let mut blocks = vec![Block::Paragraph(result(cells, &cables)), over_time(cells, &cables, &conditions)];
    blocks.push(by_method(cells, &cables, &conditions));
    blocks.extend(beyond(cells, &cables, &conditions));
    blocks.extend(fewer(cells, &cables, &conditions));
    blocks.extend(sizes(cells, &conditions));
    blocks.push(parameters(cells, &cables, &conditions));
    blocks.push(Block::Paragraph(LIMITS.to_owned()));
    section(["real-cables", "Predictions of real cables", INTRODUCTION], blocks)
}

/// What came of it, in a few sentences.
fn result(cells: &Cells<'_>, cables: &[&str]) -> String {
    let mean = |methods: &dyn Fn(&str) -> Option<f64>| {
        let all: Option<Vec<f64>> = cables.iter().map(|cable| methods(cable)).collect();
        all.filter(|all| !all.is_empty()).map(|all| all.iter().sum::<f64>() / all.len() as f64)
    };
    let error = |method: Method| mean(&|cable| of(cells, cable, method).map(|own| own.errors[0].mean_cm));
    let others = mean(&|cable| {
        let own = of(cells, cable, Method::OtherMotions)?;
        Some(1.0 - mean_of(own, "shipped")? / mean_of(own, "identified")?)
    });
    let applied = mean(&|cable| Some(of(cells, cable, Method::OtherMotions)?.parameters.first()?.1));
    let told = |value: Option<f64>| value.map_or_else(|| "(not measured)".to_owned(), number);
    let (identified, corrected) = (error(Method::Identified), error(Method::Corrected(1)));
    let like = identified.zip(corrected).map(|(before, after)| 100.0 * (1.0 - after / before));
    format!(
        "A coordinate of a marker is {} cm off in the mean over {} cables and five seconds, by physics alone. A learned correction takes it to {} cm, \
         {} % less, on motions like those that it learned from. On motions of other kinds it takes {} %, and applies itself to {} % of them: the \
         distance of a motion from those in training tells little.",
        told(identified),
        cables.len(),
        told(corrected),
        told(like),
        told(others.map(|gain| 100.0 * gain)),
        told(applied.map(|share| 100.0 * share)),
    )
}

/// The mean of errors of this name [cm]: halves have as many recordings.
fn mean_of(measured: &Measured, name: &str) -> Option<f64> {
    let own: Vec<f64> = measured.errors.iter().filter(|errors| errors.name == name).map(|of| of.mean_cm).collect();
    (!own.is_empty()).then(|| own.iter().sum::<f64>() / own.len() as f64)
}

/// Errors of all methods.
fn by_method(cells: &Cells<'_>, cables: &[&str], conditions: &Conditions) -> Block {
    let mut rows: Vec<Vec<Cell>> = Vec::new();
    for (name, errors) in PUBLISHED {
        let error = |cable: &&str| PUBLISHED_CABLES.iter().position(|own| own == cable).map(|k| errors[k]);
        let row: Vec<Cell> = cables.iter().map(|cable| told(error(cable))).collect();
        rows.push(std::iter::once(name.into()).chain(row).collect());
    }
    let ours = NAMES.iter().filter(|(method, ..)| cells.iter().any(|(key, _)| key.method == *method));
    for (method, which, name) in ours {
        let error = |cable: &&str| of(cells, cable, *method).map(|own| own.errors[*which].mean_cm);
        let row: Vec<Cell> = cables.iter().map(|cable| told(error(cable))).collect();
        rows.push(std::iter::once((*name).into()).chain(row).collect());
    }
    let headings: String = cables.iter().map(|cable| format!(" | #{cable} [cm]")).collect();
    table(
        [
            "real-cables-errors",
            "Error of a coordinate",
            "Means over the recordings that were predicted. Published errors are those of the DEFORM data set's paper. A recurrent network has about \
             as many parameters as the perceptron. Curvatures along the cable: at rest, linear from marker to marker, found together with the twelve numbers. \
             Moments inside: a perceptron says what each joint bears beyond, by how it is bent and was bent, in each step of the simulation; \
             trained by Gauss and Newton's method through runs of the whole length.",
        ],
        &format!("prediction{headings}"),
        rows,
        conditions.clone(),
    )
}

/// The error over time, a chart a cable.
fn over_time(cells: &Cells<'_>, cables: &[&str], conditions: &Conditions) -> Block {
    let own = |cable: &&str| -> LineChart {
        let curve = |&method: &Method| {
            let measured = of(cells, cable, method)?;
            Some(Series { markers: false, ..Series::new(name(method), measured.errors[0].over_time.iter().copied()) })
        };
        let axes = [Axis::linear("time [s]"), Axis::linear("error of a coordinate [cm]")];
        chart(cable, axes, DRAWN.iter().filter_map(curve).collect(), Vec::new())
    };
    let caption = "Mean over recordings and the markers between the grips.";
    figure(["real-cables-time", "Error over time", caption], cables.iter().map(own).collect(), conditions.clone())
}

/// Motions of other kinds, faster ones, and long ones.
fn beyond(cells: &Cells<'_>, cables: &[&str], conditions: &Conditions) -> Vec<Block> {
    let mut rows = Vec::new();
    for (cable, (method, name)) in cables.iter().flat_map(|cable| OTHERS.map(|other| (cable, other))) {
        let like = [Method::Identified, Method::Corrected(1)].map(|method| of(cells, cable, method));
        let ([Some(before), Some(after)], Some(other)) = (like, of(cells, cable, method)) else { continue };
        let gain = |before: f64, after: f64| number(100.0 * (1.0 - after / before));
        let errors = ["identified", "corrected", "shipped"].map(|name| mean_of(other, name).unwrap_or(f64::NAN));
        let applies = other.parameters.first().map_or(f64::NAN, |(_, share)| 100.0 * share);
        rows.push(vec![
            (*cable).into(),
            gain(before.errors[0].mean_cm, after.errors[0].mean_cm).into(),
            name.into(),
            number(errors[0]).into(),
            number(errors[1]).into(),
            gain(errors[0], errors[1]).into(),
            number(applies).into(),
            number(errors[2]).into(),
        ]);
    }
    let others = (!rows.is_empty()).then(|| {
        table(
            [
                "real-cables-others",
                "Motions unlike those in training",
                "Other kinds: the recordings to learn from are sorted into eight kinds by the ways of their grips, whole kinds go to one of two halves, and \
                 each half is predicted by what is identified and learned on the other; the mean of both. Faster half: identified and learned on the half of \
                 the recordings whose grips move slower. Applies: the share of recordings to which the correction says that it applies; as shipped: it is \
                 left out of the others.",
            ],
            "cable | #gain on like motions [%] | motions | #identified [cm] | #corrected [cm] | #gain [%] | #applies [%] | #as shipped [cm]",
            rows,
            conditions.clone(),
        )
    });
    let long = |cable: &&str| -> Option<Vec<Cell>> {
        let ways =
            of(cells, cable, Method::ToAndFro(20))?.errors.iter().map(|Errors { mean_cm, .. }| number(*mean_cm).into());
        Some(std::iter::once((*cable).into()).chain(ways).collect())
    };
    let rows: Vec<Vec<Cell>> = cables.iter().filter_map(long).collect();
    let long = (!rows.is_empty()).then(|| {
        table(
            [
                "real-cables-beyond",
                "Long motions",
                "The grips' ways are played to and fro, twenty times in all, in one run; errors of the first and of the last way forth, on which the \
                 grips move as they were recorded.",
            ],
            "cable | #identified: first [cm] | #last [cm] | #corrected: first [cm] | #last [cm]",
            rows,
            conditions.clone(),
        )
    });
    others.into_iter().chain(long).collect()
}

/// Errors by how many recordings there are to learn from.
fn fewer(cells: &Cells<'_>, cables: &[&str], conditions: &Conditions) -> Option<Block> {
    let own = |cable: &&str| -> Option<LineChart> {
        let curve = |name: &'static str| {
            let point = |&count: &usize| Some((count as f64, mean_of(of(cells, cable, Method::Fewer(count))?, name)?));
            Series::new(name, FEWER.iter().filter_map(point))
        };
        of(cells, cable, Method::Fewer(FEWER[0]))?;
        let axes = [Axis::log("recordings"), Axis::linear("error of a coordinate [cm]")];
        Some(chart(cable, axes, vec![curve("identified"), curve("corrected")], Vec::new()))
    };
    let charts: Vec<LineChart> = cables.iter().filter_map(own).collect();
    let caption = "Mean over the recordings to predict, by the number of recordings of five seconds that a cable is identified on, and that its \
                   correction learns from.";
    (!charts.is_empty()).then(|| figure(["real-cables-fewer", "Fewer recordings", caption], charts, conditions.clone()))
}

/// Networks of other sizes, on one cable.
fn sizes(cells: &Cells<'_>, conditions: &Conditions) -> Option<Block> {
    let mut rows: Vec<(Kind, Shape, Vec<&Measured>)> = Vec::new();
    for (key, measured) in cells {
        let Method::Size { kind, shape, .. } = key.method else { continue };
        match rows.last_mut().filter(|(own, size, _)| (*own, *size) == (kind, shape)) {
            Some((.., all)) => all.push(measured),
            None => rows.push((kind, shape, vec![measured])),
        }
    }
    let row = |(kind, shape, all): &(Kind, Shape, Vec<&Measured>)| -> Vec<Cell> {
        let errors = all.iter().map(|own| own.errors[1].mean_cm);
        let count = all.len() as f64;
        let seconds = all.iter().map(|own| own.seconds).sum::<f64>() / count;
        vec![
            kind.name().into(),
            if *kind == Kind::Graph { shape.blocks.to_string().into() } else { Cell::muted("-") },
            shape.width.to_string().into(),
            format!("{:.0}", all[0].parameters[0].1).into(),
            number(errors.clone().sum::<f64>() / count).into(),
            number(errors.clone().fold(f64::INFINITY, f64::min)).into(),
            number(errors.fold(0.0, f64::max)).into(),
            number(seconds).into(),
        ]
    };
    let cable = cells.iter().find(|(key, _)| matches!(key.method, Method::Size { .. })).map(|(key, _)| &key.cable)?;
    let plain = number(rows.first()?.2[0].errors[0].mean_cm);
    Some(table(
        [
            "real-cables-sizes",
            "Networks of other sizes",
            &format!(
                "On {cable}: one network of each size and seed, which keeps a seventh of the recordings to learn from aside. Errors of a coordinate of \
                 those, in the epoch that is best for them; identified alone {plain} cm. Perceptrons are trained from three seeds."
            ),
        ],
        "network | #blocks | #width | #parameters | #mean error [cm] | #least [cm] | #largest [cm] | #training [s]",
        rows.iter().map(row).collect(),
        conditions.clone(),
    ))
}

/// What was found.
fn parameters(cells: &Cells<'_>, cables: &[&str], conditions: &Conditions) -> Block {
    // Cables may have been identified by other lists of numbers.
    let mut names: Vec<&str> = Vec::new();
    for (_, own) in cells.iter().filter(|(key, _)| key.method == Method::Identified) {
        for (name, _) in &own.parameters {
            if !names.contains(&name.as_str()) {
                names.push(name);
            }
        }
    }
    let row = |name: &&str| -> Vec<Cell> {
        let value = |cable: &&str| {
            let own = of(cells, cable, Method::Identified);
            told(own.and_then(|own| own.parameters.iter().find(|(known, _)| known == name)).map(|(_, value)| *value))
        };
        std::iter::once((*name).into()).chain(cables.iter().map(value)).collect()
    };
    let rows: Vec<Vec<Cell>> = names.iter().map(row).collect();
    let headings: String = cables.iter().map(|cable| format!(" | #{cable}")).collect();
    table(
        ["real-cables-parameters", "What was identified", "Units are in docs/identify.md."],
        &format!("parameter{headings}"),
        rows,
        conditions.clone(),
    )
}
