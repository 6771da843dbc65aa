//! A part of a model: some of its rods with all that belongs to them, as if there were no others; and a model in another place.

use std::collections::{BTreeSet, HashMap};
use std::ops::Range;
use std::sync::Arc;

use crate::{
    Body, BreakableJoint, Carried, Change, Changing, Contacts, Driven, InelasticJoint, JointForce, Lift, Load, Model,
    Motion, Pose, Pulley, Sheath, SlidingJoint, State,
};

/// Some rods of a model without the others: see [`Model::part`].
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// The rods as a model of their own.
    pub model: Model,
    /// Which segment of the whole each one is.
    pub segments: Vec<usize>,
    /// Which joint of the whole each one is, ascending.
    pub joints: Vec<usize>,
    /// Which entry of the whole's laws each one is, ascending.
    pub laws: Vec<usize>,
}

impl Model {
    /// The part that has these segments, which must exist, in this order (the numbers of their rods stay), with the joints
    /// between them and to anchors, anchors, loads and motions; gravity, air, contacts and obstacles are the whole's. Joints to
    /// other segments are left out, and so it does not move as the whole does.
    pub fn part(&self, segments: Vec<usize>) -> Part {
        let places = |list: &[usize]| list.iter().enumerate().map(|(new, &old)| (old, new)).collect();
        let of_segment: HashMap<usize, usize> = places(&segments);
        let has_body = |body| matches!(body, Body::Segment(i) if of_segment.contains_key(&i));
        let anchor = |body| if let Body::Anchor(k) = body { Some(k) } else { None };
        let is_anchor = |body| anchor(body).is_some();
        let stays = |[a, b]: [Body; 2]| {
            (has_body(a) || is_anchor(a)) && (has_body(b) || is_anchor(b)) && !(is_anchor(a) && is_anchor(b))
        };
        let ends = |k: usize| [self.joints[k].a, self.joints[k].b];
        let joints: Vec<usize> = (0..self.joints.len()).filter(|&k| stays(ends(k))).collect();
        let segments_of = |segments: &Range<usize>| {
            let first = *of_segment.get(&segments.start)?;
            let stays = segments.clone().enumerate().all(|(k, i)| of_segment.get(&i) == Some(&(first + k)));
            stays.then_some(first..first + segments.len())
        };
        let eyelets = self.sliding_joints.iter().filter(|joint| segments_of(&joint.segments).is_some());
        let pulleys = self.pulleys.iter().filter(|pulley| segments_of(&pulley.segments).is_some());
        let holders = eyelets.map(|joint| joint.holder).chain(pulleys.map(|pulley| pulley.holder));
        let anchors: BTreeSet<usize> = joints.iter().flat_map(|&k| ends(k)).chain(holders).filter_map(anchor).collect();
        let anchors: Vec<usize> = anchors.into_iter().collect();
        let loads: Vec<usize> =
            (0..self.loads.len()).filter(|&k| of_segment.contains_key(&self.loads[k].segment)).collect();
        let (of_anchor, of_load): (HashMap<usize, usize>, HashMap<usize, usize>) = (places(&anchors), places(&loads));
        let body = |body: Body| match body {
            Body::Segment(i) => of_segment.get(&i).copied().map(Body::Segment),
            Body::Anchor(i) => of_anchor.get(&i).copied().map(Body::Anchor),
        };
        let joint = |&k: &usize| {
            let mut joint = self.joints[k];
            (joint.a, joint.b) = (body(joint.a)?, body(joint.b)?);
            Some(joint)
        };
        let slides = |joint: &SlidingJoint| {
            Some(SlidingJoint { segments: segments_of(&joint.segments)?, holder: body(joint.holder)?, ..joint.clone() })
        };
        let on_pulley = |own: &Pulley| {
            Some(Pulley { segments: segments_of(&own.segments)?, holder: body(own.holder)?, ..own.clone() })
        };
        let sheath = |own: &Sheath| {
            let (inner, outer) = (segments_of(&own.inner)?, segments_of(&own.outer)?);
            Some(Sheath { inner, outer, ..own.clone() })
        };
        let law = |own: &InelasticJoint| {
            let joint = joints.binary_search(&own.joint).ok()?;
            Some(InelasticJoint { joint, law: own.law.clone() })
        };
        let breaks = |own: &BreakableJoint| {
            let joint = joints.binary_search(&own.joint).ok()?;
            Some(BreakableJoint { joint, ..*own })
        };
        let lift = |own: &Lift| Some(Lift { load: *of_load.get(&own.load)?, ..*own });
        let change = |change: &Change| {
            let of = match change.of {
                Changing::Gravity => Changing::Gravity,
                Changing::Force(k) => Changing::Force(*of_load.get(&k)?),
                Changing::Torque(k) => Changing::Torque(*of_load.get(&k)?),
                Changing::Rest(k) => Changing::Rest(joints.binary_search(&k).ok()?),
            };
            Some(Change { of, track: change.track.clone() })
        };
        let driven = |driven: &Driven| body(driven.body).map(|body| Driven { body, ..driven.clone() });
        let load = |&k: &usize| Load { segment: of_segment[&self.loads[k].segment], ..self.loads[k] };
        let model = Model {
            segments: segments.iter().map(|&i| self.segments[i].clone()).collect(),
            joints: joints.iter().filter_map(joint).collect(),
            strain_measure: self.strain_measure,
            anchors: anchors.iter().map(|&k| self.anchors[k]).collect(),
            loads: loads.iter().map(load).collect(),
            lifts: self.lifts.iter().filter_map(lift).collect(),
            motions: self.motions.iter().filter_map(driven).collect(),
            sliding_joints: self.sliding_joints.iter().filter_map(slides).collect(),
            pulleys: self.pulleys.iter().filter_map(on_pulley).collect(),
            laws: self.laws.iter().filter_map(law).collect(),
            breakable: self.breakable.iter().filter_map(breaks).collect(),
            open: self.open.iter().filter_map(|k| of_anchor.get(k).copied()).collect(),
            changes: self.changes.iter().filter_map(change).collect(),
            gravity: self.gravity,
            damping: self.damping,
            contacts: Contacts {
                sheaths: self.contacts.sheaths.iter().filter_map(sheath).collect(),
                ..self.contacts.clone()
            },
            air: self.air.clone(),
            mistake: self.mistake.clone(),
        };
        let laws = (0..self.laws.len()).filter(|&k| joints.binary_search(&self.laws[k].joint).is_ok()).collect();
        Part { model, segments, joints, laws }
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
        for (k, load) in moved.loads.iter_mut().enumerate().filter(|(_, load)| !load.follows) {
            // Buoyancy follows gravity.
            if self.lifts.iter().all(|lift| lift.load != k) {
                (load.force, load.torque) = (turn * load.force, turn * load.torque);
            }
        }
        moved.motions = with_motions(&self.motions, |motion| motion.moved(place));
        let turns = |change: &&mut Change| match change.of {
            Changing::Force(load) | Changing::Torque(load) => !self.loads[load].follows,
            Changing::Gravity | Changing::Rest(_) => false,
        };
        for change in moved.changes.iter_mut().filter(turns) {
            change.track = Arc::new(change.track.turned(&turn));
        }
        moved
    }
}

impl Part {
    /// What a state of the whole says of the part.
    pub fn state(&self, whole: &State) -> State {
        fn pick<T: Copy>(values: &[T], segments: &[usize]) -> Vec<T> {
            segments.iter().map(|&i| values[i]).collect()
        }
        State {
            positions: pick(&whole.positions, &self.segments),
            orientations: pick(&whole.orientations, &self.segments),
            velocities: pick(&whole.velocities, &self.segments),
            angular_velocities: pick(&whole.angular_velocities, &self.segments),
            internals: self.laws.iter().filter_map(|&k| whole.internals.get(k).cloned()).collect(),
        }
    }

    /// What the part's joints transmit, of all that the whole's do; nothing where that is not known.
    pub fn forces(&self, whole: &[JointForce]) -> Vec<JointForce> {
        self.joints.iter().filter_map(|&k| whole.get(k).copied()).collect()
    }
}

impl State {
    /// The same state moved by `place`, velocities along: see [`Model::moved`].
    pub fn moved(&self, place: &Pose) -> Self {
        let turn = place.orientation;
        Self {
            positions: self.positions.iter().map(|x| turn * x + place.position).collect(),
            orientations: self.orientations.iter().map(|q| turn * q).collect(),
            velocities: self.velocities.iter().map(|v| turn * v).collect(),
            angular_velocities: self.angular_velocities.iter().map(|w| turn * w).collect(),
            internals: self.internals.clone(),
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
    use crate::{Assembly, Material, RodSpec, measure, shape};

    #[test]
    fn a_part_is_what_there_would_be_without_the_others() {
        let material = Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };
        let build = |rods: &[f64]| {
            let mut assembly = Assembly::new(Vector3::z() * -9.81);
            let ranges: Vec<_> = rods
                .iter()
                .map(|&y| {
                    let nodes = shape::straight(Vector3::y() * y, Vector3::x(), 1.0, 4);
                    let rod = assembly.rod(&RodSpec::new(nodes, 0.01 + 0.01 * y, material));
                    assembly.clamp_end(&rod);
                    rod
                })
                .collect();
            if let [first, second, _] = &ranges[..] {
                assembly.join(first.start, 0.5, second.start, 0.5);
            }
            assembly.finish()
        };
        let (whole, state) = build(&[0.0, 1.0, 2.0]);
        let part = whole.part((4..12).collect());
        let (mut alone, own) = build(&[1.0, 2.0]);
        alone.segments.iter_mut().for_each(|segment| segment.rod += 1);
        assert_eq!((&part.model, part.state(&state)), (&alone, own.clone()));
        assert_eq!(part.segments, [4, 5, 6, 7, 8, 9, 10, 11]);
        let last = part.model.joints.last().unwrap();
        assert!([last.a, last.b].contains(&Body::Anchor(1)), "{last:?}");
        assert_eq!(measure::energy(&part.model, &own), measure::energy(&alone, &own));
        let forces: Vec<_> = (0..whole.joints.len())
            .map(|k| JointForce { force: Vector3::x() * k as f64, ..JointForce::default() })
            .collect();
        let of: Vec<_> = part.forces(&forces).iter().map(|joint| joint.force.x as usize).collect();
        assert_eq!((of, part.forces(&[])), (part.joints.clone(), Vec::new()));
        assert_eq!(whole.part((0..12).collect()).model, whole);
        assert_eq!(whole.part(Vec::new()).model, Model { gravity: whole.gravity, ..Model::default() });
    }

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
