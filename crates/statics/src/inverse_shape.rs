//! The rest shape with which a tree of rods, held in one place, hangs in a given shape.
//!
//! Where nothing but the root is held, the forces in all joints follow from the loads alone, from the leaves to the root, and so
//! each joint's moment, and the curvature at rest that it asks for: one pass, nothing is solved (Derouet-Jourdan,
//! Bertails-Descoubes, Daviet and Thollot 2013, for curves; here for trees, with stretch and shear).

use nalgebra::Vector3;
use rod::{Body, Changing, Freedom, Model, State};
use thiserror::Error;

/// Why there is no rest shape.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum RestShapeError {
    /// The state does not fit the model.
    #[error("a state of {found} segments for a model of {expected}")]
    State {
        /// Segments of the state.
        found: usize,
        /// Segments of the model.
        expected: usize,
    },
    /// A segment that no joints lead to from what is held.
    #[error("segment {0} is not held: rods must be joined to one clamp")]
    Free(usize),
    /// A joint beyond those of trees.
    #[error("joint {0} closes a loop: rods must be trees that are held in one place")]
    Loop(usize),
    /// A joint that transmits no moment, or an open grip.
    #[error("joint {0} turns freely or is open: it has no rest shape")]
    Loose(usize),
    /// Forces that are not those of weight and loads.
    #[error("the rest shape knows no {0}")]
    Unknown(&'static str),
    /// A moment that would take more than half a turn.
    #[error("joint {0} bears a moment that bends it by more than half a turn")]
    Moment(usize),
}

/// A joint on the way from what is held to the leaves.
struct Link {
    joint: usize,
    /// Indices of bodies: segments, and then anchors.
    inner: usize,
    outer: usize,
    /// Whether the outer body is the joint's body a.
    is_a: bool,
}

/// Gives all joints the rest Darboux vectors with which `state` is an equilibrium of the model under its gravity and its
/// loads, with the materials that it has. Orientations stay as they are; positions move by what the joints stretch and shear,
/// their compliance times the force, and velocities become zero.
///
/// Whether the equilibrium is stable is another question, which [`super::equilibrium`] answers.
///
/// # Errors
/// If rods are not trees that are each held in one place, a joint turns freely or would have to bend by more than half a
/// turn, or there are contacts or air that moves. Nothing is changed then.
pub fn rest_shape(model: &mut Model, state: &mut State) -> Result<(), RestShapeError> {
    let (found, expected) = (state.positions.len(), model.segments.len());
    if found != expected {
        return Err(RestShapeError::State { found, expected });
    }
    if !model.contacts.sheaths.is_empty() {
        return Err(RestShapeError::Unknown("sheaths"));
    }
    if !model.contacts.is_empty() {
        return Err(RestShapeError::Unknown("contacts"));
    }
    if !model.sliding_joints.is_empty() {
        return Err(RestShapeError::Unknown("eyelets"));
    }
    if model.has_followers() {
        return Err(RestShapeError::Unknown("loads that turn with their segments"));
    }
    if !model.pulleys.is_empty() {
        return Err(RestShapeError::Unknown("pulleys"));
    }
    if !model.laws.is_empty() {
        return Err(RestShapeError::Unknown("joints that are not elastic"));
    }
    if super::is_windy(model) {
        return Err(RestShapeError::Unknown("wind"));
    }
    if model.changes.iter().any(|change| matches!(change.of, Changing::Rest(_))) {
        return Err(RestShapeError::Unknown("rest shapes that change"));
    }
    let links = links(model)?;
    let forces = forces(model, &links);
    let mut hung = state.clone();
    hung.velocities.fill(Vector3::zeros());
    hung.angular_velocities.fill(Vector3::zeros());
    // From the root on: what holds a body is in its place by now.
    for link in &links {
        let joint = &model.joints[link.joint];
        let [a, b] = [joint.a, joint.b].map(|body| model.pose(body, &hung));
        let (arm_a, arm_b) = (joint.arm_a(&a.orientation), joint.arm_b(&b.orientation));
        let sign = if link.is_a { -1.0 } else { 1.0 };
        let force = forces[link.outer] * sign;
        let [second, axis] = [Vector3::y(), Vector3::z()].map(|unit| a.orientation * unit);
        let yielded = force * joint.shear_compliance
            + axis * ((joint.stretch_compliance - joint.shear_compliance) * axis.dot(&force))
            + second * (joint.shear_extra * second.dot(&force));
        hung.positions[link.outer] = match link.is_a {
            false => a.position + arm_a - arm_b + yielded,
            true => b.position + arm_b - arm_a - yielded,
        };
    }
    let moments = moments(model, &hung, &links, &forces);
    let mut rests = Vec::with_capacity(links.len());
    for (link, torque) in links.iter().zip(moments) {
        let joint = &model.joints[link.joint];
        let [a, b] = joint.frames(model, &hung);
        let between = (a.inverse() * b).into_inner();
        let (s, v) = if between.w < 0.0 { (-between.w, -between.imag()) } else { (between.w, between.imag()) };
        let own = a.inverse() * torque;
        let multiplier = model.strain_measure.multiplier((s.max(1e-6), v), &own) * joint.length;
        let bent = joint.bend_twist_compliance().component_mul(&multiplier);
        let rest =
            model.strain_measure.darboux_of(&(model.strain_measure.strain(&a, &b, joint.length) + bent), joint.length);
        // NaN is refused, too.
        let half_a_turn = 2.0 / joint.length;
        if rest.norm().partial_cmp(&half_a_turn) != Some(std::cmp::Ordering::Less) {
            return Err(RestShapeError::Moment(link.joint));
        }
        rests.push(rest);
    }
    for (link, rest) in links.iter().zip(rests) {
        model.joints[link.joint].rest_darboux = rest;
    }
    *state = hung;
    Ok(())
}

/// All joints from what is held to the leaves.
fn links(model: &Model) -> Result<Vec<Link>, RestShapeError> {
    let segments = model.segments.len();
    let index = |body: Body| match body {
        Body::Segment(i) => i,
        Body::Anchor(i) => segments + i,
    };
    let mut joints_of = vec![Vec::new(); segments + model.anchors.len()];
    for (j, joint) in model.joints.iter().enumerate() {
        if joint.freedom != Freedom::None || model.is_open(joint) {
            return Err(RestShapeError::Loose(j));
        }
        [joint.a, joint.b].into_iter().for_each(|body| joints_of[index(body)].push(j));
    }
    let is_held = |body: usize| body >= segments || model.segments[body].fixed;
    let mut met: Vec<bool> = (0..joints_of.len()).map(is_held).collect();
    let mut is_used = vec![false; model.joints.len()];
    let mut links = Vec::with_capacity(model.joints.len());
    let mut front: Vec<usize> = (0..joints_of.len()).filter(|&body| is_held(body)).collect();
    while !front.is_empty() {
        let mut beyond = Vec::new();
        for inner in front {
            for &j in &joints_of[inner] {
                let [a, b] = [model.joints[j].a, model.joints[j].b].map(index);
                let is_a = b == inner;
                let outer = if is_a { a } else { b };
                if !met[outer] {
                    (met[outer], is_used[j]) = (true, true);
                    links.push(Link { joint: j, inner, outer, is_a });
                    beyond.push(outer);
                } else if !(is_used[j] || is_held(a) && is_held(b)) {
                    return Err(RestShapeError::Loop(j));
                }
            }
        }
        front = beyond;
    }
    met.iter().position(|met| !met).map_or(Ok(links), |body| Err(RestShapeError::Free(body)))
}

/// All that pulls at each body and at what hangs on it [N].
fn forces(model: &Model, links: &[Link]) -> Vec<Vector3<f64>> {
    let weights = model.segments.iter().map(|segment| model.gravity * segment.mass());
    let mut forces: Vec<_> = weights.chain(model.anchors.iter().map(|_| Vector3::zeros())).collect();
    model.loads.iter().for_each(|load| forces[load.segment] += load.force);
    for link in links.iter().rev() {
        let own = forces[link.outer];
        forces[link.inner] += own;
    }
    forces
}

/// The torque that each link transmits, with the sign of its joint's multiplier [N m].
fn moments(model: &Model, state: &State, links: &[Link], forces: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    // About the bodies' centres.
    let mut torques = vec![Vector3::zeros(); forces.len()];
    for load in &model.loads {
        torques[load.segment] += load.torque + (state.axis(load.segment) * load.offset).cross(&load.force);
    }
    let mut out: Vec<Vector3<f64>> = Vec::with_capacity(links.len());
    for link in links.iter().rev() {
        let joint = &model.joints[link.joint];
        let arms = [
            joint.arm_a(&model.pose(joint.a, state).orientation),
            joint.arm_b(&model.pose(joint.b, state).orientation),
        ];
        let [of_outer, of_inner] = if link.is_a { arms } else { [arms[1], arms[0]] };
        let force = forces[link.outer];
        // What is left of the outer body's torque beside the force that holds its connector.
        let left = torques[link.outer] - of_outer.cross(&force);
        torques[link.inner] += left + of_inner.cross(&force);
        out.push(if link.is_a { left } else { -left });
    }
    out.reverse();
    out
}
