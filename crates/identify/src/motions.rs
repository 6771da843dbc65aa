//! Kinds of motion: which recordings' grips go alike ways, to hold whole kinds out.

use kodama::{Method, linkage};
use nalgebra::{Rotation3, Vector3};

use crate::recording::{GRIPPED, Recording};

/// Moments of a recording that are compared, evenly over its time.
const MOMENTS: usize = 25;

/// Sorts recordings into so many kinds by the ways of their grips, the same in every place and heading: the number of its kind for
/// each, from 0, in the order in which kinds come first. Fewer kinds where there are fewer recordings.
///
/// Hierarchical clustering after Ward (1963) of where the end's grip is from the start's, how high both are above where they
/// began, and where they point.
pub fn kinds(recordings: &[Recording], count: usize) -> Vec<usize> {
    let ways: Vec<Vec<f64>> = recordings.iter().map(way).collect();
    let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    let mut distances: Vec<f64> =
        ways.iter().enumerate().flat_map(|(k, a)| ways[k + 1..].iter().map(move |b| apart(a, b))).collect();
    let total = recordings.len();
    // Clusters of one recording each come first, those that merge two of them after.
    let mut of: Vec<Vec<usize>> = (0..total).map(|k| vec![k]).collect();
    if total > 1 {
        let merges = linkage(&mut distances, total, Method::Ward);
        for step in merges.steps().iter().take(total.saturating_sub(count.max(1))) {
            let (a, b) = (std::mem::take(&mut of[step.cluster1]), std::mem::take(&mut of[step.cluster2]));
            of.push([a, b].concat());
        }
    }
    of.retain(|members| !members.is_empty());
    of.iter_mut().for_each(|members| members.sort_unstable());
    of.sort();
    let mut kinds = vec![0; total];
    for (kind, members) in of.iter().enumerate() {
        members.iter().for_each(|&k| kinds[k] = kind);
    }
    kinds
}

/// Two halves of recordings, as near in size as whole kinds allow: for each recording whether it is in the second. The largest kind
/// goes first, each to the half that is smaller so far.
pub fn halves(kinds: &[usize]) -> Vec<bool> {
    let count = kinds.iter().max().map_or(0, |most| most + 1);
    let size = |kind: usize| kinds.iter().filter(|own| **own == kind).count();
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by_key(|&kind| std::cmp::Reverse(size(kind)));
    let (mut sizes, mut second) = ([0, 0], vec![false; count]);
    for kind in order {
        second[kind] = sizes[1] < sizes[0];
        sizes[usize::from(second[kind])] += size(kind);
    }
    kinds.iter().map(|&kind| second[kind]).collect()
}

/// The ways of both grips as numbers [m]; where they point counts as a tenth of a metre.
fn way(recording: &Recording) -> Vec<f64> {
    let last = recording.count() - 1;
    let first = &recording.markers[0];
    let chord = first[last + 1 - GRIPPED] - first[GRIPPED - 1];
    let heading = Rotation3::from_axis_angle(&Vector3::z_axis(), -chord.y.atan2(chord.x));
    let mut out = Vec::with_capacity(11 * MOMENTS);
    for moment in 0..MOMENTS {
        let markers = &recording.markers[moment * (recording.frames() - 1) / (MOMENTS - 1)];
        let (start, end) = (markers[GRIPPED - 1], markers[last + 1 - GRIPPED]);
        out.extend((heading * (end - start)).iter());
        out.extend([start.z - first[GRIPPED - 1].z, end.z - first[last + 1 - GRIPPED].z]);
        for [inner, outer] in [[start, markers[0]], [end, markers[last]]] {
            out.extend((heading * (outer - inner).normalize() * 0.1).iter());
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    /// Grips that go apart, or up, at some place and heading.
    fn recording(is_up: bool, turn: f64, place: f64) -> Recording {
        let heading = Rotation3::from_axis_angle(&Vector3::z_axis(), turn);
        let frame = |k: usize| {
            let share = k as f64 / 9.0 * 0.3;
            let by = if is_up { Vector3::z() } else { Vector3::x() } * share;
            let marker = |i: usize| Vector3::new(0.1 * i as f64, 0.0, 0.0) + if i < 3 { Vector3::zeros() } else { by };
            (0..6).map(|i| heading * marker(i) + Vector3::new(place, 2.0 * place, place)).collect()
        };
        let time = (0..10).map(|k| 0.01 * k as f64).collect();
        Recording { path: PathBuf::from("a"), time, markers: (0..10).map(frame).collect() }
    }

    #[test]
    fn alike_ways_are_one_kind_in_every_place_and_heading() {
        let ups = [false, true, true, false, true];
        let recordings: Vec<Recording> =
            ups.iter().enumerate().map(|(k, &up)| recording(up, k as f64, 0.3 * k as f64)).collect();
        assert_eq!(kinds(&recordings, 2), [0, 1, 1, 0, 1]);
        assert_eq!(kinds(&recordings, 1), [0; 5]);
        assert_eq!(kinds(&recordings, 9), [0, 1, 2, 3, 4]);
        assert_eq!(kinds(&recordings[..1], 2), [0]);
    }

    #[test]
    fn halves_are_of_whole_kinds_and_alike_in_size() {
        let kinds = [0, 1, 1, 2, 1, 0, 3, 2];
        let halves = halves(&kinds);
        assert_eq!(halves, [true, false, false, true, false, true, false, true]);
    }
}
