//! Pages and what stands in them.

use crate::evidence::Evidence;
use crate::{Conditions, Figure, Table};

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
}

/// All figures and tables of `blocks`, in their order.
pub(crate) fn evidence(blocks: &[Block]) -> Vec<Evidence<'_>> {
    let mut found = Vec::new();
    for block in blocks {
        match block {
            Block::Paragraph(_) => {}
            Block::Table(table) => found.push(Evidence::Table(table)),
            Block::Figure(figure) => found.push(Evidence::Figure(figure)),
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
}
