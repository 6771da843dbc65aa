//! What figures and tables have in common: an id, conditions, and numbers as CSV.

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
        let written = self.rows(&mut writer).and_then(|()| Ok(writer.flush()?));
        drop(writer);
        written.map_err(|cause| ReportError::Csv { id: self.id().into(), cause })?;
        Ok(bytes)
    }

    /// Writes the names of the columns and the rows.
    fn rows(self, out: &mut csv::Writer<&mut Vec<u8>>) -> csv::Result<()> {
        let charts = match self {
            Self::Figure(figure) => &figure.charts,
            Self::Table(table) => {
                out.write_record(table.columns.iter().map(|column| &column.name))?;
                return table.rows.iter().try_for_each(|row| out.write_record(row.iter().map(|cell| &cell.text)));
            }
        };
        match charts {
            Charts::Lines(charts) => {
                out.write_record(["chart", "series", "x", "y", "lower", "upper", "emphasis", "x axis", "y axis"])?;
                for LineChart { title, x, y, series, .. } in charts {
                    for (name, point) in series.iter().flat_map(|s| s.points.iter().map(|point| (&s.name, point))) {
                        let place = [point.x, point.y].map(number);
                        let [lower, upper] = point.band.map(|band| band.map(number)).unwrap_or_default();
                        let emphasis = point.emphasis.to_string();
                        let numbers = [&place[0], &place[1], &lower, &upper, &emphasis];
                        out.write_record([title, name].into_iter().chain(numbers).chain([&x.label, &y.label]))?;
                    }
                }
            }
            Charts::Heat(charts) => {
                out.write_record(["chart", "row", "column", "value", "quantity"])?;
                for HeatMap { title, rows, columns, values, value_label, .. } in charts {
                    for (row, values) in rows.iter().zip(values) {
                        for (column, value) in columns.iter().zip(values) {
                            let value = value.map(number).unwrap_or_default();
                            out.write_record([title, row, column, &value, value_label])?;
                        }
                    }
                }
            }
            Charts::Bars(charts) => {
                out.write_record(["chart", "bar", "part", "value", "quantity"])?;
                for BarChart { title, label, parts, bars } in charts {
                    for bar in bars {
                        for (part, value) in parts.iter().zip(&bar.values) {
                            out.write_record([title, &bar.name, part, &number(*value), label])?;
                        }
                    }
                }
            }
        }
        Ok(())
    }
}

/// All digits that are needed to read the same number back; "NaN", "inf" and "-inf" too.
fn number(value: f64) -> String {
    format!("{value:?}")
}
