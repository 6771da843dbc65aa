//! How a training went: one row a measurement, as text, CSV and SVG.

use std::io::Write;
use std::path::Path;

use anyhow::Result;
use chart::{Axis, Charts, Conditions, Figure, LineChart, Reference, Series};

use crate::measure::{Columns, Measured};
use crate::paths::with_ending;

/// One measurement.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Row {
    /// Epochs done.
    pub(crate) epoch: u64,
    /// Time since the beginning [s].
    pub(crate) seconds: f64,
    /// Mean loss of the samples since the row before.
    pub(crate) loss: f64,
    pub(crate) measured: Measured,
}

/// Numbers of a row before its ratios.
const BEFORE: usize = 4;

impl Row {
    /// As numbers, which [`Self::from_numbers`] reads back: of all pairs the first ratios, then the second ones.
    pub(crate) fn numbers(&self) -> Vec<f64> {
        let Measured { pairs, score } = &self.measured;
        let mut numbers = vec![self.epoch as f64, self.seconds, self.loss, *score];
        numbers.extend((0..2).flat_map(|part| pairs.iter().map(move |pair| pair[part])));
        numbers
    }

    pub(crate) fn from_numbers(numbers: &[f64], columns: &Columns) -> Option<Self> {
        let (before, ratios) = numbers.split_at_checked(BEFORE)?;
        let (first, second) = ratios.split_at_checked(columns.pairs.len())?;
        let pairs = first.iter().zip(second).map(|(&a, &b)| [a, b]).collect();
        let measured = Measured { pairs, score: before[3] };
        let row = Self { epoch: before[0] as u64, seconds: before[1], loss: before[2], measured };
        (first.len() == second.len()).then_some(row)
    }

    /// Epoch, seconds and ratios in the columns of [`header`].
    pub(crate) fn text(&self) -> String {
        let cells: String = self.measured.pairs.iter().map(|[a, b]| format!("  {a:5.2}/{b:4.2}")).collect();
        format!("{:5} {:6.0}{cells} ", self.epoch, self.seconds)
    }
}

/// Heads of the columns.
pub(crate) fn header(columns: &Columns) -> String {
    let cells: String = columns.pairs.iter().map(|pair| format!("  {:>10}", pair.head)).collect();
    format!("epoch      s{cells} ")
}

/// Writes PATH.csv and PATH.svg.
pub(crate) fn write(path: &Path, columns: &Columns, rows: &[Row]) -> Result<()> {
    let part = |part: &'static str| columns.pairs.iter().map(move |pair| format!("{part}_{}", pair.name));
    let names: Vec<String> = columns.parts.into_iter().flat_map(part).collect();
    export::write_atomically(&with_ending(path, ".csv"), |out| {
        writeln!(out, "epoch,seconds,loss,score,{}", names.join(","))?;
        for row in rows {
            let numbers: Vec<String> = row.numbers().iter().map(f64::to_string).collect();
            writeln!(out, "{}", numbers.join(","))?;
        }
        Ok(())
    })?;
    let svg = picture(columns, rows).svg();
    Ok(export::write_atomically(&with_ending(path, ".svg"), |out| out.write_all(svg.as_bytes()))?)
}

/// Ratios over epochs: the first of a pair dashed, the second solid.
fn picture(columns: &Columns, rows: &[Row]) -> Figure {
    let ratios = rows.iter().flat_map(|row| row.measured.pairs.iter().flatten());
    let highest = ratios.copied().fold(1.0, f64::max).min(2.0);
    let series = columns.pairs.iter().enumerate().flat_map(|(k, pair)| {
        let part = move |part: usize| {
            let points = rows.iter().map(|row| (row.epoch as f64, row.measured.pairs[k][part]));
            let name = format!("{}, {}", pair.head, columns.parts[part]);
            Series {
                dashed: part == 0,
                markers: rows.len() == 1,
                colour: Some(pair.head.to_string()),
                ..Series::new(name, points)
            }
        };
        (0..2).map(part)
    });
    let chart = LineChart {
        x: Axis::linear("epoch"),
        y: Axis { range: Some([0.0, 1.05 * highest]), ..Axis::linear("ratio") },
        series: series.collect(),
        references: vec![Reference::Horizontal { y: 1.0, label: String::new() }],
        ..LineChart::default()
    };
    let [epochs, seconds] = rows.last().map_or([0.0; 2], |row| [row.epoch as f64, row.seconds]);
    Figure {
        id: "curves".into(),
        title: columns.about.into(),
        caption: String::new(),
        charts: Charts::Lines(vec![chart]),
        conditions: Conditions::new("epochs", epochs.to_string())
            .with("training and measuring", format!("{seconds:.0} s")),
    }
}
