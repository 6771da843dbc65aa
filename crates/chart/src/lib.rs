//! Charts as SVG: curves, heat maps and stacked bars.
//!
//! A [`Figure`] is one chart or several of a kind with a title, a caption and the [`Conditions`] under which its numbers
//! were measured. [`Figure::svg`] makes a file of its own of it, and [`Figure::draw`] a part of a page, whose style sheet
//! holds [`style`]. Other drawings use [`Xml`], which is well-formed by construction. The same figure gives the same
//! bytes.
//!
//! This crate knows nothing of rods and solvers.

mod axis;
mod bars;
mod conditions;
mod draw;
mod figure;
mod heat;
mod lines;
mod number;
mod palette;
mod standalone;
mod theme;
mod xml;

pub use axis::{Axis, Scale};
pub use bars::{Bar, BarChart};
pub use conditions::Conditions;
pub use figure::{Charts, Figure};
pub use heat::HeatMap;
pub use lines::{LineChart, Point, Reference, Series};
pub use number::significant;
pub use palette::Palette;
pub use theme::style;
pub use xml::{Attribute, Px, Xml, polyline};
