//! What is known of a cable with branches.

use cosserat::motion::KeyframeError;
use cosserat::state::{Model, State};
use nalgebra::Vector3;

use super::shape::Shape;
use super::twig::Twig;
use super::{Numbers, Tree};
use crate::cable::{Cable, Place};
use crate::recording::Recording;
use crate::specimen::{Specimen, SpecimenError};

/// How often the rods are drawn anew beside the markers: the frames in which these lie beside them turn a little each time.
const DRAWN: usize = 2;

/// What a prediction may know of a recording: its first two frames, and its grips over all time.
#[derive(Clone, Debug)]
pub struct BranchedCable {
    /// Its rods, were they to go through the markers.
    shape: Shape,
    /// Markers in the first two frames [m].
    frames: [Vec<Vector3<f64>>; 2],
    tree: Tree,
    /// Segments between two markers.
    parts: usize,
    /// Where the markers lie that are predicted.
    places: Vec<Place>,
    /// With which marker of the parent each of them goes beside the rod, and in the frame of which segment.
    beside: Vec<Option<(usize, usize)>>,
    free: Vec<usize>,
}

impl BranchedCable {
    /// The cable of a recording, with so many segments between two markers. Its parent is held as a [`Cable`] is.
    ///
    /// # Errors
    /// If the markers of a grip make no motion, because a coordinate is not finite.
    pub fn new(recording: &Recording, tree: &Tree, parts: usize) -> Result<Self, KeyframeError> {
        let frames = [0, 1].map(|frame| recording.markers[frame].clone());
        let of_parent = recording.markers.iter().map(|markers| markers[..tree.parent].to_vec()).collect();
        let parent = Recording { markers: of_parent, ..recording.clone() };
        let parent = Cable::with_junctions(&parent, parts, &tree.junctions(), tree.grips)?;
        let shape = Shape { parent, twigs: Twig::all(&frames, tree, parts) };
        let (places, free): (_, Vec<usize>) = (shape.places(), tree.free().collect());
        let between = tree.between();
        let segment =
            |marker| free.iter().zip(&places).find(|(own, _)| **own == marker).map(|(_, place)| place.segment);
        let goes_with = |&marker: &usize| {
            let on_parent = tree.on_parent(marker);
            segment(on_parent).filter(|_| between.contains(&on_parent)).map(|segment| (on_parent, segment))
        };
        let beside = free.iter().map(goes_with).collect();
        Ok(Self { shape, frames, tree: tree.clone(), parts, places, beside, free })
    }

    /// What [`Numbers::seen`] are of this recording [rad]: the side on which the first branch of each junction leaves the parent in the
    /// first frame, were the parent not twisted, as an angle about the parent's axis from its d1; and the twist between the grips.
    pub fn seen(&self) -> Vec<f64> {
        self.shape.seen()
    }

    /// Its rods, beside which the markers lie as the numbers say.
    pub(super) fn shape(&self, numbers: &Numbers) -> Shape {
        let mut shape = self.shape.clone();
        if numbers.beside.iter().all(|beside| *beside == Vector3::zeros()) {
            return shape;
        }
        for _ in 0..DRAWN {
            let (_, state) = shape.assembled(numbers);
            let mut frames = self.frames.clone();
            for (&marker, beside) in self.free.iter().zip(&self.beside) {
                let beside = off(*beside, numbers, &state);
                frames.iter_mut().for_each(|markers| markers[marker] -= beside);
            }
            let on_parent = frames.each_ref().map(|markers| &markers[..self.tree.parent]);
            let parent = self.shape.parent.through(on_parent, self.parts, &self.tree.junctions(), self.tree.grips);
            shape = Shape { parent, twigs: Twig::all(&frames, &self.tree, self.parts) };
        }
        shape
    }

    /// Where the recorded markers of the parent between the grips lie from their places on the rod in a state, in the frames of its segments
    /// [m].
    pub(super) fn off<'a>(
        &'a self,
        markers: &'a [Vector3<f64>],
        model: &'a Model,
        state: &'a State,
    ) -> impl Iterator<Item = Vector3<f64>> + 'a {
        let between = self.tree.between();
        let own = self.free.iter().zip(&self.places).filter(move |(marker, _)| between.contains(marker));
        own.map(move |(&marker, place)| {
            state.orientations[place.segment].inverse() * (markers[marker] - place.at(model, state))
        })
    }

    /// Its cable.
    pub(super) fn tree(&self) -> &Tree {
        &self.tree
    }
}

/// By how much a marker lies off its place on a rod in a state [m].
fn off(beside: Option<(usize, usize)>, numbers: &Numbers, state: &State) -> Vector3<f64> {
    beside.map_or_else(Vector3::zeros, |(marker, segment)| state.orientations[segment] * numbers.beside[marker])
}

impl Specimen for BranchedCable {
    type Numbers = Numbers;

    fn time(&self) -> &[f64] {
        &self.shape.parent.time
    }

    fn free(&self) -> Vec<usize> {
        self.free.clone()
    }

    fn model(&self, numbers: &Numbers) -> Result<(Model, State), SpecimenError> {
        Ok(self.shape(numbers).assembled(numbers))
    }

    fn markers(&self, numbers: &Numbers, model: &Model, state: &State) -> Vec<Vector3<f64>> {
        let places = self.places.iter().zip(&self.beside);
        places.map(|(place, beside)| place.at(model, state) + off(*beside, numbers, state)).collect()
    }

    fn averaged(
        specimens: &[Self],
        recordings: &[&Recording],
        numbers: &Numbers,
        steps: usize,
        usual: f64,
    ) -> Result<Option<Numbers>, SpecimenError> {
        super::beside::averaged(specimens, recordings, numbers, steps, usual).map(Some)
    }
}
