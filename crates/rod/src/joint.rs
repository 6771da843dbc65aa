//! What a joint's constants mean together: its compliances, the frame of its bend-twist rows, the measure from rest.

use nalgebra::{UnitQuaternion, Vector3};

use crate::darboux::{darboux, rotation_of};
use crate::{Body, Changing, Freedom, InnerDamping, Joint, Model, State, StrainMeasure};

impl Joint {
    /// Compliance of stretch and shear [m/N] up to which a joint does not yield in effect: that of
    /// [`Stretch::ZERO_STRETCH`](crate::Stretch::ZERO_STRETCH), and rounding.
    pub const RIGID: f64 = 1.000_001e-10;

    /// Compliances of the curvatures about d1 and d2 and of the twist [1/(N m^3)].
    pub fn bend_twist_compliance(&self) -> Vector3<f64> {
        Vector3::new(self.bend_compliance, self.bend_compliance + self.bend_extra, self.twist_compliance)
    }

    /// The frames between which the Darboux vector is measured, fixed to bodies a and b; the first is that of its rows.
    #[inline]
    pub fn frames(&self, model: &Model, state: &State) -> [UnitQuaternion<f64>; 2] {
        let (a, b) = (model.pose(self.a, state).orientation, model.pose(self.b, state).orientation);
        let [of_a, of_b] = &self.rest_frames;
        if self.has_rest_frames() { [a * of_a, b * of_b] } else { [a, b] }
    }

    /// Measures the Darboux vector from the joint's rest: its rest frames, which agree there, take the place of its rest
    /// Darboux vector. They stand at `share` of the way from body a's frame to body b's: 1/2 in a smooth rod, 1 where the
    /// joint is made of the material of b.
    ///
    /// The paper's measure is a sine of half the angle between the bodies, not between body b and its place at rest. A joint
    /// that is bent by a large angle at rest is softer by it than its material says (half as stiff about the axis of a right
    /// angle), and what is bending and what is twist is told half-way. Measured from rest it is as stiff as its material.
    ///
    /// A ball joint has no rest, and a hinge is measured so already: they stay as they are.
    pub fn measure_from_rest(&mut self, share: f64) {
        if self.freedom != Freedom::None {
            return;
        }
        let rest = self.rest_rotation();
        let of_a = rest.powf(share);
        self.rest_frames = [of_a, rest.inverse() * of_a];
        self.rest_darboux = Vector3::zeros();
    }

    /// conj(q_a) q_b at rest.
    pub fn rest_rotation(&self) -> UnitQuaternion<f64> {
        let [of_a, of_b] = self.rest_frames;
        of_a * rotation_of(&self.rest_darboux, self.length) * of_b.inverse()
    }

    /// Whether it is the spring to the ground at the centre of a segment, which may turn ([`crate::Assembly::foundation`]): no joint of the rod
    /// itself, and nothing that holds it.
    pub fn is_foundation(&self) -> bool {
        let is_centre = self.offset_a == 0.0 && self.offset_b == 0.0;
        matches!((self.a, self.b), (Body::Anchor(_), Body::Segment(_))) && self.freedom == Freedom::Ball && is_centre
    }

    /// Whether it is measured from rest frames other than those of its bodies.
    #[inline]
    pub fn has_rest_frames(&self) -> bool {
        self.rest_frames != [UnitQuaternion::identity(); 2]
    }
}

/// Angle of a joint at rest from which on it is measured from there [rad].
const BENT: f64 = std::f64::consts::PI / 9.0;

impl Model {
    /// Measures all Darboux vectors from rest ([`Joint::measure_from_rest`]): in the frame of body b where two rods are
    /// joined, half-way within a rod. Joints whose rest changes over time stay as they are.
    pub fn measure_from_rest(&mut self) {
        self.measure_from_rest_where(|_, _| true);
    }

    /// The same of joints alone that are bent at rest by 20 degrees or more, and are measured between their bodies. The rotation vector from one body to the
    /// other, less that at rest, is too stiff about other axes than its own, by 1 % at 20 degrees. Joints with indices in `except` stay as they are.
    pub fn measure_bent_from_rest(&mut self, except: &[usize]) {
        let is_bent = |joint: &Joint| !joint.has_rest_frames() && joint.rest_rotation().angle() >= BENT;
        self.measure_from_rest_where(|k, joint| !except.contains(&k) && is_bent(joint));
    }

    fn measure_from_rest_where(&mut self, is_chosen: impl Fn(usize, &Joint) -> bool) {
        let changing: Vec<bool> = self.changing_rests();
        for (k, joint) in self.joints.iter_mut().enumerate() {
            if changing[k] || !is_chosen(k, joint) {
                continue;
            }
            let rods = [joint.a, joint.b].map(|body| match body {
                Body::Segment(i) => self.segments.get(i).map(|segment| segment.rod),
                Body::Anchor(_) => None,
            });
            let between_two = rods[0].zip(rods[1]).is_some_and(|(a, b)| a != b);
            joint.measure_from_rest(if between_two { 1.0 } else { 0.5 });
        }
    }

    /// Measures as in the paper: by the sine of half the angle between the two segments of a joint, less that at rest.
    pub fn measure_as_in_paper(&mut self) {
        self.strain_measure = StrainMeasure::Sine;
        for joint in &mut self.joints {
            let is_between_segments = [joint.a, joint.b].iter().all(|body| matches!(body, Body::Segment(_)));
            let is_round = joint.mount.is_none() && joint.bend_extra == 0.0 && joint.freedom == Freedom::None;
            if is_between_segments && is_round && joint.has_rest_frames() {
                let rest = joint.rest_rotation();
                joint.rest_frames = [UnitQuaternion::identity(); 2];
                joint.rest_darboux = darboux(&UnitQuaternion::identity(), &rest, joint.length);
            }
        }
    }

    /// Whether the rest of each joint changes over time.
    pub fn changing_rests(&self) -> Vec<bool> {
        let mut changing = vec![false; self.joints.len()];
        for change in &self.changes {
            if let Changing::Rest(joint) = change.of
                && let Some(own) = changing.get_mut(joint)
            {
                *own = true;
            }
        }
        changing
    }

    /// What this model has that no rod of the paper has, and no learned guess has learned from, in words; `None` where
    /// there is nothing of it.
    pub fn beyond_the_paper(&self) -> Option<&'static str> {
        let has = |part: &dyn Fn(&Joint) -> bool| self.joints.iter().any(part);
        if self.segments.iter().any(|segment| segment.body.is_some()) {
            return Some("rigid bodies");
        }
        if self.has_timed_grips() || !self.open.is_empty() || has(&|joint| joint.freedom != Freedom::None) {
            return Some("joints that turn freely, or grips that open");
        }
        if !self.sliding_joints.is_empty() {
            return Some("rods in eyelets");
        }
        if !self.pulleys.is_empty() {
            return Some("pulleys");
        }
        if !self.contacts.sheaths.is_empty() {
            return Some("rods in sheaths");
        }
        if !self.laws.is_empty() {
            return Some("joints that are not elastic");
        }
        if !self.breakable.is_empty() {
            return Some("joints that can break");
        }
        if self.has_followers() {
            return Some("loads that turn with their segments");
        }
        if self.changes.iter().any(|change| matches!(change.of, Changing::Rest(_))) {
            return Some("rest shapes that change over time");
        }
        if has(&Joint::has_rest_frames) {
            return Some("bending measured from a rest rotation");
        }
        if has(&|joint| joint.inner_damping != InnerDamping::NONE) {
            return Some("inner damping");
        }
        if has(&|joint| joint.shear_extra != 0.0) {
            return Some("grips with two stiffnesses across a rod");
        }
        let is_round = self.segments.iter().all(|segment| segment.line_inertia.is_none());
        (!is_round || has(&|joint| joint.bend_extra != 0.0)).then_some("sections that are not full circles")
    }
}
