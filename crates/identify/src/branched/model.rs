//! The model of a cable with branches.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use cosserat::assembly::{Assembly, InnerDamping, Material, RestShape, RodSpec};
use cosserat::motion::KeyframeError;
use cosserat::state::{Model, State};
use nalgebra::Vector3;

use super::{Numbers, Tree};
use crate::cable::{Cable, DENSITY, Place, RADIUS, set_velocities, turn, youngs_modulus};
use crate::parameter::{Parameter, Parameters};
use crate::recording::{GRIPPED, Recording};
use crate::specimen::Specimen;
use crate::specimen::SpecimenError;
use crate::spline;

/// What a prediction may know of a recording: its first two frames, and its grips over all time.
#[derive(Clone, Debug)]
pub struct BranchedCable {
    pub(super) parent: Cable,
    pub(super) twigs: Vec<Twig>,
    /// Its markers that are predicted.
    free: Vec<usize>,
}

/// How a branch begins.
#[derive(Clone, Debug)]
pub(super) struct Twig {
    /// The parent's segment in whose middle it hangs.
    pub(super) junction: usize,
    /// Segments between two markers.
    parts: usize,
    /// Its nodes [m] in the first two frames; the first is on the parent.
    pub(super) nodes: [Vec<Vector3<f64>>; 2],
}

impl BranchedCable {
    /// The cable of a recording, with so many segments between two markers. Its parent is held as a [`Cable`] is.
    ///
    /// # Errors
    /// If the markers of a grip make no motion, because a coordinate is not finite.
    pub fn new(recording: &Recording, tree: &Tree, parts: usize) -> Result<Self, KeyframeError> {
        let of_parent = recording.markers.iter().map(|markers| markers[..tree.parent].to_vec()).collect();
        let parent = Recording { markers: of_parent, ..recording.clone() };
        let mut junctions: Vec<usize> = tree.branches.iter().map(|branch| branch.junction).collect();
        junctions.sort_unstable();
        junctions.dedup();
        let twig = |branch: &super::Branch| {
            let nodes = [0, 1].map(|frame| {
                let markers = &recording.markers[frame];
                let points: Vec<_> = std::iter::once(markers[branch.junction])
                    .chain(markers[branch.markers.clone()].iter().copied())
                    .collect();
                spline::through(&points, parts)
            });
            let before = junctions.iter().filter(|junction| **junction < branch.junction).count();
            Twig { junction: (branch.junction + 1 - GRIPPED) * parts + before, parts, nodes }
        };
        let twigs = tree.branches.iter().map(twig).collect();
        Ok(Self { parent: Cable::with_junctions(&parent, parts, &junctions)?, twigs, free: tree.free().collect() })
    }

    /// On which side of the parent each branch leaves it in the first frame, were the parent not twisted: angle about the parent's
    /// axis from its d1 [rad].
    pub fn sides(&self) -> Vec<f64> {
        let (_, state) = self.parent.assembly(&Parameters::default()).finish();
        self.twigs.iter().map(|twig| twig.side(&state)).collect()
    }

    /// Gives the joints of the parent their rest shape.
    fn bend(&self, model: &mut Model, numbers: &Numbers) {
        let towards = Vector3::new(-numbers.side.sin(), numbers.side.cos(), 0.0);
        let segments = self.segments();
        let clamps = [(0, segments - 1), (segments, segments)];
        for (node, joint) in clamps.into_iter().chain((1..segments).map(|node| (node, node - 1))) {
            let span = self.twigs.iter().filter(|twig| twig.junction < node).count();
            // Half of a kink at each end of the junction's segment.
            let is_here = |twig: &Twig| twig.junction == node || twig.junction + 1 == node;
            let kinks = self.twigs.iter().zip(&numbers.kinks).filter(|(twig, _)| is_here(twig));
            let joint = &mut model.joints[joint];
            let kink: f64 = kinks.map(|(_, kink)| 2.0 * (0.25 * kink).sin() / joint.length).sum();
            joint.rest_darboux += towards * (numbers.curvatures[span] + kink);
        }
    }

    /// Segments of the parent.
    pub(super) fn segments(&self) -> usize {
        self.parent.first_nodes().len() - 1
    }

    /// By how much each segment of the parent is turned about its axis in the first frame [rad], as the branches show: where one
    /// hangs, by the angle from the side on which it leaves at rest to that on which it is seen, and evenly between. `drawn`: the parent's
    /// state without these turns.
    pub(super) fn turns(&self, numbers: &Numbers, drawn: &State) -> Vec<f64> {
        let mut turns = vec![(0.0, 0.0)];
        let mut seen = |place: f64, angle: f64| {
            let (_, before): (f64, f64) = turns[turns.len() - 1];
            turns.push((place, before + (angle - before + PI).rem_euclid(TAU) - PI));
        };
        let mut twigs: Vec<&Twig> = self.twigs.iter().collect();
        twigs.sort_by_key(|twig| twig.junction);
        twigs.dedup_by_key(|twig| twig.junction);
        twigs.iter().for_each(|twig| seen(twig.junction as f64 + 0.5, twig.side(drawn) - numbers.side));
        let segments = self.segments();
        seen(segments as f64, self.parent.held(&numbers.parent)[1].z);
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
    /// The parent begins with the twist that its branches show. Branches leave the parent at rest at the angle of the first frame, and
    /// are at rest as they are in it, but for their weight.
    pub(super) fn assembled(&self, numbers: &Numbers) -> (Model, State) {
        let mut assembly = self.parent.assembly(&numbers.parent);
        let turns = self.turns(numbers, assembly.state_mut());
        turn(assembly.state_mut(), &turns);
        self.bend(assembly.model_mut(), numbers);
        for twig in &self.twigs {
            self.add(&mut assembly, twig, numbers);
        }
        assembly.finish()
    }

    /// Adds a branch.
    fn add(&self, assembly: &mut Assembly, twig: &Twig, numbers: &Numbers) {
        let tau = numbers.parent[Parameter::InnerDamping];
        let rod = assembly.rod(&RodSpec {
            inner_damping: InnerDamping { bending: tau, twist: tau, stretch: 0.0 },
            rest: RestShape::Initial,
            ..RodSpec::new(twig.nodes[0].clone(), RADIUS, twig.material(numbers))
        });
        assembly.branch(twig.junction, 0.5, &rod);
        if let Some(joint) = assembly.model_mut().joints.last_mut() {
            joint.measure_from_rest(1.0);
            // It bends over the half of the branch's first segment; the parent's half is the parent's own.
            joint.bend_compliance *= 0.5;
            joint.twist_compliance *= 0.5;
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
}

impl Specimen for BranchedCable {
    type Numbers = Numbers;

    fn time(&self) -> &[f64] {
        &self.parent.time
    }

    fn free(&self) -> Vec<usize> {
        self.free.clone()
    }

    fn model(&self, numbers: &Numbers) -> Result<(Model, State), SpecimenError> {
        Ok(self.assembled(numbers))
    }

    fn markers(&self, _: &Numbers, model: &Model, state: &State) -> Vec<Vector3<f64>> {
        let mut first = self.segments();
        let mut places = self.parent.places.clone();
        for twig in &self.twigs {
            let segments = twig.nodes[0].len() - 1;
            let nodes = (twig.parts..=segments).step_by(twig.parts);
            places.extend(nodes.map(|node| Place::end_of(first + node - 1)));
            first += segments;
        }
        places.into_iter().map(|place| place.at(model, state)).collect()
    }
}

impl Twig {
    /// What it is made of.
    pub(super) fn material(&self, numbers: &Numbers) -> Material {
        let youngs_modulus = youngs_modulus(&numbers.parent) * numbers.branch_bending * numbers.branch_mass;
        Material {
            youngs_modulus,
            torsion_modulus: 0.5 * numbers.parent[Parameter::Twist] * youngs_modulus,
            density: DENSITY * numbers.branch_mass,
        }
    }

    /// On which side of the parent's segment at the junction the branch begins: angle from d1 [rad].
    fn side(&self, state: &State) -> f64 {
        let begin = self.nodes[0][1] - self.nodes[0][0];
        let local = state.orientations[self.junction].inverse() * begin;
        local.y.atan2(local.x)
    }
}
