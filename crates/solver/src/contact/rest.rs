//! How contacts come to rest where the momentum residual is solved for, which sees each change of an impulse.

use super::cone::{Bound, length};
use super::geometry::Contact;

/// What a contact keeps of its error and its friction from one iteration to the next; kept beside the contacts, as no
/// formulation without a momentum residual asks for it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rest {
    /// What friction is at most, where it no longer follows the normal impulse [N s^2].
    pub(super) bound: Option<f64>,
    /// What of gap and slip, in the contact's frame, is good enough to stay [m].
    pub(super) left: [f64; 3],
}

impl Rest {
    /// What friction is at most.
    pub(super) fn bound(&self, contact: &Contact) -> Bound {
        self.bound.map_or(Bound::Coulomb(contact.coefficient), Bound::Lagged)
    }

    /// Friction is at most what it is at the normal impulse that there is now, until this is asked again.
    pub(super) fn keep_bound(&mut self, contact: &Contact) {
        let normal = contact.impulse.dot(contact.normal);
        self.bound = (normal > 0.0).then_some(contact.coefficient * normal);
    }

    /// What of gap and slip `w` the impulse there is does not answer, in the contact's frame [m]: with so much less it would be
    /// the solution.
    pub(super) fn unanswered(&self, contact: &Contact, w: [f64; 3]) -> [f64; 3] {
        let force = contact.local(contact.impulse);
        let normal = if force[0] > 0.0 { w[0] } else { w[0].min(0.0) };
        let across = length([force[1], force[2]]);
        if across == 0.0 && force[0] <= 0.0 {
            return [normal, 0.0, 0.0];
        }
        // What slides against its friction may go on to.
        let slides = across > 0.0 && across >= self.bound(contact).most(force[0]) * (1.0 - 1e-9);
        let along = if slides { (w[1] * force[1] + w[2] * force[2]).min(0.0) / (across * across) } else { 0.0 };
        [normal, w[1] - along * force[1], w[2] - along * force[2]]
    }
}
