//! Pages of evidence: text, tables and charts as one self-contained HTML file, each with the conditions under which it
//! was measured, and a CSV file beside it.
//!
//! The drawing may leave values out (a zero on a logarithmic axis), the CSV file never does. A page needs no network and no
//! scripts, follows the reader's choice of light or dark, and fits a phone. The same page gives the same bytes. It is
//! well-formed XML as well as HTML, so that [`check`] can read it back and list what is wrong with it.
//!
//! This crate knows nothing of rods and solvers. Charts are the crate `chart`'s.

mod check;
mod error;
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
