//! Copies of rods, with all that belongs to them.

use std::ops::Range;

use super::Assembly;
use crate::Pose;

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
        let mut part = self.model.part(rods.iter().flat_map(Clone::clone).collect());
        let state = part.state(&self.state);
        let own = rods.iter().enumerate().flat_map(|(rod, range)| std::iter::repeat_n(rod, range.len()));
        part.model.segments.iter_mut().zip(own).for_each(|(segment, rod)| segment.rod = rod);
        let mut copies = Vec::with_capacity(rods.len() * places.len());
        for place in places {
            let mut start = self.model.segments.len();
            let laws = self.model.laws.len();
            self.model.append_after(self.rods, &part.model.moved(place));
            self.state.append(&state.moved(place), laws);
            self.rods += rods.len();
            for rod in rods {
                self.made_of.extend_from_within(rod.clone());
                self.strains.extend_from_within(rod.clone());
                copies.push(start..start + rod.len());
                start += rod.len();
            }
        }
        copies
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;
    use crate::{
        Body, Change, Changing, Driven, Interpolation, Joint, Keyframe, Load, Material, Motion, RodSpec, Track,
        measure, shape,
    };

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
        let load = Load { segment: twig.start, offset: 0.1, force: Vector3::x(), torque: Vector3::y(), follows: false };
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
