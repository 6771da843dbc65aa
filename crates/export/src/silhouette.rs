//! Outlines of rigid bodies and obstacles on paper.

use chart::{Xml, polyline};
use rod::{Model, State};

/// Draws all rigid bodies that are not hidden as filled outlines; `place` says where a place of the world is on the paper.
pub(crate) fn draw_bodies(
    svg: &mut Xml,
    model: &Model,
    state: &State,
    colour: &str,
    place: impl Fn(&nalgebra::Vector3<f64>) -> [f64; 2],
) {
    for (i, segment) in model.segments.iter().enumerate() {
        let Some(body) = &segment.body else { continue };
        let corner = |corner| place(&(state.positions[i] + state.orientations[i] * corner));
        fill(svg, body.shape.mesh().positions.into_iter().map(corner).collect(), colour);
    }
}

/// Fills the convex hull of points, if that has an area.
pub(crate) fn fill(svg: &mut Xml, points: Vec<[f64; 2]>, colour: &str) {
    let outline = hull(points);
    if outline.len() > 2 {
        let path = polyline(outline) + "z";
        svg.push(Xml::nest("path", &[("fill", &colour), ("d", &path)], []));
    }
}

/// The convex hull of points, in order about it (Andrew 1979).
fn hull(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let turns_left =
        |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0;
    let chain = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && !turns_left(a, b, point)
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut lower = chain(&mut points.iter().copied());
    lower.extend(chain(&mut points.iter().rev().copied()));
    lower
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hull_holds_the_corners_alone() {
        let points = vec![[0.0, 0.0], [0.5, 0.5], [1.0, 0.0], [0.5, 0.0], [1.0, 1.0], [0.0, 1.0], [0.2, 0.9]];
        assert_eq!(hull(points), [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        assert!(hull(vec![[1.0, 2.0]; 3]).len() < 3 && hull(Vec::new()).is_empty());
    }
}
