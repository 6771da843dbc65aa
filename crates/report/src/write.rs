//! Writing a page, after all that must hold of it was checked.

use std::collections::BTreeSet;
use std::io::Write;
use std::path::{Path, PathBuf};

use export::{ExportError, write_atomically};

use crate::html::{self, CONTENTS};
use crate::{Block, Charts, Conditions, LineChart, Page, ReportError};

impl Page {
    /// Writes `directory/index.html` and a `directory/csv/<id>.csv` for each figure and table; returns the page's path.
    /// Missing directories are made. Each file is complete or not there, and the page is written last. Files of an
    /// earlier page with other ids stay; [`crate::check`] names them.
    ///
    /// The CSV file of a table has the table's columns; of curves, a row for each point of each series of each chart;
    /// of a heat map, a row for each cell; of bars, a row for each part.
    ///
    /// # Errors
    /// Before anything is written: [`ReportError::Part`] for an id that cannot be a file's name or is there twice, for an
    /// empty condition, and for rows of the wrong length. [`ReportError::File`] if the system refuses.
    pub fn write(&self, directory: &Path) -> Result<PathBuf, ReportError> {
        self.validate().map_err(|(id, message)| ReportError::Part { id: id.into(), message })?;
        let folder = directory.join("csv");
        std::fs::create_dir_all(&folder).map_err(ExportError::io("create the directory", &folder))?;
        for item in self.evidence() {
            write_atomically(&folder.join(format!("{}.csv", item.id)), |file| Ok(csv(item.block, file)?))?;
        }
        let path = directory.join("index.html");
        write_atomically(&path, |file| file.write_all(html::page(self).as_bytes()))?;
        Ok(path)
    }

    /// Checks ids, conditions and the lengths of rows; the error is the id of the part, and what is wrong with it.
    fn validate(&self) -> Result<(), (&str, String)> {
        let mut seen = BTreeSet::from([CONTENTS]);
        for id in self.sections.iter().map(|section| section.id.as_str()).chain(self.evidence().map(|item| item.id)) {
            let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_".contains(c);
            if !id.starts_with(|c: char| c.is_ascii_lowercase()) || !id.chars().all(allowed) || id.len() > 80 {
                let rule = "an id has a to z, 0 to 9, '-' and '_', begins with a letter, and has at most 80 in all";
                return Err((id, rule.into()));
            }
            if !seen.insert(id) {
                return Err((id, "more than one section, figure or table has this id".into()));
            }
        }
        let page = empty_condition(&self.conditions).map(|message| ("page", message));
        let mut parts = self
            .evidence()
            .filter_map(|item| Some((item.id, empty_condition(item.conditions).or_else(|| ragged(item.block))?)));
        page.or_else(|| parts.next()).map_or(Ok(()), Err)
    }
}

/// Writes the CSV file of a figure or a table: names of columns, then rows. Numbers are read back the same.
fn csv(block: &Block, out: impl Write) -> csv::Result<()> {
    let mut out = csv::Writer::from_writer(out);
    let figure = match block {
        Block::Paragraph(_) => return Ok(()),
        Block::Table(table) => {
            out.write_record(table.columns.iter().map(|column| &column.name))?;
            for row in &table.rows {
                out.write_record(row.iter().map(|cell| &cell.text))?;
            }
            return Ok(out.flush()?);
        }
        Block::Figure(figure) => figure,
    };
    match &figure.charts {
        Charts::Lines(charts) => {
            out.write_record(["chart", "series", "x", "y", "lower", "upper", "emphasis", "x axis", "y axis"])?;
            for LineChart { title, x, y, series, .. } in charts {
                for (name, point) in series.iter().flat_map(|s| s.points.iter().map(|point| (&s.name, point))) {
                    let [lower, upper] = point.band.map(|band| band.map(Some)).unwrap_or_default();
                    let place = (point.x, point.y, lower, upper, point.emphasis);
                    out.serialize((title, name, place, &x.label, &y.label))?;
                }
            }
        }
        Charts::Heat(charts) => {
            out.write_record(["chart", "row", "column", "value", "quantity"])?;
            for chart in charts {
                for (row, values) in chart.rows.iter().zip(&chart.values) {
                    for (column, value) in chart.columns.iter().zip(values) {
                        out.serialize((&chart.title, row, column, value, &chart.value_label))?;
                    }
                }
            }
        }
        Charts::Bars(charts) => {
            out.write_record(["chart", "bar", "part", "value", "quantity"])?;
            for (chart, bar) in charts.iter().flat_map(|chart| chart.bars.iter().map(move |bar| (chart, bar))) {
                for (part, value) in chart.parts.iter().zip(&bar.values) {
                    out.serialize((&chart.title, &bar.name, part, value, &chart.label))?;
                }
            }
        }
    }
    Ok(out.flush()?)
}

/// What is wrong with the lengths of the lists of a figure or a table, if anything.
fn ragged(block: &Block) -> Option<String> {
    let differs = |what: String, found: usize, expected: usize| {
        (found != expected).then(|| format!("{what} has {found} entries instead of {expected}"))
    };
    match block {
        Block::Paragraph(_) => None,
        Block::Table(table) => {
            let mut rows = (1..).zip(&table.rows);
            rows.find_map(|(i, row)| differs(format!("row {i}"), row.len(), table.columns.len()))
        }
        Block::Figure(figure) => match &figure.charts {
            Charts::Lines(_) => None,
            Charts::Heat(charts) => charts.iter().find_map(|chart| {
                let row =
                    |(name, row): (&String, &Vec<_>)| differs(format!("row {name:?}"), row.len(), chart.columns.len());
                differs("values".into(), chart.values.len(), chart.rows.len())
                    .or_else(|| chart.rows.iter().zip(&chart.values).find_map(row))
            }),
            Charts::Bars(charts) => charts.iter().find_map(|chart| {
                let mut bars = chart.bars.iter();
                bars.find_map(|bar| differs(format!("bar {:?}", bar.name), bar.values.len(), chart.parts.len()))
            }),
        },
    }
}

/// What is wrong with the conditions, if anything.
fn empty_condition(conditions: &Conditions) -> Option<String> {
    let mut conditions = conditions.iter();
    let (key, value) = conditions.find(|(key, value)| key.trim().is_empty() || value.trim().is_empty())?;
    Some(format!("the condition {key:?} has the value {value:?}; neither may be empty"))
}
