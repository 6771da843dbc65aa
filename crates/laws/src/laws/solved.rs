//! Whether what the status says is so: residuals of joints, computed from scratch, and gaps.

use cosserat::assembly::InnerDamping;
use cosserat::simulation::Status;
use cosserat::state::{Body, measure};

use crate::law::{Law, Violation};
use crate::step::Step;

/// Gap of a joint that does not yield, in its lengths, from which on the status must say that joints are apart.
const APART: f64 = 0.1;

pub(super) fn residual(step: &Step<'_>, violations: &mut Vec<Violation>) {
    if !step.is_solved() {
        return;
    }
    let state = step.states[1];
    // Rounding of places, and of multipliers of constraints that hardly yield.
    let size = state.positions.iter().map(|x| x.amax()).fold(0.0, f64::max);
    for (k, joint, force) in step.joints() {
        // What inner damping and laws transmit is none of the constraint's.
        let is_elastic = step.model.laws.iter().all(|law| law.joint != k);
        if joint.inner_damping != InnerDamping::NONE
            || !is_elastic
            || is_stored(step, joint.a)
            || is_stored(step, joint.b)
        {
            continue;
        }
        let found = force.residual(step.model, state, joint);
        let rounding = 16.0 * f64::EPSILON * size / joint.length + 1e-12;
        // `newton` ends where the surfaces of both bodies are near enough to their ends.
        let near = |body: Body| match body {
            Body::Segment(i) if step.is_newton() => step.way(i) / step.model.segments[i].radius,
            _ => 0.0,
        };
        let allowed = (near(joint.a) + near(joint.b)).max(step.tolerance()) * (1.0 + 1e-3) + rounding;
        step.hold(violations, Law::Residual, found, allowed, || {
            format!("joint {k} is {found:.3e} of its length or rad off where the status is {}", step.status.name())
        });
    }
}

/// Whether a body is in a store, as a whole or in part: its joints yield less than the model says.
fn is_stored(step: &Step<'_>, body: Body) -> bool {
    let Body::Segment(i) = body else { return false };
    let joints = step.model.sliding_joints.iter().zip(step.sliding);
    joints.into_iter().any(|(joint, sliding)| {
        let centre = |i: usize| joint.centreline(step.model).centre(i - joint.segments.start);
        joint.has_store() && joint.segments.contains(&i) && centre(i) <= sliding.place + sliding.rate.abs() * step.dt
    })
}

pub(super) fn open(step: &Step<'_>, violations: &mut Vec<Violation>) {
    if matches!(step.status, Status::Apart | Status::NonFinite | Status::OutOfIterations | Status::TooManyContacts) {
        return;
    }
    if let Some((k, gap)) = measure::widest_gap(step.model, step.states[1]) {
        step.hold(violations, Law::Open, gap, APART, || {
            format!("joint {k} gapes by {gap:.3} of its length where the status is {}", step.status.name())
        });
    }
}
