//! Joints that hold less than all: ball joints, hinges, springs, open grips.

use std::collections::HashMap;

use nalgebra::{UnitQuaternion, Vector3};

use crate::{Body, Freedom, Joint, Model, Springs};

/// How much more than the next joint of its rod a joint to an anchor gives way that springs hold; less is rounding.
const SOFTER: f64 = 1.0 + 1e-6;

/// What the springs of a grip give way, beyond what the rod itself does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Give {
    /// Across the rod [m/N].
    pub(crate) across: f64,
    /// To bending [rad/(N m)].
    pub(crate) turn: f64,
}

impl Model {
    /// The joints to anchors behind springs ([`Model::soften`]), by index: those that give way more than the next joint of
    /// the same rod. A face that is clamped gives way half as much as that joint.
    pub(crate) fn grip_springs(&self) -> HashMap<usize, Give> {
        let mut springs = HashMap::new();
        if self.anchors.is_empty() {
            return springs;
        }
        let mut inner = vec![None; self.segments.len()];
        for joint in &self.joints {
            if let (Body::Segment(a), Body::Segment(b)) = (joint.a, joint.b)
                && self.segments[a].rod == self.segments[b].rod
            {
                (inner[a], inner[b]) = (Some(joint), Some(joint));
            }
        }
        let of = |joint: &Joint| {
            let across = joint.shear_compliance + joint.shear_extra.max(0.0);
            let turn = joint.bend_compliance + joint.bend_extra.max(0.0);
            [across, joint.stretch_compliance, turn * joint.length.powi(2)]
        };
        for (k, joint) in self.joints.iter().enumerate() {
            let ((Body::Anchor(_), Body::Segment(i)) | (Body::Segment(i), Body::Anchor(_))) = (joint.a, joint.b) else {
                continue;
            };
            let Some(next) = inner[i] else { continue };
            let (own, next) = (of(joint), of(next));
            let beyond = |k: usize| if own[k] > SOFTER * next[k] { own[k] - 0.5 * next[k] } else { 0.0 };
            let [across, along, turn] = [0, 1, 2].map(beyond);
            if across.max(along).max(turn) > 0.0 {
                springs.insert(k, Give { across, turn });
            }
        }
        springs
    }

    /// Makes a joint a ball joint: it holds places together and turns freely. An index that is none changes nothing.
    pub fn pin(&mut self, joint: usize) {
        self.laws.retain(|own| own.joint != joint);
        if let Some(joint) = self.joints.get_mut(joint) {
            joint.freedom = Freedom::Ball;
        }
    }

    /// Makes a joint to an anchor a hinge about `axis` (world axes, any length but zero), at rest in the direction in which
    /// the joint was at rest. The anchor becomes the joint's body a, its d3 along the axis. Between two segments the axis is
    /// the first one's own, whatever `axis` says. Behind an axis at an angle to the rod the joint yields across as it does along. An index that is
    /// none changes nothing.
    pub fn hinge(&mut self, joint: usize, axis: &Vector3<f64>) {
        self.laws.retain(|own| own.joint != joint);
        let Some(joint) = self.joints.get_mut(joint) else { return };
        let mut rest = joint.rest_rotation();
        let anchor = match (joint.a, joint.b) {
            (Body::Anchor(i), _) => Some(i),
            (_, Body::Anchor(i)) => {
                std::mem::swap(&mut joint.a, &mut joint.b);
                std::mem::swap(&mut joint.offset_a, &mut joint.offset_b);
                rest = rest.inverse();
                Some(i)
            }
            _ => None,
        };
        if let Some(anchor) = anchor.and_then(|i| self.anchors.get_mut(i)) {
            let held = anchor.orientation * rest;
            let half_turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
            let turn = UnitQuaternion::rotation_between(&(anchor.orientation * Vector3::z()), axis);
            anchor.orientation =
                turn.unwrap_or(anchor.orientation * half_turn * anchor.orientation.inverse()) * anchor.orientation;
            rest = anchor.orientation.inverse() * held;
            // The rod turns against the anchor's axes, along which the joint's compliances are: it yields along itself in any direction.
            if axis.normalize().cross(&(held * Vector3::z())).norm() > 1e-9 {
                (joint.shear_compliance, joint.shear_extra) = (joint.stretch_compliance, 0.0);
            }
        }
        joint.freedom = Freedom::Hinge;
        joint.rest_frames = [UnitQuaternion::identity(), rest.inverse()];
        joint.rest_darboux = Vector3::zeros();
    }

    /// Turns the anchor of a hinge about the hinge's axis, so that its d1 points along `first` as far as it can. An index that is
    /// no such joint changes nothing.
    pub fn turn_hinge(&mut self, joint: usize, first: &Vector3<f64>) {
        let Some(joint) = self.joints.get_mut(joint).filter(|joint| joint.freedom == Freedom::Hinge) else { return };
        let Body::Anchor(anchor) = joint.a else { return };
        let Some(anchor) = self.anchors.get_mut(anchor) else { return };
        let across = anchor.orientation.inverse() * first;
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), across.y.atan2(across.x));
        anchor.orientation *= turn;
        joint.rest_frames[1] *= turn;
    }

    /// Adds springs to a joint, in series with what it yields already. A hinge with a finite stiffness of twist is held by
    /// that spring about its axis, and no longer free. Where springs along the three axes differ, an anchor becomes the joint's
    /// body a: what slides moves along axes that the anchor holds, for any stroke, and no moment of the gap is left out. A joint
    /// with a law that springs let turn is elastic from then on. An index that is none changes nothing.
    pub fn soften(&mut self, joint: usize, springs: &Springs) {
        if springs.moment.iter().any(|stiffness| stiffness.is_finite()) {
            self.laws.retain(|own| own.joint != joint);
        }
        let Some(joint) = self.joints.get_mut(joint) else { return };
        let [across, sideways, along] = springs.force;
        if (across != sideways || across != along) && matches!(joint.b, Body::Anchor(_)) {
            joint.exchange_bodies();
        }
        let [first, second, twist] = springs.moment;
        joint.shear_compliance += 1.0 / across;
        joint.shear_extra += 1.0 / sideways - 1.0 / across;
        joint.stretch_compliance += 1.0 / along;
        // A Darboux vector is an angle over the joint's length.
        let square = joint.length.powi(2);
        joint.bend_compliance += 1.0 / (first * square);
        joint.bend_extra += 1.0 / (second * square) - 1.0 / (first * square);
        joint.twist_compliance += 1.0 / (twist * square);
        if joint.freedom == Freedom::Hinge && twist.is_finite() {
            joint.freedom = Freedom::None;
        }
    }

    /// Whether a joint transmits nothing: it has broken, or holds on to an anchor that is open ([`Model::open`]).
    pub fn is_open(&self, joint: &Joint) -> bool {
        let is_open = |body| matches!(body, Body::Anchor(i) if self.open.contains(&i));
        joint.freedom == Freedom::Broken || !self.open.is_empty() && (is_open(joint.a) || is_open(joint.b))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::bend_strain;
    use crate::{Assembly, Material, RodSpec, shape};

    #[test]
    fn a_hinge_is_at_rest_at_all_its_angles_and_bent_about_other_axes() {
        let soft = Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };
        for axis in [Vector3::y(), Vector3::x(), Vector3::new(0.3, -1.0, 0.4)] {
            let mut assembly = Assembly::new(Vector3::zeros());
            let rod = assembly.rod(&RodSpec::new(shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 4), 0.05, soft));
            assembly.clamp_start(&rod).clamp_end(&rod);
            let (mut model, state) = assembly.finish();
            for (joint, segment) in [(3, 0), (4, 3)] {
                model.hinge(joint, &axis);
                model.validate(&state).unwrap();
                let joint = model.joints[joint];
                for angle in [0.0, 0.5, 2.0, 3.0, -3.1] {
                    let mut turned = state.clone();
                    let turn = UnitQuaternion::from_scaled_axis(axis.normalize() * angle);
                    turned.orientations[segment] = turn * state.orientations[segment];
                    assert!(bend_strain(&model, &turned, &joint).norm() < 1e-12, "{axis} {angle}");
                    // About an axis across, the angle over the length.
                    let aside = UnitQuaternion::from_scaled_axis(axis.cross(&Vector3::z()).normalize() * 1e-4);
                    turned.orientations[segment] = aside * state.orientations[segment];
                    let bent = bend_strain(&model, &turned, &joint).norm() * joint.length;
                    assert!((bent / 1e-4 - 1.0).abs() < 1e-6, "{axis}: {bent}");
                }
            }
        }
    }
}
