//! Balances of momentum of all that moves freely.
//!
//! Euler's rule has `m (v' - v) = dt F'` for each body, so that the balance of linear momentum holds to rounding where the
//! momentum residual is dropped, and to the tolerance in the formulation `newton`. That of angular momentum holds in the same
//! way about any place where velocities are those of the step's places, `x' x m (v' - v)`, and the spin of a body is the
//! discrete momentum of Moser and Veselov, `(2 / dt) q (s I u + u x I u)` with (s, u) the relative rotation of the step.
//! `xpbd` pushes along the directions of its iterates: its torques, and the forces of contacts, are off by the
//! angle that bodies turn in the step, of first order in dt.

use cosserat::assembly::Damping;
use cosserat::internals::component::OF_TRANSMITTED;
use cosserat::simulation::{ContactForce, StepParams, Touched};
use cosserat::state::{Body, Segment, State, measure};
use nalgebra::{UnitQuaternion, Vector3};

use crate::law::{EPSILON, Law, Violation};
use crate::step::{MOST_TURN, Step};

/// Rounding of sums of what may cancel.
const ROUNDING: f64 = 1e-10;

/// Forces from outside on a segment: force [N], and place at which it acts [m] with a moment about it [N m].
struct Outside {
    force: Vector3<f64>,
    place: Vector3<f64>,
    moment: Vector3<f64>,
}

/// All of them on what moves freely, but for the air's.
fn outside(step: &Step<'_>) -> Vec<Outside> {
    let (model, state) = (step.model, step.states[1]);
    let zero = Vector3::zeros();
    let mut all = Vec::new();
    for (i, segment) in model.segments.iter().enumerate().filter(|(i, _)| step.is_free(*i)) {
        all.push(Outside { force: model.gravity * segment.mass(), place: state.positions[i], moment: zero });
    }
    for load in model.loads.iter().filter(|load| step.is_free(load.segment)) {
        let place = state.positions[load.segment] + state.axis(load.segment) * load.offset;
        let [force, moment] = step.load(load);
        all.push(Outside { force, place, moment });
    }
    for (_, joint, force) in step.joints() {
        let ends = [step.free_end(joint.a), step.free_end(joint.b)];
        let (end, i) = match ends {
            [Some(i), None] => (0, i),
            [None, Some(i)] => (1, i),
            _ => continue,
        };
        let [force, moment, arm] = step.pull(joint, force, end);
        all.push(Outside { force, place: state.positions[i] + arm, moment });
    }
    for (joint, sliding) in model.sliding_joints.iter().zip(step.sliding) {
        let is_free = step.is_free(joint.segments.start);
        let holder = matches!(joint.holder, Body::Segment(i) if step.is_free(i));
        let sign = match (is_free, holder) {
            (true, false) => 1.0,
            (false, true) => -1.0,
            _ => continue,
        };
        let place = joint.point(model, state, sliding.place);
        all.push(Outside { force: sliding.force * sign, place, moment: zero });
    }
    for contact in step.contacts {
        let other = match contact.other {
            Touched::Segment(i) => step.is_free(i),
            Touched::Obstacle(_) => false,
        };
        let sign = match (step.is_free(contact.segment), other) {
            (true, false) => 1.0,
            (false, true) => -1.0,
            _ => continue,
        };
        all.push(Outside { force: contact.force * sign, place: contact.place, moment: zero });
    }
    all
}

/// Whether a rod that runs through an eyelet has both segments that move and segments that are held or stored, or runs over a pulley: what bears which force is not
/// told.
fn has_mixed_eyelets(step: &Step<'_>) -> bool {
    !step.model.pulleys.is_empty()
        || step.model.sliding_joints.iter().any(|joint| {
            let is_free = step.is_free(joint.segments.start);
            joint.has_store() || joint.segments.clone().any(|i| step.is_free(i) != is_free)
        })
}

/// Whether anything but gravity and loads acts from outside.
fn is_alone(step: &Step<'_>) -> bool {
    let model = step.model;
    model.contacts.obstacles.is_empty()
        && model.anchors.is_empty()
        && model.segments.iter().all(|segment| !segment.fixed)
        && model.damping == Damping::default()
        && model.changes.is_empty()
        && !model.has_followers()
}

pub(super) fn linear(step: &Step<'_>, violations: &mut Vec<Violation>) {
    let alone = is_alone(step);
    if step.model.air.is_some() || has_mixed_eyelets(step) || !(step.is_whole() || (alone && step.is_solved())) {
        return;
    }
    let [before, after] = step.states;
    let model = step.model;
    let decay = (-model.damping.linear * step.dt).exp();
    let is_bdf2 = !step.is_euler() && !alone;
    // Impacts and breaks restart it, in the sets that they reach alone: of an impulse between two sets in the steps before, one that begins anew counts another
    // share than one that goes on.
    let may_restart = !model.contacts.is_empty() || !model.sliding_joints.is_empty() || !model.breakable.is_empty();
    if !step.is_euler() && may_restart || is_bdf2 && (step.earlier.is_none() || model.damping.linear > 0.0) {
        return;
    }
    let mut change = [Vector3::zeros(); 2];
    let (mut sum, mut slack) = (0.0, 0.0);
    let missing = unbalanced(step);
    for (i, segment) in model.segments.iter().enumerate().filter(|(i, _)| step.is_free(*i)) {
        let mass = segment.mass();
        let (v, w) = (before.velocities[i], after.velocities[i]);
        change[0] += (w - v * decay) * mass;
        if let Some(earlier) = step.earlier {
            // The backward differences of second order.
            change[1] += (w * 1.5 - v * 2.0 + earlier.velocities[i] * 0.5) * mass;
        }
        sum += mass * (v.norm() + w.norm());
        slack += mass * EPSILON * after.positions[i].norm() / step.dt;
        if step.is_newton() {
            slack += mass * step.tolerance() * segment.length / step.dt + missing * step.dt;
        }
    }
    let forces = outside(step);
    let impulse: Vector3<f64> = forces.iter().map(|one| one.force * step.dt).sum();
    sum += forces.iter().map(|one| one.force.norm() * step.dt).sum::<f64>();
    slack += contacts(step).iter().map(|[impulse, turn]| impulse * turn).sum::<f64>();
    let loads = model.loads.iter().filter(|load| step.is_free(load.segment));
    slack += loads.map(|load| load.force.norm() * step.dt * step.followed(load)).sum::<f64>();
    let mut found = (change[0] - impulse).norm();
    if is_bdf2 {
        // A step of Euler's rule, after a start or an impact, or one of the second order.
        found = found.min((change[1] - impulse).norm());
    }
    let allowed = ROUNDING * sum + slack;
    step.hold(violations, Law::LinearMomentum, found, allowed, || {
        format!("changes by {found:.3e} kg m/s more than impulses say, allowed {allowed:.1e}")
    });
}

/// Of each contact its impulse [N s], and the angle by which its normal may turn from the iterates to the end of the step
/// [rad]: in the formulation `newton` by as many radii as surfaces may still move, else by what the bodies turn and slip.
fn contacts(step: &Step<'_>) -> Vec<[f64; 2]> {
    // Round surfaces turn it as they slip and turn, and as the body goes from its prediction, whose normals are the first, to its end; a plane's normal stays.
    let rolled = |contact: &ContactForce| {
        let far = contact.slip.norm() + strayed(step, contact.segment);
        far / step.model.segments[contact.segment].radius + step.turn(contact.segment)
    };
    let of = |contact: &ContactForce| {
        if step.is_newton() {
            return [contact.force.norm() * step.dt, step.method.settings().step.allowed_motion(true)];
        }
        let turn = StepParams::DEFAULT.contact_tolerance
            + match contact.other {
                Touched::Obstacle(k) if step.is_plane(k) => step.obstacle_turn(k),
                Touched::Obstacle(k) => rolled(contact) + step.obstacle_turn(k),
                Touched::Segment(i) => {
                    rolled(contact) + step.turn(i) + strayed(step, i) / step.model.segments[contact.segment].radius
                }
            };
        [contact.force.norm() * step.dt, turn.min(2.0)]
    };
    step.contacts.iter().map(of).collect()
}

/// How far a body ends from where its velocity and gravity alone take it with Euler's rule [m].
fn strayed(step: &Step<'_>, i: usize) -> f64 {
    let [before, after] = step.states;
    let predicted = before.velocities[i] * step.dt + step.model.gravity * step.dt.powi(2);
    (after.positions[i] - before.positions[i] - if step.is_free(i) { predicted } else { Vector3::zeros() }).norm()
}

/// What may be missing in the balance of forces on a segment [N], beside what moves it by the tolerance: the solver's share of the largest force that is
/// transmitted; at eyelets ten times the way that surfaces may be off, of their largest force.
fn unbalanced(step: &Step<'_>) -> f64 {
    let of_joints = step.joints().map(|(_, _, force)| force.force.norm()).fold(0.0, f64::max);
    let of_eyelets = step.sliding.iter().map(|sliding| sliding.force.norm()).fold(0.0, f64::max);
    let way = step.method.settings().step.allowed_motion(!step.model.contacts.is_empty()).max(step.tolerance());
    OF_TRANSMITTED * of_joints.max(of_eyelets) + 10.0 * way * of_eyelets
}

/// Moments of inertia about the axes of a segment.
fn moments(segment: &Segment) -> Vector3<f64> {
    match &segment.body {
        Some(body) => body.inertia,
        None => {
            let across = segment.transverse_inertia();
            Vector3::new(across, across, segment.axial_inertia())
        }
    }
}

/// Discrete momentum of a segment's turn from one state to the next [kg m^2/s], in world axes.
fn spin(segment: &Segment, [from, to]: [&UnitQuaternion<f64>; 2], dt: f64) -> Vector3<f64> {
    let turn = from.inverse() * to;
    let (s, u) = if turn.w < 0.0 { (-turn.w, -turn.imag()) } else { (turn.w, turn.imag()) };
    let turning = moments(segment).component_mul(&u);
    from * (turning * s + u.cross(&turning)) * (2.0 / dt)
}

/// By which part torques on a segment may be off. In `xpbd` directions are those of the iterates, off by the
/// turn of the step; sines stand for halves of turns, to second order, in all of them.
fn off(step: &Step<'_>, turn: f64) -> f64 {
    if step.is_newton() { turn * turn } else { turn + turn * turn }
}

pub(super) fn angular(step: &Step<'_>, violations: &mut Vec<Violation>) {
    let Some(earlier) = step.earlier else { return };
    let [before, after] = step.states;
    let model = step.model;
    if !step.is_whole()
        || !step.is_euler()
        || model.damping.angular > 0.0
        || model.air.is_some()
        || has_mixed_eyelets(step)
    {
        return;
    }
    let free: Vec<usize> = (0..model.segments.len()).filter(|&i| step.is_free(i)).collect();
    // What a push adds to a turn is known to first order beside it.
    if step.is_newton() && free.iter().any(|&i| step.turn(i) > MOST_TURN) {
        return;
    }
    let about = free.iter().map(|&i| after.positions[i]).sum::<Vector3<f64>>() / free.len().max(1) as f64;
    let decay = (-model.damping.linear * step.dt).exp();
    let turned = |states: [&State; 2], i: usize| states.map(|state: &State| state.orientations[i]);
    let (mut change, mut sum, mut slack) = (Vector3::zeros(), 0.0, 0.0);
    let missing = unbalanced(step);
    for &i in &free {
        let segment = &model.segments[i];
        let arm = after.positions[i] - about;
        let pushed = (after.velocities[i] - before.velocities[i] * decay) * segment.mass();
        let [from, middle, to] = {
            let [from, middle] = turned([earlier, before], i);
            [from, middle, turned([before, after], i)[1]]
        };
        let (old, new) = (spin(segment, [&from, &middle], step.dt), spin(segment, [&middle, &to], step.dt));
        change += arm.cross(&pushed) + new - old;
        sum += arm.norm() * segment.mass() * (after.velocities[i].norm() + before.velocities[i].norm())
            + old.norm()
            + new.norm();
        slack += segment.mass() * arm.norm() * EPSILON * after.positions[i].norm() / step.dt;
        slack += moments(segment).max() * EPSILON / step.dt;
        if step.is_newton() {
            let residual = step.tolerance() * segment.length / step.dt;
            slack += (segment.mass() * residual + missing * step.dt) * (arm.norm() + segment.length);
        }
    }
    let forces = outside(step);
    let impulse: Vector3<f64> =
        forces.iter().map(|one| ((one.place - about).cross(&one.force) + one.moment) * step.dt).sum();
    sum += forces
        .iter()
        .map(|one| ((one.place - about).norm() * one.force.norm() + one.moment.norm()) * step.dt)
        .sum::<f64>();
    for (k, joint, force) in step.joints() {
        // Gaps and angles within the tolerance.
        slack += 2.0 * step.dt * step.tolerance() * (force.force.norm() * joint.length + force.moment.norm());
        // Forces and moments are along axes of either body.
        let turned: f64 =
            [joint.a, joint.b].into_iter().filter_map(|body| step.free_end(body)).map(|i| step.turn(i)).sum();
        // Joints that yield otherwise along their axis than across leave out the moment of their gap (docs/accuracy.md).
        if joint.shear_compliance != joint.stretch_compliance || joint.shear_extra != 0.0 {
            let gap = measure::stretch_gap(model, after, joint);
            slack += step.dt * gap.cross(&force.force).norm() * (1.0 + turned);
        }
        for (end, body) in [joint.a, joint.b].into_iter().enumerate() {
            if step.free_end(body).is_none() {
                continue;
            }
            let [force, moment, arm] = step.pull(joint, force, end);
            // The geometric stiffness begins with the pulls of the step before.
            let old = if step.is_newton() { 0.0 } else { step.forces[0][k].force.norm() };
            slack += step.dt * ((force.norm() + old) * arm.norm() + moment.norm()) * off(step, turned);
        }
    }
    for load in model.loads.iter().filter(|load| step.is_free(load.segment)) {
        let size = load.force.norm() * load.offset.abs() + load.torque.norm();
        slack += step.dt * size * off(step, step.turn(load.segment));
        let far = (after.positions[load.segment] - about).norm() + load.offset.abs();
        slack += step.dt * (load.force.norm() * far + load.torque.norm()) * step.followed(load);
    }
    for (contact, [impulse, turn]) in step.contacts.iter().zip(contacts(step)) {
        // Places may lie within the tolerance; those of iterates turn with the bodies.
        let far = (contact.place - about).norm() + step.reach(contact.segment);
        let other = match contact.other {
            Touched::Segment(i) => Some(i),
            Touched::Obstacle(_) => None,
        };
        slack += impulse * far * turn;
        for i in [Some(contact.segment), other].into_iter().flatten() {
            let turned = if step.is_newton() { turn } else { step.turn(i) };
            slack += impulse * (2e-3 * model.segments[i].radius + step.reach(i) * turned);
        }
    }
    let allowed = 10.0 * ROUNDING * sum + slack;
    let found = (change - impulse).norm();
    step.hold(violations, Law::AngularMomentum, found, allowed, || {
        format!("changes by {found:.3e} kg m^2/s more than impulses say, allowed {allowed:.1e}")
    });
}
