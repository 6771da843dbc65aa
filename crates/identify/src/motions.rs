//! Kinds of motion: which recordings' grips go alike ways, to hold whole kinds out.

use kodama::{Method, linkage};
use nalgebra::{Rotation3, Vector3};
use serde::{Deserialize, Serialize};

use crate::recording::{GRIPPED, Recording};

/// Moments of a recording that are compared, evenly over its time.
const MOMENTS: usize = 25;

/// The ways of two grips over the time of a recording, the same in every place and heading: where the end's grip is from the start's, how
/// high both are above where they began [m], where they point, which counts as a tenth of a metre, and how fast they move, which counts as the
/// way of a tenth of a second.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Way(Vec<f32>);

impl Way {
    /// That of a recording of a cable without branches.
    pub fn of(recording: &Recording) -> Self {
        let last = recording.count() - 1;
        Self::of_grips(&recording.time, &recording.markers, [[GRIPPED - 1, 0], [last + 1 - GRIPPED, last]])
    }

    /// That of grips with these inner and outer markers, over times [s] and frames of markers, two or more; the same marker twice gives no
    /// direction.
    pub fn of_grips(
        time: &[f64],
        frames: &[Vec<Vector3<f64>>],
        [[first, first_outer], [second, second_outer]]: [[usize; 2]; 2],
    ) -> Self {
        let begun = &frames[0];
        let chord = begun[second] - begun[first];
        let heading = Rotation3::from_axis_angle(&Vector3::z_axis(), -chord.y.atan2(chord.x));
        let mut out: Vec<f64> = Vec::with_capacity(17 * MOMENTS);
        for moment in 0..MOMENTS {
            let frame = moment * (frames.len() - 1) / (MOMENTS - 1);
            let markers = &frames[frame];
            let from = frame.min(frames.len() - 2);
            let interval = time[from + 1] - time[from];
            let (start, end) = (markers[first], markers[second]);
            out.extend((heading * (end - start)).iter());
            out.extend([start.z - begun[first].z, end.z - begun[second].z]);
            for (inner, outer) in [(start, markers[first_outer]), (end, markers[second_outer])] {
                let direction = (outer - inner).try_normalize(0.0).unwrap_or_else(Vector3::zeros);
                out.extend((heading * direction * 0.1).iter());
            }
            for grip in [first, second] {
                out.extend((heading * (frames[from + 1][grip] - frames[from][grip]) * (0.1 / interval)).iter());
            }
        }
        Self(out.into_iter().map(|x| x as f32).collect())
    }

    /// How far it is from another one: the root of the mean square over time [m].
    pub fn distance(&self, other: &Self) -> f64 {
        let squares = self.0.iter().zip(&other.0).map(|(a, b)| f64::from(a - b).powi(2));
        (squares.sum::<f64>() / MOMENTS as f64).sqrt()
    }

    /// How far it is from the nearest of others [m]; infinite where there is none.
    pub fn nearest<'a>(&self, others: impl IntoIterator<Item = &'a Self>) -> f64 {
        others.into_iter().map(|other| self.distance(other)).fold(f64::INFINITY, f64::min)
    }
}

/// Sorts ways into so many kinds: the number of its kind for each, from 0, in the order in which kinds come first. Fewer kinds where there are
/// fewer ways. By hierarchical clustering (Ward 1963).
pub fn kinds(ways: &[Way], count: usize) -> Vec<usize> {
    let mut distances: Vec<f64> =
        ways.iter().enumerate().flat_map(|(k, a)| ways[k + 1..].iter().map(move |b| a.distance(b))).collect();
    let total = ways.len();
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

/// The faster half of recordings, by the mean speed of both grips: for each recording whether it is in it.
pub fn faster(recordings: &[Recording]) -> Vec<bool> {
    let speeds: Vec<f64> = recordings.iter().map(speed).collect();
    let mut sorted = speeds.clone();
    sorted.sort_by(f64::total_cmp);
    speeds.iter().map(|&speed| speed >= sorted[sorted.len() / 2]).collect()
}

/// The mean speed of both grips [m/s].
pub fn speed(recording: &Recording) -> f64 {
    let grips = [GRIPPED - 1, recording.count() - GRIPPED];
    let frames = recording.markers.windows(2);
    let way: f64 =
        frames.map(|pair| grips.map(|grip| (pair[1][grip] - pair[0][grip]).norm()).iter().sum::<f64>()).sum();
    0.5 * way / recording.time.last().copied().unwrap_or(1.0)
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
        let recordings = ups.iter().enumerate().map(|(k, &up)| recording(up, k as f64, 0.3 * k as f64));
        let ways: Vec<Way> = recordings.map(|recording| Way::of(&recording)).collect();
        assert_eq!(kinds(&ways, 2), [0, 1, 1, 0, 1]);
        assert_eq!(kinds(&ways, 1), [0; 5]);
        assert_eq!(kinds(&ways, 9), [0, 1, 2, 3, 4]);
        assert_eq!(kinds(&ways[..1], 2), [0]);
        assert!(ways[0].nearest(&ways[3..]) < 1e-6 && ways[0].nearest(&ways[1..3]) > 0.05);
    }

    #[test]
    fn the_faster_half_moves_faster() {
        let mut recordings = vec![recording(true, 0.0, 0.0); 4];
        for (recording, factor) in recordings.iter_mut().zip([1.0, 3.0, 2.0, 0.5]) {
            recording.time.iter_mut().for_each(|time| *time /= factor);
        }
        // One grip of two goes 0.3 m in 0.09 s.
        assert!((speed(&recordings[0]) - 0.5 * 0.3 / 0.09).abs() < 1e-9);
        assert_eq!(faster(&recordings), [false, true, true, false]);
    }

    #[test]
    fn halves_are_of_whole_kinds_and_alike_in_size() {
        let kinds = [0, 1, 1, 2, 1, 0, 3, 2];
        let halves = halves(&kinds);
        assert_eq!(halves, [true, false, false, true, false, true, false, true]);
    }
}
