//! Pages and what stands in them.

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

/// A figure or a table.
pub(crate) struct Evidence<'a> {
    pub(crate) id: &'a str,
    pub(crate) title: &'a str,
    pub(crate) caption: &'a str,
    pub(crate) conditions: &'a Conditions,
    pub(crate) block: &'a Block,
}

impl Block {
    /// The figure or table that it is, if it is one.
    pub(crate) fn evidence(&self) -> Option<Evidence<'_>> {
        match self {
            Self::Paragraph(_) => None,
            Self::Table(Table { id, title, caption, conditions, .. })
            | Self::Figure(Figure { id, title, caption, conditions, .. }) => {
                Some(Evidence { id, title, caption, conditions, block: self })
            }
        }
    }
}

impl Page {
    /// All figures and tables, in their order.
    pub(crate) fn evidence(&self) -> impl Iterator<Item = Evidence<'_>> {
        self.sections.iter().flat_map(|section| &section.blocks).filter_map(Block::evidence)
    }

    /// The ids of all figures and tables, in their order.
    pub fn ids(&self) -> impl Iterator<Item = &str> {
        self.evidence().map(|item| item.id)
    }

    /// All figures, in their order.
    pub fn figures(&self) -> impl Iterator<Item = &Figure> {
        self.evidence().filter_map(|item| if let Block::Figure(figure) = item.block { Some(figure) } else { None })
    }
}
