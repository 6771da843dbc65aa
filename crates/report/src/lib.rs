//! Pages of evidence: text, tables and charts as one self-contained HTML file, each with the conditions under which it
//! was measured, and a CSV file beside it.
//!
//! A caller builds a [`Page`] as a value and writes it with [`Page::write`]. Every [`Figure`] and [`Table`] carries
//! [`Conditions`], which cannot be empty, and becomes `csv/<id>.csv` beside `index.html`: the drawing may leave values
//! out (a zero on a logarithmic axis), the CSV file never does. The page needs no network and no scripts, follows the
//! reader's choice of light or dark, and fits a phone. The same page gives the same bytes. [`check`] reads a page back
//! and lists what is wrong with it.
//!
//! The page is well-formed XML as well as HTML, so that it can be read back without guessing.
//!
//! This crate knows nothing of rods and solvers.

mod axis;
mod bars;
mod check;
mod conditions;
mod data;
mod draw;
mod error;
mod figure;
mod heat;
mod html;
mod inline;
mod lines;
mod number;
mod page;
mod palette;
mod standalone;
mod table;
mod text;
mod theme;
mod validate;
mod xml;

pub use axis::{Axis, Scale};
pub use bars::{Bar, BarChart};
pub use check::check;
pub use conditions::Conditions;
pub use error::ReportError;
pub use figure::{Charts, Figure};
pub use heat::{ColourScale, HeatMap};
pub use lines::{Aspect, LineChart, LineStyle, Point, Reference, Series};
pub use number::NumberFormat;
pub use page::{Block, Details, Page, Section};
pub use table::{Align, Cell, Column, Emphasis, Table};
pub use text::wrapped;
