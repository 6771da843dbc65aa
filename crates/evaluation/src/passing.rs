//! Whether segments pass through each other in a step, by brute force on their swept axes: what the solver says is not asked.

use cosserat::state::{Body, Model, State};
use nalgebra::Vector3;

/// Parts of a step in which each pair of axes is looked at: a pair whose axes lie in one plane twice within a part is missed.
const PARTS: usize = 64;

/// Ends [m] of a segment's axis.
type Line = [Vector3<f64>; 2];

/// Pairs of segments whose axes pass through each other where their ends go on straight lines from one state to the next.
///
/// Two axes cross where their four ends lie in one plane, which is looked for in 64 parts of the step, within both
/// lengths. Segments that joints hold together at one place and pairs of which both are fixed are left out. Where the solver did the step in parts the ends
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
    let joined = joined(model);
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

/// Pairs of segments, ascending, that joints hold together at one place: directly, or by other segments there.
fn joined(model: &Model) -> Vec<[usize; 2]> {
    let holds = model.joints.iter().map(|joint| {
        let held = |(body, offset)| match body {
            Body::Segment(segment) => Some((segment, offset)),
            Body::Anchor(_) => None,
        };
        [(joint.a, joint.offset_a), (joint.b, joint.offset_b)].map(held)
    });
    // Of each segment, the places on it that joints hold [m], and the number of each.
    let mut places: Vec<Vec<(f64, usize)>> = vec![Vec::new(); model.segments.len()];
    let mut first = Vec::new();
    for hold in holds {
        let new = first.len();
        first.push(new);
        for (segment, offset) in hold.into_iter().flatten() {
            let near = |&&(other, _): &&(f64, usize)| (other - offset).abs() < 1e-6 * model.segments[segment].length;
            match places[segment].iter().find(near) {
                Some(&(_, old)) => {
                    let (old, new) = (find(&first, old), find(&first, new));
                    first[new] = old;
                }
                None => places[segment].push((offset, new)),
            }
        }
    }
    let mut at: Vec<Vec<usize>> = vec![Vec::new(); first.len()];
    for (segment, own) in places.iter().enumerate() {
        own.iter().for_each(|&(_, place)| at[find(&first, place)].push(segment));
    }
    let pairs = |held: &Vec<usize>| -> Vec<[usize; 2]> {
        held.iter().enumerate().flat_map(|(k, &a)| held[k + 1..].iter().map(move |&b| [a, b])).collect()
    };
    let mut joined: Vec<_> = at.iter().flat_map(pairs).collect();
    joined.sort_unstable();
    joined
}

/// The first of the places that are one with `place`.
fn find(first: &[usize], mut place: usize) -> usize {
    while first[place] != place {
        place = first[place];
    }
    place
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
