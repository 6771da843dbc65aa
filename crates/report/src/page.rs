//! Pages and what stands in them.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use export::{ExportError, write_atomically};

use crate::{Conditions, Figure, ReportError, Table, data, html, validate};

/// A page.
#[derive(Clone, Debug)]
pub struct Page {
    /// Its title.
    pub title: String,
    /// The paragraphs before everything else, with inline marks (see [`Block::Paragraph`]).
    pub lead: Vec<String>,
    /// What holds for all of the page.
    pub conditions: Conditions,
    /// The sections.
    pub sections: Vec<Section>,
}

/// A section of a page.
#[derive(Clone, Debug)]
pub struct Section {
    /// Its anchor: a to z, 0 to 9, '-' and '_', unique in the page.
    pub id: String,
    /// Its heading.
    pub title: String,
    /// What stands in it.
    pub blocks: Vec<Block>,
}

/// A part of a section.
#[derive(Clone, Debug)]
pub enum Block {
    /// A paragraph of plain text with inline marks: `` `code` ``, `**bold**` and `[text](#id)`, a link to a section, a
    /// figure or a table of the page, or to a file beside it; without a text it reads as the figure's or table's number.
    /// Marks that are not closed stand for themselves.
    Paragraph(String),
    /// A table.
    Table(Table),
    /// A figure.
    Figure(Figure),
    /// Blocks folded away.
    Details(Details),
}

/// Blocks folded away under a line, for long lists.
#[derive(Clone, Debug)]
pub struct Details {
    /// The line that is always seen.
    pub summary: String,
    /// What opens below it.
    pub blocks: Vec<Block>,
}

/// A figure or a table.
#[derive(Clone, Copy)]
pub(crate) enum Evidence<'a> {
    Figure(&'a Figure),
    Table(&'a Table),
}

impl<'a> Evidence<'a> {
    pub(crate) fn id(self) -> &'a str {
        match self {
            Self::Figure(figure) => &figure.id,
            Self::Table(table) => &table.id,
        }
    }

    pub(crate) fn title(self) -> &'a str {
        match self {
            Self::Figure(figure) => &figure.title,
            Self::Table(table) => &table.title,
        }
    }
}

/// All figures and tables of `blocks`, those folded away too, in their order.
pub(crate) fn evidence(blocks: &[Block]) -> Vec<Evidence<'_>> {
    let mut found = Vec::new();
    for block in blocks {
        match block {
            Block::Paragraph(_) => {}
            Block::Table(table) => found.push(Evidence::Table(table)),
            Block::Figure(figure) => found.push(Evidence::Figure(figure)),
            Block::Details(details) => found.extend(evidence(&details.blocks)),
        }
    }
    found
}

impl Page {
    /// All figures and tables, in their order.
    pub(crate) fn evidence(&self) -> Vec<Evidence<'_>> {
        self.sections.iter().flat_map(|section| evidence(&section.blocks)).collect()
    }

    /// All figures, in their order.
    pub fn figures(&self) -> impl Iterator<Item = &Figure> {
        self.evidence().into_iter().filter_map(|evidence| match evidence {
            Evidence::Figure(figure) => Some(figure),
            Evidence::Table(_) => None,
        })
    }

    /// Writes `directory/index.html` and a `directory/csv/<id>.csv` for each figure and table; returns the page's path.
    /// Missing directories are made. Each file is complete or not there, and the page is written last. Files of an
    /// earlier page with other ids stay; [`crate::check`] names them.
    ///
    /// The CSV file of a table has the table's columns; of curves, a row for each point of each series of each chart;
    /// of a heat map, a row for each cell; of bars, a row for each part.
    ///
    /// # Errors
    /// Before anything is written: [`ReportError::Id`] and [`ReportError::DuplicateId`] for an id that cannot be a file's
    /// name or is there twice, [`ReportError::EmptyCondition`], [`ReportError::Shape`] for rows of the wrong length.
    /// [`ReportError::File`] if the system refuses.
    pub fn write(&self, directory: &Path) -> Result<PathBuf, ReportError> {
        validate::page(self)?;
        let page = html::page(self);
        let tables = self.evidence().into_iter().map(|item| Ok((item.id(), data::csv(item)?)));
        let tables = tables.collect::<Result<Vec<_>, ReportError>>()?;

        let csv = directory.join("csv");
        std::fs::create_dir_all(&csv).map_err(io_error("create the directory", &csv))?;
        for (id, bytes) in tables {
            write_atomically(&csv.join(format!("{id}.csv")), |file| file.write_all(&bytes))?;
        }
        let path = directory.join("index.html");
        write_atomically(&path, |file| file.write_all(page.as_bytes()))?;
        Ok(path)
    }
}

/// An [`ExportError::Io`] to be made from the system's error.
pub(crate) fn io_error(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> ExportError {
    move |cause| ExportError::Io { action, path: path.to_owned(), cause }
}
