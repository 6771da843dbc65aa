//! What one measures of a state: energies, momenta, lengths. All of it expects a model and a state that pass
//! [`Model::validate`].

use nalgebra::{UnitQuaternion, Vector3};

use crate::{Body, Freedom, InelasticJoint, InternalVariables, Joint, Model, Segment, State};

/// Energies [J].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Kinetic energy of translation and rotation of the segments that move freely.
    pub kinetic: f64,
    /// Potential energy in gravity and under the constant forces, relative to the world's origin.
    pub external: f64,
    /// Energy of stretch and shear.
    pub stretch: f64,
    /// Energy of bending and twist.
    pub bend: f64,
}

impl Energy {
    /// Sum of all [J].
    pub fn total(&self) -> f64 {
        self.kinetic + self.external + self.stretch + self.bend
    }
}

/// `I w` [kg m^2/s] of a segment at orientation `q`, for any world vector `w`.
#[inline]
pub(crate) fn apply_inertia(segment: &Segment, q: &UnitQuaternion<f64>, w: &Vector3<f64>) -> Vector3<f64> {
    if let Some(body) = &segment.body {
        return q * (q.inverse() * w).component_mul(&body.inertia);
    }
    let axis = q * Vector3::z();
    let along = axis * axis.dot(w);
    (w - along) * segment.transverse_inertia() + along * segment.axial_inertia()
}

/// Gap C_s [m] between the connectors of a joint.
pub fn stretch_gap(model: &Model, state: &State, joint: &Joint) -> Vector3<f64> {
    gap_and_axis(model, state, joint).0
}

/// The same, and the axis d3 of body a.
#[inline(always)]
fn gap_and_axis(model: &Model, state: &State, joint: &Joint) -> (Vector3<f64>, Vector3<f64>) {
    let (a, b) = (model.pose(joint.a, state), model.pose(joint.b, state));
    let (axis_a, axis_b) = (a.orientation * Vector3::z(), b.orientation * Vector3::z());
    let connector_a = a.position + joint.arm(&a.orientation, &axis_a, 0);
    let connector_b = b.position + joint.arm(&b.orientation, &axis_b, 1);
    (connector_a - connector_b, axis_a)
}

/// The model's [`crate::StrainMeasure`] minus its rest value, C_b [1/m], in the frame of the joint's rows ([`Joint::frames`]); zero about axes that it
/// leaves free.
#[inline]
pub fn bend_strain(model: &Model, state: &State, joint: &Joint) -> Vector3<f64> {
    let [a, b] = joint.frames(model, state);
    let measure = model.strain_measure;
    let strain = measure.strain(&a, &b, joint.length) - measure.at_rest(&joint.rest_darboux, joint.length);
    match joint.freedom {
        Freedom::None => strain,
        Freedom::Ball | Freedom::Broken => Vector3::zeros(),
        Freedom::Hinge => Vector3::new(strain.x, strain.y, 0.0),
    }
}

/// Work that joints with laws have lost so far [J].
pub fn dissipated(model: &Model, state: &State) -> f64 {
    let of = |(own, at): (&InelasticJoint, &InternalVariables)| model.joints[own.joint].length * at.dissipated;
    model.laws.iter().zip(&state.internals).map(of).sum()
}

/// Energies of a state; of joints with laws what they store. Torques have no potential and are left out, as what inner damping takes; a compliance of zero stores
/// no energy.
pub fn energy(model: &Model, state: &State) -> Energy {
    let mut energy = Energy::default();
    for (i, segment) in model.segments.iter().enumerate() {
        if segment.fixed {
            continue;
        }
        let (v, w) = (state.velocities[i], state.angular_velocities[i]);
        energy.kinetic +=
            0.5 * segment.mass() * v.norm_squared() + 0.5 * w.dot(&apply_inertia(segment, &state.orientations[i], &w));
        energy.external -= segment.mass() * model.gravity.dot(&state.positions[i]);
    }
    // Follower loads are the gradient of no energy.
    for load in model.loads.iter().filter(|load| !load.follows) {
        energy.external -= load.force.dot(&(state.positions[load.segment] + state.axis(load.segment) * load.offset));
    }
    let quotient = |value: f64, compliance: f64| if compliance > 0.0 { value / compliance } else { 0.0 };
    let mut laws = model.laws.iter().enumerate().peekable();
    for (index, joint) in model.joints.iter().enumerate() {
        let law = laws.next_if(|(_, own)| own.joint == index);
        if model.is_open(joint) {
            continue;
        }
        let (gap, axis) = gap_and_axis(model, state, joint);
        let along = gap.dot(&axis).powi(2);
        let across = if joint.shear_extra == 0.0 {
            quotient(gap.norm_squared() - along, joint.shear_compliance)
        } else {
            let q_a = model.pose(joint.a, state).orientation;
            let [first, second] = [Vector3::x(), Vector3::y()].map(|d| gap.dot(&(q_a * d)).powi(2));
            quotient(first, joint.shear_compliance) + quotient(second, joint.shear_compliance + joint.shear_extra)
        };
        energy.stretch += 0.5 * quotient(along, joint.stretch_compliance) + 0.5 * across;
        let strain = bend_strain(model, state, joint);
        if let Some((k, own)) = law {
            let virgin = InternalVariables::default();
            let at = state.internal(k).unwrap_or(&virgin);
            energy.bend += joint.length * own.law.stored(&joint.bend_twist_stiffness(), &strain, at);
            continue;
        }
        let bending = if joint.bend_extra == 0.0 {
            quotient(strain.xy().norm_squared(), joint.bend_compliance)
        } else {
            let [first, second, _] = joint.bend_twist_compliance().into();
            quotient(strain.x.powi(2), first) + quotient(strain.y.powi(2), second)
        };
        energy.bend += 0.5 * bending + 0.5 * quotient(strain.z.powi(2), joint.twist_compliance);
    }
    energy
}

/// Linear momentum [kg m/s] of the segments that move freely.
pub fn linear_momentum(model: &Model, state: &State) -> Vector3<f64> {
    free(model).map(|(i, segment)| state.velocities[i] * segment.mass()).sum()
}

/// Angular momentum about the world's origin [kg m^2/s] of the segments that move freely.
pub fn angular_momentum(model: &Model, state: &State) -> Vector3<f64> {
    let of_segment = |(i, segment): (usize, &Segment)| {
        state.positions[i].cross(&(state.velocities[i] * segment.mass()))
            + apply_inertia(segment, &state.orientations[i], &state.angular_velocities[i])
    };
    free(model).map(of_segment).sum()
}

/// Length of each rod [m] along its centreline: the segments' lengths plus the gaps between them, signed along d3.
/// Joints between two rods count for neither, and what springs of grips give is no part of a rod, nor what a rod of a single
/// segment, which is rigid, gives at an anchor.
pub fn rod_lengths(model: &Model, state: &State) -> Vec<f64> {
    let rods = model.segments.iter().map(|s| s.rod + 1).max().unwrap_or(0);
    let springs = model.grip_springs();
    let (mut lengths, mut counts) = (vec![0.0; rods], vec![0; rods]);
    for segment in &model.segments {
        lengths[segment.rod] += segment.length;
        counts[segment.rod] += 1;
    }
    for (k, joint) in model.joints.iter().enumerate() {
        if model.is_open(joint) || springs.contains_key(&k) {
            continue;
        }
        let rod_of = |body| match body {
            Body::Segment(i) => Some(model.segments[i].rod),
            Body::Anchor(_) => None,
        };
        let (a, b) = (rod_of(joint.a), rod_of(joint.b));
        let Some(rod) = a.or(b) else { continue };
        if a != b && (counts[rod] == 1 || (a.is_some() && b.is_some())) {
            continue;
        }
        let (gap, axis) = gap_and_axis(model, state, joint);
        lengths[rod] -= gap.dot(&axis);
    }
    lengths
}

/// Largest relative change of any rod's length from its `first` one, as a magnitude.
pub fn length_drift(model: &Model, state: &State, first: &[f64]) -> f64 {
    let drift = |(now, first): (&f64, &f64)| (now / first - 1.0).abs();
    rod_lengths(model, state).iter().zip(first).map(drift).fold(0.0, f64::max)
}

/// Largest gap between two connectors, in units of the joint's length.
pub fn worst_gap(model: &Model, state: &State) -> f64 {
    let relative = |joint: &Joint| stretch_gap(model, state, joint).norm() / joint.length;
    model.joints.iter().filter(|joint| !model.is_open(joint)).map(relative).fold(0.0, f64::max)
}

/// The joint with the widest gap of those that do not yield in effect ([`Joint::RIGID`]), and that gap in lengths of the
/// joint; `None` where there is no such joint.
pub fn widest_gap(model: &Model, state: &State) -> Option<(usize, f64)> {
    let is_rigid = |joint: &Joint| joint.stretch_compliance.max(joint.shear_compliance) <= Joint::RIGID;
    let rigid = model.joints.iter().enumerate().filter(|(_, joint)| is_rigid(joint) && !model.is_open(joint));
    let gaps = rigid.map(|(k, joint)| (k, stretch_gap(model, state, joint).norm() / joint.length));
    gaps.max_by(|a, b| a.1.total_cmp(&b.1))
}

fn free(model: &Model) -> impl Iterator<Item = (usize, &Segment)> {
    model.segments.iter().enumerate().filter(|(_, segment)| !segment.fixed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Assembly, Material, RodSpec, Springs, Stretch, shape};

    #[test]
    fn what_springs_of_a_grip_give_is_no_length_of_the_rod() {
        let material = Material { youngs_modulus: 1e6, torsion_modulus: 1e6, density: 1e3 };
        for stretch in [Stretch::ZERO_STRETCH, Stretch::Physical] {
            let mut assembly = Assembly::new(Vector3::zeros());
            let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 4);
            let rod = assembly.rod(&RodSpec { stretch, ..RodSpec::new(nodes, 0.01, material) });
            assembly.clamp_start(&rod).clamp_end(&rod);
            let (mut model, state) = assembly.finish();
            model.anchors[1].position.x += 0.1;
            assert!((rod_lengths(&model, &state)[0] - 1.1).abs() < 1e-12);
            let (joint, gap) = (4, 0.1 / 0.125);
            let rigid = (stretch == Stretch::ZERO_STRETCH).then_some((joint, gap));
            let found = widest_gap(&model, &state);
            assert!(found.map(|(k, _)| k) == rigid.map(|(k, _)| k), "{found:?}");
            assert!(found.is_none_or(|(_, found)| (found - gap).abs() < 1e-12), "{found:?}");
            model.soften(joint, &Springs { force: [f64::INFINITY, f64::INFINITY, 100.0], ..Springs::RIGID });
            assert!((rod_lengths(&model, &state)[0] - 1.0).abs() < 1e-12);
            assert!(widest_gap(&model, &state).is_none_or(|(_, gap)| gap < 1e-12));
        }
    }
}
