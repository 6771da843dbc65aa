//! Pages of evidence: text, tables and charts as one self-contained HTML file, each with the conditions under which it
//! was measured, and a CSV file beside it.
//!
//! A caller builds a [`Page`] as a value and writes it with [`Page::write`]. Every [`Figure`] and [`Table`] carries
//! [`Conditions`], which cannot be empty, and becomes `csv/<id>.csv` beside `index.html`: the drawing may leave values
//! out (a zero on a logarithmic axis), the CSV file never does. The page needs no network and no scripts, follows the
//! reader's choice of light or dark, and fits a phone. The same page gives the same bytes. [`check`] reads a page back
//! and lists what is wrong with it.
//!
//! The page is well-formed XML as well as HTML, so that it can be read back without guessing. Charts are the crate
//! `chart`'s, and stand here under their names there. This crate knows nothing of rods and solvers.

mod check;
mod error;
mod evidence;
mod html;
mod inline;
mod page;
mod table;
mod text;
mod write;

pub use chart::{
    Axis, Bar, BarChart, Charts, Conditions, Figure, HeatMap, LineChart, Point, Reference, Series, significant,
};
pub use check::check;
pub use error::ReportError;
pub use page::{Block, Page, Section};
pub use table::{Cell, Column, Table};
pub use text::wrapped;
