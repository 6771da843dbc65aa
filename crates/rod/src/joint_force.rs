//! What a joint transmits, and what one reads off it: tension, curvature, residual.

use nalgebra::{UnitQuaternion, Vector3};

use crate::darboux::relative_rotation;
use crate::measure::{bend_strain, stretch_gap};
use crate::{Body, Freedom, Joint, Model, State, StrainMeasure};

/// What a joint transmits, the viscous part of its inner damping included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointForce {
    /// Force of body b on body a at the joint, in world axes [N].
    pub force: Vector3<f64>,
    /// Moment of body b on body a at the joint, in the frame of body a [N m]: bending about x and y, twist about z.
    pub moment: Vector3<f64>,
}

impl Default for JointForce {
    fn default() -> Self {
        Self { force: Vector3::zeros(), moment: Vector3::zeros() }
    }
}

impl JointForce {
    /// Of a joint's multipliers over dt^2 (Kugelstadt et al. 2018): `lambda_s` in world axes [N] and `lambda_b` in the frame
    /// of body a [N m^2]. `a` and `b` are the bodies' orientations, `length` is the joint's [m]. Of a joint with rest
    /// frames all that is of a and b is of its [`Joint::frames`].
    ///
    /// `J^T lambda` is the force `lambda_s` on body a and the torque `-F^T lambda_b / l`, with the derivative F of what is measured; by the paper's measure
    /// that is `-(s lambda_b + u x lambda_b) / l`, (s, u) being the relative rotation `conj(q_a) q_b`.
    pub fn of_multipliers(
        measure: StrainMeasure,
        lambda_s: Vector3<f64>,
        lambda_b: Vector3<f64>,
        [a, b]: [&UnitQuaternion<f64>; 2],
        length: f64,
    ) -> Self {
        Self { force: lambda_s, moment: measure.torque(relative_rotation(a, b), &lambda_b) / -length }
    }

    /// The bend-twist multiplier over dt^2 [N m^2]: the inverse of [`Self::of_multipliers`].
    fn lambda_b(&self, model: &Model, state: &State, joint: &Joint) -> Vector3<f64> {
        let [a, b] = joint.frames(model, state);
        let moment = joint.rest_frames[0].inverse() * self.moment;
        model.strain_measure.multiplier(relative_rotation(&a, &b), &moment) * -joint.length
    }

    /// Pull along the axis d3 of body a [N], behind a hinge along that of body b; negative where the joint is pressed.
    pub fn tension(&self, model: &Model, state: &State, joint: &Joint) -> f64 {
        self.tension_between(joint, [joint.a, joint.b].map(|body| model.pose(body, state).orientation * Vector3::z()))
    }

    /// The same of bodies with these axes d3.
    pub fn tension_between(&self, joint: &Joint, [axis_a, axis_b]: [Vector3<f64>; 2]) -> f64 {
        if joint.freedom == Freedom::Hinge {
            return self.force.dot(&axis_b) * if joint.offset_b > 0.0 { -1.0 } else { 1.0 };
        }
        // Of a rod and a rigid body the rod comes first, also where the body is at its start; of springs that differ the anchor, also at a rod's end.
        let is_at_end = matches!((joint.a, joint.b), (Body::Anchor(_), Body::Segment(_)))
            && joint.offset_b > 0.0
            && joint.mount.is_none();
        let sign = if is_at_end || joint.mount.is_some() && joint.offset_a < 0.0 { -1.0 } else { 1.0 };
        self.force.dot(&axis_a) * sign
    }

    /// How far the joint is from its constraints, `max(|C_s + alpha~ lambda_s| / l, |C_b + alpha~ lambda_b| l)`: the gap in
    /// lengths of the joint, or the angle [rad]; an open one has none. What inner damping transmits counts as such an error.
    pub fn residual(&self, model: &Model, state: &State, joint: &Joint) -> f64 {
        if model.is_open(joint) {
            return 0.0;
        }
        let axis = axis(model, state, joint);
        let along = axis * axis.dot(&self.force);
        let across = self.force - along;
        let mut gap =
            stretch_gap(model, state, joint) + along * joint.stretch_compliance + across * joint.shear_compliance;
        if joint.shear_extra != 0.0 {
            let d2 = model.pose(joint.a, state).orientation * Vector3::y();
            gap += d2 * (d2.dot(&self.force) * joint.shear_extra);
        }
        let lambda_b = self.lambda_b(model, state, joint);
        let strain = bend_strain(model, state, joint) + lambda_b.component_mul(&joint.bend_twist_compliance());
        (gap.norm() / joint.length).max(strain.norm() * joint.length)
    }
}

/// Curvature of the rod at a joint [1/m]: what is measured of its rotation without its twist; zero where the joint turns freely or is open.
pub fn curvature(model: &Model, state: &State, joint: &Joint) -> f64 {
    if joint.freedom != Freedom::None || model.is_open(joint) {
        return 0.0;
    }
    let [a, b] = joint.frames(model, state);
    model.strain_measure.strain(&a, &b, joint.length).xy().norm()
}

/// Axis d3 of a joint's body a.
fn axis(model: &Model, state: &State, joint: &Joint) -> Vector3<f64> {
    model.pose(joint.a, state).orientation * Vector3::z()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::straight;
    use crate::{Assembly, Material, RodSpec};

    /// A weightless rod along x, pulled apart: its segments have moved by so much each.
    fn pulled(by: f64) -> (Model, State) {
        let material = Material { youngs_modulus: 1e6, torsion_modulus: 1e6, density: 1e3 };
        let nodes = straight(Vector3::zeros(), Vector3::x(), 1.0, 2);
        let mut assembly = Assembly::new(Vector3::zeros());
        assembly.rod(&RodSpec::new(nodes, 0.01, material));
        let (model, mut state) = assembly.finish();
        state.positions[1].x += by;
        (model, state)
    }

    #[test]
    fn a_joint_that_is_pulled_is_in_tension_and_at_rest_where_it_answers_as_hooke_says() {
        let (model, state) = pulled(1e-3);
        let joint = &model.joints[0];
        let hooke = 1e-3 / joint.stretch_compliance;
        let answer = JointForce { force: Vector3::x() * hooke, ..JointForce::default() };
        assert!((answer.tension(&model, &state, joint) - hooke).abs() < 1e-9 * hooke);
        assert!(answer.residual(&model, &state, joint) < 1e-12);
        let none = JointForce::default().residual(&model, &state, joint);
        assert!((none - 1e-3 / joint.length).abs() < 1e-12);
    }

    #[test]
    fn curvature_is_one_over_the_radius() {
        let radius = 2.0;
        let angle: f64 = 0.1;
        let (model, mut state) = pulled(0.0);
        let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
        state.orientations[1] = turn * state.orientations[1];
        let joint = Joint { length: radius * angle, ..model.joints[0] };
        let expected = 1.0 / radius;
        assert!((curvature(&model, &state, &joint) - expected).abs() < 1e-12);
        let lambda_b = -bend_strain(&model, &state, &joint).component_div(&Vector3::new(
            joint.bend_compliance,
            joint.bend_compliance,
            joint.twist_compliance,
        ));
        // The gap that turning about the centre leaves is the force's business.
        let force = -stretch_gap(&model, &state, &joint) / joint.shear_compliance;
        let [a, b] = [0, 1].map(|i| &state.orientations[i]);
        let answer = JointForce::of_multipliers(model.strain_measure, force, lambda_b, [a, b], joint.length);
        assert!(answer.residual(&model, &state, &joint) < 1e-9);
        // Body b is turned about y, and pulls body a after it.
        let hooke = expected / joint.bend_compliance / joint.length;
        assert!((answer.moment - Vector3::y() * hooke).norm() < 1e-12 * hooke, "{}", answer.moment);
    }
}
