//! Several models and their states as one.

use crate::part::with_motions;
use crate::{
    Body, BreakableJoint, Changing, Driven, InelasticJoint, InternalVariables, Joint, Lift, Load, Model, Motion,
    Pulley, Segment, Sheath, SlidingJoint, State,
};

impl Model {
    /// Adds another model beside this one: its segments, joints, anchors, loads, motions and sheaths, and what of its loads changes
    /// over time, each after those that there are. What is of the world stays this model's: gravity and its changes, damping,
    /// all other contacts, air, and the strain measure.
    pub fn append(&mut self, other: &Model) {
        self.append_after(self.rods(), other);
    }

    /// Number of rods: one more than the largest index that a segment has.
    pub fn rods(&self) -> usize {
        self.segments.iter().map(|segment| segment.rod + 1).max().unwrap_or(0)
    }

    /// [`Model::append`] to a model of so many `rods`, for who appends many and counts them.
    pub fn append_after(&mut self, rods: usize, other: &Model) {
        let (segments, anchors, loads) = (self.segments.len(), self.anchors.len(), self.loads.len());
        let moved = |body: Body| body.shifted(segments, anchors);
        // Every field stands here, so that whoever adds one says what becomes of it.
        let Model {
            segments: _,
            joints,
            strain_measure: _,
            anchors: _,
            loads: _,
            lifts,
            motions,
            sliding_joints,
            pulleys,
            laws,
            breakable,
            open,
            changes,
            gravity: _,
            damping: _,
            contacts,
            air: _,
            mistake,
        } = other;
        self.segments.extend(other.segments.iter().map(|own| Segment { rod: own.rod + rods, ..own.clone() }));
        self.joints.extend(joints.iter().map(|own| Joint { a: moved(own.a), b: moved(own.b), ..*own }));
        self.anchors.extend(&other.anchors);
        self.loads.extend(other.loads.iter().map(|own| Load { segment: own.segment + segments, ..*own }));
        self.lifts.extend(lifts.iter().map(|own| Lift { load: own.load + loads, ..*own }));
        self.sliding_joints.extend(sliding_joints.iter().map(|own| SlidingJoint {
            segments: own.segments.start + segments..own.segments.end + segments,
            holder: moved(own.holder),
            ..own.clone()
        }));
        self.pulleys.extend(pulleys.iter().map(|own| Pulley {
            segments: own.segments.start + segments..own.segments.end + segments,
            holder: moved(own.holder),
            ..own.clone()
        }));
        self.contacts.sheaths.extend(contacts.sheaths.iter().map(|own| Sheath {
            inner: own.inner.start + segments..own.inner.end + segments,
            outer: own.outer.start + segments..own.outer.end + segments,
            ..own.clone()
        }));
        let joints = self.joints.len() - joints.len();
        self.laws.extend(laws.iter().map(|own| InelasticJoint { joint: own.joint + joints, law: own.law.clone() }));
        self.breakable.extend(breakable.iter().map(|own| BreakableJoint { joint: own.joint + joints, ..*own }));
        self.open.extend(open.iter().map(|anchor| anchor + anchors));
        // What one motion drives goes on as one rigid body: each model keeps motions of its own.
        let motions = with_motions(motions, Motion::clone);
        self.motions.extend(motions.into_iter().map(|own| Driven { body: moved(own.body), ..own }));
        self.changes.extend(changes.iter().filter(|own| own.of != Changing::Gravity).map(|own| {
            let mut change = own.clone();
            change.of = match own.of {
                Changing::Gravity => Changing::Gravity,
                Changing::Force(i) => Changing::Force(i + loads),
                Changing::Torque(i) => Changing::Torque(i + loads),
                Changing::Rest(i) => Changing::Rest(i + joints),
            };
            change
        }));
        if self.mistake.is_none() {
            self.mistake.clone_from(mistake);
        }
    }
}

impl Body {
    /// The body of a model that so many segments and anchors have been put in front of.
    pub fn shifted(self, segments: usize, anchors: usize) -> Self {
        match self {
            Body::Segment(i) => Body::Segment(i + segments),
            Body::Anchor(i) => Body::Anchor(i + anchors),
        }
    }
}

impl State {
    /// Adds the entries of another state after those that there are; internal variables, which are by the order of laws, after those of
    /// `laws` laws, the number of this state's model.
    pub fn append(&mut self, other: &State, laws: usize) {
        self.positions.extend(&other.positions);
        self.orientations.extend(&other.orientations);
        self.velocities.extend(&other.velocities);
        self.angular_velocities.extend(&other.angular_velocities);
        if !other.internals.is_empty() {
            self.internals.resize_with(laws, InternalVariables::default);
            self.internals.extend_from_slice(&other.internals);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::Vector3;

    use super::*;
    use crate::{Assembly, Change, Interpolation, Material, RodSpec, Track, measure, shape};

    /// A rod of so many segments with all that an index can point to.
    fn one(segments: usize, height: f64) -> (Model, State) {
        let material = Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };
        let mut assembly = Assembly::new(Vector3::z() * -9.81);
        let nodes = shape::straight(Vector3::z() * height, Vector3::x(), 1.0, segments);
        let rod = assembly.rod(&RodSpec::new(nodes, 0.01, material));
        assembly.clamp_start(&rod).fix(rod.end - 1);
        let load = Load {
            segment: rod.start + 1,
            offset: 0.0,
            force: Vector3::y() * height,
            torque: Vector3::zeros(),
            follows: false,
        };
        assembly.load(load);
        let (mut model, state) = assembly.finish();
        let motion = Motion::through(&[(0.0, model.anchors[0])], Interpolation::Linear).unwrap();
        model.motions.push(Driven::new(Body::Anchor(0), Arc::new(motion)));
        let track = Track::new(&[(0.0, Vector3::y() * height)], Interpolation::Linear).unwrap();
        model.changes.push(Change { of: Changing::Force(0), track: Arc::new(track) });
        (model, state)
    }

    #[test]
    fn two_models_are_one_that_holds_both() {
        let ((mut model, mut state), (second, second_state)) = (one(4, 1.0), one(6, 2.0));
        let energies = [measure::energy(&model, &state), measure::energy(&second, &second_state)];
        model.append(&second);
        state.append(&second_state, 0);
        model.validate(&state).unwrap();
        let together = measure::energy(&model, &state).total();
        let sum = energies[0].total() + energies[1].total();
        assert!((together - sum).abs() < 1e-12 * sum.abs(), "{together} J, {sum} J");
        assert_eq!((model.segments[4].rod, model.loads[1].segment, model.anchors.len()), (1, 5, 2));
        assert_eq!((model.motions[1].body, model.changes[1].of), (Body::Anchor(1), Changing::Force(1)));
        let joints = model.joints_of(&(4..10));
        assert_eq!(joints.len(), 6, "five between segments and the clamp");
        assert_eq!(model.joints[joints[0]].a, Body::Anchor(1));
        let part = model.part((4..10).collect());
        let own = part.state(&state);
        let mut alone = part.model;
        alone.segments.iter_mut().for_each(|segment| segment.rod -= 1);
        assert_eq!((alone, own), (second, second_state));
    }
}
