//! Which markers lie on which rod.

use std::ops::Range;

use nalgebra::Vector3;

use crate::recording::{GRIPPED, Grips, Recording, RecordingError, check_neighbours, fill_grips, median};

/// The rods of a cable with branches, by their markers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tree {
    /// Markers on the parent, the first ones, in their order from end to end.
    pub parent: usize,
    /// The branches.
    pub branches: Vec<Branch>,
    /// Which markers of the parent the grips hold.
    pub grips: Grips,
}

/// A branch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Branch {
    /// The marker where it begins: of the parent, or of a branch before it.
    pub junction: usize,
    /// Its own markers, in their order from there to its end.
    pub markers: Range<usize>,
}

impl Tree {
    /// Finds the rods of a cable from its recordings, whose markers come rod by rod: those of the parent from one end to the other, then
    /// those of each branch from its junction to its end.
    ///
    /// A cable does not stretch, so that neighbours never get far from each other: a marker goes on with the rod if, of all before it,
    /// the last one stays nearest, and the rod does not turn back there, by more than a quarter of a turn in the mean; else a branch
    /// begins. It begins at that marker of the rods before it, but for the last one, whose distance changes least. The middle one of all
    /// recordings counts, so that some in which markers swap do not.
    ///
    /// # Errors
    /// If there is no branch, the parent has too few markers, or a branch begins in a grip.
    pub fn of(recordings: &[Recording], grips: Grips) -> Result<Self, String> {
        let count = recordings.first().map_or(0, Recording::count);
        let nearest = |marker: usize, among: Range<usize>, of: &dyn Fn(usize, usize) -> f64| {
            among.min_by(|&a, &b| of(marker, a).total_cmp(&of(marker, b)))
        };
        let farthest = |a, b| median(recordings.iter().map(|own| distances(own, a, b).fold(0.0, f64::max)).collect());
        let turn = |marker| median(recordings.iter().map(|own| mean_turn(own, marker)).collect());
        let mut begins: Vec<usize> = Vec::new();
        for marker in 1..count {
            let start = begins.last().copied().unwrap_or(0);
            let turns_back = marker >= start + 2 && turn(marker) < 0.0;
            if turns_back || nearest(marker, 0..marker, &farthest) != Some(marker - 1) {
                begins.push(marker);
            }
        }
        let parent = *begins.first().ok_or("there is no branch: each marker goes on where the one before it is")?;
        grips.check(parent)?;
        let shakes = |a, b| median(recordings.iter().map(|own| variance(distances(own, a, b))).collect());
        let ends = begins[1..].iter().copied().chain([count]);
        let branch = |(&first, end): (&usize, usize)| {
            let junction = nearest(first, 0..first - 1, &shakes).unwrap_or(0);
            if grips.given(parent).contains(&junction) {
                return Err(format!("the branch of marker {first} begins at marker {junction}, which is in a grip"));
            }
            Ok(Branch { junction, markers: first..end })
        };
        Ok(Self { parent, branches: begins.iter().zip(ends).map(branch).collect::<Result<_, _>>()?, grips })
    }

    /// The branch on which a branch hangs, by its index; none: it hangs on the parent.
    pub fn host(&self, branch: usize) -> Option<usize> {
        let junction = self.branches[branch].junction;
        self.branches.iter().position(|host| host.markers.contains(&junction))
    }

    /// The markers of the parent between the grips.
    pub fn between(&self) -> Range<usize> {
        self.grips.first() + 1..self.parent - GRIPPED
    }

    /// The marker itself where it is one of the parent, else that of the parent on which its branch hangs, or what that hangs on.
    pub fn on_parent(&self, marker: usize) -> usize {
        let own = self.branches.iter().find(|branch| branch.markers.contains(&marker));
        own.map_or(marker, |branch| self.on_parent(branch.junction))
    }

    /// The markers of the parent between the grips where branches begin, each once, in their order.
    pub fn junctions(&self) -> Vec<usize> {
        let between = self.between();
        let on_parent = self.branches.iter().map(|branch| branch.junction);
        let mut junctions: Vec<usize> = on_parent.filter(|junction| between.contains(junction)).collect();
        junctions.sort_unstable();
        junctions.dedup();
        junctions
    }

    /// The recording with the gaps of its grips filled, if it is one of this cable.
    ///
    /// # Errors
    /// With the file, and the frame and the marker, if there is another number of markers, one is lost where it must not be, or two
    /// neighbours are much farther from each other than mostly: markers swapped, or one jumps.
    pub fn checked(&self, mut recording: Recording) -> Result<Recording, RecordingError> {
        if recording.count() != self.count() {
            let message = format!("{} markers, but there must be {}", recording.count(), self.count());
            return Err(RecordingError::new(&recording.path, message));
        }
        fill_grips(&mut recording, &self.grips.given(self.parent))?;
        check_neighbours(&recording, &self.neighbours().collect::<Vec<_>>())?;
        Ok(recording)
    }

    /// Markers in all.
    pub fn count(&self) -> usize {
        self.branches.last().map_or(self.parent, |branch| branch.markers.end)
    }

    /// The markers that are to be predicted: all but those in the grips.
    pub fn free(&self) -> impl Iterator<Item = usize> {
        self.grips.free(self.parent).chain(self.parent..self.count())
    }

    /// The markers of each rod: of the parent with those in its grips, then of each branch.
    pub fn rods(&self) -> impl Iterator<Item = Range<usize>> {
        std::iter::once(0..self.parent).chain(self.branches.iter().map(|branch| branch.markers.clone()))
    }

    /// The markers through which each rod goes, in their order; those of a branch begin with the marker on which it hangs.
    pub fn ways(&self) -> Vec<Vec<usize>> {
        let branch = |branch: &Branch| std::iter::once(branch.junction).chain(branch.markers.clone()).collect();
        std::iter::once((0..self.parent).collect()).chain(self.branches.iter().map(branch)).collect()
    }

    /// Pairs of markers that are neighbours on a rod.
    pub fn neighbours(&self) -> impl Iterator<Item = [usize; 2]> {
        let pairs = |way: Vec<usize>| way.windows(2).map(|pair| [pair[0], pair[1]]).collect::<Vec<_>>();
        self.ways().into_iter().flat_map(pairs)
    }
}

/// Distances [m] of two markers in the frames where neither was lost.
pub(super) fn distances(recording: &Recording, a: usize, b: usize) -> impl Iterator<Item = f64> {
    let apart = move |markers: &Vec<Vector3<f64>>| (markers[a] - markers[b]).norm();
    recording.markers.iter().map(apart).filter(|distance| distance.is_finite())
}

/// Cosine of the angle between the way to a marker from the one before it and the way to that one, in the mean of the frames where none was
/// lost.
fn mean_turn(recording: &Recording, marker: usize) -> f64 {
    let cosine = |markers: &Vec<Vector3<f64>>| {
        let [before, after] = [1, 0].map(|k| markers[marker - k] - markers[marker - k - 1]);
        before.dot(&after) / (before.norm() * after.norm())
    };
    let (sum, count) = recording
        .markers
        .iter()
        .map(cosine)
        .filter(|cosine| cosine.is_finite())
        .fold((0.0, 0), |(sum, count), cosine| (sum + cosine, count + 1));
    sum / f64::from(count)
}

fn variance(values: impl Iterator<Item = f64>) -> f64 {
    let (mut count, mut mean, mut sum) = (0.0, 0.0, 0.0);
    for value in values {
        count += 1.0;
        let from = value - mean;
        mean += from / count;
        sum += from * (value - mean);
    }
    sum / count
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    /// A parent of seven markers that bends, and two branches of two markers, which are stiff at their junctions: the second leaves
    /// so flat that its first marker is nearer to the next one of the parent than to its junction.
    fn recording() -> Recording {
        let frames = 40;
        let row = |frame: usize| {
            let bend = 0.25 + 0.2 * (0.4 * frame as f64).sin();
            let mut markers = vec![Vector3::zeros()];
            let direction = |angle: f64| Vector3::new(angle.cos(), angle.sin(), 0.0);
            for k in 0..6 {
                let last = markers[k];
                markers.push(last + direction(bend * k as f64) * 0.1);
            }
            for (junction, lean) in [(2, -1.6), (4, -0.5)] {
                // As the segment before the junction turns.
                let along = direction(bend * (junction - 1) as f64 + lean);
                let start = markers[junction];
                markers.extend([start + along * 0.09, start + along * 0.16]);
            }
            markers
        };
        let time = (0..frames).map(|frame| 0.01 * frame as f64).collect();
        Recording { path: PathBuf::from("tree"), time, markers: (0..frames).map(row).collect() }
    }

    #[test]
    fn branches_begin_where_the_distance_does_not_change() {
        let recording = recording();
        let near = |a, b| distances(&recording, a, b).fold(0.0, f64::max);
        assert!(near(9, 5) < near(9, 4), "{} {}", near(9, 5), near(9, 4));
        let tree = Tree::of(std::slice::from_ref(&recording), Grips::Ends).unwrap();
        let branches = [(2, 7..9), (4, 9..11)].map(|(junction, markers)| Branch { junction, markers }).to_vec();
        assert_eq!(tree, Tree { parent: 7, branches, grips: Grips::Ends });
        assert_eq!(tree.free().collect::<Vec<_>>(), [2, 3, 4, 7, 8, 9, 10]);
        let neighbours: Vec<_> = tree.neighbours().collect();
        assert_eq!(neighbours[6..], [[2, 7], [7, 8], [4, 9], [9, 10]]);
    }

    #[test]
    fn a_cable_without_branches_is_refused() {
        let mut recording = recording();
        recording.markers.iter_mut().for_each(|markers| markers.truncate(7));
        assert!(Tree::of(&[recording], Grips::Ends).unwrap_err().contains("no branch"));
    }
}
