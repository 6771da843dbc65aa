//! Copies of rods, with all that belongs to them.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use super::Assembly;
use crate::{Body, Change, Changing, Driven, Joint, Load, Motion, Pose};

/// What is copied besides segments, by its place in the model.
#[derive(Default)]
struct Belongings {
    /// Joints between the rods, or of one of them and an anchor.
    joints: Vec<Joint>,
    anchors: Vec<usize>,
    loads: Vec<usize>,
    motions: Vec<Driven>,
    /// Changes of loads.
    changes: Vec<Change>,
}

impl Assembly {
    /// Copies `rods` (ranges returned by [`Assembly::rod`]) once for each of `places`, which moves a copy from where its
    /// original is: a point x to `orientation * x + position`, and all directions along. What belongs to the rods is copied
    /// with them: velocities, joints between them, anchors, loads and their changes, motions. Joints to other rods are left out.
    ///
    /// Returns the copies' segments, place after place, in the order of `rods`. A mistake, and no copy, where a range holds
    /// no segment.
    pub fn copies(&mut self, rods: &[Range<usize>], places: &[Pose]) -> Vec<Range<usize>> {
        if !rods.iter().all(|rod| self.has_rod("copy", rod)) {
            return Vec::new();
        }
        // Where a segment is among those of one copy.
        let order: Vec<usize> = rods.iter().flat_map(Clone::clone).collect();
        let index: HashMap<usize, usize> = order.iter().enumerate().map(|(new, &old)| (old, new)).collect();
        let belongings = self.belongings(&index);
        let mut copies = Vec::with_capacity(rods.len() * places.len());
        for place in places {
            let first = self.model.segments.len();
            for &i in &order {
                self.copy_segment(i, place);
            }
            let mut start = first;
            for rod in rods {
                let copy = start..start + rod.len();
                self.model.segments[copy.clone()].iter_mut().for_each(|segment| segment.rod = self.rods);
                self.rods += 1;
                start = copy.end;
                copies.push(copy);
            }
            self.copy_belongings(&belongings, place, &|i| first + index[&i]);
        }
        copies
    }

    fn belongings(&self, index: &HashMap<usize, usize>) -> Belongings {
        let is_own = |body: Body| matches!(body, Body::Segment(i) if index.contains_key(&i));
        let mut found = Belongings::default();
        let mut anchors = HashMap::new();
        for joint in &self.model.joints {
            let bodies = [joint.a, joint.b];
            if !bodies.iter().all(|&body| is_own(body) || matches!(body, Body::Anchor(_))) {
                continue;
            }
            for body in bodies {
                if let Body::Anchor(k) = body {
                    anchors.entry(k).or_insert_with(|| {
                        found.anchors.push(k);
                        found.anchors.len() - 1
                    });
                }
            }
            found.joints.push(*joint);
        }
        let mut loads = HashMap::new();
        for (k, _) in self.model.loads.iter().enumerate().filter(|(_, load)| index.contains_key(&load.segment)) {
            loads.insert(k, found.loads.len());
            found.loads.push(k);
        }
        // Anchors and loads are named by their places in the lists found.
        let of_anchor = |body: Body| match body {
            Body::Anchor(k) => Body::Anchor(anchors[&k]),
            segment => segment,
        };
        for joint in &mut found.joints {
            (joint.a, joint.b) = (of_anchor(joint.a), of_anchor(joint.b));
        }
        for driven in &self.model.motions {
            let is_held = matches!(driven.body, Body::Anchor(k) if anchors.contains_key(&k));
            if is_held || is_own(driven.body) {
                found.motions.push(Driven { body: of_anchor(driven.body), ..driven.clone() });
            }
        }
        for change in &self.model.changes {
            let of = match change.of {
                Changing::Force(k) => loads.get(&k).map(|&k| Changing::Force(k)),
                Changing::Torque(k) => loads.get(&k).map(|&k| Changing::Torque(k)),
                Changing::Gravity => None,
            };
            found.changes.extend(of.map(|of| Change { of, track: change.track.clone() }));
        }
        found
    }

    fn copy_segment(&mut self, i: usize, place: &Pose) {
        let Self { model, state, made_of, strains, .. } = self;
        let turn = place.orientation;
        model.segments.push(model.segments[i]);
        made_of.push(made_of[i]);
        strains.push(strains[i]);
        state.positions.push(turn * state.positions[i] + place.position);
        state.orientations.push(turn * state.orientations[i]);
        state.velocities.push(turn * state.velocities[i]);
        state.angular_velocities.push(turn * state.angular_velocities[i]);
    }

    fn copy_belongings(&mut self, own: &Belongings, place: &Pose, segment: &dyn Fn(usize) -> usize) {
        let model = &mut self.model;
        let (anchors, loads, turn) = (model.anchors.len(), model.loads.len(), place.orientation);
        let body = |body: Body| match body {
            Body::Segment(i) => Body::Segment(segment(i)),
            Body::Anchor(k) => Body::Anchor(anchors + k),
        };
        let is_open: Vec<bool> = own.anchors.iter().map(|k| model.open.contains(k)).collect();
        model.open.extend((0..own.anchors.len()).filter(|&k| is_open[k]).map(|k| anchors + k));
        for &k in &own.anchors {
            let Pose { position, orientation } = model.anchors[k];
            let copy = Pose { position: turn * position + place.position, orientation: turn * orientation };
            model.anchors.push(copy);
        }
        model.joints.extend(own.joints.iter().map(|joint| Joint { a: body(joint.a), b: body(joint.b), ..*joint }));
        for &k in &own.loads {
            let Load { segment: on, force, torque, .. } = model.loads[k];
            let copy = Load { segment: segment(on), force: turn * force, torque: turn * torque, ..model.loads[k] };
            model.loads.push(copy);
        }
        // What one motion drives goes on as one rigid body, in a copy as well.
        let mut moved = HashMap::new();
        for driven in &own.motions {
            let motion: &Arc<Motion> =
                moved.entry(Arc::as_ptr(&driven.motion)).or_insert_with(|| Arc::new(driven.motion.moved(place)));
            let motion = motion.clone();
            model.motions.push(Driven { body: body(driven.body), motion, ..driven.clone() });
        }
        for Change { of, track } in &own.changes {
            let of = match *of {
                Changing::Force(k) => Changing::Force(loads + k),
                Changing::Torque(k) => Changing::Torque(loads + k),
                Changing::Gravity => Changing::Gravity,
            };
            model.changes.push(Change { of, track: Arc::new(track.turned(&turn)) });
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;
    use crate::{Interpolation, Keyframe, Material, RodSpec, Track, measure, shape};

    #[test]
    fn a_copy_is_its_original_moved_and_turned() {
        let material = Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };
        let mut assembly = Assembly::new(Vector3::zeros());
        let bar = |start, along| RodSpec::new(shape::straight(start, along, 1.0, 4), 0.02, material);
        let other = assembly.rod(&bar(Vector3::z(), Vector3::x()));
        let mast = assembly.rod(&bar(Vector3::zeros(), Vector3::x()));
        let twig = assembly.rod(&bar(Vector3::x(), Vector3::y()));
        assembly.branch(mast.end - 1, 1.0, &twig).clamp_start(&mast).clamp_end(&other).fix(twig.end - 1);
        assembly.add_mass(twig.start, 3.0);
        let load = Load { segment: twig.start, offset: 0.1, force: Vector3::x(), torque: Vector3::y() };
        assembly.load(load);
        assembly.state_mut().velocities[mast.start] = Vector3::y();
        let driven = |assembly: &mut Assembly, body, pose: Pose| {
            let keyframe = |time, shift, turn| Keyframe { time, position: pose.position + shift, turn };
            let keys =
                [keyframe(0.0, Vector3::zeros(), Vector3::zeros()), keyframe(1.0, Vector3::x(), Vector3::x() * 3.0)];
            let motion = Arc::new(Motion::new(pose.orientation, &keys, Interpolation::Smooth).unwrap());
            assembly.model_mut().motions.push(Driven::new(body, motion));
        };
        let anchor = assembly.model_mut().anchors[0];
        driven(&mut assembly, Body::Anchor(0), anchor);
        let state = assembly.state_mut();
        let held = Pose { position: state.positions[twig.end - 1], orientation: state.orientations[twig.end - 1] };
        driven(&mut assembly, Body::Segment(twig.end - 1), held);
        let track = Arc::new(Track::new(&[(0.0, Vector3::x()), (1.0, Vector3::z())], Interpolation::Linear).unwrap());
        assembly.model_mut().changes.push(Change { of: Changing::Force(0), track });

        let turn = UnitQuaternion::from_euler_angles(0.3, -0.7, 2.0);
        let places = [
            Pose { position: Vector3::new(0.0, 0.0, 5.0), orientation: UnitQuaternion::identity() },
            Pose { position: Vector3::new(3.0, -1.0, 2.0), orientation: turn },
        ];
        let copies = assembly.copies(&[mast.clone(), twig.clone()], &places);
        assert_eq!(copies, [12..16, 16..20, 20..24, 24..28]);
        let (mut model, state) = assembly.finish();
        model.validate(&state).unwrap();
        assert_eq!((model.anchors.len(), model.loads.len(), model.motions.len(), model.changes.len()), (4, 3, 6, 3));
        assert_eq!(model.segments.iter().map(|s| s.rod).max(), Some(6));
        assert!(measure::worst_gap(&model, &state) < 1e-12);
        assert_eq!(model.joints_of(&copies[2]).len(), model.joints_of(&mast).len());
        let mut originals = model.joints[3..].iter().filter(|j| ![j.a, j.b].contains(&Body::Anchor(1)));
        let strain = |joint: &Joint| measure::bend_strain(&model, &state, joint);
        for joint in &model.joints[12..20] {
            let original = originals.next().unwrap();
            assert!((strain(joint) - strain(original)).norm() < 1e-12);
            assert_eq!((joint.length, joint.rest_darboux), (original.length, original.rest_darboux));
        }
        assert_eq!((state.velocities[20], model.segments[24].added_mass), (turn * Vector3::y(), 3.0));
        let [original, copy] = [&model.motions[1], &model.motions[5]].map(|driven| driven.at(0.6));
        assert!((copy.pose.position - (turn * original.pose.position + places[1].position)).norm() < 1e-12);
        assert!(copy.pose.orientation.angle_to(&(turn * original.pose.orientation)) < 1e-7);
        assert!((copy.angular_velocity - turn * original.angular_velocity).norm() < 1e-12);
        model.set_time(0.5);
        assert!((model.loads[2].force - turn * model.loads[0].force).norm() < 1e-12);
        assert!((model.loads[2].torque - turn * Vector3::y()).norm() < 1e-12);
        assert!(Assembly::default().copies(&[mast], &places).is_empty());
    }
}
