//! A smooth curve through markers.

use nalgebra::Vector3;

/// Nodes [m] on the cubic spline through `points` [m] (continuous curvature, none at both ends, its parameter the length of
/// the chords), with `parts` parts between each two points: the points themselves are nodes, `(points - 1) parts + 1` in all.
/// There are at least two points, and neighbours do not coincide.
pub fn through(points: &[Vector3<f64>], parts: usize) -> Vec<Vector3<f64>> {
    let spans = points.len() - 1;
    let lengths: Vec<f64> = points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).collect();
    let second = second_derivatives(points, &lengths);
    let mut nodes = Vec::with_capacity(spans * parts + 1);
    nodes.push(points[0]);
    for i in 0..spans {
        let square = lengths[i].powi(2) / 6.0;
        for k in 1..parts {
            let b = k as f64 / parts as f64;
            let a = 1.0 - b;
            let bent = second[i] * (a.powi(3) - a) + second[i + 1] * (b.powi(3) - b);
            nodes.push(points[i] * a + points[i + 1] * b + bent * square);
        }
        nodes.push(points[i + 1]);
    }
    nodes
}

/// Direction of the same curve at one of its points, which is not the last: of length 1.
pub fn direction(points: &[Vector3<f64>], at: usize) -> Vector3<f64> {
    let lengths: Vec<f64> = points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).collect();
    let second = second_derivatives(points, &lengths);
    let chord = (points[at + 1] - points[at]) / lengths[at];
    (chord - (second[at] * 2.0 + second[at + 1]) * (lengths[at] / 6.0)).normalize()
}

/// Second derivatives of the natural spline at its points, by elimination of its tridiagonal system.
fn second_derivatives(points: &[Vector3<f64>], lengths: &[f64]) -> Vec<Vector3<f64>> {
    let mut second = vec![Vector3::zeros(); points.len()];
    let mut upper = vec![0.0; points.len()];
    for i in 1..points.len() - 1 {
        let [before, after] = [lengths[i - 1], lengths[i]];
        let bend = (points[i + 1] - points[i]) / after - (points[i] - points[i - 1]) / before;
        let pivot = 2.0 * (before + after) - before * upper[i - 1];
        upper[i] = after / pivot;
        second[i] = (bend * 6.0 - second[i - 1] * before) / pivot;
    }
    for i in (1..points.len() - 1).rev() {
        second[i] = second[i] - second[i + 1] * upper[i];
    }
    second
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn its_direction_is_that_of_its_nodes() {
        let points: Vec<_> = (0..5).map(f64::from).map(|t| Vector3::new(t, 0.3 * t * t, (0.9 * t).sin())).collect();
        for at in 0..4 {
            let nodes = through(&points, 1000);
            let chord = nodes[1000 * at + 1] - nodes[1000 * at];
            assert!((direction(&points, at) - chord.normalize()).norm() < 2e-3, "at {at}");
        }
    }

    #[test]
    fn a_circle_is_met_to_fourth_order_and_points_are_nodes() {
        let error = |count: usize| {
            let point = |angle: f64| Vector3::new(angle.cos(), angle.sin(), 0.3 * angle);
            let step = 2.0 / count as f64;
            let points: Vec<_> = (0..=count).map(|i| point(step * i as f64)).collect();
            let nodes = through(&points, 2);
            assert!(points.iter().zip(nodes.iter().step_by(2)).all(|(point, node)| point == node));
            (nodes[count + 1] - point(step * (0.5 * (count + 1) as f64))).norm()
        };
        let [coarse, fine] = [error(20), error(40)];
        assert!(coarse < 1e-5 && fine < coarse / 14.0, "{coarse} {fine}");
    }
}
