//! Shapes of markers.

use std::f64::consts::TAU;

use crate::palette::MARKERS;
use crate::xml::{Px, Xml};

/// Radius of a marker \[px\].
pub(super) const RADIUS: f64 = 3.2;
/// Radius of a marker that stands out \[px\].
pub(super) const LARGE: f64 = 5.6;

/// Draws a marker with what is read under the mouse.
pub(super) fn draw(svg: &mut Xml, shape: usize, centre: [f64; 2], radius: f64, class: &str, title: &str) {
    svg.open("path", &[("class", &class), ("d", &outline(shape, centre, radius))]);
    if !title.is_empty() {
        svg.element("title", &[], title);
    }
    svg.close();
}

/// The outline of a shape: circle, square, triangle, diamond, triangle upside down, plus, star; all of about one area.
fn outline(shape: usize, [x, y]: [f64; 2], radius: f64) -> String {
    const PLUS: [[f64; 2]; 12] = [
        [-0.4, -1.1],
        [0.4, -1.1],
        [0.4, -0.4],
        [1.1, -0.4],
        [1.1, 0.4],
        [0.4, 0.4],
        [0.4, 1.1],
        [-0.4, 1.1],
        [-0.4, 0.4],
        [-1.1, 0.4],
        [-1.1, -0.4],
        [-0.4, -0.4],
    ];
    // Corners at equal angles from `turn` (in full turns) on, at radii that alternate.
    let corners = |n: u32, turn: f64, radii: [f64; 2]| -> Vec<[f64; 2]> {
        let angle = |i: u32| TAU * (turn + f64::from(i) / f64::from(n));
        let corner = |i: u32| (radii[(i % 2) as usize], angle(i).sin_cos());
        (0..n).map(corner).map(|(r, (sin, cos))| [r * cos, r * sin]).collect()
    };
    let corners = match shape % MARKERS {
        0 => {
            let r = Px(radius);
            return format!(
                "M{} {}a{r} {r} 0 1 0 {} 0a{r} {r} 0 1 0 {} 0z",
                Px(x - radius),
                Px(y),
                Px(2.0 * radius),
                Px(-2.0 * radius)
            );
        }
        1 => corners(4, 0.125, [1.25; 2]),
        2 => corners(3, -0.25, [1.4; 2]),
        3 => corners(4, 0.0, [1.35; 2]),
        4 => corners(3, 0.25, [1.4; 2]),
        5 => PLUS.to_vec(),
        _ => corners(10, -0.25, [1.5, 0.65]),
    };
    let points: Vec<_> =
        corners.iter().map(|[dx, dy]| format!("{} {}", Px(x + radius * dx), Px(y + radius * dy))).collect();
    format!("M{}z", points.join("L"))
}
