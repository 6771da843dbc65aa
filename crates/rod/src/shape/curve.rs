//! Curves through given points, cut evenly.

use nalgebra::Vector3;

use crate::motion::{hermite, parabola_velocity};

/// Fewest parts of the curve between two points over which its length is measured, and fewest for each segment.
const PARTS: [usize; 2] = [4, 8];

/// Nodes [m] at equal distances along the curve through `points` [m], the first of them at the first point: `segments + 1`,
/// the last at the last point; `segments` where it is `closed`. Neighbouring points must not coincide; there are at least
/// two, three where it is closed.
///
/// A `smooth` curve is made of cubics whose tangents go through the points without a jump (Hermite), each that of the
/// parabola through the point and its neighbours; else it is the polygon.
pub fn resample(points: &[Vector3<f64>], closed: bool, smooth: bool, segments: usize) -> Vec<Vector3<f64>> {
    let spans = points.len() - usize::from(!closed);
    let point = |i: usize| points[i % points.len()];
    let way = |i: usize| point(i + 1) - point(i);
    let inside =
        |before: usize, here: usize| parabola_velocity([way(before).norm(), way(here).norm()], way(before), way(here));
    // The parabola's mean velocity over a span is that of the chord.
    let outside = |span: usize, other: Vector3<f64>| way(span) / way(span).norm() * 2.0 - other;
    let velocity = |i: usize| match i {
        _ if closed => inside((i + spans - 1) % spans, i % spans),
        _ if spans == 1 => way(0) / way(0).norm(),
        0 => outside(0, inside(0, 1)),
        _ if i == spans => outside(spans - 1, inside(spans - 2, spans - 1)),
        _ => inside(i - 1, i),
    };
    let at = |span: usize, share: f64| match smooth {
        true => point(span) + hermite(share, way(span).norm(), &way(span), &velocity(span), &velocity(span + 1))[0],
        false => point(span) + way(span) * share,
    };
    let parts = if smooth { PARTS[0].max(PARTS[1] * segments / spans) } else { 1 };
    let mut lengths = Vec::with_capacity(spans * parts + 1);
    let (mut total, mut last) = (0.0, points[0]);
    lengths.push(total);
    for k in 1..=spans * parts {
        let here = at((k - 1) / parts, ((k - 1) % parts + 1) as f64 / parts as f64);
        total += (here - last).norm();
        lengths.push(total);
        last = here;
    }
    let mut part = 0;
    let mut node = |k: usize| {
        let along = total * (k as f64 / segments as f64);
        while part + 1 < spans * parts && lengths[part + 1] <= along {
            part += 1;
        }
        let share = (along - lengths[part]) / (lengths[part + 1] - lengths[part]);
        at(part / parts, ((part % parts) as f64 + share.clamp(0.0, 1.0)) / parts as f64)
    };
    (0..segments + usize::from(!closed)).map(&mut node).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::{helix, ring};

    #[test]
    fn a_smooth_curve_through_points_of_a_helix_is_the_helix_to_third_order() {
        let errors = [40, 80].map(|count| {
            let nodes = resample(&helix(Vector3::zeros(), 1.0, 1.0, 1.0, count), false, true, 333);
            assert_eq!(nodes.len(), 334);
            let off = |node: &Vector3<f64>| ((node.x + 1.0).hypot(node.y) - 1.0).abs();
            let sides: Vec<f64> = nodes.windows(2).map(|pair| (pair[1] - pair[0]).norm()).collect();
            let mean = sides.iter().sum::<f64>() / 333.0;
            assert!(sides.iter().all(|side| (side / mean - 1.0).abs() < 1e-3), "even");
            nodes.iter().map(off).fold(0.0, f64::max)
        });
        assert!(errors[0] < 1e-3 && errors[1] < errors[0] / 6.0, "{errors:?}");
    }

    #[test]
    fn its_ends_and_a_closed_curves_seam_are_like_any_other_place() {
        let points = [Vector3::zeros(), Vector3::x(), Vector3::new(1.0, 2.0, 0.0), Vector3::new(4.0, 2.0, 0.0)];
        for smooth in [false, true] {
            let nodes = resample(&points, false, smooth, 12);
            assert!((nodes[0] - points[0]).norm() < 1e-15 && (nodes[12] - points[3]).norm() < 1e-12);
        }
        let polygon = resample(&points, false, false, 12);
        assert!((polygon[2] - points[1]).norm() < 1e-12 && (polygon[6] - points[2]).norm() < 1e-12);
        let circle = resample(&ring(Vector3::zeros(), 1.0, 40), true, true, 30);
        assert_eq!(circle.len(), 30);
        for (i, node) in circle.iter().enumerate() {
            let side = (circle[(i + 1) % 30] - node).norm();
            assert!((node.norm() - 1.0).abs() < 1e-4 && (side / 0.2090569 - 1.0).abs() < 1e-3, "{i}: {side}");
        }
        assert_eq!(resample(&points[..2], false, true, 2)[1], Vector3::x() * 0.5);
    }
}
