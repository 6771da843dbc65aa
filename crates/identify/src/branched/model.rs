//! What is known of a cable with branches.

use std::f64::consts::{PI, TAU};

use cosserat::motion::KeyframeError;
use cosserat::state::{Model, State};
use nalgebra::Vector3;

use super::twig::{At, Twig};
use super::{Numbers, Tree};
use crate::cable::{Cable, Place, turn};
use crate::parameter::{Parameter, Parameters};
use crate::recording::Recording;

/// What a prediction may know of a recording: its first two frames, and its grips over all time.
#[derive(Clone, Debug)]
pub struct BranchedCable {
    /// Its rods, were they to go through the markers.
    pub(super) shape: Shape,
    /// Markers in the first two frames [m].
    frames: [Vec<Vector3<f64>>; 2],
    tree: Tree,
    /// Segments between two markers.
    parts: usize,
    /// Where the markers lie that are predicted.
    pub(super) places: Vec<Place>,
    /// With which marker of the parent each of them goes beside the rod, and in the frame of which segment.
    pub(super) beside: Vec<Option<(usize, usize)>>,
    pub(super) free: Vec<usize>,
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
        // Twice, as the frames in which markers lie beside rods turn a little when these are drawn anew.
        for _ in 0..2 {
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
pub(super) fn off(beside: Option<(usize, usize)>, numbers: &Numbers, state: &State) -> Vector3<f64> {
    beside.map_or_else(Vector3::zeros, |(marker, segment)| state.orientations[segment] * numbers.beside[marker])
}

/// The rods of a cable in the first two frames.
#[derive(Clone, Debug)]
pub(super) struct Shape {
    /// The parent between the grips.
    pub(super) parent: Cable,
    /// The rods with a free end: what of the parent lies before a grip in its middle, then the branches.
    pub(super) twigs: Vec<Twig>,
}

impl Shape {
    /// What [`Numbers::seen`] are of this recording [rad]: the side on which the first branch of each junction leaves the parent in the
    /// first frame, were the parent not twisted, as an angle about the parent's axis from its d1; and the twist between the grips.
    pub(super) fn seen(&self) -> Vec<f64> {
        let numbers = Parameters::default();
        let (_, state) = self.parent.assembly(&numbers).finish();
        let sides = self.at_junctions().map(|(segment, twig)| twig.side(&state, segment));
        sides.chain([wrapped(self.parent.twist(&numbers))]).collect()
    }

    /// The first twig of each junction of the parent, with the parent's segment there.
    fn at_junctions(&self) -> impl Iterator<Item = (usize, &Twig)> {
        let on_parent = self.twigs.iter().filter_map(|twig| match twig.at {
            At::Parent { segment } => Some((segment, twig)),
            At::Grip | At::Twig { .. } => None,
        });
        let mut twigs: Vec<(usize, &Twig)> = on_parent.collect();
        twigs.sort_by_key(|(segment, _)| *segment);
        twigs.dedup_by_key(|(segment, _)| *segment);
        twigs.into_iter()
    }

    /// Gives the joints of the parent their rest shape.
    fn bend(&self, model: &mut Model, numbers: &Numbers) {
        let plane = numbers.plane();
        let towards = Vector3::new(-plane.sin(), plane.cos(), 0.0);
        let segments = self.segments();
        let junctions: Vec<usize> = self.at_junctions().map(|(segment, _)| segment).collect();
        let clamps = [(0, segments - 1), (segments, segments)];
        for (node, joint) in clamps.into_iter().chain((1..segments).map(|node| (node, node - 1))) {
            let span = junctions.iter().filter(|junction| **junction < node).count();
            model.joints[joint].rest_darboux += towards * numbers.curvatures[span];
        }
    }

    /// Segments of the parent.
    pub(super) fn segments(&self) -> usize {
        self.parent.first_nodes().len() - 1
    }

    /// By how much each segment of the parent is turned about its axis in the first frame [rad], as the branches show: at a junction
    /// by the angle from the side on which a branch leaves at rest to that on which it is seen, and evenly between. Whole turns are those
    /// with which angles are nearest to the mean of recordings. `drawn`: the parent's state without these turns.
    pub(super) fn turns(&self, numbers: &Numbers, drawn: &State) -> Vec<f64> {
        let mut turns = vec![(0.0, 0.0)];
        // By how much this recording is off the mean.
        let mut off = 0.0;
        for (((segment, twig), &usual), &side) in self.at_junctions().zip(&numbers.seen).zip(&numbers.sides) {
            off += wrapped(twig.side(drawn, segment) - usual - off);
            turns.push((segment as f64 + 0.5, off - side));
        }
        let segments = self.segments();
        let usual = numbers.seen.last().copied().unwrap_or_default() + numbers.parent[Parameter::Roll] + off;
        turns.push((segments as f64, usual + wrapped(self.parent.twist(&numbers.parent) - usual)));
        let at = |i: usize| {
            let place = i as f64 + 0.5;
            let pair = turns.windows(2).find(|pair| place < pair[1].0);
            pair.map_or(0.0, |pair| {
                let [(from, before), (to, after)] = [pair[0], pair[1]];
                before + (after - before) * (place - from) / (to - from)
            })
        };
        (0..segments).map(at).collect()
    }

    /// The model with these numbers, and its state in the first frame.
    ///
    /// The parent begins with the twist that its branches show. Branches leave what they hang on at rest at the angle of the first
    /// frame, and are at rest as they are in it, but for their weight.
    pub(super) fn assembled(&self, numbers: &Numbers) -> (Model, State) {
        let mut assembly = self.parent.assembly(&numbers.parent);
        let turns = self.turns(numbers, assembly.state_mut());
        turn(assembly.state_mut(), &turns);
        self.bend(assembly.model_mut(), numbers);
        Twig::add_all(&self.twigs, &mut assembly, numbers, &self.parent);
        assembly.finish()
    }

    /// Where its markers lie that are not given, by the model's segments, in their order.
    pub(super) fn places(&self) -> Vec<Place> {
        let mut first = self.segments();
        let (mut before, mut after) = (Vec::new(), Vec::new());
        for twig in &self.twigs {
            let own = twig.places.iter().map(|place| Place { segment: first + place.segment, ..*place });
            match twig.at {
                // From the grip to the end, against the parent's order.
                At::Grip => before.extend(own.rev()),
                At::Parent { .. } | At::Twig { .. } => after.extend(own),
            }
            first += twig.segments();
        }
        before.into_iter().chain(self.parent.places.iter().copied()).chain(after).collect()
    }
}

/// The same angle [rad] from minus to plus half a turn.
fn wrapped(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}
