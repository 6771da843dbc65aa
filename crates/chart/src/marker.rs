//! Markers of points.

use crate::xml::{Px, Xml};

/// Radius of a marker \[px\].
pub(crate) const RADIUS: f64 = 3.2;
/// Radius of a marker that stands out \[px\].
pub(crate) const LARGE: f64 = 5.6;

/// Paths about (0, 0), all of about one area: circle, square, triangle, diamond, triangle upside down, stars of four and
/// five. With no factor in common with the number of colours, 70 series in a row differ in colour, shape or both.
const SHAPES: [&str; 7] = [
    "M-1 0a1 1 0 1 0 2 0a1 1 0 1 0-2 0z",
    "M-.9-.9H.9V.9H-.9z",
    "M0-1.4 1.2.7H-1.2z",
    "M0-1.35 1.35 0 0 1.35-1.35 0z",
    "M0 1.4 1.2-.7H-1.2z",
    "M1.6 0 .44.44 0 1.6-.44.44-1.6 0-.44-.44 0-1.6 .44-.44z",
    "M0-1.5 .38-.53 1.43-.46 .62.2 .88 1.21 0 .65-.88 1.21-.62.2-1.43-.46-.38-.53z",
];

/// Draws marker number `shape` with what is read under the mouse.
pub(crate) fn marker(svg: &mut Xml, shape: usize, [x, y]: [f64; 2], radius: f64, class: &str, title: &str) {
    let place = format!("translate({} {})scale({radius})", Px(x), Px(y));
    svg.shape("path", &[("class", &class), ("transform", &place), ("d", &SHAPES[shape % SHAPES.len()])], title);
}
