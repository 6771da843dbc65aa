//! What figures and tables have in common: an id, conditions, and numbers as CSV.

use std::iter::once;

use crate::{BarChart, Charts, Conditions, Figure, HeatMap, LineChart, ReportError, Table};

/// A figure or a table.
#[derive(Clone, Copy)]
pub(crate) enum Evidence<'a> {
    Figure(&'a Figure),
    Table(&'a Table),
}

impl<'a> Evidence<'a> {
    /// Id, title and caption.
    pub(crate) fn words(self) -> [&'a str; 3] {
        match self {
            Self::Figure(Figure { id, title, caption, .. }) => [id, title, caption],
            Self::Table(Table { id, title, caption, .. }) => [id, title, caption],
        }
    }

    pub(crate) fn id(self) -> &'a str {
        self.words()[0]
    }

    pub(crate) fn conditions(self) -> &'a Conditions {
        match self {
            Self::Figure(figure) => &figure.conditions,
            Self::Table(table) => &table.conditions,
        }
    }

    /// Its CSV file.
    pub(crate) fn csv(self) -> Result<Vec<u8>, ReportError> {
        let mut bytes = Vec::new();
        let mut writer = csv::Writer::from_writer(&mut bytes);
        let written = self.rows().iter().try_for_each(|row| writer.write_record(row));
        let written = written.and_then(|()| writer.flush().map_err(csv::Error::from));
        drop(writer);
        written.map_err(|cause| ReportError::Csv { id: self.id().into(), cause })?;
        Ok(bytes)
    }

    /// Rows of text; the first are the names of the columns.
    fn rows(self) -> Vec<Vec<String>> {
        let head = |names: &[&str]| names.iter().map(ToString::to_string).collect();
        match self {
            Self::Table(table) => {
                let names = table.columns.iter().map(|column| column.name.clone()).collect();
                let rows = table.rows.iter().map(|row| row.iter().map(|cell| cell.text.clone()).collect());
                once(names).chain(rows).collect()
            }
            Self::Figure(figure) => match &figure.charts {
                Charts::Lines(charts) => {
                    let names = ["chart", "series", "x", "y", "lower", "upper", "emphasis", "x axis", "y axis"];
                    once(head(&names)).chain(charts.iter().flat_map(line_rows)).collect()
                }
                Charts::Heat(charts) => {
                    let names = ["chart", "row", "column", "value", "quantity"];
                    once(head(&names)).chain(charts.iter().flat_map(heat_rows)).collect()
                }
                Charts::Bars(charts) => {
                    let names = ["chart", "bar", "part", "value", "quantity"];
                    once(head(&names)).chain(charts.iter().flat_map(bar_rows)).collect()
                }
            },
        }
    }
}

fn line_rows(chart: &LineChart) -> impl Iterator<Item = Vec<String>> {
    let points = chart.series.iter().flat_map(|series| series.points.iter().map(move |point| (series, point)));
    points.map(|(series, point)| {
        let [x, y] = [point.x, point.y].map(number);
        let [lower, upper] = point.band.map(|band| band.map(number)).unwrap_or_default();
        let (title, name) = (chart.title.clone(), series.name.clone());
        let labels = [chart.x.label.clone(), chart.y.label.clone()];
        [title, name, x, y, lower, upper, point.emphasis.to_string()].into_iter().chain(labels).collect()
    })
}

fn heat_rows(chart: &HeatMap) -> impl Iterator<Item = Vec<String>> {
    let cells = chart.rows.iter().zip(&chart.values).flat_map(|(row, values)| {
        chart.columns.iter().zip(values).map(move |(column, value)| (row, column, value.map(number)))
    });
    cells.map(|(row, column, value)| {
        vec![chart.title.clone(), row.clone(), column.clone(), value.unwrap_or_default(), chart.value_label.clone()]
    })
}

fn bar_rows(chart: &BarChart) -> impl Iterator<Item = Vec<String>> {
    let parts = chart.bars.iter().flat_map(|bar| chart.parts.iter().zip(&bar.values).map(move |part| (bar, part)));
    parts.map(|(bar, (part, value))| {
        vec![chart.title.clone(), bar.name.clone(), part.clone(), number(*value), chart.label.clone()]
    })
}

/// All digits that are needed to read the same number back; "NaN", "inf" and "-inf" too.
fn number(value: f64) -> String {
    format!("{value:?}")
}
