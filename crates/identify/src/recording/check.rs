//! What a recording must be to be of use.

use std::path::Path;

use nalgebra::Vector3;

use super::{GRIPPED, Grips, Recording, RecordingError};

/// Fewest frames: two give the velocities at the start.
const FEWEST_FRAMES: usize = 3;
/// Fewest markers: those in the grips, and one to be predicted.
const FEWEST_MARKERS: usize = 2 * GRIPPED + 1;
/// Lengths of cables [m].
const LENGTHS: [f64; 2] = [0.05, 20.0];
/// How far a distance of neighbours may be from its median, in mean distances along the cable: markers shake, cables hardly
/// stretch.
const FARTHEST: f64 = 0.5;
/// Longest gap of a marker in a grip that is filled by a line [s].
const LONGEST_GAP: f64 = 0.1;
/// How far lengths of cables and times from frame to frame of recordings that belong together may be apart, as a part of them.
pub const ALIKE: f64 = 0.15;

/// The recording with the gaps of its grips filled, if it is sound.
pub(super) fn checked(mut recording: Recording) -> Result<Recording, RecordingError> {
    let path = recording.path.clone();
    let wrong = |message: String| Err(RecordingError::new(&path, message));
    let (frames, count) = (recording.frames(), recording.count());
    if frames < FEWEST_FRAMES {
        return wrong(format!("{frames} frames, but there must be at least {FEWEST_FRAMES}"));
    }
    if count < FEWEST_MARKERS {
        return wrong(format!(
            "{count} markers, but there must be at least {FEWEST_MARKERS}: two in each grip, one between"
        ));
    }
    for (frame, pair) in recording.time.windows(2).enumerate() {
        if !(pair[1] > pair[0] && pair[1].is_finite()) {
            return wrong(format!("frame {}: time {} s, but it must be later than {} s", frame + 1, pair[1], pair[0]));
        }
    }
    check_finite(&recording)?;
    fill_grips(&mut recording, &Grips::Ends.given(count))?;
    check_distances(&recording)?;
    Ok(recording)
}

/// Fills the gaps of the markers in grips, and refuses markers lost in the first two frames.
pub(crate) fn fill_grips(recording: &mut Recording, gripped: &[usize]) -> Result<(), RecordingError> {
    for &marker in gripped {
        fill(recording, marker)?;
    }
    for frame in 0..2 {
        if let Some(marker) = recording.markers[frame].iter().position(is_lost) {
            let message = "it is lost, but the first two frames say how the cable starts: cut them off";
            return Err(RecordingError::at(&recording.path, frame, marker, message));
        }
    }
    Ok(())
}

/// Refuses infinite coordinates; what is no number is a marker that was lost.
pub(super) fn check_finite(recording: &Recording) -> Result<(), RecordingError> {
    for (frame, markers) in recording.markers.iter().enumerate() {
        if let Some(marker) = markers.iter().position(|position| position.iter().any(|x| x.is_infinite())) {
            return Err(RecordingError::at(&recording.path, frame, marker, "a coordinate is infinite"));
        }
    }
    Ok(())
}

/// Whether a marker was lost.
fn is_lost(position: &Vector3<f64>) -> bool {
    position.iter().any(|x| x.is_nan())
}

/// Fills the gaps of a marker by lines.
fn fill(recording: &mut Recording, marker: usize) -> Result<(), RecordingError> {
    let lost: Vec<bool> = recording.markers.iter().map(|markers| is_lost(&markers[marker])).collect();
    let mut frame = 0;
    while let Some(first) = (frame..lost.len()).find(|&frame| lost[frame]) {
        let fault = |message: String| RecordingError::at(&recording.path, first, marker, message);
        let (Some(before), Some(after)) = (first.checked_sub(1), (first..lost.len()).find(|&frame| !lost[frame]))
        else {
            return Err(fault("a marker in a grip is lost at the start or at the end: cut these frames off".into()));
        };
        let [from, to] = [before, after].map(|frame| (recording.time[frame], recording.markers[frame][marker]));
        let gap = to.0 - from.0;
        if gap > LONGEST_GAP + 1e-6 {
            return Err(fault(format!(
                "a marker in a grip is lost for {gap:.3} s, but at most {LONGEST_GAP} s can be filled"
            )));
        }
        for frame in before + 1..after {
            let share = (recording.time[frame] - from.0) / gap;
            recording.markers[frame][marker] = from.1 + (to.1 - from.1) * share;
        }
        frame = after;
    }
    Ok(())
}

/// Neighbours on a cable of so many markers.
pub(super) fn along(count: usize) -> impl Iterator<Item = [usize; 2]> {
    (1..count).map(|marker| [marker - 1, marker])
}

/// Refuses other units, and markers that swap or jump.
fn check_distances(recording: &Recording) -> Result<(), RecordingError> {
    let mean = check_neighbours(recording, &along(recording.count()).collect::<Vec<_>>())?;
    check_order(recording, mean)
}

/// Refuses other units, and pairs of neighbours that get far from each other; returns their mean distance [m].
pub(crate) fn check_neighbours(recording: &Recording, neighbours: &[[usize; 2]]) -> Result<f64, RecordingError> {
    let distance = |markers: &[Vector3<f64>], [a, b]: [usize; 2]| (markers[b] - markers[a]).norm();
    let medians: Vec<f64> = neighbours
        .iter()
        .map(|&pair| median(recording.markers.iter().map(|markers| distance(markers, pair)).collect()))
        .collect();
    let length: f64 = medians.iter().sum();
    check_length(&recording.path, length)?;
    let mean = length / medians.len() as f64;
    for (frame, markers) in recording.markers.iter().enumerate() {
        for (&pair, &usual) in neighbours.iter().zip(&medians) {
            let found = distance(markers, pair);
            if (found - usual).abs() > FARTHEST * mean {
                let message = format!(
                    "{found:.4} m to marker {}, but mostly {usual:.4} m: markers swapped, or one jumps",
                    pair[1]
                );
                return Err(RecordingError::at(&recording.path, frame, pair[0], message));
            }
        }
    }
    Ok(mean)
}

/// Refuses other units.
pub(crate) fn check_length(path: &Path, length: f64) -> Result<(), RecordingError> {
    let [least, most] = LENGTHS;
    if (least..=most).contains(&length) {
        return Ok(());
    }
    let message = format!("a cable {length} m long, but it must be {least} to {most} m: say the unit (--unit-m)");
    Err(RecordingError::new(path, message))
}

/// Refuses markers that are one and the same, and neighbours that are told in the wrong order in all frames: a smooth cable is
/// shorter in its own order than with two neighbours exchanged.
fn check_order(recording: &Recording, mean: f64) -> Result<(), RecordingError> {
    let apart =
        |a: usize, b: usize| median(recording.markers.iter().map(|markers| (markers[a] - markers[b]).norm()).collect());
    let fault = |marker, message: String| Err(RecordingError::at(&recording.path, 0, marker, message));
    let count = recording.count();
    for first in 0..count {
        if let Some(second) = (first + 1..count).find(|&second| apart(first, second) < 1e-3 * mean) {
            return fault(first, format!("it lies where marker {second} does, in most frames"));
        }
    }
    for first in 1..count - 2 {
        let told = apart(first - 1, first) + apart(first + 1, first + 2);
        let exchanged = apart(first - 1, first + 1) + apart(first, first + 2);
        if exchanged < told {
            return fault(first, format!("it seems to change places with marker {} in most frames", first + 1));
        }
    }
    Ok(())
}

/// Takes recordings away whose number of markers is not that of most, and says why.
pub(crate) fn drop_other_counts(recordings: &mut Vec<Recording>) -> Vec<RecordingError> {
    let counts: Vec<usize> = recordings.iter().map(Recording::count).collect();
    let Some(count) = most_frequent(&counts) else { return Vec::new() };
    let mut dropped = Vec::new();
    recordings.retain(|recording| {
        let fits = recording.count() == count;
        if !fits {
            let message = format!("{} markers, but most recordings have {count}", recording.count());
            dropped.push(RecordingError::new(&recording.path, message));
        }
        fits
    });
    dropped
}

/// Takes recordings away whose length [m] is not that of most, and says why. `of` tells the path of one and its length.
pub(crate) fn drop_other_lengths<R>(recordings: &mut Vec<R>, of: impl Fn(&R) -> (&Path, f64)) -> Vec<RecordingError> {
    // Of an even number the lower one of both in the middle: a length that one of them has.
    let mut lengths: Vec<f64> =
        recordings.iter().map(|recording| of(recording).1).filter(|length| !length.is_nan()).collect();
    lengths.sort_by(f64::total_cmp);
    let Some(&usual) = lengths.get(lengths.len().saturating_sub(1) / 2) else { return Vec::new() };
    let mut dropped = Vec::new();
    recordings.retain(|recording| {
        let (path, found) = of(recording);
        let fits = (found / usual - 1.0).abs() <= ALIKE;
        if !fits {
            let message = format!("{found:.3} m long, but most are {usual:.3} m: other units or markers");
            dropped.push(RecordingError::new(path, message));
        }
        fits
    });
    dropped
}

/// The number that comes most often, the first of those that come as often.
fn most_frequent(numbers: &[usize]) -> Option<usize> {
    let times = |number: usize| numbers.iter().filter(|own| **own == number).count();
    numbers.iter().copied().rev().max_by_key(|&number| times(number))
}

/// The way over pairs of markers in the first frame [m].
pub(crate) fn first_length(recording: &Recording, neighbours: impl Iterator<Item = [usize; 2]>) -> f64 {
    neighbours.map(|[a, b]| (recording.markers[0][b] - recording.markers[0][a]).norm()).sum()
}

/// The middle one of the numbers that are known; NaN where there is none.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.retain(|value| !value.is_nan());
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        count if count % 2 == 1 => values[count / 2],
        count => 0.5 * (values[count / 2 - 1] + values[count / 2]),
    }
}
