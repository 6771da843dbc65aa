//! Charts as SVG: curves, heat maps and stacked bars, for pages and as files of their own. The same figure gives the same
//! bytes. Other drawings use [`Xml`], which is well-formed by construction.
//!
//! This crate knows nothing of rods and solvers.

mod axis;
mod charts;
mod conditions;
mod drawing;
mod figure;
mod grid;
mod legend;
mod lines;
mod marker;
mod palette;
mod text;
mod theme;
mod xml;

pub use axis::Axis;
pub use charts::Charts;
pub use conditions::Conditions;
pub use figure::Figure;
pub use grid::{Bar, BarChart, HeatMap};
pub use lines::{LineChart, Point, Reference, Series};
pub use palette::Palette;
pub use text::significant;
pub use theme::style;
pub use xml::{Attribute, Px, Xml, polyline};
