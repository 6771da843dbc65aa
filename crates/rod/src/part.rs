//! Some rods of a model and its state on their own, and all of them in another place.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use crate::{Body, Carried, Change, Changing, Driven, Joint, Load, Model, Motion, Pose, Segment, State};

impl Model {
    /// The segments of `rods`, which must exist, as a model of their own: each range a rod, in this order. With them goes what
    /// belongs to them: joints between them, anchors that those hold on to, loads, motions, and what of the loads changes over
    /// time. Joints to other segments are left out. What is of the world goes along: gravity and its changes, damping,
    /// contacts, air.
    pub fn part(&self, rods: &[Range<usize>]) -> Self {
        // Where segments, anchors and loads are in the part.
        let (mut segments, mut anchors, mut loads) = (HashMap::new(), HashMap::new(), HashMap::new());
        let (mut own_segments, mut own_joints) = (Vec::new(), Vec::new());
        let (mut own_anchors, mut own_loads) = (Vec::new(), Vec::new());
        for (rod, range) in rods.iter().enumerate() {
            for i in range.clone() {
                segments.insert(i, own_segments.len());
                own_segments.push(Segment { rod, ..self.segments[i] });
            }
        }
        let belongs = |body: &Body| match body {
            Body::Segment(i) => segments.contains_key(i),
            Body::Anchor(_) => true,
        };
        for joint in self.joints.iter().filter(|joint| belongs(&joint.a) && belongs(&joint.b)) {
            let [a, b] = [joint.a, joint.b].map(|body| match body {
                Body::Segment(i) => Body::Segment(segments[&i]),
                Body::Anchor(k) => Body::Anchor(*anchors.entry(k).or_insert_with(|| {
                    own_anchors.push(self.anchors[k]);
                    own_anchors.len() - 1
                })),
            });
            own_joints.push(Joint { a, b, ..*joint });
        }
        for (k, load) in self.loads.iter().enumerate() {
            if let Some(&segment) = segments.get(&load.segment) {
                loads.insert(k, own_loads.len());
                own_loads.push(Load { segment, ..*load });
            }
        }
        let own_body = |body: Body| match body {
            Body::Segment(i) => segments.get(&i).map(|&i| Body::Segment(i)),
            Body::Anchor(k) => anchors.get(&k).map(|&k| Body::Anchor(k)),
        };
        let own_change = |of: Changing| match of {
            Changing::Gravity => Some(Changing::Gravity),
            Changing::Force(k) => loads.get(&k).map(|&k| Changing::Force(k)),
            Changing::Torque(k) => loads.get(&k).map(|&k| Changing::Torque(k)),
        };
        let motion = |driven: &Driven| Some(Driven { body: own_body(driven.body)?, ..driven.clone() });
        let change = |change: &Change| Some(Change { of: own_change(change.of)?, ..change.clone() });
        Self {
            segments: own_segments,
            joints: own_joints,
            anchors: own_anchors,
            loads: own_loads,
            motions: self.motions.iter().filter_map(motion).collect(),
            open: self.open.iter().filter_map(|k| anchors.get(k).copied()).collect(),
            changes: self.changes.iter().filter_map(change).collect(),
            gravity: self.gravity,
            damping: self.damping,
            contacts: self.contacts.clone(),
            air: self.air.clone(),
            mistake: self.mistake.clone(),
        }
    }

    /// The same model with all that belongs to its rods moved by `place`, from a point x to `orientation * x + position`, and
    /// all directions along. What is of the world stays: gravity and its changes, obstacles, air.
    pub fn moved(&self, place: &Pose) -> Self {
        let turn = place.orientation;
        let mut moved = self.clone();
        for anchor in &mut moved.anchors {
            anchor.position = turn * anchor.position + place.position;
            anchor.orientation = turn * anchor.orientation;
        }
        for load in &mut moved.loads {
            (load.force, load.torque) = (turn * load.force, turn * load.torque);
        }
        moved.motions = with_motions(&self.motions, |motion| motion.moved(place));
        for change in moved.changes.iter_mut().filter(|change| change.of != Changing::Gravity) {
            change.track = Arc::new(change.track.turned(&turn));
        }
        moved
    }
}

impl State {
    /// The entries of `rods`, which must exist, in this order: see [`Model::part`].
    pub fn part(&self, rods: &[Range<usize>]) -> Self {
        fn own<T: Copy>(all: &[T], rods: &[Range<usize>]) -> Vec<T> {
            rods.iter().flat_map(|rod| &all[rod.clone()]).copied().collect()
        }
        Self {
            positions: own(&self.positions, rods),
            orientations: own(&self.orientations, rods),
            velocities: own(&self.velocities, rods),
            angular_velocities: own(&self.angular_velocities, rods),
        }
    }

    /// The same state moved by `place`, velocities along: see [`Model::moved`].
    pub fn moved(&self, place: &Pose) -> Self {
        let turn = place.orientation;
        Self {
            positions: self.positions.iter().map(|x| turn * x + place.position).collect(),
            orientations: self.orientations.iter().map(|q| turn * q).collect(),
            velocities: self.velocities.iter().map(|v| turn * v).collect(),
            angular_velocities: self.angular_velocities.iter().map(|w| turn * w).collect(),
        }
    }
}

/// The same with motions made anew by `make`: those that share one, whose bodies go on as one rigid body, share the new one.
pub(crate) fn with_motions(all: &[Driven], make: impl Fn(&Motion) -> Motion) -> Vec<Driven> {
    let mut made = HashMap::new();
    let anew = |driven: &Driven| {
        let motion: &Arc<Motion> =
            made.entry(Arc::as_ptr(&driven.carried.motion)).or_insert_with(|| Arc::new(make(&driven.carried.motion)));
        let carried = Carried { motion: motion.clone(), ..driven.carried };
        Driven { carried, ..driven.clone() }
    };
    all.iter().map(anew).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;
    use crate::{Assembly, Material, RodSpec, shape};

    #[test]
    fn what_shares_a_motion_shares_it_in_a_copy_and_with_no_other() {
        let material = Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };
        let mut assembly = Assembly::new(Vector3::zeros());
        let rod = assembly.rod(&RodSpec::new(shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 4), 0.02, material));
        assembly.clamp_start(&rod).clamp_end(&rod);
        let motion = Arc::new(Motion::resting(&assembly.model_mut().anchors[0]));
        for (k, pose) in assembly.model_mut().anchors.clone().iter().enumerate() {
            let driven = Driven::gripped(Body::Anchor(k), motion.clone(), pose, 0.0);
            assembly.model_mut().motions.push(driven);
        }
        let turn = UnitQuaternion::from_euler_angles(0.3, -0.7, 2.0);
        let places = [1.0, 2.0].map(|z| Pose { position: Vector3::z() * z, orientation: turn });
        assembly.copies(&[rod], &places);
        let (model, state) = assembly.finish();
        model.validate(&state).unwrap();
        for (a, b) in (0..6).flat_map(|a| (0..6).map(move |b| (a, b))) {
            let is_shared = Arc::ptr_eq(&model.motions[a].carried.motion, &model.motions[b].carried.motion);
            assert_eq!(is_shared, a / 2 == b / 2, "{a} {b}");
        }
    }
}
