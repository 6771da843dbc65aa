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
        // What inner damping transmits is none of the constraint's.
        if joint.inner_damping != InnerDamping::NONE {
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
