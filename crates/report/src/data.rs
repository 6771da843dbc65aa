//! The numbers of figures and tables as CSV.

use crate::page::Evidence;
use crate::{BarChart, Charts, HeatMap, LineChart, ReportError, Table};

/// Rows of text; the first are the names of the columns.
type Rows = Vec<Vec<String>>;

/// The CSV file of a figure or a table.
pub(crate) fn csv(item: Evidence<'_>) -> Result<Vec<u8>, ReportError> {
    let rows = match item {
        Evidence::Table(table) => table_rows(table),
        Evidence::Figure(figure) => match &figure.charts {
            Charts::Lines(charts) => line_rows(charts),
            Charts::Heat(charts) => heat_rows(charts),
            Charts::Bars(charts) => bar_rows(charts),
        },
    };
    let mut bytes = Vec::new();
    let mut writer = csv::Writer::from_writer(&mut bytes);
    let written = rows.iter().try_for_each(|row| writer.write_record(row));
    let written = written.and_then(|()| writer.flush().map_err(csv::Error::from));
    drop(writer);
    written.map_err(|cause| ReportError::Csv { id: item.id().into(), cause })?;
    Ok(bytes)
}

fn table_rows(table: &Table) -> Rows {
    let header = table.columns.iter().map(|column| column.name.clone()).collect();
    let rows = table.rows.iter().map(|row| row.iter().map(|cell| cell.text.clone()).collect());
    std::iter::once(header).chain(rows).collect()
}

fn line_rows(charts: &[LineChart]) -> Rows {
    let mut rows = header(&["chart", "series", "x", "y", "lower", "upper", "emphasis", "note", "x axis", "y axis"]);
    for chart in charts {
        for series in &chart.series {
            rows.extend(series.points.iter().map(|point| {
                let [lower, upper] = point.band.map_or([None; 2], |band| band.map(Some)).map(optional);
                let (x, y) = (number(point.x), number(point.y));
                let axes = [&chart.x.label, &chart.y.label].map(String::clone);
                let [x_axis, y_axis] = axes;
                let emphasis = point.emphasis.to_string();
                let names = [chart.title.clone(), series.name.clone()];
                names.into_iter().chain([x, y, lower, upper, emphasis, point.note.clone(), x_axis, y_axis]).collect()
            }));
        }
    }
    rows
}

fn heat_rows(charts: &[HeatMap]) -> Rows {
    let mut rows = header(&["chart", "row", "column", "value", "quantity"]);
    for chart in charts {
        for (name, values) in chart.rows.iter().zip(&chart.values) {
            rows.extend(chart.columns.iter().zip(values).map(|(column, value)| {
                vec![chart.title.clone(), name.clone(), column.clone(), optional(*value), chart.value_label.clone()]
            }));
        }
    }
    rows
}

fn bar_rows(charts: &[BarChart]) -> Rows {
    let mut rows = header(&["chart", "bar", "part", "value", "quantity"]);
    for chart in charts {
        for bar in &chart.bars {
            rows.extend(chart.parts.iter().zip(&bar.values).map(|(part, value)| {
                vec![chart.title.clone(), bar.name.clone(), part.clone(), number(*value), chart.label.clone()]
            }));
        }
    }
    rows
}

fn header(names: &[&str]) -> Rows {
    vec![names.iter().map(ToString::to_string).collect()]
}

fn optional(value: Option<f64>) -> String {
    value.map(number).unwrap_or_default()
}

/// All digits that are needed to read the same number back; "NaN", "inf" and "-inf" too.
fn number(value: f64) -> String {
    format!("{value:?}")
}
