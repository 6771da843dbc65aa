//! The knot is knotted, its segments are alike, and its strands keep clear of each other.

use nalgebra::{DMatrix, Rotation3, Vector3};
use rod::shape::{self, KNOT_CLEARANCE, KNOT_ROPE, KNOT_SEGMENTS};

/// Where two edges of a closed polygon cross in the projection along z.
struct Crossing {
    /// Place along the polygon of the edge below, in edges.
    under: f64,
    /// Place of the edge above.
    over: f64,
}

fn crossings(nodes: &[Vector3<f64>]) -> Vec<Crossing> {
    let edge = |i: usize| (nodes[i], nodes[(i + 1) % nodes.len()]);
    let mut found = Vec::new();
    for i in 0..nodes.len() {
        for k in i + 2..nodes.len() {
            if i == 0 && k == nodes.len() - 1 {
                continue;
            }
            let ((a, b), (c, d)) = (edge(i), edge(k));
            let cross = |p: Vector3<f64>, q: Vector3<f64>| p.x * q.y - p.y * q.x;
            let area = cross(b - a, d - c);
            let (s, t) = (cross(c - a, d - c) / area, cross(c - a, b - a) / area);
            if (0.0..1.0).contains(&s) && (0.0..1.0).contains(&t) {
                let first_above = a.z + s * (b.z - a.z) > c.z + t * (d.z - c.z);
                let (first, second) = (i as f64 + s, k as f64 + t);
                let (over, under) = if first_above { (first, second) } else { (second, first) };
                found.push(Crossing { under, over });
            }
        }
    }
    found.sort_by(|a, b| a.under.total_cmp(&b.under));
    found
}

/// The determinant of a closed polygon's knot, |Alexander polynomial at -1|, from the colourings of a projection:
/// unknot 1, trefoil 3, figure-eight knot 5.
fn determinant(nodes: &[Vector3<f64>]) -> f64 {
    let turn = Rotation3::from_euler_angles(0.3, 0.7, 0.2);
    let nodes: Vec<_> = nodes.iter().map(|node| turn * node).collect();
    let crossings = crossings(&nodes);
    let n = crossings.len();
    if n < 2 {
        return 1.0;
    }
    // Arc k runs from the k-th passage below to the next one.
    let arc = |place: f64| (crossings.partition_point(|c| c.under < place) + n - 1) % n;
    let mut matrix = DMatrix::<f64>::zeros(n, n);
    for (k, crossing) in crossings.iter().enumerate() {
        matrix[(k, arc(crossing.over))] += 2.0;
        matrix[(k, k)] -= 1.0;
        matrix[(k, (k + n - 1) % n)] -= 1.0;
    }
    matrix.remove_row(0).remove_column(0).determinant().abs()
}

/// The determinant of an open rope's knot, its ends joined by a wide detour.
fn determinant_of_open(nodes: &[Vector3<f64>]) -> f64 {
    let (first, last) = (nodes[0], nodes[nodes.len() - 1]);
    let along = last - first;
    let aside = along.cross(&Vector3::new(0.1, 0.7, 0.3)).normalize() * (10.0 * along.norm());
    let mut closed = nodes.to_vec();
    closed.extend([last + along, last + along + aside, first - along + aside, first - along]);
    determinant(&closed)
}

fn distance(a: [Vector3<f64>; 2], b: [Vector3<f64>; 2]) -> f64 {
    let point = |p: Vector3<f64>, s: [Vector3<f64>; 2]| {
        let along = s[1] - s[0];
        (p - s[0] - along * ((p - s[0]).dot(&along) / along.norm_squared()).clamp(0.0, 1.0)).norm()
    };
    // Where two lines are nearest inside both segments, or at one of the four ends.
    let (u, v, w) = (a[1] - a[0], b[1] - b[0], a[0] - b[0]);
    let (uu, uv, vv, uw, vw) = (u.dot(&u), u.dot(&v), v.dot(&v), u.dot(&w), v.dot(&w));
    let area = uu * vv - uv * uv;
    let (s, t) = ((uv * vw - vv * uw) / area, (uu * vw - uv * uw) / area);
    let inside = (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t);
    let between = if inside { (w + u * s - v * t).norm() } else { f64::INFINITY };
    [between, point(a[0], b), point(a[1], b), point(b[0], a), point(b[1], a)].into_iter().fold(f64::INFINITY, f64::min)
}

#[test]
fn the_determinant_knows_knots() {
    let closed = |f: fn(f64) -> Vector3<f64>| -> Vec<_> {
        (0..200).map(|i| f(std::f64::consts::TAU * i as f64 / 200.0)).collect()
    };
    let circle = closed(|t| Vector3::new(t.cos(), t.sin(), 0.3 * (2.0 * t).sin()));
    let trefoil = closed(|t| {
        let r = 2.0 + (3.0 * t).cos();
        Vector3::new(r * (2.0 * t).cos(), r * (2.0 * t).sin(), (3.0 * t).sin())
    });
    let figure_eight = closed(|t| {
        let r = 2.0 + (2.0 * t).cos();
        Vector3::new(r * (3.0 * t).cos(), r * (3.0 * t).sin(), (4.0 * t).sin())
    });
    for (nodes, expected) in [(circle, 1.0), (trefoil, 3.0), (figure_eight, 5.0)] {
        assert!((determinant(&nodes) - expected).abs() < 1e-9, "{} != {expected}", determinant(&nodes));
    }
}

#[test]
fn it_is_a_trefoil_and_a_straight_rope_is_not() {
    for direction in [Vector3::x(), Vector3::new(-1.0, 0.2, 0.5), -Vector3::z()] {
        for (length, segments) in [(11.0, 110), (11.0, 111), (KNOT_ROPE, 71), (20.0, 1000)] {
            let knot = shape::knot(Vector3::new(1.0, 2.0, 3.0), direction, 1.0, length, segments);
            let found = determinant_of_open(&knot);
            assert!((found - 3.0).abs() < 1e-9, "{found}, {length} m, {segments} segments");
        }
        let straight = shape::straight(Vector3::zeros(), direction, 11.0, 110);
        assert_eq!(determinant_of_open(&straight), 1.0);
    }
}

#[test]
fn segments_are_alike_and_strands_keep_clear() {
    for (length, segments) in [(11.0, 110), (11.0, 111), (KNOT_ROPE, 71), (12.0, 700)] {
        assert!(segments as f64 >= KNOT_SEGMENTS * length);
        let direction = Vector3::new(1.0, 2.0, -1.0);
        let nodes = shape::knot(Vector3::x(), direction, 1.0, length, segments);
        assert_eq!((nodes.len(), nodes[0]), (segments + 1, Vector3::x()));
        let each = length / segments as f64;
        let parts: Vec<_> = nodes.windows(2).map(|pair| [pair[0], pair[1]]).collect();
        for part in &parts {
            assert!(((part[1] - part[0]).norm() / each - 1.0).abs() < 1e-11, "{}", (part[1] - part[0]).norm() / each);
        }
        let total: f64 = parts.iter().map(|part| (part[1] - part[0]).norm()).sum();
        assert!((total - length).abs() < 1e-9, "{total}");
        // Both ends run along the one line.
        let line = direction.normalize();
        assert!((nodes[segments] - nodes[0]).normalize().dot(&line) > 1.0 - 1e-12);
        assert!((parts[0][1] - parts[0][0]).normalize().dot(&line) > 1.0 - 1e-12);
        // Smooth: no joint bends more than a circle of a sixth of the loop would.
        let sharpest = parts.windows(2).map(|p| (p[0][1] - p[0][0]).angle(&(p[1][1] - p[1][0]))).fold(0.0, f64::max);
        assert!(sharpest < 6.0 * each, "{sharpest} rad at {each} m");
        // Strands: parts that are farther along the rope than straight lines across the loop are long.
        let mut nearest = f64::INFINITY;
        for i in 0..segments {
            for k in i + 1..segments {
                if (k - i - 1) as f64 * each > 1.0 {
                    nearest = nearest.min(distance(parts[i], parts[k]));
                }
            }
        }
        assert!(nearest > KNOT_CLEARANCE, "{nearest}");
    }
}
