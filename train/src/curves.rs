//! How a training went: one row a measurement, as text, CSV and SVG.

use std::io::Write;
use std::path::Path;

use anyhow::{Result, anyhow};
use plotters::prelude::*;

use crate::measure::{CELLS, Measured};
use crate::run::with_ending;

/// One measurement.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Row {
    /// Epochs done.
    pub(crate) epoch: u64,
    /// Time since the beginning [s].
    pub(crate) seconds: f64,
    /// Mean loss of the samples since the row before.
    pub(crate) loss: f64,
    /// By what the best weights are chosen.
    pub(crate) score: f64,
    pub(crate) measured: Measured,
}

/// Numbers of a row before its ratios.
const BEFORE: usize = 4;

impl Row {
    /// As numbers, which [`Self::from_numbers`] reads back.
    pub(crate) fn numbers(&self) -> Vec<f64> {
        let mut numbers = vec![self.epoch as f64, self.seconds, self.loss, self.score];
        numbers.extend(self.measured.first);
        numbers.extend(self.measured.later);
        numbers
    }

    pub(crate) fn from_numbers(numbers: &[f64]) -> Option<Self> {
        let (before, ratios) = numbers.split_at_checked(BEFORE)?;
        let (first, later) = ratios.split_at_checked(CELLS.len())?;
        let measured = Measured { first: first.try_into().ok()?, later: later.try_into().ok()? };
        Some(Self { epoch: before[0] as u64, seconds: before[1], loss: before[2], score: before[3], measured })
    }

    /// Epoch, seconds and ratios in the columns of [`header`].
    pub(crate) fn text(&self) -> String {
        let Measured { first, later } = &self.measured;
        let cells: String = (0..CELLS.len()).map(|k| format!(" {:5.2}/{:4.2}", first[k], later[k])).collect();
        format!("{:5} {:6.0}{cells} ", self.epoch, self.seconds)
    }
}

/// Heads of the columns: ratios of first and of later steps.
pub(crate) fn header() -> String {
    let short = |name: &str| if name == "block-jacobi" { "block" } else { "raw" }.to_owned();
    let cells: String =
        CELLS.iter().map(|(kind, tolerance)| format!(" {:>5} {tolerance:e}", short(kind.name()))).collect();
    format!("epoch      s{cells} ")
}

/// Writes PATH.csv and PATH.svg.
pub(crate) fn write(path: &Path, rows: &[Row]) -> Result<()> {
    let names = ["first", "later"]
        .iter()
        .flat_map(|steps| CELLS.iter().map(move |(kind, tolerance)| format!("{steps}_{}_{tolerance:e}", kind.name())));
    let names: Vec<String> = names.collect();
    export::write_atomically(&with_ending(path, ".csv"), |out| {
        writeln!(out, "epoch,seconds,loss,score,{}", names.join(","))?;
        for row in rows {
            let numbers: Vec<String> = row.numbers().iter().map(f64::to_string).collect();
            writeln!(out, "{}", numbers.join(","))?;
        }
        Ok(())
    })?;
    let svg = picture(rows).map_err(|error| anyhow!("the training curves cannot be drawn: {error}"))?;
    Ok(export::write_atomically(&with_ending(path, ".svg"), |out| out.write_all(svg.as_bytes()))?)
}

/// Ratios of the later steps over epochs.
fn picture(rows: &[Row]) -> Result<String, Box<dyn std::error::Error>> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (720, 420)).into_drawing_area();
        area.fill(&WHITE)?;
        let last = rows.last().map_or(1.0, |row| row.epoch as f64);
        let highest = rows.iter().flat_map(|row| row.measured.later).fold(1.0, f64::max).min(2.0);
        let mut chart = ChartBuilder::on(&area)
            .caption("cg iterations relative to a zero start, later steps", ("sans-serif", 16))
            .margin(12)
            .x_label_area_size(36)
            .y_label_area_size(44)
            .build_cartesian_2d(0.0..last, 0.0..highest * 1.05)?;
        chart.configure_mesh().x_desc("epoch").y_desc("ratio").light_line_style(WHITE).draw()?;
        for (k, (kind, tolerance)) in CELLS.iter().enumerate() {
            let colour = Palette99::pick(k).to_rgba();
            let points = rows.iter().map(|row| (row.epoch as f64, row.measured.later[k].min(highest)));
            chart
                .draw_series(LineSeries::new(points, colour.stroke_width(2)))?
                .label(format!("{} {tolerance:e}", kind.name()))
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], colour.stroke_width(2)));
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::LowerLeft)
            .background_style(WHITE)
            .border_style(BLACK)
            .draw()?;
        area.present()?;
    }
    Ok(svg)
}
