//! All numbers are finite.

use cosserat::simulation::ContactForce;

use crate::law::{Law, Violation};
use crate::step::Step;

/// Whether they are.
pub(super) fn finite(step: &Step<'_>, violations: &mut Vec<Violation>) -> bool {
    let state = step.states[1];
    let vectors = [&state.positions, &state.velocities, &state.angular_velocities];
    let is_state = vectors.into_iter().flatten().flatten().all(|x| x.is_finite())
        && state.orientations.iter().flat_map(|q| &q.coords).all(|x| x.is_finite());
    let is_forces = step.forces[1].iter().flat_map(|f| f.force.iter().chain(&f.moment)).all(|x| x.is_finite());
    let of_contact = |c: &ContactForce| [c.place, c.normal, c.force, c.slip].iter().flatten().all(|x| x.is_finite());
    let is_contacts = step.contacts.iter().all(of_contact);
    let parts = [("poses and velocities", is_state), ("joint forces", is_forces), ("contact forces", is_contacts)];
    for (what, is_finite) in parts {
        if !is_finite {
            let message = format!("{what} are not finite, status {}", step.status.name());
            violations.push(Violation { law: Law::Finite, step: step.number, ratio: f64::INFINITY, message });
            return false;
        }
    }
    true
}
