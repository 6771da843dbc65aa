//! Whether segments pass through each other in a step, by brute force on their swept axes: what the solver says is not asked.

use nalgebra::Vector3;
use rod::{Body, Model, State};

/// Parts of a step in which each pair of axes is looked at: a pair whose axes lie in one plane twice within a part is missed.
const PARTS: usize = 64;

/// Ends [m] of a segment's axis.
type Line = [Vector3<f64>; 2];

/// Pairs of segments whose axes pass through each other where their ends go on straight lines from one state to the next.
///
/// Two axes cross where their four ends lie in one plane, which is looked for in 64 parts of the step, within both
/// lengths. Segments that a joint holds on to each other and pairs of which both are fixed are left out. Where the solver did the step in parts the ends
/// went other ways: what is found may then have gone round.
pub fn passing(model: &Model, before: &State, after: &State) -> Vec<[usize; 2]> {
    let segments = &model.segments;
    let line = |state: &State, i: usize| {
        let half = state.axis(i) * (0.5 * segments[i].length);
        [state.positions[i] - half, state.positions[i] + half]
    };
    let ways: Vec<[Line; 2]> = (0..segments.len()).map(|i| [line(before, i), line(after, i)]).collect();
    let bounds: Vec<[Vector3<f64>; 2]> = ways
        .iter()
        .map(|[from, to]| {
            let [a, b, c, d] = [from[0], from[1], to[0], to[1]];
            [a.inf(&b).inf(&c.inf(&d)), a.sup(&b).sup(&c.sup(&d))]
        })
        .collect();
    let mut joined: Vec<[usize; 2]> = model
        .joints
        .iter()
        .filter_map(|joint| match (joint.a, joint.b) {
            (Body::Segment(a), Body::Segment(b)) => Some([a.min(b), a.max(b)]),
            _ => None,
        })
        .collect();
    joined.sort_unstable();
    // Along x, each with those that begin before it ends.
    let mut order: Vec<usize> = (0..segments.len()).collect();
    order.sort_by(|&a, &b| bounds[a][0].x.total_cmp(&bounds[b][0].x));
    let mut found = Vec::new();
    for (k, &a) in order.iter().enumerate() {
        for &b in order[k + 1..].iter().take_while(|&&b| bounds[b][0].x <= bounds[a][1].x) {
            let apart = (1..3).any(|i| bounds[a][0][i] > bounds[b][1][i] || bounds[b][0][i] > bounds[a][1][i]);
            let pair = [a.min(b), a.max(b)];
            let left_out = || segments[a].fixed && segments[b].fixed || joined.binary_search(&pair).is_ok();
            if !apart && !left_out() && cross(&ways[a], &ways[b]) {
                found.push(pair);
            }
        }
    }
    found.sort_unstable();
    found
}

/// Whether two axes cross as their ends go straight from the first to the second line.
fn cross(a: &[Line; 2], b: &[Line; 2]) -> bool {
    let at = |way: &[Line; 2], t: f64| [0, 1].map(|end| way[0][end].lerp(&way[1][end], t));
    let volume = |t: f64| {
        let (a, b) = (at(a, t), at(b, t));
        (b[0] - a[0]).dot(&(a[1] - a[0]).cross(&(b[1] - b[0])))
    };
    let mut low = (0.0, volume(0.0));
    for part in 1..=PARTS {
        let time = part as f64 / PARTS as f64;
        let high = (time, volume(time));
        if low.1 * high.1 <= 0.0 && low.1 != high.1 {
            let (mut from, mut to) = (low.0, high.0);
            for _ in 0..50 {
                let middle = 0.5 * (from + to);
                if volume(middle) * low.1 > 0.0 { from = middle } else { to = middle }
            }
            if within(&at(a, to), &at(b, to)) {
                return true;
            }
        }
        low = high;
    }
    false
}

/// Whether two lines in one plane cross within both their ends.
fn within(a: &Line, b: &Line) -> bool {
    let (u, v, w) = (a[1] - a[0], b[1] - b[0], b[0] - a[0]);
    let normal = u.cross(&v);
    let area = normal.norm_squared();
    let (s, t) = (w.cross(&v).dot(&normal) / area, w.cross(&u).dot(&normal) / area);
    (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t)
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;
    use rod::{Assembly, Material, RodSpec, shape};

    use super::*;

    /// Two rods of two segments of 1 m, crosswise, the second `height` [m] above the first.
    fn crosswise(height: f64) -> (Model, State) {
        let mut assembly = Assembly::new(Vector3::zeros());
        let material = Material { youngs_modulus: 1e6, torsion_modulus: 1e6, density: 1000.0 };
        for (start, along) in
            [(Vector3::new(-0.7, 0.0, 0.0), Vector3::x()), (Vector3::new(0.0, -0.7, height), Vector3::y())]
        {
            assembly.rod(&RodSpec::new(shape::straight(start, along, 2.0, 2), 0.01, material));
        }
        assembly.finish()
    }

    #[test]
    fn what_jumps_through_is_found_and_what_goes_by_is_not() {
        let (model, before) = crosswise(0.2);
        assert!(passing(&model, &before, &before).is_empty());
        assert_eq!(passing(&model, &before, &crosswise(-0.2).1), [[0, 2]]);
        assert!(passing(&model, &before, &crosswise(0.1).1).is_empty());
        // Down beside it, and along it.
        let aside = |shift: Vector3<f64>| {
            let mut state = before.clone();
            state.positions[2..].iter_mut().for_each(|x| *x += shift);
            state
        };
        assert!(passing(&model, &aside(Vector3::x() * 2.0), &aside(Vector3::new(2.0, 0.0, -1.0))).is_empty());
        assert!(passing(&model, &before, &aside(Vector3::x() * 3.0)).is_empty());
        // Through it and back within the step: turned by half a turn about an axis below it, its ends cross.
        let mut turned = before.clone();
        let half = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        turned.orientations[2] = half * turned.orientations[2];
        turned.positions[2].z = -0.2;
        assert_eq!(passing(&model, &before, &turned), [[0, 2]]);
    }
}
