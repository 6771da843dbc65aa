//! Charts as SVG: curves, heat maps and stacked bars, for pages and as files of their own. The same figure gives the same
//! bytes. Other drawings use [`Xml`], which is well-formed by construction.
//!
//! This crate knows nothing of rods and solvers.

mod axis;
mod conditions;
mod figure;
mod grid;
mod legend;
mod lines;
mod text;
mod theme;
mod xml;

pub use axis::Axis;
pub use conditions::Conditions;
pub use figure::{Charts, Figure};
pub use grid::{Bar, BarChart, HeatMap};
pub use legend::Palette;
pub use lines::{LineChart, Point, Reference, Series};
pub use text::significant;
pub use theme::style;
pub use xml::{Attribute, Px, Xml, polyline};
