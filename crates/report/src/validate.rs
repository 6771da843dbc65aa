//! What must hold of a page before it is written.

use std::collections::BTreeSet;

use crate::html::CONTENTS;
use crate::page::Evidence;
use crate::{Charts, Conditions, Figure, Page, ReportError, Table};

/// Checks ids, conditions and the lengths of rows.
pub(crate) fn page(page: &Page) -> Result<(), ReportError> {
    conditions("page", &page.conditions)?;
    let evidence = page.evidence();
    let mut seen = BTreeSet::from([CONTENTS]);
    let sections = page.sections.iter().map(|section| section.id.as_str());
    for id in sections.chain(evidence.iter().map(|item| item.id())) {
        let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_".contains(c);
        if !id.starts_with(|c: char| c.is_ascii_lowercase()) || !id.chars().all(allowed) || id.len() > 80 {
            return Err(ReportError::Id { id: id.into() });
        }
        if !seen.insert(id) {
            return Err(ReportError::DuplicateId { id: id.into() });
        }
    }
    evidence.into_iter().try_for_each(|item| match item {
        Evidence::Figure(item) => figure(item),
        Evidence::Table(item) => table(item),
    })
}

/// Checks a figure's conditions and the shapes of its charts.
pub(crate) fn figure(figure: &Figure) -> Result<(), ReportError> {
    let id = &figure.id;
    conditions(id, &figure.conditions)?;
    match &figure.charts {
        Charts::Lines(_) => Ok(()),
        Charts::Heat(charts) => charts.iter().try_for_each(|chart| {
            shape(id, "values", chart.values.len(), chart.rows.len())?;
            let mut rows = chart.values.iter().zip(&chart.rows);
            rows.try_for_each(|(row, name)| shape(id, &format!("row {name:?}"), row.len(), chart.columns.len()))
        }),
        Charts::Bars(charts) => charts.iter().try_for_each(|chart| {
            let mut bars = chart.bars.iter();
            bars.try_for_each(|bar| shape(id, &format!("bar {:?}", bar.name), bar.values.len(), chart.parts.len()))
        }),
    }
}

fn table(table: &Table) -> Result<(), ReportError> {
    conditions(&table.id, &table.conditions)?;
    let mut rows = table.rows.iter().enumerate();
    rows.try_for_each(|(i, row)| shape(&table.id, &format!("row {}", i + 1), row.len(), table.columns.len()))
}

fn shape(id: &str, what: &str, found: usize, expected: usize) -> Result<(), ReportError> {
    if found == expected {
        return Ok(());
    }
    Err(ReportError::Shape { id: id.into(), what: what.into(), found, expected })
}

fn conditions(id: &str, conditions: &Conditions) -> Result<(), ReportError> {
    match conditions.iter().find(|(key, value)| key.trim().is_empty() || value.trim().is_empty()) {
        Some((key, value)) => Err(ReportError::EmptyCondition { id: id.into(), key: key.into(), value: value.into() }),
        None => Ok(()),
    }
}
