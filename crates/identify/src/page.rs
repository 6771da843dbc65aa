//! The page of an identification: what was found and how far predictions are off.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use report::{
    Axis, Block, Cell, Charts, Column, Conditions, Figure, LineChart, Page, Section, Series, Table, significant,
};

use crate::confidence::Known;
use crate::metric::mean_error;
use crate::parameter::Parameter;
use crate::predict::Prediction;
use crate::recording::Recording;

/// Recordings with their predictions.
pub struct Predicted<'a> {
    /// What they are called: "train", "eval".
    pub name: &'a str,
    /// The recordings.
    pub recordings: &'a [Recording],
    /// A prediction for each.
    pub predictions: &'a [Prediction],
}

impl Predicted<'_> {
    /// Mean error of each recording [m].
    pub fn errors(&self) -> Vec<f64> {
        self.recordings.iter().zip(self.predictions).map(|(real, predicted)| mean_error(real, predicted)).collect()
    }

    /// Mean error over time: times [s] and errors [cm] of a coordinate of a free marker.
    pub fn over_time(&self) -> Vec<(f64, f64)> {
        let frames = self.predictions.iter().map(|prediction| prediction.markers.len()).max().unwrap_or(0);
        let time = |frame: usize| self.recordings.iter().find_map(|recording| recording.time.get(frame).copied());
        let errors = (0..frames).map(|frame| self.mean(|at, _| at == frame));
        (0..frames).zip(errors).filter_map(|(frame, error)| Some((time(frame)?, error * 100.0))).collect()
    }

    /// Mean error of each free marker [cm].
    fn by_marker(&self) -> Vec<(f64, f64)> {
        let free = self.recordings.first().map_or(0..0, Recording::free);
        free.clone().map(|marker| (marker as f64, 100.0 * self.mean(|_, at| at + free.start == marker))).collect()
    }

    fn mean(&self, counts: impl Fn(usize, usize) -> bool) -> f64 {
        let (mut sum, mut count) = (0.0, 0usize);
        for (real, predicted) in self.recordings.iter().zip(self.predictions) {
            for (frame, markers) in predicted.markers.iter().enumerate() {
                for (marker, here) in markers.iter().enumerate() {
                    let there = real.markers[frame][real.free().start + marker];
                    if counts(frame, marker) && there.iter().all(|x| !x.is_nan()) {
                        sum += (here - there).abs().sum();
                        count += 3;
                    }
                }
            }
        }
        sum / count as f64
    }
}

/// Writes `folder/index.html` with its tables and figures.
///
/// # Errors
/// If the system refuses.
pub fn write(folder: &Path, known: &[Known], sets: &[Predicted<'_>], conditions: &Conditions) -> Result<PathBuf> {
    let numbers = |value: f64| significant(value, 3);
    let row = |known: &Known| -> Vec<Cell> {
        let spread = match known.interval {
            Some(_) => known.told().into(),
            None => Cell::muted(known.told()),
        };
        vec![known.parameter.name().into(), numbers(known.value).into(), spread, known.parameter.unit().into()]
    };
    let parameters = Table {
        id: "parameters".into(),
        title: "What the cable is".into(),
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
        for (recording, error) in set.recordings.iter().zip(set.errors()) {
            rows.push((error, vec![recording.name().into(), set.name.into(), numbers(100.0 * error).into()]));
        }
    }
    rows.sort_by(|a, b| b.0.total_cmp(&a.0));
    let errors = Table {
        id: "errors".into(),
        title: "Each recording".into(),
        caption: "Mean absolute error of a coordinate, over all markers and frames, those in the grips included. The worst come \
                  first."
            .into(),
        columns: vec![Column::text("recording"), Column::text("set"), Column::number("error [cm]")],
        rows: rows.into_iter().map(|(_, row)| row).collect(),
        conditions: conditions.clone(),
    };
    let chart = |x: &str, curve: &dyn Fn(&Predicted<'_>) -> Vec<(f64, f64)>| LineChart {
        x: Axis::linear(x),
        y: Axis { range: None, ..Axis::linear("mean error of a coordinate [cm]") },
        series: sets.iter().map(|set| Series { markers: false, ..Series::new(set.name, curve(set)) }).collect(),
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
    let over_time = chart("time [s]", &|set| set.over_time());
    let by_marker = chart("marker", &|set| set.by_marker());
    let page = Page {
        title: "An identified cable".into(),
        lead: vec![
            "A prediction is one run from the first frame on: of a recording it knows the first two frames and the markers in \
             the grips, nothing else. Markers tell ratios to the mass alone, so that stiffness stands over mass per length."
                .into(),
            "[The worst recording](worst.html) and [the one in the middle](median.html) play beside their predictions.".into(),
        ],
        conditions: conditions.clone(),
        sections: vec![
            Section { id: "cable".into(), title: "Parameters".into(), blocks: vec![Block::Table(parameters)] },
            Section {
                id: "predictions".into(),
                title: "Predictions".into(),
                blocks: vec![
                    figure("time", "Over time", "Mean over recordings and free markers.", over_time),
                    figure("markers", "By marker", "Mean over recordings and frames; grips are at both ends.", by_marker),
                    Block::Table(errors),
                ],
            },
        ],
    };
    page.write(folder).context("the page")
}

/// A table of parameters for the terminal.
pub fn lines(known: &[Known]) -> String {
    let line = |known: &Known| {
        let Known { parameter, value, .. } = *known;
        let unit = if parameter.unit() == "1" { "" } else { parameter.unit() };
        format!("{:<14} {:>10} {:<8} {}", parameter.name(), significant(value, 4), unit, known.told())
    };
    let shown = known.iter().filter(|known| known.value != 0.0 || Parameter::DEFAULT.contains(&known.parameter));
    shown.map(line).collect::<Vec<_>>().join("\n")
}
