//! The model of a cable with branches, and predictions with it.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use nalgebra::{UnitQuaternion, Vector3};
use rayon::prelude::*;
use rod::{Assembly, InnerDamping, KeyframeError, Material, Model, RestShape, RodSpec, State};
use solver::simulation::SimulationError;

use super::{Numbers, Tree};
use crate::cable::{Cable, DENSITY, RADIUS, set_velocities, youngs_modulus};
use crate::parameter::{Parameter, Parameters};
use crate::predict::{Prediction, end_of, simulated};
use crate::recording::{GRIPPED, Recording};
use crate::spline;

/// What a prediction may know of a recording: its first two frames, and its grips over all time.
#[derive(Clone, Debug)]
pub struct BranchedCable {
    parent: Cable,
    twigs: Vec<Twig>,
}

/// How a branch begins.
#[derive(Clone, Debug)]
struct Twig {
    /// Node of the parent where it hangs.
    junction: usize,
    /// Its nodes [m] in the first two frames; the first is the parent's.
    nodes: [Vec<Vector3<f64>>; 2],
}

impl BranchedCable {
    /// The cable of a recording, with so many segments between two markers. Its parent is held as a [`Cable`] is.
    ///
    /// # Errors
    /// If the markers of a grip make no motion, because a coordinate is not finite.
    pub fn new(recording: &Recording, tree: &Tree, parts: usize) -> Result<Self, KeyframeError> {
        let of_parent = recording.markers.iter().map(|markers| markers[..tree.parent].to_vec()).collect();
        let parent = Recording { markers: of_parent, ..recording.clone() };
        let twig = |branch: &super::Branch| {
            let nodes = [0, 1].map(|frame| {
                let markers = &recording.markers[frame];
                let points: Vec<_> = std::iter::once(markers[branch.junction])
                    .chain(markers[branch.markers.clone()].iter().copied())
                    .collect();
                spline::through(&points, parts)
            });
            Twig { junction: (branch.junction + 1 - GRIPPED) * parts, nodes }
        };
        Ok(Self { parent: Cable::new(&parent, parts)?, twigs: tree.branches.iter().map(twig).collect() })
    }

    /// On which side of the parent each branch leaves it in the first frame, were the parent not twisted: angle about the parent's
    /// axis from its d1 [rad].
    pub fn sides(&self) -> Vec<f64> {
        let (_, state) = self.parent.assembly(&Parameters::default()).finish();
        self.twigs.iter().map(|twig| twig.side(&state)).collect()
    }

    /// The model of the cable with these numbers, and its state in the first frame.
    ///
    /// The parent begins with the twist that its branches show: where a branch hangs, it is turned by the angle from the side on which
    /// the branch leaves it at rest to that on which it is seen, and evenly between. Branches leave the parent at rest at the angle of
    /// the first frame, and are at rest as they are in it.
    pub fn model(&self, numbers: &Numbers) -> (Model, State) {
        let mut assembly = self.parent.assembly(&numbers.parent);
        self.twist(assembly.state_mut(), numbers);
        self.bend(assembly.model_mut(), numbers);
        for twig in &self.twigs {
            self.add(&mut assembly, twig, numbers);
        }
        assembly.finish()
    }

    /// Gives the joints of the parent their rest shape.
    fn bend(&self, model: &mut Model, numbers: &Numbers) {
        let towards = Vector3::new(-numbers.side.sin(), numbers.side.cos(), 0.0);
        let segments = self.segments();
        let clamps = [(0, segments - 1), (segments, segments)];
        for (node, joint) in clamps.into_iter().chain((1..segments).map(|node| (node, node - 1))) {
            let span = self.twigs.iter().filter(|twig| twig.junction < node).count();
            let kinks = self.twigs.iter().zip(&numbers.kinks).filter(|(twig, _)| twig.junction == node);
            let joint = &mut model.joints[joint];
            let kink: f64 = kinks.map(|(_, kink)| 2.0 * (0.5 * kink).sin() / joint.length).sum();
            joint.rest_darboux += towards * (numbers.curvatures[span] + kink);
        }
    }

    /// Segments of the parent.
    fn segments(&self) -> usize {
        self.parent.first_nodes().len() - 1
    }

    /// Twists the parent as the branches show.
    fn twist(&self, state: &mut State, numbers: &Numbers) {
        let mut turns = vec![(0.0, 0.0)];
        let mut turn = |node: usize, angle: f64| {
            let (_, before): (f64, f64) = turns[turns.len() - 1];
            turns.push((node as f64, before + (angle - before + PI).rem_euclid(TAU) - PI));
        };
        let mut twigs: Vec<&Twig> = self.twigs.iter().collect();
        twigs.sort_by_key(|twig| twig.junction);
        twigs.dedup_by_key(|twig| twig.junction);
        twigs.iter().for_each(|twig| turn(twig.junction, twig.side(state) - numbers.side));
        let segments = self.segments();
        turn(segments, self.parent.twisted(&numbers.parent));
        for i in 0..segments {
            let place = i as f64 + 0.5;
            let Some(pair) = turns.windows(2).find(|pair| place < pair[1].0) else { continue };
            let [(from, before), (to, after)] = [pair[0], pair[1]];
            let angle = before + (after - before) * (place - from) / (to - from);
            state.orientations[i] *= UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        }
    }

    /// Adds a branch.
    fn add(&self, assembly: &mut Assembly, twig: &Twig, numbers: &Numbers) {
        let tau = numbers.parent[Parameter::InnerDamping];
        let youngs = youngs_modulus(&numbers.parent) * numbers.branch_bending * numbers.branch_mass;
        let material = Material {
            youngs_modulus: youngs,
            torsion_modulus: 0.5 * numbers.parent[Parameter::Twist] * youngs,
            density: DENSITY * numbers.branch_mass,
        };
        let rod = assembly.rod(&RodSpec {
            inner_damping: InnerDamping { bending: tau, twist: tau, stretch: 0.0 },
            rest: RestShape::Initial,
            ..RodSpec::new(twig.nodes[0].clone(), RADIUS, material)
        });
        assembly.branch(twig.junction - 1, 1.0, &rod);
        if let Some(joint) = assembly.model_mut().joints.last_mut() {
            joint.measure_from_rest(1.0);
        }
        self.balance(assembly, &rod);
        set_velocities(assembly.state_mut(), rod.start, &twig.nodes, self.parent.interval());
    }

    /// Gives the joints of a branch, whose last joint is that to the parent, the rest shape with which it hangs as it is drawn under gravity.
    fn balance(&self, assembly: &mut Assembly, rod: &Range<usize>) {
        let State { positions, orientations, .. } = assembly.state_mut().clone();
        let model = assembly.model_mut();
        let count = model.joints.len();
        let (mut weight, mut moment) = (Vector3::zeros(), Vector3::zeros());
        let mut at = positions[rod.end - 1];
        for segment in rod.clone().rev() {
            let half = orientations[segment] * Vector3::z() * (0.5 * model.segments[segment].length);
            let start = positions[segment] - half;
            let own = model.gravity * model.segments[segment].mass();
            // About the segment's start: of what hangs beyond it, and of itself.
            moment += (at - start).cross(&weight) + half.cross(&own);
            weight += own;
            at = start;
            let joint = if segment == rod.start { count - 1 } else { count - 1 - (rod.end - segment) };
            let joint = &mut model.joints[joint];
            let local = orientations[segment].inverse() * moment;
            let soft = Vector3::new(joint.bend_compliance, joint.bend_compliance, joint.twist_compliance);
            joint.rest_darboux -= local.component_mul(&soft) * joint.length;
        }
    }

    /// The free markers.
    fn markers(&self, model: &Model, state: &State) -> Vec<Vector3<f64>> {
        let mut first = self.segments();
        let mut nodes: Vec<usize> = self.parent.marker_nodes().collect();
        for twig in &self.twigs {
            let segments = twig.nodes[0].len() - 1;
            nodes.extend((self.parent.parts..=segments).step_by(self.parent.parts).map(|node| first + node));
            first += segments;
        }
        nodes.into_iter().map(|node| end_of(model, state, node)).collect()
    }
}

impl Twig {
    /// On which side of the parent's segment before the junction the branch begins: angle from d1 [rad].
    fn side(&self, state: &State) -> f64 {
        let begin = self.nodes[0][1] - self.nodes[0][0];
        let local = state.orientations[self.junction - 1].inverse() * begin;
        local.y.atan2(local.x)
    }
}

/// Predicts `frames` frames of each cable, in `steps` steps from frame to frame, all on rayon's threads, with the same bits on any
/// number of them.
///
/// # Errors
/// If a model is not valid.
pub fn predict(
    cables: &[BranchedCable],
    numbers: &Numbers,
    frames: usize,
    steps: usize,
) -> Result<Vec<Prediction>, SimulationError> {
    cables.par_iter().map(|cable| alone(cable, numbers, frames, steps)).collect()
}

/// Predicts a cable.
pub(super) fn alone(
    cable: &BranchedCable,
    numbers: &Numbers,
    frames: usize,
    steps: usize,
) -> Result<Prediction, SimulationError> {
    let time = &cable.parent.time[..cable.parent.time.len().min(frames)];
    let mut markers = Vec::with_capacity(time.len());
    let watch = &mut |_, model: &Model, state: &State| markers.push(cable.markers(model, state));
    let unsolved = simulated(&[cable.model(numbers)], &[time], steps, watch)?[0];
    Ok(Prediction { markers, unsolved })
}
