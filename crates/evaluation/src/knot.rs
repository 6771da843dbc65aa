//! Whether a rope is knotted, whatever its shape: the determinant of a knot.

use nalgebra::{DMatrix, Rotation3, Vector3};

/// Where edges of a closed polygon pass below others, seen along z: the places of the lower and the upper edge's point along
/// the polygon, in edges; sorted by the lower ones.
fn crossings(nodes: &[Vector3<f64>]) -> Vec<[f64; 2]> {
    let count = nodes.len();
    let edge = |i: usize| (nodes[i], nodes[(i + 1) % count] - nodes[i]);
    let area = |a: &Vector3<f64>, b: &Vector3<f64>| a.x * b.y - a.y * b.x;
    let mut found = Vec::new();
    for i in 0..count {
        // The last edge is the first one's neighbour.
        for k in i + 2..count - usize::from(i == 0) {
            let ((a, u), (b, v)) = (edge(i), edge(k));
            let (s, t) = (area(&(b - a), &v) / area(&u, &v), area(&(b - a), &u) / area(&u, &v));
            if (0.0..1.0).contains(&s) && (0.0..1.0).contains(&t) {
                let (first, second) = (i as f64 + s, k as f64 + t);
                let first_is_over = (a + u * s).z > (b + v * t).z;
                found.push(if first_is_over { [second, first] } else { [first, second] });
            }
        }
    }
    found.sort_by(|a, b| a[0].total_cmp(&b[0]));
    found
}

/// The rope with its ends joined by a wide detour, turned so that no two edges lie above each other by design.
fn closed(nodes: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let (first, last) = (nodes[0], nodes[nodes.len() - 1]);
    let along = last - first;
    let aside = along.cross(&Vector3::new(0.1, 0.7, 0.3)).normalize() * (10.0 * along.norm());
    let detour = [last + along, last + along + aside, first - along + aside, first - along];
    let turn = Rotation3::from_euler_angles(0.3, 0.7, 0.2);
    nodes.iter().chain(&detour).map(|node| turn * node).collect()
}

/// The determinant of the knot in an open rope through `nodes` [m], its ends joined by a wide detour: |Alexander
/// polynomial at -1|. No knot has 1, the trefoil (the overhand knot) 3, the figure-eight knot 5.
///
/// It is a minor of the matrix of Fox's colourings: one arc from each passage below to the next, and at each crossing
/// twice the colour of the arc above is the sum of those below.
pub fn determinant(nodes: &[Vector3<f64>]) -> f64 {
    if nodes.len() < 3 {
        return 1.0;
    }
    let crossings = crossings(&closed(nodes));
    let n = crossings.len();
    if n < 2 {
        return 1.0;
    }
    let mut colourings = DMatrix::<f64>::zeros(n, n);
    for (k, [_, over]) in crossings.iter().enumerate() {
        let above = (crossings.partition_point(|[under, _]| under < over) + n - 1) % n;
        colourings[(k, above)] += 2.0;
        colourings[(k, k)] -= 1.0;
        colourings[(k, (k + n - 1) % n)] -= 1.0;
    }
    colourings.remove_row(0).remove_column(0).determinant().abs()
}
