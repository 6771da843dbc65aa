//! Building a model and its first state from rods, branches and clamps.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Quaternion, UnitQuaternion, Vector2, Vector3};

use crate::darboux::{darboux, rotation_of};
use crate::shape::frames;
use crate::{
    Air, Body, BreakableJoint, Change, Changing, Damping, Foundation, Freedom, InelasticJoint, InnerDamping, Joint,
    JointLaw, Load, Material, Model, ModelError, Mount, Pose, RigidBody, Section, Segment, State, Stiffness, Strength,
    Stretch,
};

mod copies;
mod spec;

pub use spec::{RestShape, RodSpec};

/// Half of a joint: what one of its bodies contributes to its compliance.
struct Half {
    length: f64,
    stiffness: Stiffness,
}

/// What a segment is made of, for the joints to come.
#[derive(Clone, Debug)]
struct MadeOf {
    material: Material,
    stretch: Stretch,
    stiffness: Stiffness,
    inner_damping: InnerDamping,
    /// What its joints are if not elastic.
    law: Option<Arc<JointLaw>>,
    /// What its joints bear, if they can break.
    strength: Option<Strength>,
    /// Whether a turn about the axis would make another rod of it.
    has_sides: bool,
}

impl MadeOf {
    /// That of a rigid body, which makes no joints: the rods that are joined to it do.
    const NOTHING: Self = Self {
        material: Material { youngs_modulus: 0.0, torsion_modulus: 0.0, density: 0.0 },
        stretch: Stretch::ZERO_STRETCH,
        stiffness: Stiffness { stretch: 0.0, shear: 0.0, bending: [0.0; 2], torsion: 0.0 },
        inner_damping: InnerDamping::NONE,
        law: None,
        strength: None,
        has_sides: false,
    };
}

/// A [`Model`] and its first [`State`] in the making.
///
/// No step panics or fails. The first one that cannot be done, because it names a segment that does not exist or a rod whose
/// lists are too short, is left out and remembered in [`Model::mistake`], so that [`Model::validate`] says what was wrong.
#[derive(Clone, Debug, Default)]
pub struct Assembly {
    model: Model,
    state: State,
    rods: usize,
    made_of: Vec<MadeOf>,
    /// Strain with which each segment was drawn.
    strains: Vec<f64>,
}

impl Assembly {
    /// Nothing yet, with `gravity` [m/s^2].
    pub fn new(gravity: Vector3<f64>) -> Self {
        Self { model: Model { gravity, ..Model::default() }, ..Self::default() }
    }

    /// Sets the damping.
    pub fn damping(&mut self, damping: Damping) -> &mut Self {
        self.model.damping = damping;
        self
    }

    /// Surrounds all segments with `air`.
    pub fn air(&mut self, air: Air) -> &mut Self {
        self.model.air = Some(air);
        self
    }

    /// Adds a rod at rest (velocities zero) and returns the range of its segments; [`Model::joints_of`] gives its joints.
    ///
    /// A mistake, and no segment, where `spec` has fewer than two nodes, radii, sections or strains that are neither one nor
    /// one a segment, rest vectors that are not one a joint, or a d1 along the axis.
    pub fn rod(&mut self, spec: &RodSpec) -> Range<usize> {
        let first = self.model.segments.len();
        if !self.succeeds(spec.validate(self.rods)) {
            return first..first;
        }
        let mut nodes = spec.nodes.clone();
        if spec.closed {
            nodes.extend(spec.nodes.first());
        }
        let poses = frames(&nodes, spec.twist);
        let roll = match poses.first().map_or(Ok(UnitQuaternion::identity()), |p| spec.roll(&p.orientation, self.rods))
        {
            Ok(roll) => roll,
            Err(mistake) => {
                self.succeeds(Err(mistake));
                return first..first;
            }
        };
        let laws: Vec<Arc<JointLaw>> = spec.laws.iter().cloned().map(Arc::new).collect();
        for (i, pose) in poses.into_iter().enumerate() {
            let (radius, section) = spec.section(i);
            let strain = if spec.strains.len() == 1 { spec.strains[0] } else { spec.strains[i] };
            self.strains.push(strain);
            let is_round = section == Section::Circle { radius };
            self.model.segments.push(Segment {
                length: (nodes[i + 1] - nodes[i]).norm() / (1.0 + strain),
                radius,
                density: spec.material.density,
                line_inertia: (!is_round).then(|| section.line_inertia(&spec.material)),
                added_mass: 0.0,
                fixed: false,
                rod: self.rods,
                body: None,
            });
            let stiffness = section.stiffness(&spec.material);
            self.made_of.push(MadeOf {
                material: spec.material,
                stretch: spec.stretch,
                stiffness,
                inner_damping: spec.inner_damping,
                law: laws.get(if laws.len() == 1 { 0 } else { i }).cloned(),
                strength: spec.strengths.get(if spec.strengths.len() == 1 { 0 } else { i }).copied(),
                has_sides: spec.d1.is_some() || stiffness.bending[0] != stiffness.bending[1],
            });
            self.state.positions.push(pose.position);
            self.state.orientations.push(if spec.d1.is_some() { pose.orientation * roll } else { pose.orientation });
            self.state.velocities.push(Vector3::zeros());
            self.state.angular_velocities.push(Vector3::zeros());
        }
        self.rods += 1;
        let (count, joints) = spec.counts();
        for k in 0..joints {
            let (a, b) = (first + k, first + (k + 1) % count);
            let mut joint = self.joint([(a, 1.0), (b, 0.0)], &[self.half(a), self.half(b)]);
            joint.rest_darboux = self.current_darboux(&joint);
            self.add_joint(joint, &[a, b]);
            if let Some(track) = spec.rests.get(if spec.rests.len() == 1 { 0 } else { k }) {
                let of = Changing::Rest(self.model.joints.len() - 1);
                self.model.changes.push(Change { of, track: track.clone() });
                self.set_last_rest(track.at(0.0));
                continue;
            }
            let rest = match &spec.rest {
                RestShape::Initial => continue,
                RestShape::Straight => Vector3::zeros(),
                RestShape::Uniform(omega) => *omega,
                RestShape::PerJoint(omegas) => omegas[k],
            };
            self.set_last_rest(rest);
        }
        first..first + count
    }

    /// Length [m] of a segment as it was drawn, between its nodes: its own, stretched by its strain. There must be such a
    /// segment.
    pub fn drawn_length(&self, segment: usize) -> f64 {
        self.model.segments[segment].length * (1.0 + self.strains.get(segment).unwrap_or(&0.0))
    }

    /// Joins the start of `branch` (a range returned by [`Assembly::rod`]) to segment `parent`, at `fraction` of its
    /// length (0 its start, 1 its end), at the angle they have now. The joint is made of the branch's material. A mistake
    /// where there is no such segment. The frames of a branch without sides, whose sections bend alike about all axes and
    /// whose d1 was not asked for, are turned about its axis.
    pub fn branch(&mut self, parent: usize, fraction: f64, branch: &Range<usize>) -> &mut Self {
        if !self.has_rod("branch", branch) || !self.has_segments("branch", &[parent]) {
            return self;
        }
        if !self.made_of[branch.clone()].iter().any(|made| made.has_sides) {
            self.align(parent, branch);
        }
        self.join(parent, fraction, branch.start, 0.0)
    }

    /// Turns the material frames of a rod about its axes, so that its first is the smallest rotation away from that of
    /// `parent`. Nothing else changes: sections bend alike about all axes, and rest shapes turn along.
    ///
    /// With the relative rotation (s, u) at rest a joint is softer about u by 1 / s^2 than its material says (its measure
    /// is a sine), without bounds towards a half turn. Roll is no part of a branch's direction and must not matter.
    fn align(&mut self, parent: usize, rod: &Range<usize>) {
        let relative = self.state.orientations[parent].inverse() * self.state.orientations[rod.start];
        if relative.w.hypot(relative.k) < 1e-9 {
            return;
        }
        let roll = UnitQuaternion::from_quaternion(Quaternion::new(relative.w, 0.0, 0.0, -relative.k));
        for i in rod.clone() {
            self.state.orientations[i] *= roll;
        }
        let mut joints = std::mem::take(&mut self.model.joints);
        for (k, joint) in joints.iter_mut().enumerate() {
            let inside = [joint.a, joint.b].map(|body| matches!(body, Body::Segment(i) if rod.contains(&i)));
            match (inside, joint.a, joint.b) {
                ([false, false], ..) => continue,
                ([true, true], ..) => {
                    joint.rest_darboux = roll.inverse() * joint.rest_darboux;
                    let own = self.model.changes.iter_mut().filter(|change| change.of == Changing::Rest(k));
                    own.for_each(|change| change.track = Arc::new(change.track.turned(&roll.inverse())));
                }
                (_, Body::Anchor(anchor), _) | (_, _, Body::Anchor(anchor)) => {
                    self.model.anchors[anchor].orientation *= roll;
                    joint.rest_darboux = roll.inverse() * joint.rest_darboux;
                }
                _ if joint.mount.is_some() => {
                    joint.rest_frames[1] *= roll;
                    joint.rest_darboux = roll.inverse() * joint.rest_darboux;
                }
                // Joined to another rod, at rest as it is.
                _ => {
                    let from_rest = joint.has_rest_frames();
                    joint.rest_frames = [UnitQuaternion::identity(); 2];
                    joint.rest_darboux = self.current_darboux(joint);
                    if from_rest {
                        joint.measure_from_rest(1.0);
                    }
                }
            }
        }
        self.model.joints = joints;
    }

    /// Joins two segments where they are, at fractions of their lengths (0 the start, 1 the end), at rest as they are.
    /// The joint is made of the material of `b` and bends over one segment of `b`. A mistake where there is no such segment.
    /// Where the section of `b` bends unlike about its axes, the joint is measured from rest, in the frame of `b`
    /// ([`Joint::measure_from_rest`]).
    pub fn join(&mut self, a: usize, fraction_a: f64, b: usize, fraction_b: f64) -> &mut Self {
        if !self.has_segments("joint", &[a, b]) {
            return self;
        }
        let half = || self.half(b);
        let mut joint = self.joint([(a, fraction_a), (b, fraction_b)], &[half(), half()]);
        joint.rest_darboux = self.current_darboux(&joint);
        if joint.bend_extra != 0.0 {
            joint.measure_from_rest(1.0);
        }
        self.add_joint(joint, &[b]);
        self
    }

    /// Adds a joint that is made of these segments.
    fn add_joint(&mut self, mut joint: Joint, of: &[usize]) {
        let index = self.model.joints.len();
        let made_of = || of.iter().map(|&i| &self.made_of[i]);
        let law = made_of().filter_map(|made| made.law.clone()).reduce(|a, b| JointLaw::between(&a, &b));
        let rod = |body| if let Body::Segment(i) = body { Some(self.model.segments[i].rod) } else { None };
        // Two rods that are joined stay so.
        let is_glue = joint.mount.is_none() && rod(joint.a).zip(rod(joint.b)).is_some_and(|(a, b)| a != b);
        let strength = made_of().filter_map(|made| made.strength.filter(|_| !is_glue)).reduce(Strength::weaker);
        if let Some(bending) = law.as_ref().and_then(|law| law.bending_stiffness()) {
            (joint.bend_compliance, joint.bend_extra) = (1.0 / (bending * joint.length), 0.0);
        }
        self.model.laws.extend(law.map(|law| InelasticJoint { joint: index, law }));
        self.model.breakable.extend(strength.map(|strength| BreakableJoint { joint: index, strength, broke: None }));
        self.model.joints.push(joint);
    }

    /// Adds a rigid body at `pose`, at rest (velocities zero), and returns the index of its segment.
    pub fn body(&mut self, body: RigidBody, pose: Pose) -> usize {
        self.model.segments.push(Segment::of_body(body, self.rods));
        self.rods += 1;
        self.made_of.push(MadeOf::NOTHING);
        self.strains.push(0.0);
        self.state.positions.push(pose.position);
        self.state.orientations.push(pose.orientation);
        self.state.velocities.push(Vector3::zeros());
        self.state.angular_velocities.push(Vector3::zeros());
        self.model.segments.len() - 1
    }

    /// Joins a segment, at a fraction of its length (0 the start, 1 the end), to a rigid body at a `place` in the body's frame
    /// [m], at the angle they have now. The joint is made of the segment's material and bends over half of it, as a clamped
    /// face. A mistake where there is no such segment.
    pub fn join_body(&mut self, segment: usize, fraction: f64, body: usize, place: &Vector3<f64>) -> &mut Self {
        if !self.has_segments("joint", &[segment, body]) {
            return self;
        }
        let offset = (fraction - 0.5) * self.model.segments[segment].length;
        let ends = [(Body::Segment(segment), offset), (Body::Segment(body), place.z)];
        let joint = self.composed(ends, &[self.half(segment)], segment);
        let [q_a, q_b] = [segment, body].map(|i| self.state.orientations[i]);
        let mount = Mount { across: [Vector2::zeros(), place.xy()] };
        let rest_frames = [UnitQuaternion::identity(), q_b.inverse() * q_a];
        self.add_joint(Joint { mount: Some(mount), rest_frames, ..joint }, &[segment]);
        self
    }

    /// Fixes a segment where it is (the paper's clamp). A mistake where there is no such segment.
    pub fn fix(&mut self, segment: usize) -> &mut Self {
        if self.has_segments("fixed segment", &[segment]) {
            self.model.segments[segment].fixed = true;
        }
        self
    }

    /// Joins the start face of an open rod to the ground, where it is drawn, over half a segment. A mistake where the range holds no segment.
    pub fn clamp_start(&mut self, rod: &Range<usize>) -> &mut Self {
        self.clamp_face(rod, rod.start, -0.5)
    }

    /// Joins the end face of an open rod to the ground, where it is drawn, over half a segment. A mistake where the range holds no segment.
    pub fn clamp_end(&mut self, rod: &Range<usize>) -> &mut Self {
        self.clamp_face(rod, rod.end.saturating_sub(1), 0.5)
    }

    /// Lays segments on springs that pull their centres to where they are drawn, without moments: one anchor and one joint a segment, so that
    /// equilibria, modes and derivatives know them. A rod on N segments turns by itself about each centre.
    pub fn foundation(&mut self, segments: Range<usize>, springs: &Foundation) -> &mut Self {
        // A joint has a stiffness in all directions; with less than a millionth of the others' its rows lose too many digits.
        let softest = 1e-6 * springs.across.max(springs.along);
        if softest <= 0.0 {
            return self;
        }
        for segment in segments {
            if !self.has_segments("foundation", &[segment]) {
                return self;
            }
            let (position, orientation) = (self.state.positions[segment], self.state.orientations[segment]);
            self.model.anchors.push(Pose { position, orientation });
            let anchor = Body::Anchor(self.model.anchors.len() - 1);
            let ends = [(anchor, 0.0), (Body::Segment(segment), 0.0)];
            let joint = self.composed(ends, &[self.half(segment)], segment);
            let yields = |stiffness: f64| 1.0 / (stiffness.max(softest) * self.model.segments[segment].length);
            let joint = Joint {
                stretch_compliance: yields(springs.along),
                shear_compliance: yields(springs.across),
                inner_damping: InnerDamping { stretch: springs.damping, ..InnerDamping::NONE },
                freedom: Freedom::Ball,
                ..joint
            };
            // Springs have neither law nor strength.
            self.model.joints.push(joint);
        }
        self
    }

    /// Adds a load.
    pub fn load(&mut self, load: Load) -> &mut Self {
        self.model.loads.push(load);
        self
    }

    /// Adds `mass` [kg] at the centre of a segment. A mistake where there is no such segment.
    pub fn add_mass(&mut self, segment: usize, mass: f64) -> &mut Self {
        if self.has_segments("added mass", &[segment]) {
            self.model.segments[segment].added_mass += mass;
        }
        self
    }

    /// The state in the making, to give segments their first velocities [m/s], [rad/s].
    pub fn state_mut(&mut self) -> &mut State {
        &mut self.state
    }

    /// The model in the making.
    pub fn model_mut(&mut self) -> &mut Model {
        &mut self.model
    }

    /// The model and its first state; [`Model::validate`] says whether all steps could be done.
    pub fn finish(self) -> (Model, State) {
        (self.model, self.state)
    }

    /// Whether a step can be done; remembers the first that cannot.
    fn succeeds(&mut self, checked: Result<(), ModelError>) -> bool {
        let is_ok = checked.is_ok();
        if let (None, Err(mistake)) = (&self.model.mistake, checked) {
            self.model.mistake = Some(mistake);
        }
        is_ok
    }

    /// Whether rods of this assembly have all these `segments`, asked for by `what`; a mistake if not.
    fn has_segments(&mut self, what: &'static str, segments: &[usize]) -> bool {
        let lists =
            [self.made_of.len(), self.model.segments.len(), self.state.positions.len(), self.state.orientations.len()];
        let count = lists.into_iter().fold(usize::MAX, usize::min);
        let missing = segments.iter().find(|&&segment| segment >= count);
        self.succeeds(missing.map_or(Ok(()), |&to| {
            Err(ModelError::Index { what, index: self.model.joints.len(), target: "segment", to, count })
        }))
    }

    /// Whether `rod` is a range of one or more segments of this assembly; a mistake if not.
    fn has_rod(&mut self, what: &'static str, rod: &Range<usize>) -> bool {
        let (index, allowed) = (self.model.joints.len(), "1 or more".to_owned());
        let none = ModelError::Count { what, index, quantity: "segments", found: 0, allowed };
        let checked = if rod.is_empty() { Err(none) } else { Ok(()) };
        self.succeeds(checked) && self.has_segments(what, &[rod.start, rod.end - 1])
    }

    /// What segment `i` contributes to a joint at one of its ends.
    fn half(&self, i: usize) -> Half {
        Half { length: 0.5 * self.model.segments[i].length, stiffness: self.made_of[i].stiffness }
    }

    /// A joint between segments at fractions of their lengths, of the second one's material, its rest shape straight.
    fn joint(&self, ends: [(usize, f64); 2], halves: &[Half]) -> Joint {
        let end = |(i, fraction): (usize, f64)| (Body::Segment(i), (fraction - 0.5) * self.model.segments[i].length);
        self.composed(ends.map(end), halves, ends[1].0)
    }

    /// Clamps the face of `segment`, an end of `rod`, that lies at `side` of its centre (in lengths).
    fn clamp_face(&mut self, rod: &Range<usize>, segment: usize, side: f64) -> &mut Self {
        if !self.has_rod("clamp", rod) {
            return self;
        }
        let has_neighbour = rod.len() > 1;
        let length = self.model.segments[segment].length;
        let pose = Pose {
            position: self.state.positions[segment] + self.state.axis(segment) * (side * self.drawn_length(segment)),
            orientation: self.state.orientations[segment],
        };
        // The face's direction continues the curvature and the twist of the neighbouring joint over half a segment.
        let at_joint = |j: &&Joint| {
            let end = if side < 0.0 { j.a } else { j.b };
            end == Body::Segment(segment)
        };
        let neighbour = self.model.joints.iter().find(at_joint).filter(|_| has_neighbour);
        let (now, rest) =
            neighbour.map_or((Vector3::zeros(), Vector3::zeros()), |j| (self.current_darboux(j), j.rest_darboux));
        let over_half = rotation_of(&now, 0.5 * length);
        let turn = if side < 0.0 { over_half.inverse() } else { over_half };
        self.model.anchors.push(Pose { orientation: pose.orientation * turn, ..pose });
        let anchor = Body::Anchor(self.model.anchors.len() - 1);
        // Body a comes first along the rod, so that the Darboux vector keeps its sense.
        let own = Body::Segment(segment);
        let own = (own, side * length);
        let ends = if side < 0.0 { [(anchor, 0.0), own] } else { [own, (anchor, 0.0)] };
        let joint = self.composed(ends, &[self.half(segment)], segment);
        self.add_joint(Joint { rest_darboux: rest, ..joint }, &[segment]);
        self
    }

    /// A joint between two bodies at places on their axes [m], whose halves act in series; the material, the way to
    /// stretch and the inner damping are those of segment `made_of`.
    fn composed(&self, [(a, offset_a), (b, offset_b)]: [(Body, f64); 2], halves: &[Half], made_of: usize) -> Joint {
        let MadeOf { material, stretch, inner_damping, .. } = self.made_of[made_of];
        let sum = |stiffness: &dyn Fn(&Stiffness) -> f64| -> f64 {
            halves.iter().map(|half| half.length / stiffness(&half.stiffness)).sum()
        };
        let length: f64 = halves.iter().map(|half| half.length).sum();
        let (stretch_compliance, shear_compliance) = match stretch {
            Stretch::Compliance(alpha) => (alpha, alpha),
            Stretch::Physical => (sum(&|own| own.stretch), sum(&|own| own.shear)),
        };
        let [first, second] = [0, 1].map(|k| sum(&|own| own.bending[k]) / length.powi(2));
        Joint {
            a,
            b,
            offset_a,
            offset_b,
            length,
            rest_darboux: Vector3::zeros(),
            rest_frames: [UnitQuaternion::identity(); 2],
            stretch_compliance,
            shear_compliance,
            shear_extra: 0.0,
            bend_compliance: first,
            bend_extra: second - first,
            twist_compliance: sum(&|own| own.torsion) / length.powi(2),
            inner_damping,
            youngs_modulus: material.youngs_modulus,
            torsion_modulus: material.torsion_modulus,
            mount: None,
            freedom: Freedom::None,
        }
    }

    fn current_darboux(&self, joint: &Joint) -> Vector3<f64> {
        let [a, b] = joint.frames(&self.model, &self.state);
        darboux(&a, &b, joint.length)
    }

    fn set_last_rest(&mut self, rest: Vector3<f64>) {
        if let Some(joint) = self.model.joints.last_mut() {
            joint.rest_darboux = rest;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape;

    const SOFT: Material = Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };

    #[test]
    fn a_uniform_rod_has_the_compliance_of_the_paper() {
        let mut assembly = Assembly::new(Vector3::zeros());
        assembly.rod(&RodSpec::new(shape::straight(Vector3::zeros(), Vector3::x(), 3.0, 30), 0.05, SOFT));
        let (model, state) = assembly.finish();
        model.validate(&state).unwrap();
        assert_eq!((model.segments.len(), model.joints.len()), (30, 29));
        let joint = model.joints[7];
        let own = Section::Circle { radius: 0.05 }.stiffness(&SOFT);
        assert!((joint.bend_compliance * 0.1 * own.bending[0] - 1.0).abs() < 1e-12 && joint.bend_extra == 0.0);
        assert!((joint.twist_compliance * 0.1 * own.torsion - 1.0).abs() < 1e-12);
        assert!(joint.rest_darboux.norm() < 1e-12);
    }

    #[test]
    fn a_clamped_face_bends_over_half_a_segment() {
        let mut assembly = Assembly::new(Vector3::zeros());
        let rod = assembly.rod(&RodSpec::new(shape::helix(Vector3::zeros(), 0.5, 0.5, 2.5, 60), 0.05, SOFT));
        assembly.clamp_start(&rod).clamp_end(&rod);
        let (model, state) = assembly.finish();
        model.validate(&state).unwrap();
        for joint in &model.joints[59..] {
            assert!((joint.length / (0.5 * model.segments[0].length) - 1.0).abs() < 1e-12);
            let now = darboux(
                &model.pose(joint.a, &state).orientation,
                &model.pose(joint.b, &state).orientation,
                joint.length,
            );
            assert!((now - joint.rest_darboux).norm() < 1e-9);
        }
    }

    #[test]
    fn a_strained_rod_pulls_alike_everywhere() {
        let (tension, taper) = (3.0, vec![0.05, 0.04, 0.03, 0.02]);
        let strains: Vec<f64> =
            taper.iter().map(|&r| tension / (SOFT.youngs_modulus * Section::Circle { radius: r }.area())).collect();
        let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 4);
        for closed in [false, true] {
            let mut assembly = Assembly::new(Vector3::zeros());
            let nodes = if closed { shape::ring(Vector3::zeros(), 1.0, 4) } else { nodes.clone() };
            let (radii, strains) = (taper.clone(), strains.clone());
            let spec = RodSpec { closed, radii, strains, stretch: Stretch::Physical, ..RodSpec::new(nodes, 0.0, SOFT) };
            let rod = assembly.rod(&spec);
            if !closed {
                assembly.clamp_start(&rod).clamp_end(&rod);
            }
            let (model, state) = assembly.finish();
            model.validate(&state).unwrap();
            for joint in model.joints.iter().filter(|_| !closed) {
                let pull = -crate::measure::stretch_gap(&model, &state, joint).x / joint.stretch_compliance;
                assert!((pull / tension - 1.0).abs() < 1e-12, "{pull} N");
            }
            for (segment, strain) in model.segments.iter().zip(&spec.strains) {
                let drawn = if closed { 2f64.sqrt() } else { 0.25 };
                assert!((segment.length * (1.0 + strain) / drawn - 1.0).abs() < 1e-12);
            }
        }
        let wrong = RodSpec { strains: vec![0.0; 3], ..RodSpec::new(nodes, 0.05, SOFT) };
        let mut assembly = Assembly::new(Vector3::zeros());
        assert!(assembly.rod(&wrong).is_empty() && assembly.finish().0.mistake.is_some());
    }

    #[test]
    fn a_ring_closes() {
        let mut assembly = Assembly::new(Vector3::zeros());
        let nodes = shape::ring(Vector3::zeros(), 1.0, 20);
        assembly.rod(&RodSpec { closed: true, ..RodSpec::new(nodes, 0.05, SOFT) });
        let (model, state) = assembly.finish();
        model.validate(&state).unwrap();
        assert_eq!((model.segments.len(), model.joints.len()), (20, 20));
        let joint = model.joints[19];
        assert_eq!((joint.a, joint.b), (Body::Segment(19), Body::Segment(0)));
        let gap = state.positions[19] + state.axis(19) * joint.offset_a
            - (state.positions[0] + state.axis(0) * joint.offset_b);
        assert!(gap.norm() < 1e-12);
    }

    #[test]
    fn a_branch_turns_its_frames_to_its_parent_and_keeps_its_shape() {
        let mut assembly = Assembly::new(Vector3::zeros());
        let trunk = assembly.rod(&RodSpec::new(shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 4), 0.05, SOFT));
        let nodes = shape::helix(Vector3::x(), 0.2, 0.5, 0.5, 12);
        let rest = RestShape::Uniform(Vector3::new(1.0, 2.0, 3.0));
        let rod = assembly.rod(&RodSpec { rest, ..RodSpec::new(nodes.clone(), 0.02, SOFT) });
        let twig = assembly.rod(&RodSpec::new(shape::straight(nodes[6], -Vector3::x(), 0.3, 3), 0.01, SOFT));
        assembly.branch(rod.start + 5, 1.0, &twig).clamp_end(&rod);
        let (before, state_before) = assembly.clone().finish();
        assembly.branch(trunk.end - 1, 1.0, &rod);
        let (model, state) = assembly.finish();
        // World axes of the strains, and so energies, stay.
        for (old, new) in before.joints.iter().zip(&model.joints) {
            let strain = |model: &Model, state: &State, joint: &Joint| {
                model.pose(joint.a, state).orientation * crate::measure::bend_strain(model, state, joint)
            };
            let change = strain(&before, &state_before, old) - strain(&model, &state, new);
            assert!(change.norm() < 1e-12, "{change}");
        }
        let joint = model.joints.last().unwrap();
        let relative = state.orientations[trunk.end - 1].inverse() * state.orientations[rod.start];
        let angle = state.axis(trunk.end - 1).angle(&state.axis(rod.start));
        assert!((relative.angle() - angle).abs() < 1e-12);
        assert!(crate::measure::bend_strain(&model, &state, joint).norm() < 1e-12);
    }
}
