//! The page of an identification: what was found and how far predictions are off.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use nalgebra::Vector3;
use report::{
    Axis, Block, Cell, Charts, Column, Conditions, Figure, LineChart, Page, Section, Series, Table, significant,
};

use crate::confidence::Known;
use crate::conformal::Regions;
use crate::metric::mean_error;
use crate::predict::Prediction;
use crate::quantity::Quantity;
use crate::recording::Recording;

/// Recordings with their predictions.
pub struct Predicted<'a> {
    /// What they are called: "train", "eval".
    pub name: &'a str,
    /// The recordings.
    pub recordings: &'a [Recording],
    /// The markers that are predicted.
    pub free: &'a [usize],
    /// A prediction for each.
    pub predictions: &'a [Prediction],
}

impl Predicted<'_> {
    /// Mean error of each recording of a cable without branches [m].
    pub fn errors(&self) -> Vec<f64> {
        self.recordings.iter().zip(self.predictions).map(|(real, predicted)| mean_error(real, predicted)).collect()
    }

    /// Mean error over time: times [s] and errors [cm] of a coordinate of a free marker.
    pub fn over_time(&self) -> Vec<(f64, f64)> {
        let frames = self.predictions.iter().map(|prediction| prediction.markers.len()).max().unwrap_or(0);
        let time = |frame: usize| self.recordings.iter().find_map(|recording| recording.time.get(frame).copied());
        let mut means = vec![Mean::default(); frames];
        self.each(|frame, _, off| means[frame].add(off));
        (0..frames).zip(means).filter_map(|(frame, mean)| Some((time(frame)?, mean.cm()))).collect()
    }

    /// Mean error of each free marker [cm].
    fn by_marker(&self) -> Vec<(f64, f64)> {
        let mut means = vec![Mean::default(); self.free.len()];
        self.each(|_, marker, off| means[marker].add(off));
        self.free.iter().zip(means).map(|(&marker, mean)| (marker as f64, mean.cm())).collect()
    }

    /// Shows each frame and each free marker that was not lost, and by how much it is off.
    fn each(&self, mut show: impl FnMut(usize, usize, Vector3<f64>)) {
        for (real, predicted) in self.recordings.iter().zip(self.predictions) {
            for (frame, markers) in predicted.markers.iter().enumerate() {
                for (marker, (here, &free)) in markers.iter().zip(self.free).enumerate() {
                    let off = here - real.markers[frame][free];
                    if off.iter().all(|x| !x.is_nan()) {
                        show(frame, marker, off);
                    }
                }
            }
        }
    }
}

/// A mean of coordinates.
#[derive(Clone, Copy, Default)]
struct Mean {
    sum: f64,
    count: usize,
}

impl Mean {
    fn add(&mut self, off: Vector3<f64>) {
        self.sum += off.abs().sum();
        self.count += 3;
    }

    fn cm(self) -> f64 {
        100.0 * self.sum / self.count as f64
    }
}

/// What is shown of a set of recordings: its predictions, and for each recording its errors by their names [m].
pub struct Shown<'a> {
    /// The predictions.
    pub predicted: Predicted<'a>,
    /// The errors, the same names for each recording.
    pub errors: &'a [Vec<(String, f64)>],
    /// The regions of its predictions, where they are known.
    pub regions: Option<&'a Regions>,
}

/// Writes `folder/index.html` with its tables and figures, `warnings` first.
///
/// # Errors
/// If the system refuses.
pub fn write<Q: Quantity>(
    folder: &Path,
    warnings: &[String],
    known: &[Known<Q>],
    sets: &[Shown<'_>],
    conditions: &Conditions,
) -> Result<PathBuf> {
    let numbers = |value: f64| significant(value, 3);
    let row = |known: &Known<Q>| -> Vec<Cell> {
        let spread = match known.interval {
            Some(_) => known.told().into(),
            None => Cell::muted(known.told()),
        };
        vec![known.parameter.to_string().into(), numbers(known.value).into(), spread, known.parameter.unit().into()]
    };
    let parameters = Table {
        id: "parameters".into(),
        title: "What was found".into(),
        caption:
            "Intervals hold 95 % and are robust over recordings. What the recordings do not tell is held at its value."
                .into(),
        columns: vec![
            Column::text("parameter"),
            Column::number("value"),
            Column::text("interval"),
            Column::text("unit"),
        ],
        rows: known.iter().map(row).collect(),
        conditions: conditions.clone(),
    };
    let mut rows: Vec<(f64, Vec<Cell>)> = Vec::new();
    for set in sets {
        for (recording, errors) in set.predicted.recordings.iter().zip(set.errors) {
            let names = [recording.name().into(), set.predicted.name.into()];
            let told = errors.iter().map(|(_, error)| numbers(100.0 * error).into());
            rows.push((errors.first().map_or(f64::NAN, |(_, error)| *error), names.into_iter().chain(told).collect()));
        }
    }
    rows.sort_by(|a, b| b.0.total_cmp(&a.0));
    let names = sets.iter().flat_map(|set| set.errors).next().map_or(&[][..], Vec::as_slice);
    let columns = names.iter().map(|(name, _)| Column::number(format!("{name} [cm]")));
    let errors = Table {
        id: "errors".into(),
        title: "Each recording".into(),
        caption: "Mean: absolute error of a coordinate, over all markers and frames, those that are given included. Tip: distance of the \
                  tip. The worst come first."
            .into(),
        columns: [Column::text("recording"), Column::text("set")].into_iter().chain(columns).collect(),
        rows: rows.into_iter().map(|(_, row)| row).collect(),
        conditions: conditions.clone(),
    };
    let chart = |x: &str, curve: &dyn Fn(&Predicted<'_>) -> Vec<(f64, f64)>| LineChart {
        x: Axis::linear(x),
        y: Axis { range: None, ..Axis::linear("mean error of a coordinate [cm]") },
        series: sets
            .iter()
            .map(|Shown { predicted, .. }| Series { markers: false, ..Series::new(predicted.name, curve(predicted)) })
            .collect(),
        ..LineChart::default()
    };
    let figure = |id: &str, title: &str, caption: &str, chart| {
        Block::Figure(Figure {
            id: id.into(),
            title: title.into(),
            caption: caption.into(),
            charts: Charts::Lines(vec![chart]),
            conditions: conditions.clone(),
        })
    };
    let coverage = sets.iter().find_map(|set| Some(set.regions?.coverage));
    let regions = coverage.map(|coverage| {
        let held = |(Shown { predicted, .. }, regions): (&Shown<'_>, &Regions)| {
            let held = regions.held(predicted.recordings, predicted.free, predicted.predictions);
            let place = |k: usize| (k as f64 + 0.5) / 10.0 * held.longest;
            let known = held.tenths.iter().enumerate().filter(|(_, share)| !share.is_nan());
            let curve = known.map(|(k, share)| (place(k), 100.0 * share));
            Series { markers: false, ..Series::new(predicted.name, curve) }
        };
        let chart = LineChart {
            x: Axis::linear("time [s]"),
            y: Axis { range: Some([0.0, 100.0]), ..Axis::linear("markers in their regions [%]") },
            series: sets.iter().filter_map(|set| Some(held((set, set.regions?)))).collect(),
            ..LineChart::default()
        };
        let caption = format!(
            "Share of the recorded markers that lie in the balls about the predicted ones that should hold {} % of them. Radii are those of \
             recordings that were left out of the fit one by one; `predictions/` has them.",
            100.0 * coverage
        );
        figure("regions", "Regions that hold", &caption, chart)
    });
    let over_time = chart("time [s]", &|set| set.over_time());
    let by_marker = chart("marker", &|set| set.by_marker());
    let doubts = warnings.iter().map(|warning| format!("**Warning: {warning}.**"));
    let lead = [
            "A prediction is one run from the first frame on: of a recording it knows the first two frames and how the grips \
             move, nothing else. Markers tell ratios to the mass alone, so that stiffness stands over mass per length."
                .into(),
            "[The worst recording](worst.html) and [the one in the middle](median.html) play beside their predictions.".into(),
    ];
    let page = Page {
        title: "What recordings tell of a cable".into(),
        lead: doubts.chain(lead).collect(),
        conditions: conditions.clone(),
        sections: vec![
            Section { id: "cable".into(), title: "Parameters".into(), blocks: vec![Block::Table(parameters)] },
            Section {
                id: "predictions".into(),
                title: "Predictions".into(),
                blocks: [
                    figure("time", "Over time", "Mean over recordings and free markers.", over_time),
                    figure(
                        "markers",
                        "By marker",
                        "Mean over recordings and frames, of the markers that are not given.",
                        by_marker,
                    ),
                    Block::Table(errors),
                ]
                .into_iter()
                .chain(regions)
                .collect(),
            },
        ],
    };
    page.write(folder).context("the page")
}

/// A table of parameters for the terminal.
pub fn lines<Q: Quantity>(known: &[Known<Q>]) -> String {
    let line = |known: &Known<Q>| {
        let Known { parameter, value, .. } = *known;
        let unit = if parameter.unit() == "1" { "" } else { parameter.unit() };
        format!("{:<14} {:>10} {:<8} {}", parameter.to_string(), significant(value, 4), unit, known.told())
    };
    let is_there = |known: &&Known<Q>| known.value != 0.0 || !known.parameter.may_be_left_out();
    known.iter().filter(is_there).map(line).collect::<Vec<_>>().join("\n")
}
