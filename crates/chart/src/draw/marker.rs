//! Shapes of markers.

use std::f64::consts::TAU;

use crate::{Px, Xml, polyline};

/// Radius of a marker \[px\].
pub(super) const RADIUS: f64 = 3.2;
/// Radius of a marker that stands out \[px\].
pub(super) const LARGE: f64 = 5.6;

/// Square, triangle, diamond, triangle upside down, star of four, star of five, all of about one area: how many corners,
/// where the first is in full turns, and the radii at which they alternate.
const SHAPES: [(u32, f64, [f64; 2]); 6] = [
    (4, 0.125, [1.25; 2]),
    (3, -0.25, [1.4; 2]),
    (4, 0.0, [1.35; 2]),
    (3, 0.25, [1.4; 2]),
    (8, 0.0, [1.6, 0.62]),
    (10, -0.25, [1.5, 0.65]),
];

/// Draws a marker with what is read under the mouse. Shape 0 is a circle, the others are those of [`SHAPES`].
pub(super) fn draw(svg: &mut Xml, shape: usize, [x, y]: [f64; 2], radius: f64, class: &str, title: &str) {
    let outline = match shape.checked_sub(1) {
        Some(k) => {
            let (corners, turn, radii) = SHAPES[k % SHAPES.len()];
            let corner = |i: u32| {
                let (sin, cos) = (TAU * (turn + f64::from(i) / f64::from(corners))).sin_cos();
                let r = radius * radii[(i % 2) as usize];
                [x + r * cos, y + r * sin]
            };
            polyline((0..corners).map(corner)) + "z"
        }
        None => {
            let [r, left, wide] = [radius, x - radius, 2.0 * radius].map(Px);
            format!("M{left} {}a{r} {r} 0 1 0 {wide} 0a{r} {r} 0 1 0 -{wide} 0z", Px(y))
        }
    };
    svg.path(class, &outline, title);
}
