//! Writing a page, after all that must hold of it was checked.

use std::collections::BTreeSet;
use std::io::Write;
use std::path::{Path, PathBuf};

use export::write_atomically;

use crate::evidence::Evidence;
use crate::html::{self, CONTENTS};
use crate::{Charts, Conditions, Page, ReportError};

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
        self.validate().map_err(|(id, message)| ReportError::Part { id, message })?;
        let tables = self.evidence().into_iter().map(|item| Ok((item.id(), item.csv()?)));
        let tables = tables.collect::<Result<Vec<_>, ReportError>>()?;
        let csv = directory.join("csv");
        std::fs::create_dir_all(&csv).map_err(ReportError::io("create the directory", &csv))?;
        for (id, bytes) in tables {
            write_atomically(&csv.join(format!("{id}.csv")), |file| file.write_all(&bytes))?;
        }
        let path = directory.join("index.html");
        write_atomically(&path, |file| file.write_all(html::page(self).as_bytes()))?;
        Ok(path)
    }

    /// Checks ids, conditions and the lengths of rows; the error is the id of the part, and what is wrong with it.
    fn validate(&self) -> Result<(), (String, String)> {
        let evidence = self.evidence();
        let mut seen = BTreeSet::from([CONTENTS]);
        for id in self.sections.iter().map(|section| section.id.as_str()).chain(evidence.iter().map(|item| item.id())) {
            let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_".contains(c);
            if !id.starts_with(|c: char| c.is_ascii_lowercase()) || !id.chars().all(allowed) || id.len() > 80 {
                let rule = "an id has a to z, 0 to 9, '-' and '_', begins with a letter, and has at most 80 in all";
                return Err((id.into(), rule.into()));
            }
            if !seen.insert(id) {
                return Err((id.into(), "more than one section, figure or table has this id".into()));
            }
        }
        has_conditions("page", &self.conditions)?;
        for item in evidence {
            has_conditions(item.id(), item.conditions())?;
            if let Some((what, found, expected)) =
                lengths(item).into_iter().find(|(_, found, allowed)| found != allowed)
            {
                return Err((item.id().into(), format!("{what} has {found} entries instead of {expected}")));
            }
        }
        Ok(())
    }
}

/// The lists of a figure or a table: what each is, how long it is, and how long it must be.
fn lengths(item: Evidence<'_>) -> Vec<(String, usize, usize)> {
    match item {
        Evidence::Table(table) => {
            let rows = table.rows.iter().enumerate();
            rows.map(|(i, row)| (format!("row {}", i + 1), row.len(), table.columns.len())).collect()
        }
        Evidence::Figure(figure) => match &figure.charts {
            Charts::Lines(_) => Vec::new(),
            Charts::Heat(charts) => {
                let all = charts.iter().map(|chart| ("values".into(), chart.values.len(), chart.rows.len()));
                let rows = charts.iter().flat_map(|chart| {
                    let rows = chart.values.iter().zip(&chart.rows);
                    rows.map(|(row, name)| (format!("row {name:?}"), row.len(), chart.columns.len()))
                });
                all.chain(rows).collect()
            }
            Charts::Bars(charts) => {
                let bars = charts.iter().flat_map(|chart| chart.bars.iter().map(move |bar| (bar, chart.parts.len())));
                bars.map(|(bar, parts)| (format!("bar {:?}", bar.name), bar.values.len(), parts)).collect()
            }
        },
    }
}

fn has_conditions(id: &str, conditions: &Conditions) -> Result<(), (String, String)> {
    match conditions.iter().find(|(key, value)| key.trim().is_empty() || value.trim().is_empty()) {
        Some((key, value)) => {
            Err((id.into(), format!("the condition {key:?} has the value {value:?}; neither may be empty")))
        }
        None => Ok(()),
    }
}
